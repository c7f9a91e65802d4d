"""Make random meshes, release rocks on them, and check independently that no rock falls through the ground.

The rocks start on vertices, edges and facets. The check shares no code with the contact search. For every facet that a
point lies over in plan, the check computes in NumPy whether the point is below the facet's plane. A family is a kind of
random mesh, made by one function. All meshes except those of OVERHANGING and `pieces` are height fields over a convex
rim, so no facet faces downwards. In a mesh with overhangs, a point is below the ground if an odd number of facets lies
straight above the point.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import shapely
from flights.models_by_name import models_called
from flights.scenes_of_facets import terrain_of
from matplotlib.tri import Triangulation

from meshes.cracked_ground import cracked, releases_at_cracks
from meshes.cutting_pieces import (
    PIECES,
    Legs,
    highest,
    is_closed,
    meeting_points,
    parts_of,
    passed_through,
    rim_of,
    within,
)
from meshes.sharp_ground import releases_thrown, strips, terraces, wedges
from meshes.side_of_ground import DEEP, NEXT_TO, has_odd_above, touches
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.materials.library import Surface, materials_of
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Mode, Outcome

SIDE = 12.0
"""Side of the square that a mesh covers, if the mesh is not LARGE (m)."""
LARGE = 100.0
"""Factor on the size of some meshes: the tolerance and the faults within the tolerance grow with the size."""
UTM = (512_345.678, 4_567_890.123, 1_687.0)
"""Offset (m) as of survey coordinates; adding and subtracting the offset rounds the vertices."""
ROUNDED = 2e-4
"""Distance from the rim, as a share of the mesh's size, within which rocks are not checked.

A rim with rounded vertices is not convex.
"""

LEGS = 8
"""Number of legs of an arc; at the ends of each leg, the check computes on which side of a facet the rock is."""

Draw = np.random.Generator


@dataclass(frozen=True)
class Case:
    """A mesh of a family, rocks released on the mesh, and the models of their flights; all drawn from one seed.

    x : (R, 3) m; v : (R, 3) m/s; ground : name of the ground model; words : description, for reports
    """

    family: str
    seed: int
    terrain: Terrain
    x: np.ndarray
    v: np.ndarray
    flight: Flight
    ground: str
    words: str


# --- meshes -----------------------------------------------------------------------------------------------------------


def _grid(draw: Draw, cells: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points (V, 2) m in plan and triangles (F, 3) of a square grid; each cell is cut along a random diagonal.

    cells : number of cells on each side
    """
    ticks = np.linspace(0.0, SIDE, cells + 1)
    plan = np.stack(np.meshgrid(ticks, ticks, indexing="ij"), -1).reshape(-1, 2)
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    other = (draw.uniform(size=len(a)) < draw.choice([0.0, 0.5, 1.0]))[:, None]
    first = np.where(other, np.stack([a, b, d], 1), np.stack([a, b, c], 1))
    second = np.where(other, np.stack([b, c, d], 1), np.stack([a, c, d], 1))
    return plan, np.concatenate([first, second])


def _sloping(draw: Draw, plan: np.ndarray, steepest: float = 1.2) -> np.ndarray:
    """Return heights (V,) m at places (V, 2) m of a plane that falls along an axis, a diagonal or in any direction.

    steepest : largest slope (m per m)
    """
    angle = draw.choice([0.0, 0.25, 0.5, draw.uniform()]) * math.pi
    return -draw.uniform(0.0, steepest) * (plan @ (math.cos(angle), math.sin(angle)))


def rough(draw: Draw) -> Terrain:
    """Return a sloping grid with noise; its amplitude is random, from 1 nm to 3 m."""
    plan, triangles = _grid(draw, int(draw.integers(2, 13)))
    noise = 10.0 ** draw.uniform(-9.0, 0.5) * draw.uniform(-1.0, 1.0, len(plan))
    return _mesh(plan, _sloping(draw, plan) + noise, triangles)


