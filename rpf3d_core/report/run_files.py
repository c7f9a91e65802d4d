"""Read the result folder of a run for a report: summary, inputs, ends of rocks, kept paths, terrain and hazard maps."""

import json
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pyarrow as pa
import pyarrow.compute
import pyarrow.csv
import pyarrow.parquet
import rasterio
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.formats.meshes import MESH_READERS
from rpf3d_core.formats.polygons import local_plan
from rpf3d_core.results.earlier_results import DEPOSITS, read_summary
from rpf3d_core.results.folder import CRITICAL
from rpf3d_core.results.inputs import INPUTS
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray, Frame
from rpf3d_core.unknowns.dealing import turns
from rpf3d_core.unknowns.displacements import displacements
from rpf3d_core.unknowns.parameter_sets import read_parameter_sets
from rpf3d_core.values import DEPOSITED, UNSTOPPED, Outcome

IntArray = NDArray[np.int64]
AT_REST = [outcome.name.lower() for outcome in DEPOSITED]
PARAMETER_SETS = "parameter_sets.parquet"
AS_TEXT = pyarrow.csv.ConvertOptions(
    column_types={"source": pa.string(), "outcome": pa.string()}, strings_can_be_null=False
)
"""Options for reading deposits.csv: names of sources are text, even "1" and "NA"."""
KEY = ("source", "rock", "piece")
"""Columns that identify a rock in all tables."""


class Ends(NamedTuple):
    """The releases and ends of N rocks, in local coordinates with z up (m).

    key : (N,) each rock as (source, rock, fragment); source : (N,) number of its source
    at_rest : (N,) True for a rock that stopped or was caught
    on_ground : (N,) True for a rock that stopped on the ground; max_speed : (N,) m/s
    since, t : (N,) s, times of the release and of the end; a fragment is released when its rock breaks
    release, end : (N, 3) m; runout : (N,) m, horizontal; mass : (N,) kg
    set : (N,) number of the rock's parameter set; None without unknowns
    """

    key: list[tuple[str, int, int]]
    source: IntArray
    at_rest: NDArray[np.bool_]
    on_ground: NDArray[np.bool_]
    since: FloatArray
    t: FloatArray
    max_speed: FloatArray
    release: FloatArray
    end: FloatArray
    runout: FloatArray
    mass: FloatArray
    set: IntArray | None


class KeptPaths(NamedTuple):
    """Points along the K paths that a run kept, in local coordinates with z up.

    key : (K,) the rock of each path, as (source, rock, fragment)
    starts : (K + 1,) index of the first point of each path, and P at the end
    x : (P, 3) m; speed : (P,) m/s
    """

    key: list[tuple[str, int, int]]
    starts: IntArray
    x: FloatArray
    speed: FloatArray


