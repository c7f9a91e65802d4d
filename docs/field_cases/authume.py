"""Field case Authume quarry, profile P1: 41 blocks on the slope of an open pit.

Garcia, Villard, Richefeu, Daudon, Eng. Geol.; Bourrier et al. 2021, Landslides 18:639-654; data set
richefeu/AuthumeQuarryRockfalls_Data-in-Brief (2025). y is up.
"""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from field_cases.basis import Axes, EndPoints, mean_and_sd, measured_from
from field_cases.figures import bootstrap, distance, distance_of_resamples
from field_cases.flying import Ends, Keys, Site
from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.setup.choices import chosen_scene

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data" / "authume"
SCENE = ROOT / "config" / "scenes" / "authume_p1.yaml"

SECTIONS = {"upper": (-np.inf, 30.0), "ledge": (30.0, 45.0), "floor": (45.0, np.inf)}
PERCENTILES = (5, 25, 50, 75, 95)
FAR = 55.0
"""x (m) beyond which 12 % of the field's blocks stopped."""
DATUM = 2.87
"""Height (m) of the field's end points above the mesh. Simulated end points are raised by this height, which changes
only their reach angles."""
AXES = Axes(*np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]))
"""Axes of the data: x is along profile P1, z across the profile, y upwards."""

MEAN_X = 44.1
"""Mean x (m) of the 41 end points."""

REPORT_SEED = 2
ROCKS = 10_000
"""Seed and number of the rocks for the figures on the page; with this seed, they are not the rocks of a search."""


@lru_cache
def site(rocks: int, seed: int) -> Site:
    """Return the quarry as a site, prepared for many flights of a number of rocks."""
    return Site(chosen_scene(SCENE, rocks, "compiled", seed))


def end_points() -> FloatArray:
    """Return the observed end points of the 41 blocks, (41, 3) m."""
    return np.loadtxt(DATA / "Endpoints_P1.txt")[:, :3]


def drop() -> FloatArray:
    """Return the mean drop point (3,) m, from which all distances are measured."""
    return np.loadtxt(DATA / "positions_P1.xyz")[:, :3].mean(axis=0)


def field() -> dict[str, Any]:
    """Return the figures of the field's end points by name, with 95 % intervals."""
    ends = end_points()
    x, across = ends[:, 0], seen(ends).across
    return {
        **figures_of(ends),
        "rocks": len(x),
        "mean_interval": bootstrap(x, lambda s: float(s.mean())),
        "sd_interval": bootstrap(x, lambda s: float(s.std(ddof=1))),
        "side_sd_interval": bootstrap(across, lambda s: float(s.std(ddof=1))),
        "section_intervals": {n: wilson_interval(_between(x, *edges), len(x)) for n, edges in SECTIONS.items()},
        "by_chance": distance_of_resamples(x),
        "side_by_chance": distance_of_resamples(across),
    }  # fmt: skip


def simulated(keys: Keys) -> tuple[dict[str, Any], Ends]:
    """Fly a model; return the figures of its end points by name, and the end points. keys : as in `Site.fly`."""
    flown = site(ROCKS, REPORT_SEED).fly(keys)
    return compared(flown), flown


def compared(flown: Ends) -> dict[str, Any]:
    """Return the figures of simulated end points by name, with their distances from the field's distributions."""
    ends, field = in_field_datum(flown.end), end_points()
    return {
        **figures_of(ends),
        "distance": distance(ends[:, 0], field[:, 0]),
        "side_distance": distance(seen(ends).across, seen(field).across),
        "left": float(1.0 - flown.stopped.mean()),
    }


def in_field_datum(ends: FloatArray) -> FloatArray:
    """Return simulated end points (N, 3) m, raised to the height reference of the field."""
    return ends + DATUM * AXES.up


def seen(ends: FloatArray) -> EndPoints:
    """Return end points (N, 3) m in the field's height reference as distances and angles from the mean drop point."""
    return measured_from(drop(), ends, AXES)


def figures_of(ends: FloatArray) -> dict[str, Any]:
    """Return the figures of end points (N, 3) m of field or simulation by name; in the field's height reference."""
    x, found = ends[:, 0], seen(ends)
    pairs = {"": x, "side_": found.across, "runout_": found.runout, "angle_": found.reach_angle}
    figures = {f"{name}{key}": value for name, values in pairs.items()
               for key, value in zip(("mean", "sd"), mean_and_sd(values), strict=True)}  # fmt: skip
    return {
        **figures,
        "farthest": float(x.max()),
        "beyond": float((x > FAR).mean()),
        "percentiles": {f"p{p}": float(np.percentile(x, p)) for p in PERCENTILES},
        "sections": {name: _between(x, *edges) / len(x) for name, edges in SECTIONS.items()},
    }


def _between(x: FloatArray, low: float, high: float) -> int:
    return int(((x >= low) & (x < high)).sum())