def planes(draw: Draw) -> Terrain:
    """Return a plane with any slope, cut into facets."""
    plan, triangles = _grid(draw, int(draw.integers(2, 6)))
    return _mesh(plan, _sloping(draw, plan), triangles)


def ridges(draw: Draw) -> Terrain:
    """Return a slope with ridges and gullies along the grid: every other row of points is raised."""
    plan, triangles = _grid(draw, cells := int(draw.integers(3, 13)))
    row = np.repeat(np.arange(cells + 1), cells + 1)
    height = draw.uniform(0.01, 3.0) * (row % 2) + draw.choice([0.0, 1e-3, 0.3]) * draw.uniform(-1, 1, len(plan))
    return _mesh(plan, _sloping(draw, plan) + height, triangles)


def steps(draw: Draw) -> Terrain:
    """Return a mesh with few different heights, so that many facets are level or have equal slopes."""
    plan, triangles = _grid(draw, int(draw.integers(2, 13)))
    step = draw.choice([0.25, 0.5, 1.0])
    return _mesh(plan, step * np.round((_sloping(draw, plan) + draw.uniform(-1, 1, len(plan))) / step), triangles)


def benches(draw: Draw) -> Terrain:
    """Return level berms and bench faces of up to 85 degrees, with noise."""
    plan, triangles = _grid(draw, cells := 6)
    run = SIDE / cells * math.tan(math.radians(draw.uniform(5.0, 40.0))) / 2.0
    plan[:, 0] += np.where(np.round(plan[:, 0] * cells / SIDE) % 2 == 1, run - SIDE / cells, 0.0)
    level = np.floor((np.round(plan[:, 0] * cells / SIDE) + 0.5) / 2.0)
    return _mesh(plan, -2.0 * level + draw.choice([0.0, 0.05]) * draw.uniform(-1, 1, len(plan)), triangles)


def scattered(draw: Draw) -> Terrain:
    """Return the Delaunay triangles of scattered points, so that any number of facets may meet at a vertex."""
    square = [(0.0, 0.0), (SIDE, 0.0), (SIDE, SIDE), (0.0, SIDE)]
    plan = np.concatenate([square, draw.uniform(0.3, SIDE - 0.3, (int(draw.integers(5, 80)), 2))])
    noise = 10.0 ** draw.uniform(-4.0, 0.5) * draw.uniform(-1.0, 1.0, len(plan))
    return _mesh(plan, _sloping(draw, plan) + noise, Triangulation(plan[:, 0], plan[:, 1]).triangles)


def junctions(draw: Draw) -> Terrain:
    """Return a rough grid with T-junctions: some facets are cut into two, but their neighbours are not."""
    whole = rough(draw)
    vertices, triangles = whole.vertices.tolist(), []
    for a, b, c in whole.triangles.tolist():
        if draw.uniform() < 0.4:
            share = draw.choice([0.5, draw.uniform(0.1, 0.9)])
            vertices.append((np.array(vertices[a]) * (1.0 - share) + np.array(vertices[b]) * share).tolist())
            triangles += [(a, len(vertices) - 1, c), (len(vertices) - 1, b, c)]
        else:
            triangles.append((a, b, c))
    return terrain_of(vertices, triangles)


def fans(draw: Draw) -> Terrain:
    """Return four to eight facets of any slope around one vertex, with ridges and gullies between them."""
    count = int(draw.integers(4, 9))
    angles = 2.0 * math.pi * (np.arange(count) + draw.uniform(-0.3, 0.3, count)) / count
    rim = 0.5 * SIDE * np.stack([np.cos(angles), np.sin(angles)], 1)
    plan, a = np.concatenate([[(0.0, 0.0)], rim]), np.arange(count)
    heights = draw.uniform(-2.0, 2.0, count) + draw.choice([0.0, 2.0])
    return _mesh(plan, np.concatenate([[0.0], heights]), np.stack([0 * a, 1 + a, 1 + (a + 1) % count], 1))