class RunFiles(NamedTuple):
    """The content of a result folder, for a report.

    summary, inputs : content of summary.json and inputs.json
    terrain : in the local frame, with all facets in one zone
    ends, paths : releases and ends of all rocks, and the kept paths
    moves : (S, 2) m, displacement in plan of the paths of each parameter set; None if the scene states no misfit
    critical : path of the rock that stopped farthest from its release; None if this path is among `paths`, if no rock
        stopped, or if an earlier version of rpf3d wrote the result
    """

    folder: Path
    summary: dict[str, Any]
    inputs: dict[str, Any]
    terrain: Terrain
    ends: Ends
    paths: KeptPaths
    moves: FloatArray | None = None
    critical: KeptPaths | None = None

    def path_of(self, key: tuple[str, int, int]) -> FloatArray | None:
        """Return the path (P, 3) m of a rock, local frame; None if the result does not have it.

        key : the rock, as (source, rock, fragment)
        """
        for paths in (self.paths, self.critical):
            if paths is not None and key in paths.key:
                number = paths.key.index(key)
                return paths.x[paths.starts[number] : paths.starts[number + 1]]
        return None

    @property
    def areas(self) -> dict[str, list[FloatArray]]:
        """The outlines of each area of interest, closed rings (N, 2) m in the local frame, holes included."""
        frame = self.terrain.frame
        return {
            name: [local_plan(frame, np.array(ring, dtype=float)) for ring in rings]
            for name, rings in self.inputs.get("outlines", {}).items()  # results of earlier versions have no outlines
        }

    @property
    def sources(self) -> tuple[str, ...]:
        """The names of the sources, in the order of their numbers in `Ends.source`."""
        return tuple(source["name"] for source in self.inputs["scene"]["sources"])

    def ended(self, outcome: Outcome) -> int:
        """Return the number of rocks and fragments with an outcome."""
        return int(self.summary.get("outcomes", {}).get(outcome.name.lower(), {}).get("rocks", 0))

    @property
    def unstopped(self) -> dict[Outcome, int]:
        """The number of rocks and fragments with each outcome of `UNSTOPPED`, without outcomes that no rock has."""
        return {outcome: rocks for outcome in UNSTOPPED if (rocks := self.ended(outcome))}

    @property
    def sets(self) -> int:
        """The number of parameter sets of the run; 0 without unknowns."""
        return int(self.summary.get("unknowns", {}).get("sets", 0))


def read_run(folder: Path) -> RunFiles:
    """Return the content of a result folder.

    Raises
    ------
    InputError
        The folder contains no result, a damaged result, or a result without inputs.json; or no rock has flown.
    """
    summary = read_summary(folder)
    inputs = _inputs(folder)
    if not summary["rocks"]:
        raise InputError(f"{folder}: has flown no rock, so there is nothing to report")
    terrain = summary["terrain"]
    frame = Frame(origin=tuple(terrain["local_origin_z_up"]), up=terrain["up"])
    sets = int(summary.get("unknowns", {}).get("sets", 0))
    sources = [source["name"] for source in inputs["scene"]["sources"]]
    try:
        ground = _terrain(folder / "terrain.vtp", frame)
        ends = _ends(folder / DEPOSITS, frame, sources, sets)
        paths = _paths(folder / "trajectories.parquet", frame)
        critical = _paths(folder / CRITICAL, frame) if (folder / CRITICAL).is_file() else None
        moves = _moves(folder, inputs["scene"]) if sets else None
    except (OSError, KeyError, pa.ArrowInvalid) as fault:
        raise InputError(f"{folder}: is damaged ({fault}); run its scene again") from fault
    return RunFiles(
        folder=folder, summary=summary, inputs=inputs, terrain=ground, ends=ends, paths=paths, moves=moves,
        critical=critical,
    )  # fmt: skip


def _moves(folder: Path, scene: dict[str, Any]) -> FloatArray | None:
    """Return the displacement in plan (S, 2) m of the paths of each parameter set; None if the scene states no misfit.

    folder : the result folder; scene : the scene in inputs.json
    """
    misfit = (scene["unknowns"] or {}).get("misfit")
    return displacements(read_parameter_sets(folder / PARAMETER_SETS), misfit, scene["seed"]) if misfit else None


def _terrain(path: Path, frame: Frame) -> Terrain:
    """Return the terrain of a result, with all facets in one zone; path : the .vtp file of the terrain."""
    mesh = MESH_READERS[".vtp"](path)
    points, every = len(mesh.points), mesh.triangles
    triangles = np.arange(points, dtype=np.int32).reshape(-1, 3) if every is None else every
    zone = np.zeros(len(triangles), dtype=np.int32)
    return Terrain(frame.points_to_local(mesh.points), triangles, zone, ("terrain",), frame)


def _inputs(folder: Path) -> dict[str, Any]:
    """Return the content of inputs.json; raise InputError if the file is missing or damaged."""
    path = folder / INPUTS
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except FileNotFoundError:
        raise InputError(f"{folder}: has no {INPUTS}; another version wrote it, so run its scene again") from None
    except (OSError, ValueError) as fault:
        raise InputError(f"{path}: is damaged ({fault})") from fault


