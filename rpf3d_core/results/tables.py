"""Write the tables of a run: deposits.csv, impacts.parquet and trajectories.parquet.

Positions and directions are in the input's own axes and coordinates; lengths in m, times in s, speeds in m/s, energies
in J. Energies are translational unless the name of the column contains rotational or total. A value that does not
exist (no ground contact, height not computed) is left empty.

Rocks with a shape have additional columns, and their impact energies include rotation (`with_blows`). Positions and
heights of these rocks refer to the centre of mass.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from numpy.typing import ArrayLike, NDArray

from rpf3d_core.ensemble.bodies import WHY_STOPPED
from rpf3d_core.ensemble.flights import Deposits, Impacts
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.ensemble.sizes import diameter_of
from rpf3d_core.ensemble.spin import rotational_energy
from rpf3d_core.ensemble.totals import runout
from rpf3d_core.results.columns import UNITS, lower_names, quaternions_of, struck_of, xyz_of, zones_of_facets
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.values import Mode, Outcome

GROUND = "ground"
"""Value of the column `struck` in impacts.parquet for an impact on the ground."""


@contextmanager
def open_tables(
    folder: Path, sources: Sequence[str], terrain: Terrain, density: float, impacts: bool = True,
    obstacles: Obstacles = NO_OBSTACLES, spins: bool = False,
) -> Iterator[Callable[[Deposits, Impacts], None]]:  # fmt: skip
    """Open deposits.csv (a line for each rock) and impacts.parquet (a row for each impact), to write them in parts.

    The context manager yields a function that writes the deposits and impacts of the next rocks.

    sources : names of the sources
    density : of the rocks, kg/m^3; impacts : True to write impacts.parquet; obstacles : barriers and trees of the scene
    spins : True if rocks spin; both tables then also have rotational and total energies
    """
    with ExitStack() as files:
        deposits_file = files.enter_context((folder / "deposits.csv").open("wb"))
        parquet: list[Any] = []

        def write(deposits: Deposits, struck: Impacts) -> None:
            lines = deposits_table(sources, terrain, deposits, density)
            lines = with_energies(lines, deposits) if spins else lines
            lines = with_poses(lines, terrain, deposits) if deposits.pose is not None else lines
            _write_lines(deposits_file, lines, header=not deposits_file.tell())
            if not impacts:
                return
            table = impacts_table(sources, terrain, deposits, struck, obstacles)
            table = with_spins(table, deposits, struck, density) if spins else table
            table = with_blows(table, deposits, struck) if deposits.pose is not None else table
            if not parquet:
                how = {"use_dictionary": _repeated(table.schema)}
                path = folder / "impacts.parquet"
                parquet.append(files.enter_context(pyarrow.parquet.ParquetWriter(path, table.schema, **how)))
            parquet[0].write_table(table)

        yield write


def write_trajectories(
    path: Path, sources: Sequence[str], terrain: Terrain, deposits: Deposits, samples: PathSamples
) -> None:
    """Write trajectories.parquet: one row for each point of a path, grouped by rock in order of time.

    sources : names of the sources; samples : points along the paths
    """
    table = trajectories_table(sources, terrain, deposits, samples)
    pyarrow.parquet.write_table(table, path, use_dictionary=_repeated(table.schema))


def write_profiles(path: Path, sources: Sequence[str], deposits: Deposits, profiles: Mapping[str, Any]) -> None:
    """Write the points of profiles as a CSV file, one line for each point.

    sources : names of the sources
    profiles : column name -> values (S,), in m, s or m/s; the column `row` has the row of the rock in `deposits`
    """
    columns = {name: _or_null(values) for name, values in profiles.items() if name != "row"}
    _write_csv(path, _table({**_rock_names(sources, deposits, profiles["row"]), **columns}))


def deposits_table(sources: Sequence[str], terrain: Terrain, deposits: Deposits, density: float) -> pa.Table:
    """Return the ends of R rocks as a table with R rows, the content of deposits.csv.

    `runout_m` is the horizontal distance from release to end. `zone` is the zone of the last facet touched.
    `max_height` is vertical, above the terrain. `diameter_m` is the diameter of a sphere of the rock's mass and
    density.

    sources : names of the sources; density : of the rocks, kg/m^3
    """
    return _table(
        {
            "source": _names(sources, deposits.source),
            "rock": deposits.rock,
            "piece": deposits.piece,
            "outcome": _names(lower_names(Outcome), deposits.outcome),
            **xyz_of(terrain.frame.points_to_input(deposits.x)),
            "t": deposits.t,
            "path_m": deposits.path,
            "runout_m": runout(deposits),
            "impacts": deposits.impacts,
            "max_speed": deposits.max_speed,
            "max_energy_j": deposits.max_energy,
            "max_height": _or_null(deposits.max_height),
            "zone": _names(terrain.zones, zones_of_facets(terrain, deposits.facet)),
            "entered_ground_at_speed": _or_null(deposits.ground_speed),
            "mass_kg": deposits.mass,
            "diameter_m": diameter_of(deposits.mass, density),
            **xyz_of(terrain.frame.points_to_input(deposits.release), prefix="release_"),
        }
    )


def impacts_table(
    sources: Sequence[str], terrain: Terrain, deposits: Deposits, impacts: Impacts, obstacles: Obstacles = NO_OBSTACLES
) -> pa.Table:
    """Return the impacts as a table with I rows, the content of impacts.parquet.

    `index` counts the impacts of a rock from 0. `struck` is GROUND or the name of an obstacle. At an obstacle `facet`
    and `zone` are empty. `energy_in_j` is the translational energy before the impact.

    sources : names of the sources
    """
    first = np.searchsorted(impacts.row, impacts.row, side="left")
    normals = terrain.frame.directions_to_input(impacts.normal)
    return _table(
        {
            **_rock_names(sources, deposits, impacts.row),
            "index": np.arange(len(impacts.row)) - first,
            "t": impacts.t,
            **xyz_of(terrain.frame.points_to_input(impacts.x)),
            "facet": pa.array(impacts.facet, mask=impacts.facet < 0),
            "zone": _names(terrain.zones, zones_of_facets(terrain, impacts.facet)),
            "struck": _names((GROUND, *obstacles.names), struck_of(impacts.facet, obstacles)),
            **xyz_of(normals, prefix="normal_"),
            "speed_in": impacts.speed_in,
            "speed_out": impacts.speed_out,
            "energy_in_j": 0.5 * deposits.mass[impacts.row] * impacts.speed_in**2,
        }
    )


def with_energies(table: pa.Table, deposits: Deposits) -> pa.Table:
    """Return the table of R deposits with two added columns: largest rotational and largest total energy (J)."""
    return _extended(
        table,
        {
            "max_rotational_energy_j": _or_null(deposits.max_rotational_energy),
            "max_total_energy_j": _or_null(deposits.max_total_energy),
        },
    )


def with_spins(table: pa.Table, deposits: Deposits, impacts: Impacts, density: float) -> pa.Table:
    """Return the table of I impacts with added columns: spins (rad/s), and rotational and total energies (J).

    The spins are before and after the impact; the energies are before the impact.

    density : of the rocks, kg/m^3
    """
    mass = deposits.mass[impacts.row]
    if impacts.energy_in is None:
        rotational = rotational_energy(mass, 0.5 * diameter_of(mass, density), impacts.spin_in)
    else:
        rotational = mass * np.maximum(impacts.energy_in - 0.5 * impacts.speed_in**2, 0.0)
    return _extended(
        table,
        {
            "spin_in": impacts.spin_in,
            "spin_out": impacts.spin_out,
            "rotational_energy_in_j": rotational,
            "total_energy_in_j": 0.5 * mass * impacts.speed_in**2 + rotational,
        },
    )


def with_poses(table: pa.Table, terrain: Terrain, deposits: Deposits) -> pa.Table:
    """Return the table of R deposits with added columns: shape, final orientation and stop reason of each rock.

    The quaternion turns vectors from the body's principal axes into the input's axes. `stopped_because` is empty for
    rocks that did not stop on the ground. The summary has the names of the shapes by their numbers.
    """
    return _extended(
        table,
        {
            "shape": np.asarray(deposits.shape),
            **quaternions_of(terrain, deposits.pose),
            "stopped_because": _names(WHY_STOPPED, np.asarray(deposits.why)),
        },
    )


def with_blows(table: pa.Table, deposits: Deposits, impacts: Impacts) -> pa.Table:
    """Return the table of I impacts of bodies with two added columns: number of contacts, energy after the impact (J).

    In the result, `energy_in_j` and `energy_out_j` are the kinetic energies before and after the impact, of translation
    and rotation together. The former values of `energy_in_j` are replaced.
    """
    mass, none = deposits.mass[impacts.row], np.empty(0)
    given = (impacts.contacts, impacts.energy_in, impacts.energy_out)
    contacts, before, after = (none if values is None else values for values in given)
    place = table.schema.get_field_index("energy_in_j")
    table = table.set_column(place, table.schema.field(place), pa.array(mass * before))
    return _extended(table, {"contacts": contacts.astype(np.int64), "energy_out_j": mass * after})


def trajectories_table(sources: Sequence[str], terrain: Terrain, deposits: Deposits, samples: PathSamples) -> pa.Table:
    """Return the points of paths as a table with S rows, the content of trajectories.parquet.

    `mode` is the rock's motion from this point on. Rocks with a shape also have their orientation.

    sources : names of the sources; samples : points along the paths
    """
    return _table(
        {
            **_rock_names(sources, deposits, samples.row),
            "t": samples.t,
            **xyz_of(terrain.frame.points_to_input(samples.x)),
            "speed": samples.speed,
            "mode": _names(lower_names(Mode), samples.mode),
            **quaternions_of(terrain, samples.q),
        }
    )


def _rock_names(sources: Sequence[str], deposits: Deposits, rows: NDArray[np.integer]) -> dict[str, Any]:
    """Return the columns that identify rocks in every table: source, rock number and fragment number.

    sources : names of the sources; rows : (N,) rows of the rocks in `deposits`
    """
    names = _names(sources, deposits.source[rows])
    return {"source": names, "rock": deposits.rock[rows], "piece": deposits.piece[rows]}


def _names(names: Sequence[str], index: ArrayLike) -> pa.Array:
    """Return a table column of names, given as an index (N,) into `names`; empty where the index is negative."""
    positions = np.asarray(index, dtype=np.int32)
    indices = pa.array(positions, mask=positions < 0)
    return pa.DictionaryArray.from_arrays(indices, pa.array(names, pa.string()))


def _or_null(values: NDArray[np.float64]) -> pa.Array:
    """Return a table column of values (N,) that is empty where a value is NaN."""
    return pa.array(values, from_pandas=True)


def _write_csv(path: Path, table: pa.Table) -> None:
    """Write a table as a new CSV file with a header."""
    with path.open("wb") as file:
        _write_lines(file, table, header=True)


def _write_lines(file: BinaryIO, table: pa.Table, header: bool) -> None:
    """Write the lines of a table to an open CSV file.

    The header is written here without quotes, because not every version of pyarrow can omit them.
    """
    if header:
        file.write((",".join(table.column_names) + "\n").encode())
    pyarrow.csv.write_csv(table, file, pyarrow.csv.WriteOptions(include_header=False))


def _table(columns: dict[str, Any]) -> pa.Table:
    """Return columns as a table that states the unit of each column."""
    table = pa.table(columns)
    fields = [field.with_metadata({"unit": UNITS[field.name]} if field.name in UNITS else {}) for field in table.schema]
    return pa.Table.from_arrays(table.columns, schema=pa.schema(fields))


def _extended(table: pa.Table, more: dict[str, Any]) -> pa.Table:
    """Return a table with additional columns that state their units."""
    added = _table(more)
    schema = pa.schema([*table.schema, *added.schema])
    return pa.Table.from_arrays([*table.columns, *added.columns], schema=schema)


def _repeated(schema: pa.Schema) -> list[str]:
    """Return the names of the columns to store as a dictionary of distinct values, because their values repeat.

    With a dictionary for all columns, a table takes 4 times as long to write and needs about 14 % more disk space.
    """
    return [field.name for field in schema if not pa.types.is_floating(field.type)]