def walls(draw: Draw) -> Terrain:
    """Return a plateau, a wall that is vertical or nearly so, and a floor, in strips with seams at the foot.

    The floor slopes along the wall, and towards or away from it.
    """
    rows, foot = np.linspace(0.0, SIDE, int(draw.integers(2, 6))), 0.5 * SIDE
    lean = float(draw.choice([0.0, 0.0, 0.0, 1e-9, 1e-6, 1e-4, 0.1]))
    along, towards = draw.uniform(-1.0, 1.0), draw.uniform(-0.2, 1.0)
    profile = np.array([(0.0, 4.0), (foot, 4.0), (foot + lean, 0.0), (SIDE, towards * (SIDE - foot))])
    vertices = np.array([(x, y, z + along * y) for y in rows for x, z in profile])
    return terrain_of(vertices, strips(draw, len(rows)))


def seams(draw: Draw) -> Terrain:
    """Return one plane of three facets with a T-junction: two of the facets lie along one edge of the third.

    This edge runs down the plane or in a random direction.
    """
    turn, slope = draw.uniform(0.0, 2.0 * math.pi), math.tan(math.radians(draw.uniform(5.0, 65.0)))
    plan = 0.5 * SIDE * np.array([(-1.0, -0.05), (1.0, 0.07), (0.1, 1.0), (0.0, -1.0)])
    plan = plan @ np.array([(math.cos(turn), math.sin(turn)), (-math.sin(turn), math.cos(turn))])
    dip = plan[1] - plan[0] if draw.uniform() < 0.5 else draw.normal(size=2)
    corners = np.column_stack([plan, -slope * (plan @ dip) / np.linalg.norm(dip)])
    share = draw.uniform()
    return terrain_of([*corners, (1.0 - share) * corners[0] + share * corners[1]], [(0, 4, 2), (4, 1, 2), (1, 0, 3)])


def overhangs(draw: Draw) -> Terrain:
    """Return a plateau, an overhanging bench face and a floor, in strips; the foot of the face may be bent.

    The mesh is rotated by a random angle, and its vertices are rounded by one of ROUNDINGS.
    """
    rows = np.linspace(0.0, SIDE, int(draw.integers(2, 7)))
    bend = draw.choice([0.0, 0.1, 1.0]) * draw.uniform(-1.0, 1.0, (2, len(rows)))
    along, towards, lean = draw.uniform(-1.0, 1.0), draw.uniform(-0.5, 1.0), draw.uniform(0.2, 3.0)
    profiles = [
        [(0.0, 5.0), (6.0 + lean + x, 5.0 + 0.3 * z), (6.0 + x, z), (SIDE, towards * (SIDE - 6.0))]
        for x, z in bend.T.tolist()
    ]
    corners = [(x, y, z + along * y) for y, profile in zip(rows, profiles, strict=True) for x, z in profile]
    turn = draw.uniform(0.0, 2.0 * math.pi)
    about = np.array([(math.cos(turn), math.sin(turn), 0), (-math.sin(turn), math.cos(turn), 0), (0, 0, 1)])
    return terrain_of(ROUNDINGS[draw.integers(len(ROUNDINGS))](corners @ about), strips(draw, len(rows)))


def pieces(draw: Draw) -> Terrain:
    """Return a height field over the square, and one to three other meshes that cut through it (`cutting_pieces`)."""
    ground = (rough, planes, ridges, steps, benches, scattered)[draw.integers(6)](draw)
    facets = ground.vertices[ground.triangles]
    parts = [(ground.vertices, ground.triangles)]
    parts += [within(facets, *PIECES[draw.integers(len(PIECES))](draw, facets)) for _ in range(draw.integers(1, 4))]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    triangles = np.concatenate([part[1] + start for part, start in zip(parts, starts, strict=False)])
    return terrain_of(np.concatenate([vertices for vertices, _ in parts]), triangles)