def _ends(path: Path, frame: Frame, sources: list[str], sets: int) -> Ends:
    """Return the ends of rocks from deposits.csv.

    sources : names of the sources in the order of the scene; sets : number of parameter sets, 0 without unknowns
    """
    table = pyarrow.csv.read_csv(path, convert_options=AS_TEXT)
    names, number = table["source"].to_pylist(), {name: number for number, name in enumerate(sources)}
    source = np.array([number[name] for name in names], dtype=np.int64)
    rocks = table["rock"].to_numpy().astype(np.int64)
    key = list(zip(names, rocks.tolist(), table["piece"].to_pylist(), strict=True))
    outcomes = np.array(table["outcome"].to_pylist(), dtype=object)
    return Ends(
        key=key,
        source=source,
        at_rest=np.isin(outcomes, np.array(AT_REST, dtype=object)),
        on_ground=np.asarray(outcomes == Outcome.STOPPED.name.lower(), dtype=bool),
        since=_release_times(table),
        t=table["t"].to_numpy().astype(float),
        max_speed=table["max_speed"].to_numpy().astype(float),
        release=frame.points_to_local(_columns(table, ("release_x", "release_y", "release_z"))),
        end=frame.points_to_local(_columns(table, ("x", "y", "z"))),
        runout=table["runout_m"].to_numpy().astype(float),
        mass=table["mass_kg"].to_numpy().astype(float),
        set=_sets(source, rocks, sets) if sets else None,
    )


def _release_times(table: pa.Table) -> FloatArray:
    """Return the time (N,) s at which each rock of deposits.csv was released: 0, or when the whole rock broke.

    The times of a fragment count from the release of the whole rock, but its place of release is where that rock broke.
    """
    broke = table.filter(pyarrow.compute.equal(table["outcome"], Outcome.FRAGMENTED.name.lower()))
    times = dict(zip(_rows(broke, ("source", "rock", "x", "y", "z")), broke["t"].to_pylist(), strict=True))
    is_fragment = table["piece"].to_numpy() > 0
    starts = _rows(table.filter(is_fragment), ("source", "rock", "release_x", "release_y", "release_z"))
    since = np.zeros(len(table))
    since[is_fragment] = [times[start] for start in starts]
    return since


def _rows(table: pa.Table, names: tuple[str, ...]) -> list[tuple[Any, ...]]:
    """Return the rows of a table as tuples of the values in the named columns."""
    return list(zip(*(table[name].to_pylist() for name in names), strict=True))


