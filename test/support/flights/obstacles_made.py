"""Make barriers and trees for tests without a scene, and releases of rocks against them."""

import dataclasses
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from flights import scenes_of_facets as made
from rpf3d_core.effects.barriers import CORNER, Barriers, PanelSegments
from rpf3d_core.effects.forest import Deflection, Forest, Stems
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.effects.obstacle_cells import cells_of
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Paths
from rpf3d_core.simulation.engines import Models
from rpf3d_core.terrain.facets import Terrain, tolerance_of
from rpf3d_core.terrain.sections import ground_at, section_of
from rpf3d_core.values import Mode

MASS, RADIUS = 1000.0, 0.5
"""Mass and radius of the rocks of `scenes_of_facets.fly` (kg, m)."""
STRAIGHT = Deflection(0.35, 0.75, (1.0, 0.0, 0.0) * 3, (0.0, 0.0, 67.5, 76.0))
"""Deflection of rocks by trees in which no rock changes its direction."""
ASIDE = Deflection(0.35, 0.75, (0.4, 0.4, 0.2) * 3, (0.0, 22.5, 67.5, 76.0))


def fence(
    terrain: Terrain, corners: Sequence[tuple[float, float]], height: float, capacity: float, taken: float = 1.0,
    top: bool = False, first: int = 0,
) -> Barriers:  # fmt: skip
    """Return the effect of one barrier along a line on a terrain.

    corners : (x, y) m of the line; height : m; capacity : largest energy (J) that the barrier stops
    taken, top : as in `PanelSegments`; first : as in `Barriers`
    """
    feet, facets, lines = [], [], []
    for number, (begin, end) in enumerate(pairwise(np.array(corners, dtype=float))):
        section = section_of(terrain, begin, end)
        assert section is not None
        at = begin + section.share[..., None] * (end - begin)
        feet.append(np.concatenate([at, section.z[..., None]], axis=-1))
        facets.append(section.facet)
        lines.append(np.full(len(at), number))
    foot = np.concatenate(feet)
    columns = (np.ascontiguousarray(c) for c in (*foot[:, 0].T, *(foot[:, 1] - foot[:, 0]).T))
    barrier = np.zeros(len(foot), dtype=np.int64)
    one = (np.array([value]) for value in (height, capacity, taken, float(top)))
    panel = PanelSegments(*columns, np.concatenate(facets), np.concatenate(lines), barrier, *one)
    plan = foot[..., :2]
    cells = cells_of(plan.min(axis=1) - CORNER, plan.max(axis=1) + CORNER)
    return Barriers(first, panel, 4.0 * tolerance_of(terrain), cells)


def fences(*some: Barriers) -> Barriers:
    """Return the effect of several barriers together, in the given order."""
    rows, lines = [len(one.panel.x) for one in some], np.cumsum([0, *(one.panel.line.max() + 1 for one in some[:-1])])
    columns = {name: np.concatenate([getattr(one.panel, name) for one in some]) for name in PanelSegments._fields}
    columns["line"] = columns["line"] + np.repeat(lines, rows)
    columns["barrier"] = np.repeat(np.arange(len(some)), rows)
    panel = PanelSegments(**columns)
    begin, way = np.stack([panel.x, panel.y], 1), np.stack([panel.dx, panel.dy], 1)
    cells = cells_of(np.minimum(begin, begin + way) - CORNER, np.maximum(begin, begin + way) + CORNER)
    return Barriers(0, panel, some[0].slack, cells)


def trees(
    terrain: Terrain, places: Sequence[tuple[float, float]], dbh_cm: float = 40.0, height: float = 20.0,
    energy: float = 1e5, deflection: Deflection = STRAIGHT, first: int = 0,
) -> Forest:  # fmt: skip
    """Return the effect of equal trees on a terrain.

    places : (x, y) m; dbh_cm : diameter at breast height (cm); height : m; energy : largest energy that a tree absorbs
        (J); deflection : how a tree changes the direction of a rock; first : as in `Barriers`
    """
    plan = np.array(places, dtype=float).reshape(-1, 2)
    z, _ = ground_at(terrain, plan)
    some = np.ones(len(plan))
    stems = Stems(*(np.ascontiguousarray(c) for c in (
        plan[:, 0], plan[:, 1], z, 0.005 * dbh_cm * some, height * some, energy * some,
    )))  # fmt: skip
    reach = 0.005 * dbh_cm + RADIUS + 1e-6
    return Forest(first, stems, deflection, cells_of(plan - reach, plan + reach))


def with_effects(physics: Flight, *effects: object) -> Flight:
    """Return a copy of a flight with the given effects in place of its own."""
    models = physics.models
    return dataclasses.replace(physics, models=Models(models.rebound, models.ground, chain_of(effects)))


def energy_of(speed: float) -> float:
    """Return the translational energy (J) of a rock at a speed (m/s)."""
    return 0.5 * MASS * speed * speed


def passage(paths: Paths, p: int, x: float, gravity: float) -> tuple[float, float, float]:
    """Return time (s), translational energy (J) and height z (m) of a rock at the plane at x (m) on a path segment.

    p : row of the segment in `paths`; the segment must not be parallel to the plane; gravity : m/s^2
    """
    begin, end = paths.x[p], paths.x[p + 1]
    share = (x - begin[0]) / (end[0] - begin[0])
    t = share * (paths.t[p + 1] - paths.t[p])
    if paths.mode[p] == Mode.FLIGHT:
        z, vz = begin[2] + paths.v[p, 2] * t - 0.5 * gravity * t * t, paths.v[p, 2] - gravity * t
        speed2 = paths.v[p, 0] ** 2 + paths.v[p, 1] ** 2 + vz**2
    else:
        z = begin[2] + share * (end[2] - begin[2])
        speed2 = (1 - share) * (paths.v[p] ** 2).sum() + share * (paths.v_end[p] ** 2).sum()
    return paths.t[p] + t, 0.5 * MASS * speed2, z


def thrown(count: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m and velocities (R, 3) m/s of rocks thrown down an incline that falls towards +x."""
    random = np.random.default_rng(seed)
    x = np.stack([random.uniform(-2, 0, count), random.uniform(-7, 7, count), random.uniform(2, 6, count)], 1)
    return x, np.stack([random.uniform(0, 8, count), random.uniform(-2, 2, count), np.zeros(count)], 1)


def rough_ground() -> made.Terrain:
    """Return an incline of 35 degrees with uneven facets."""
    return made.incline(35, cells=(30, 8), jitter=3)