def crests(draw: Draw) -> Terrain:
    """Return a height field with T-junctions that lie 0.01 to 0.8 crack widths off their edges (`cracked_ground`)."""
    return cracked(draw, (rough, ridges, steps, benches, scattered)[draw.integers(5)](draw))


ROUNDINGS: tuple[Callable[[np.ndarray], np.ndarray], ...] = (
    lambda exact: exact,
    lambda exact: np.round(exact, 3),
    lambda exact: exact.astype(np.float32).astype(float),
)
"""Functions that round vertices (V, 3) as in survey files: not at all, to the millimetre, to single precision."""

FAMILIES: dict[str, Callable[[Draw], Terrain]] = {
    each.__name__: each
    for each in (
        *(rough, planes, ridges, steps, benches, scattered, junctions, fans, walls, seams, overhangs, pieces),
        *(wedges, terraces, crests),
    )
}
OVERHANGING = (overhangs.__name__, terraces.__name__)
"""Families of meshes that are not height fields: the number of facets above a point decides if it is below ground."""
RELEASES: dict[str, Callable[[Draw, Terrain, int], tuple[np.ndarray, np.ndarray]]] = {
    wedges.__name__: releases_thrown,
    terraces.__name__: releases_thrown,
    crests.__name__: releases_at_cracks,
}
"""Functions that release the rocks of some families, in place of `_releases`."""


def _mesh(plan: np.ndarray, heights: np.ndarray, triangles: np.ndarray) -> Terrain:
    """Return the terrain with vertices at a plan (V, 2) m and heights (V,) m; all facets are wound to face up."""
    u, w = plan[triangles[:, 1]] - plan[triangles[:, 0]], plan[triangles[:, 2]] - plan[triangles[:, 0]]
    turned = (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0] < 0.0)[:, None]
    return terrain_of(
        np.column_stack([plan, heights]), np.where(turned, triangles[:, ::-1], triangles).astype(np.int32)
    )


# --- cases ------------------------------------------------------------------------------------------------------------


def case_of(family: str, seed: int, rocks: int, rebound: str = "constant") -> Case:
    """Return the case of a family and a seed, with `rocks` rocks; rebound : name of the rebound model."""
    draw = np.random.default_rng([list(FAMILIES).index(family), seed])
    terrain = FAMILIES[family](draw)
    if draw.uniform() < 0.3:
        terrain = replace(terrain, vertices=LARGE * terrain.vertices)
    far = draw.uniform() < 0.3
    if far:
        terrain = replace(terrain, vertices=terrain.vertices + UTM - UTM, frame=Frame(UTM))
    R_n = float(draw.choice([0.0, 0.35, 0.9, 1.0, draw.uniform()]))
    R_t = float(draw.choice([0.0, 0.85, 1.0, draw.uniform()]))
    mu = float(draw.choice([0.0, 0.3, 0.577, 1.0, 5.0, draw.uniform(0.0, 2.0)]))
    stop_speed = float(draw.choice([0.0, 0.05, 0.5]))
    bounce = float(10.0 ** draw.integers(-5, -1))
    ground = str(draw.choice(["sliding", "sliding", "sliding", "rolling", "none"]))
    settings = Settings(smallest_bounce=bounce, max_impacts=400, max_time=20.0)
    materials = materials_of([Surface(R_n, R_t, mu, stop_speed, 0.5 * mu)])
    flight = Flight(materials, settings, models_called(rebound, ground))
    words = (
        f"{family} seed {seed}: R_n {R_n:.3g}, R_t {R_t:.3g}, mu {mu:.3g}, stop_speed {stop_speed:g}, "
        f"smallest_bounce {bounce:g}, {ground}, {rebound}{', survey coordinates' if far else ''}"
    )
    releases = _releases_on_top if family == pieces.__name__ else RELEASES.get(family, _releases)
    x, v = releases(draw, terrain, rocks)
    return Case(family=family, seed=seed, terrain=terrain, x=x, v=v, flight=flight, ground=ground, words=words)


