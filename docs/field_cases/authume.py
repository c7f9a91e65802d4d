"""Authume quarry, profile P1: 41 blocks on an open pit's slope.

Garcia, Villard, Richefeu, Daudon, Eng. Geol.; Bourrier et al. 2021, Landslides 18:639-654; data set
richefeu/AuthumeQuarryRockfalls_Data-in-Brief (2025). y is up.
"""

from collections.abc import Mapping, Sequence
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from field_cases.basis import Axes, EndPoints, mean_and_sd, measured_from
from field_cases.figures import bootstrap, distance, distance_of_halves, distance_of_resamples
from field_cases.flying import Ends, Keys, Site
from field_cases.rows import Row, row_named
from field_cases.search import Found, search
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.setup.choices import chosen_scene

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data" / "authume"
SCENE = ROOT / "config" / "scenes" / "authume_p1.yaml"

SECTIONS = {"upper": (-np.inf, 30.0), "ledge": (30.0, 45.0), "floor": (45.0, np.inf)}
PERCENTILES = (5, 25, 50, 75, 95)
DATUM = 2.87
"""The field's end points lie so far above the mesh (m). Simulated ones are lifted by it, which moves their reach angle
alone."""
AXES = Axes(*np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]))
"""x runs along profile P1, z across it, y upwards."""

MEAN_X, MEAN_X_ROOM = 44.1, 5.0
LEDGE, FLOOR, SHARE_ROOM = 51.0, 44.0, 15.0
"""What a calibrated model should reach: |mean x - 44.1| of 5 m; shares (%) to 15 points, as unsure as the field is."""

SEARCH_SEED = 1
REPORT_SEED = 2
ROCKS = 10_000
"""Figures of the report are of other rocks than those of the search."""
STEPS_OF_R_T = (0.78, 0.82, 0.86, 0.90, 0.94)


@lru_cache
def site(rocks: int, seed: int) -> Site:
    """The quarry with this number of rocks."""
    return Site(chosen_scene(SCENE, rocks, "compiled", seed))


def end_points() -> FloatArray:
    """The 41 end points (41, 3) m."""
    return np.loadtxt(DATA / "Endpoints_P1.txt")[:, :3]


def drop() -> FloatArray:
    """The middle of the drop points (3,) m."""
    return np.loadtxt(DATA / "positions_P1.xyz")[:, :3].mean(axis=0)


def halves() -> tuple[list[int], list[int]]:
    """The blocks of the first half, every second line of the file from the first, and of the second."""
    blocks = list(range(len(end_points())))
    return blocks[::2], blocks[1::2]


def field() -> dict[str, Any]:
    """Return the field's figures, with intervals."""
    ends = end_points()
    x, across = ends[:, 0], seen(ends).across
    return {
        **figures_of(ends),
        "rocks": len(x),
        "mean_interval": bootstrap(x, lambda s: float(s.mean())),
        "sd_interval": bootstrap(x, lambda s: float(s.std(ddof=1))),
        "percentile_intervals": {
            f"p{p}": bootstrap(x, lambda s, p=p: float(np.percentile(s, p))) for p in PERCENTILES
        },
        "side_sd_interval": bootstrap(across, lambda s: float(s.std(ddof=1))),
        "section_intervals": {n: wilson_interval(_between(x, *edges), len(x)) for n, edges in SECTIONS.items()},
        "x": _apart(x),
        "side": _apart(across),
    }  # fmt: skip


def _apart(values: FloatArray) -> dict[str, float]:
    """Return how far the field's values (N,) are from themselves, by chance alone."""
    return {
        "random_halves": distance_of_halves(values),
        "these_halves": distance(*(values[half] for half in halves())),
        "resampled": distance_of_resamples(values),
    }


def simulated(keys: Keys) -> tuple[dict[str, Any], Ends]:
    """Return a model's figures, and where its rocks ended."""
    flown = site(ROCKS, REPORT_SEED).fly(keys)
    ends, field = in_field_datum(flown.end), end_points()
    some = (range(len(field)), *halves())
    found = figures_of(ends)
    found["errors"] = [distance(ends[:, 0], field[blocks, 0]) for blocks in some]
    found["side_errors"] = [distance(seen(ends).across, seen(field).across[blocks]) for blocks in some]
    found["left"] = float(1.0 - flown.stopped.mean())
    found["checks"] = checks(found)
    return found, flown


def in_field_datum(ends: FloatArray) -> FloatArray:
    """Return simulated end points (N, 3) m, lifted by the shift of the field's vertical datum."""
    return ends + DATUM * AXES.up


def seen(ends: FloatArray) -> EndPoints:
    """Return end points (N, 3) m of field or simulation, in the field's datum, as seen from the mean drop point."""
    return measured_from(drop(), ends, AXES)


def figures_of(ends: FloatArray) -> dict[str, Any]:
    """Return the figures of end points (N, 3) m of field or simulation, in the field's datum."""
    x, found = ends[:, 0], seen(ends)
    pairs = {"": x, "side_": found.across, "runout_": found.runout, "angle_": found.reach_angle}
    figures = {f"{name}{key}": value for name, values in pairs.items()
               for key, value in zip(("mean", "sd"), mean_and_sd(values), strict=True)}  # fmt: skip
    return {
        **figures,
        "farthest": float(x.max()),
        "percentiles": {f"p{p}": float(np.percentile(x, p)) for p in PERCENTILES},
        "sections": {name: _between(x, *edges) / len(x) for name, edges in SECTIONS.items()},
    }


def checks(found: Mapping[str, Any]) -> dict[str, bool]:
    """What a calibrated model should reach, and whether these figures do."""
    shares = found["sections"]
    return {
        "mean": abs(found["mean"] - MEAN_X) <= MEAN_X_ROOM,
        "ledge": abs(100.0 * shares["ledge"] - LEDGE) <= SHARE_ROOM,
        "floor": abs(100.0 * shares["floor"] - FLOOR) <= SHARE_ROOM,
    }


def calibrate(row: Row, some: Sequence[int]) -> Found:
    """One set of parameters for all zones, by the distance of x from that of some blocks."""
    x = end_points()[some, 0]
    return search(lambda parameters: distance(_flown_x(row.name, tuple(parameters.items())), x), row.free)


@cache
def _flown_x(model: str, parameters: tuple[tuple[str, float], ...]) -> FloatArray:
    """x (N,) m of a search's rocks, flown once for all searches."""
    row = row_named(model)
    return site(row.rocks, SEARCH_SEED).fly(row.keys(dict(parameters))).end[:, 0]


def sensitivity(row: Row, about: Mapping[str, float], name: str, values: tuple[float, ...]) -> list[float]:
    """Mean x (m) as one parameter takes several values and the others stay."""
    quarry = site(row.rocks, SEARCH_SEED)
    flown = [quarry.fly(row.keys({**about, name: value})) for value in values]
    return [float(ends.end[:, 0].mean()) for ends in flown]


def _between(x: FloatArray, low: float, high: float) -> int:
    return int(((x >= low) & (x < high)).sum())