def _sets(source: IntArray, rocks: IntArray, sets: int) -> IntArray:
    """Return the number (N,) of each rock's parameter set.

    The tables of a run do not have this number, so it is computed again as in the run.

    source : (N,) number of the source; rocks : (N,) number of the rock in its source; sets : number of parameter sets
    """
    found = np.empty(len(rocks), dtype=np.int64)
    for number in np.unique(source):
        mine = source == number
        found[mine] = (rocks[mine] - turns(rocks[mine] // sets, sets, int(number))) % sets
    return found


def _paths(path: Path, frame: Frame) -> KeptPaths:
    """Return the paths in a Parquet file of a result: trajectories.parquet or critical_rock.parquet."""
    table = pyarrow.parquet.read_table(path, columns=[*KEY, "x", "y", "z", "speed"])
    key = _rows(table, KEY)
    begins = [i for i, one in enumerate(key) if i == 0 or one != key[i - 1]]
    return KeptPaths(
        key=[key[i] for i in begins],
        starts=np.array([*begins, len(key)], dtype=np.int64),
        x=frame.points_to_local(_columns(table, ("x", "y", "z"))),
        speed=table["speed"].to_numpy().astype(float),
    )


def _columns(table: pa.Table, names: tuple[str, ...]) -> FloatArray:
    """Return the named columns of a table as an array (N, C)."""
    return np.column_stack([table[name].to_numpy().astype(float) for name in names]).reshape(-1, len(names))


class ImpactRows(NamedTuple):
    """The I impacts of a run, ordered by rock and time.

    row : (I,) row of the rock in `Ends`; t : (I,) s; x : (I, 3) m
    speed_in, speed_out : (I,) m/s, before and after the impact
    """

    row: IntArray
    t: FloatArray
    x: FloatArray
    speed_in: FloatArray
    speed_out: FloatArray


def read_impacts(run: RunFiles) -> ImpactRows | None:
    """Return the impacts of all rocks; None if the run has no impacts or did not write them."""
    path = run.folder / "impacts.parquet"
    if not path.is_file():
        return None
    table = pyarrow.parquet.read_table(path, columns=[*KEY, "t", "x", "y", "z", "speed_in", "speed_out"])
    place = {key: row for row, key in enumerate(run.ends.key)}
    row = np.array([place[key] for key in _rows(table, KEY)], dtype=np.int64)
    t, into, out = (table[name].to_numpy().astype(float) for name in ("t", "speed_in", "speed_out"))
    order = np.lexsort((t, row))
    x = run.terrain.frame.points_to_local(_columns(table, ("x", "y", "z")))
    found = ImpactRows(row=row[order], t=t[order], x=x[order], speed_in=into[order], speed_out=out[order])
    return found if len(row) else None


class HazardGrid(NamedTuple):
    """A hazard map: values (Y, X), NaN in cells without a value.

    x, y : outer corner of the first cell (m, in plan, local frame)
    dx, dy : steps (m) from column to column and from row to row; dy may be < 0
    """

    values: FloatArray
    x: float
    y: float
    dx: float
    dy: float

    @property
    def cell(self) -> float:
        """The side of a cell (m)."""
        return abs(self.dx)

    def at(self, plan: FloatArray) -> FloatArray:
        """Return the values (N,) of the cells at points (N, 2) m in plan, local frame; NaN without a value."""
        column = np.floor((plan[:, 0] - self.x) / self.dx).astype(np.int64)
        row = np.floor((plan[:, 1] - self.y) / self.dy).astype(np.int64)
        rows, columns = self.values.shape
        inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        found = np.full(len(plan), np.nan)
        found[inside] = self.values[row[inside], column[inside]]
        return found


def has_hazard(run: RunFiles, name: str, band: str | None = None) -> bool:
    """Return True if a result has a hazard map, with or without values; name, band : as for `read_hazard`."""
    path = run.folder / "hazard" / f"{name}.tif"
    if not path.is_file():
        return False
    with rasterio.open(path) as file:
        return _band(file, band) is not None


def _band(file: Any, band: str | None) -> int | None:
    """Return the number of a band of an open hazard map, counted from 1; None without such a band.

    file : the opened GeoTIFF; band : as for `read_hazard`
    """
    bands = [text or "" for text in file.descriptions]
    return 1 if band is None else next((i for i, text in enumerate(bands, 1) if band in text.split()), None)


def read_hazard(run: RunFiles, name: str, band: str | None = None) -> HazardGrid | None:
    """Return a hazard map of a result; None if the file or the band is missing, or no cell has a value above 0.

    Cells with a value of 0 count as cells without a value.

    name : of the file in hazard/, without suffix; band : description of the band, such as "p95"; None for the first
    """
    path = run.folder / "hazard" / f"{name}.tif"
    if not path.is_file():
        return None
    with rasterio.open(path) as file:
        number = _band(file, band)
        if number is None:
            return None
        values, transform = file.read(number).astype(float), file.transform
    values[~(values > 0.0)] = np.nan
    east, north, _ = run.terrain.frame.origin
    turned = 1.0 if run.terrain.frame.up == "z" else -1.0  # with y up, the second axis of a map points south
    return None if np.isnan(values).all() else HazardGrid(
        values=values, x=transform.c - east, y=turned * transform.f - north, dx=transform.a, dy=turned * transform.e,
    )  # fmt: skip