def _releases(draw: Draw, terrain: Terrain, rocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m on or above vertices, edges and facets, and velocities (R, 3) m/s, most of them 0."""
    corners = terrain.vertices[terrain.triangles[draw.integers(0, len(terrain.triangles), rocks)]]
    kind = draw.choice(3, rocks, p=[0.5, 0.25, 0.25])
    share = draw.dirichlet([1.0, 1.0, 1.0], rocks)
    half = draw.uniform(size=rocks) < 0.3
    share[kind == 1, 2] = 0.0
    share[(kind == 1) & half] = (0.5, 0.5, 0.0)
    share[kind == 0] = (1.0, 0.0, 0.0)
    share /= share.sum(1)[:, None]
    x = (corners * share[:, :, None]).sum(1)
    dropped = draw.uniform(size=rocks) < 0.35
    height = np.zeros(rocks)
    height[dropped] = 10.0 ** draw.uniform(-9.0, 0.7, int(dropped.sum()))
    dropped &= ~_is_under_a_face(terrain, x)
    x[dropped, 2] += height[dropped]
    v = np.zeros((rocks, 3))
    along = draw.uniform(size=rocks) < 0.3
    v[along] = (corners[:, 1] - corners[:, 0])[along] * draw.uniform(-2.0, 2.0, (int(along.sum()), 1))
    level = draw.uniform(size=rocks) < 0.15
    v[level] = draw.normal(0.0, 2.0, (int(level.sum()), 3)) * (1.0, 1.0, 0.0)
    v[~dropped & (v[:, 2] < 0.0) & ~along] = 0.0
    return x, v


def _releases_on_top(draw: Draw, terrain: Terrain, rocks: int) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m and velocities (R, 3) m/s as `_releases`, but on or above the highest facet in plan.

    A third of the rocks start at places where meshes cut each other. Half of the rocks get a random velocity in plan.
    """
    x, v = _releases(draw, terrain, rocks)
    facets, (ground, *others) = terrain.vertices[terrain.triangles], parts_of(terrain.triangles)
    meet = meeting_points(facets[ground], facets[np.concatenate(others)])
    some = np.flatnonzero(draw.uniform(size=rocks) < 0.33)
    if len(meet):
        one, other = meet[draw.integers(0, len(meet), (2, len(some)))]
        share = draw.choice([0.0, 0.5, 1.0], (len(some), 1))
        x[some] = np.where(draw.uniform(size=(len(some), 1)) < 0.7, one, share * one + (1.0 - share) * other)
        v[some] = 0.0
    x[:, 2] = np.maximum(x[:, 2], highest(facets, x[:, :2]))
    pushed = draw.uniform(size=rocks) < 0.5
    v[pushed] += draw.normal(0.0, 3.0, (rocks, 3))[pushed] * (1.0, 1.0, 0.0)
    return x, v


def _is_under_a_face(terrain: Terrain, x: np.ndarray) -> np.ndarray:
    """Return flags (R,), True for places (R, 3) m that are in plan inside a facet that faces downwards.

    A rock that is released above such a place might start inside the ground.
    """
    facets = terrain.vertices[terrain.triangles]
    leans = np.cross(facets[:, 1] - facets[:, 0], facets[:, 2] - facets[:, 0])[:, 2] < 0.0
    under = np.zeros(len(x), dtype=bool)
    for facet in facets[leans]:
        under |= _lies_over(facet[::-1], x)
    return under


# --- the check --------------------------------------------------------------------------------------------------------


def fallen(case: Case, flights: Flights) -> np.ndarray:
    """Return the rows of the rocks that were more than DEEP below the ground anywhere on their paths.

    A point is below the ground if it is below all facets at its place in plan, including facets within NEXT_TO. At the
    foot of a vertical wall, the point must be below the floor and below the plateau. Points within NEXT_TO of the rim
    of the mesh, which is convex, do not count. In a family of OVERHANGING, a point is below the ground if an odd number
    of facets lies above the point; a path is checked only until the rock comes near the rim. In the family `pieces`,
    rocks that pass through a facet are returned as well.
    """
    rows, times, points = _points(flights, case.flight.settings.gravity)
    facets = case.terrain.vertices[case.terrain.triangles]
    if case.family in OVERHANGING:
        left = np.full(len(flights.deposits.x), np.inf)
        out = ~_within(case.terrain, points, ROUNDED * np.ptp(case.terrain.vertices, axis=0).max())
        np.minimum.at(left, rows[out], times[out])
        return np.unique(rows[(times < left[rows]) & has_odd_above(facets, points)])
    if case.family == pieces.__name__:
        return np.union1d(_below_a_piece(case, rows, times, points), _through_a_facet(case, flights))
    return np.unique(rows[_is_below_all(facets, points) & _within(case.terrain, points)])


def _is_below_all(facets: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return flags (N,), True for points (N, 3) m that are more than DEEP below each facet at their place in plan.

    The flag of a point without a facet at its place is False. facets : (F, 3, 3) m
    """
    over, above = (np.zeros(len(points), dtype=bool) for _ in range(2))
    for facet in facets:
        here = _lies_over(facet, points)
        normal = np.cross(facet[1] - facet[0], facet[2] - facet[0])
        over |= here
        above |= here & ((points - facet[0]) @ (normal / np.linalg.norm(normal)) >= -DEEP)
    return np.asarray(over & ~above)


def _ground_alone(terrain: Terrain) -> Terrain:
    """Return the terrain's first component: the height field that the other meshes cut."""
    triangles = terrain.triangles[parts_of(terrain.triangles)[0]]
    return terrain_of(terrain.vertices[: triangles.max() + 1], triangles)


def _below_a_piece(case: Case, rows: np.ndarray, times: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return the rows of the rocks that were below the height field, within a closed body, or below a buried heap.

    A heap is buried if its whole rim is lower than the height field. A place under another sheet is not below ground.
    A path is checked only until the rock leaves the height field in plan.
    """
    terrain, ground = case.terrain, _ground_alone(case.terrain)
    left = np.full(len(case.x), np.inf)
    out = ~_within(ground, points)
    np.minimum.at(left, rows[out], times[out])
    below = np.zeros(len(points), dtype=bool)
    for number, part in enumerate(parts_of(terrain.triangles)):
        triangles = terrain.triangles[part]
        if is_closed(triangles):
            below |= has_odd_above(terrain.vertices[triangles], points)
        elif number == 0 or terrain.vertices[rim_of(triangles), 2].max() < ground.vertices[:, 2].min():
            below |= _is_below_all(terrain.vertices[triangles], points)
    return np.unique(rows[below & (times < left[rows])])


def _through_a_facet(case: Case, flights: Flights) -> np.ndarray:
    """Return the rows of the rocks that pass through a facet, from its free side to its back.

    A path is checked only until the rock leaves the height field in plan.
    """
    paths, gravity = flights.paths, case.flight.settings.gravity
    last = np.concatenate([paths.row[1:] != paths.row[:-1], [True]])
    flies, way = (paths.mode == Mode.FLIGHT) & ~last, np.vstack([np.diff(paths.x, axis=0), np.zeros((1, 3))])
    lasts = np.where(last, 0.0, np.where(flies, np.append(np.diff(paths.t), 0.0), 1.0))
    begin, gravity = np.where(flies[:, None], paths.v, way), np.where(flies, case.flight.settings.gravity, 0.0)
    shares = np.linspace(0.0, 1.0, LEGS + 1)[:-1]
    t = lasts[:, None] * shares
    kept = (flies[:, None] | (shares == 0.0)).ravel()
    fall = gravity[:, None, None] * t[:, :, None] * np.array([0.0, 0.0, 1.0])
    places = paths.x[:, None] + t[:, :, None] * (begin[:, None] - 0.5 * fall)
    legs = (
        np.repeat(paths.row, LEGS), places.reshape(-1, 3), (begin[:, None] - fall).reshape(-1, 3),
        np.repeat(np.where(flies, lasts / LEGS, lasts), LEGS), np.repeat(gravity, LEGS),
    )  # fmt: skip
    rows, out = legs[0][kept], ~_within(_ground_alone(case.terrain), legs[1][kept])
    leaves = np.full(len(case.x), len(rows))
    np.minimum.at(leaves, rows[out], np.flatnonzero(out))
    on = np.arange(len(rows)) < leaves[rows]
    facets = case.terrain.vertices[case.terrain.triangles]
    return passed_through(facets, Legs(*(each[kept][on] for each in legs)), DEEP, NEXT_TO)


def _within(terrain: Terrain, points: np.ndarray, margin: float = NEXT_TO) -> np.ndarray:
    """Return flags (N,), True for points (N, 3) m inside the convex rim of a mesh in plan by more than a margin (m)."""
    corner, along = (sides.T for sides in np.split(_rim(terrain.vertices[:, :2]), 2, axis=1))
    across = (points[:, :1] - corner[0]) * -along[1] + (points[:, 1:2] - corner[1]) * along[0]
    return np.asarray((across > margin).all(axis=1))


def _rim(plan: np.ndarray) -> np.ndarray:
    """Return the sides (S, 4) of the convex hull of points (V, 2) m, counter-clockwise.

    Each side is a corner and a unit vector from the corner along the side.
    """
    hull = shapely.orient_polygons(shapely.convex_hull(shapely.multipoints(plan)))
    corners = shapely.get_coordinates(hull)[:-1]
    along = np.roll(corners, -1, axis=0) - corners
    return np.hstack([corners, along / np.linalg.norm(along, axis=1)[:, None]])


def _points(flights: Flights, gravity: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return points on the paths of all rocks: rows of the rocks (N,), times (N,) s and positions (N, 3) m.

    The points are all events, three points of each flight, and the ends of all rocks. The time of an end is that of the
    rock's last event.
    """
    paths, deposits = flights.paths, flights.deposits
    fly = np.flatnonzero(paths.mode[:-1] == Mode.FLIGHT)
    lasts = paths.t[fly + 1] - paths.t[fly]
    ends = np.zeros(len(deposits.x))
    np.maximum.at(ends, paths.row, paths.t)
    rows, times, points = [paths.row, np.arange(len(ends))], [paths.t, ends], [paths.x, deposits.x]
    for share in (0.25, 0.5, 0.75):
        t = (share * lasts)[:, None]
        rows.append(paths.row[fly])
        times.append(paths.t[fly] + share * lasts)
        points.append(paths.x[fly] + paths.v[fly] * t - 0.5 * t * t * np.array([0.0, 0.0, gravity]))
    return np.concatenate(rows), np.concatenate(times), np.concatenate(points)


def _lies_over(facet: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return flags (N,), True for points (N, 3) m that are in plan inside a facet (3, 3) m, or within NEXT_TO of it."""
    over = np.ones(len(points), dtype=bool)
    for k in range(3):
        edge = (facet[(k + 1) % 3] - facet[k])[:2]
        length = np.linalg.norm(edge)
        if length == 0.0:
            return np.zeros(len(points), dtype=bool)  # a vertical wall has no area in plan
        over &= (points[:, :2] - facet[k, :2]) @ (np.array([-edge[1], edge[0]]) / length) >= -NEXT_TO
    return over


def in_the_air(case: Case, flights: Flights) -> np.ndarray:
    """Return the rows of the rocks that stopped more than DEEP away from every facet."""
    stopped = np.flatnonzero(flights.deposits.outcome == Outcome.STOPPED)
    points = flights.deposits.x[stopped]
    on = np.zeros(len(points), dtype=bool)
    for facet in case.terrain.vertices[case.terrain.triangles]:
        on |= touches(facet, points)
    return stopped[~on]
