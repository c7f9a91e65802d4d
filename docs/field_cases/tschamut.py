"""Field case Tschamut 2014: 18 runs on an alpine meadow, whose terrain is approximated in cells of 5 m.

Volkwein & Gerber 2018, EnviDat doi:10.16904/envidat.34; Geosciences 8(3):88.
"""

import csv
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from field_cases.authume import REPORT_SEED, ROOT
from field_cases.basis import EndPoints, horizontal_axes, mean_and_sd, measured_from
from field_cases.figures import bootstrap
from field_cases.flying import Ends, Keys, Site
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.choices import chosen_scene

DATA = ROOT.parent / "shared" / "data" / "tschamut2014"
RUNS = 18
OTHER_CODE = {"point mass": -35.0, "sphere": 104.6}
"""Mean runout error (m) of another open program, without calibration, on the survey of 2 m: for comparison."""
MEADOW_DENSITY = 2700.0
SPREAD = 0.5
"""Half-width (m) of the square in which the rocks of a run start: about a block's size, much less than a cell."""
CELL, CORNER = 5.0, (-32.5, 87.5)
"""Side of a cell of the terrain (m), and the centre of the south-western cell (m)."""
ROCKS_A_RUN = 500
STAYED = 10.0
"""Runout (m) below which a rock counts as stopped near its release; no block stopped so near."""


class Runs:
    """The R measured runs of the field, sorted by name.

    names : R names; release, end : (R, 3) m on the ground; velocity : (R, 3) m/s, at the release
    radius : (R,) m; mass : (R,) kg; axes : the first axis points from the mean release to the mean end point
    """

    def __init__(self) -> None:
        releases, ends = (_table(DATA / f"{name}.csv") for name in ("release_points", "observed_deposition"))
        self.names = sorted(releases)
        self.release, self.end = (_columns(table, self.names, "x_m", "y_m", "ground_z_m") for table in (releases, ends))
        self.velocity = _columns(releases, self.names, "vx_mps", "vy_mps", "vz_mps")
        self.radius = _columns(releases, self.names, "radius_m")[:, 0]
        self.mass = _columns(releases, self.names, "mass_kg")[:, 0]
        self.axes = horizontal_axes(self.release.mean(axis=0), self.end.mean(axis=0))

    def seen(self) -> EndPoints:
        """Return the field's end points as distances and angles, each from the release of its run."""
        return seen(np.arange(len(self.names)), self.end)

    def distinct(self) -> list[int]:
        """Return the numbers of the runs that repeat no earlier run; v034 repeats v033 to the last digit."""
        rows = [(*self.release[i], *self.end[i]) for i in range(len(self.names))]
        return [i for i, row in enumerate(rows) if row not in rows[:i]]


@lru_cache
def runs() -> Runs:
    """Return the measured runs of the field; the files are read once."""
    return Runs()


@lru_cache
def site(rocks_a_run: int, seed: int) -> Site:
    """Return the meadow as a site, prepared for many flights; each run is a source with `rocks_a_run` rocks."""
    field = runs()
    # A sphere rests on the ground where its centre is a radius above; on a slope its centre is a little higher.
    sources = [
        {
            "name": name, "points": [[*map(float, field.release[i, :2]), 0.0]],
            "above_ground": 2.0 * float(field.radius[i]), "velocity": [*map(float, field.velocity[i])],
            "spread": [SPREAD, SPREAD, 0.0], "rocks": rocks_a_run,
        }
        for i, name in enumerate(field.names)
    ]  # fmt: skip
    scene = Scene.model_validate({
        "path": Path("tschamut_2014.yaml"),
        "terrain": {"files": [{"path": str(DATA / "terrain.asc"), "zone": "meadow"}]},
        "materials": {"default": {"normal_restitution": 0.3, "tangential_restitution": 0.8}},
        "rock": {"mass": float(field.mass.mean()), "density": MEADOW_DENSITY},
        "sources": sources,
        "rebound": "constant",
        "ground": "sliding",
        "stop_speed": 0.5,
    })  # fmt: skip
    return Site(chosen_scene(scene, None, "compiled", seed))


def heights() -> FloatArray:
    """Return the heights of the terrain (46, 43) m at the centres of its cells, the southernmost row first."""
    return np.loadtxt(DATA / "terrain.asc", skiprows=6)[::-1]


def seen(run: IntArray, ends: FloatArray) -> EndPoints:
    """Return end points (N, 3) m as distances and angles, each from the field's release of its run.

    run : (N,) number of the run of each end point
    """
    return measured_from(runs().release[run], ends, runs().axes)


def figures_of(run: IntArray, ends: FloatArray) -> dict[str, float]:
    """Return the figures of end points (N, 3) m of field or simulation by name; run : as in `seen`."""
    found = seen(run, ends)
    pairs = {"side": found.across, "runout": found.runout, "angle": found.reach_angle}
    return {f"{name}_{key}": value for name, values in pairs.items()
            for key, value in zip(("mean", "sd"), mean_and_sd(values), strict=True)}  # fmt: skip


def field_figures() -> dict[str, Any]:
    """Return the figures of the field's end points by name, and the number of runs."""
    field = runs()
    return {
        "runs": len(field.names),
        **figures_of(np.arange(len(field.names)), field.end),
    }


def simulated(keys: Keys) -> tuple[dict[str, Any], Ends]:
    """Fly a model; return its figures (`compared`), and the end points of its rocks. keys : as in `Site.fly`."""
    ends = site(ROCKS_A_RUN, REPORT_SEED).fly(keys)
    return compared(ends), ends


def compared(ends: Ends) -> dict[str, Any]:
    """Return the figures of simulated end points by name, with errors of the runout over the runs."""
    errors, field = errors_of(ends), runs()
    far = np.linalg.norm((mean_ends(ends) - field.end)[:, :2], axis=1)
    return {
        **figures_of(ends.source, ends.end),
        "error_mean": float(errors.mean()),
        "error_interval": bootstrap(errors, lambda s: float(s.mean())),
        "error_absolute": float(np.abs(errors).mean()),
        "correlation": correlation(errors),
        "east": _at_release(ends, errors, east()),
        "west": _at_release(ends, errors, ~east()),
        "end_off": float(far.mean()),
        "left": float(1.0 - ends.stopped.mean()),
    }


def east() -> NDArray[np.bool_]:
    """Return flags (R,), True for runs that were released at the eastern one of two places, 25 m from the other."""
    return np.asarray(runs().release[:, 0] > 50.0)


def _at_release(ends: Ends, errors: FloatArray, chosen: NDArray[np.bool_]) -> dict[str, float]:
    """Return the mean error (m) of some runs, and the share (-) of their rocks with a runout below STAYED.

    chosen : (R,) True for these runs
    """
    if not chosen.any():
        return {"error_mean": np.nan, "stayed": np.nan}
    runout = seen(ends.source, ends.end).runout[chosen[ends.source]]
    return {"error_mean": float(errors[chosen].mean()), "stayed": float((runout < STAYED).mean())}


def errors_of(ends: Ends) -> FloatArray:
    """Return the error of runout of each run (R,) m: mean simulated runout minus observed runout.

    The runout of a rock that left the terrain ends at the boundary. NaN for a run without rocks.
    """
    return _by_run(ends.source, seen(ends.source, ends.end).runout) - runs().seen().runout


def mean_ends(ends: Ends) -> FloatArray:
    """Return the mean end point (R, 3) m of the rocks of each run."""
    return np.stack([_by_run(ends.source, ends.end[:, k]) for k in range(3)], axis=1)


def correlation(errors: FloatArray) -> float:
    """Return the correlation of simulated and observed runout over the runs; 0 if all simulated runouts are equal."""
    observed = runs().seen().runout
    predicted = observed + errors
    return 0.0 if np.ptp(predicted) < 1e-9 else float(np.corrcoef(predicted, observed)[0, 1])


def _by_run(run: IntArray, values: FloatArray) -> FloatArray:
    """Return the mean (R,) of values (N,) over the rocks of each run; NaN for a run without rocks.

    run : (N,) number of the run of each rock
    """
    count = len(runs().names)
    rocks, summed = np.bincount(run, minlength=count), np.bincount(run, values, count)
    return np.divide(summed, rocks, out=np.full(count, np.nan), where=rocks > 0)


def _table(path: Path) -> dict[str, dict[str, str]]:
    with path.open(newline="") as file:
        return {line["trajectory_id"]: line for line in csv.DictReader(file)}


def _columns(table: dict[str, dict[str, str]], names: list[str], *columns: str) -> FloatArray:
    return np.array([[float(table[name][column]) for column in columns] for name in names])
