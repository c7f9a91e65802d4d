"""Tests of rocks on terrains with several gaps: a rock may fall through one gap and leave the ground through another.

The random tests compare flights with roots over all facets and sides of the rim; the check knows nothing of caps.
"""

import numpy as np
import pytest
from flights.on_both_engines import ENGINES
from flights.rolling_spheres import roll, spheres
from flights.scenes_of_facets import flight, fly, grid_triangles, joined, same_bits, surface, terrain_of

from rpf3d_core.arc import Arc
from rpf3d_core.detection.cap_neighbours import NO_CAP, neighbours_of
from rpf3d_core.detection.caps import passes_below_ground
from rpf3d_core.detection.contact import NOTHING_LEFT, first_contact
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.values import Outcome

G = 9.81
LOST, LEFT, STOPPED = Outcome.LOST_TO_HOLE, Outcome.LEFT_TERRAIN, Outcome.STOPPED
STICKY = surface(0.0, 0.0, 89.0)
"""Ground on which a rock stops where it lands."""
WIDTH = 6
"""Number of cells of 1 m across the berm."""


def surveyed(x, y, z, missing):
    """Return a terrain over a grid of points without some of its cells.

    x, y : (N,), (M,) m; z : (N, M) m; missing : (N - 1, M - 1) bool, True for a cell without ground
    """
    places = np.meshgrid(x, y, indexing="ij")
    triangles = grid_triangles(len(x), len(y))
    there = ~np.asarray(missing).ravel()
    return terrain_of(np.stack([*places, z], axis=-1).reshape(-1, 3), triangles[np.tile(there, 2)])


# --- a berm and the face behind it ------------------------------------------------------------------------------------

FACES = {"face of 61 degrees": (8.0, 10.5, 13.0), "face of 80 degrees": (7.5, 8.4, 9.0)}
"""For each face the places (m) where its hole begins and ends, and where the face ends; it begins at 7 m."""


def berm(face, passage=False, second=True):
    """Return a berm 2 m high on a bench, and the face behind it; hole 1 is in the bench, hole 2 in the face.

    passage : true if a strip without ground connects both holes, so that they are one concave hole
    second : false for a face without hole 2
    """
    begin, end, foot = FACES[face]
    fall = 11.0 / (foot - 7.0)
    x = np.array([0.0, 3.0, 5.0, 6.0, 7.0, begin, end, foot, 30.0])
    z = np.array([10.0, 10.0, 10.0, 12.0, 12.0, 12.0 - fall * (begin - 7.0), 12.0 - fall * (end - 7.0), 1.0, 0.5])
    missing = np.zeros((8, WIDTH), bool)
    missing[1, 1:4], missing[5, 1:4] = True, second
    if passage:
        missing[1:6, 3] = True
    return surveyed(x, np.arange(WIDTH + 1.0), np.tile(z[:, None], WIDTH + 1), missing)


def through_the_berm(count=12):
    """Return positions and velocities (count, 3) of rocks that fly into hole 1, below the berm and out of hole 2."""
    rng = np.random.default_rng(11)
    x = np.column_stack([np.full(count, 0.1), rng.uniform(1.2, 2.8, count), np.full(count, 10.5)])
    return x, np.column_stack([rng.uniform(14.0, 14.6, count), np.zeros(count), np.zeros(count)])


@pytest.mark.parametrize("face", FACES)
@pytest.mark.parametrize("passage", [False, True], ids=["two holes", "one concave hole"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_passes_below_a_berm_from_hole_to_hole_is_lost_at_the_first(engine, passage, face):
    x, v = through_the_berm()
    flights = fly(engine_over(engine, berm(face, passage)), flight(STICKY), x, v)
    ends = flights.deposits
    assert (ends.outcome == LOST).all() and (ends.impacts == 0).all()
    assert np.allclose(ends.x[:, 2], 10.0, atol=1e-9) and ((ends.x[:, 0] > 3.0) & (ends.x[:, 0] < 5.0)).all()


@pytest.mark.parametrize("face", FACES)
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_leaves_the_ground_exactly_through_an_edge_is_lost_at_the_hole(engine, face):
    """A rock that comes from below meets no facet at an edge of the grid; edges are at y = 2 m and y = 3 m."""
    x, v = through_the_berm(4)
    x[:, 1] = 2.0, 2.5, 3.0, 2.000001
    ends = fly(engine_over(engine, berm(face, second=False)), flight(STICKY), x, v).deposits
    assert (ends.outcome == LOST).all() and np.allclose(ends.x[:, 2], 10.0, atol=1e-9)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_sphere_that_passes_below_a_berm_from_hole_to_hole_is_lost_at_the_first(engine):
    x, v = through_the_berm(3)
    v[:, 0] = 13.0  # the sphere has room between the sides of both holes
    ends = roll(engine_over(engine, berm("face of 61 degrees")), spheres(surface()), 0.1, x, v).deposits
    assert (ends.outcome == LOST).all() and np.allclose(ends.x[:, 2], 10.0, atol=1e-9)


def from_corners(terrain, corners):
    """Return positions and velocities (N, 3) of rocks that fly off from vertices, closely over each facet around them.

    corners : numbers of the vertices
    """
    x, v = [], []
    for corner, facet in ((c, f) for c in corners for f in terrain.triangles if c in f):
        sides = [terrain.vertices[other] - terrain.vertices[corner] for other in facet if other != corner]
        up = np.cross(*sides)
        up *= np.copysign(1.0, up[2]) / np.linalg.norm(up)
        for share in (0.1, 0.5, 0.9):
            way = share * sides[0] + (1.0 - share) * sides[1]
            for steep in (1e-6, 1e-3, 0.05):
                x.append(terrain.vertices[corner])
                v.append(5.0 * (way / np.linalg.norm(way) + steep * up))
    return np.array(x), np.array(v)


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_flies_off_from_a_corner_of_a_hole_over_the_ground_is_not_lost_there(engine):
    """In this rough ground, six of the rocks pass through the cap exactly at the corner, at a time of 0."""
    rng = np.random.default_rng(7003018)
    noise = rng.choice([0.01, 0.1, 0.5]) * rng.normal(size=(7, 7))
    missing = np.zeros((6, 6), bool)
    missing[2, 2] = True
    terrain = surveyed(np.arange(7.0), np.arange(7.0), noise - 0.6 * np.arange(7.0)[:, None], missing)
    x, v = from_corners(terrain, [3 * 7 + 2])
    ends = fly(engine_over(engine, terrain), flight(surface(), rebound="coulomb_limited"), x, v).deposits
    assert (ends.t > 0.0).all() and len(x) == 45


# --- the cap of a hole with an uneven rim -----------------------------------------------------------------------------


def uneven(*holes, size=16):
    """Return a level ground of 1 m cells with holes of one cell; two opposite corners of each hole are 1 m higher.

    The cap of such a hole is a ridge between these corners.

    holes : (i, j) of each cell without ground
    """
    z, missing = np.zeros((size + 1, size + 1)), np.zeros((size, size), bool)
    for i, j in holes:
        missing[i, j] = True
        z[i, j] = z[i + 1, j + 1] = 1.0
    return surveyed(np.arange(size + 1.0), np.arange(size + 1.0), z, missing)


def across_the_hole(i, j, count=200):
    """Return positions and velocities (count, 3) of fast rocks that fly over one cell from one low corner to the other.

    The cap of the cell is a ridge across their way; about half of the rocks pass below it.
    """
    rng = np.random.default_rng(5)
    way = np.array([1.0, -1.0]) / np.sqrt(2.0)
    aside = rng.uniform(-0.2, 0.2, (count, 1)) * np.array([1.0, 1.0])
    plan = np.array([i + 0.5, j + 0.5]) - 1.1 * way + aside
    z = rng.uniform(0.35, 1.3, count)
    return np.column_stack([plan, z]), np.column_stack([np.tile(12.0 * way, (count, 1)), np.full(count, 0.5)])


@pytest.mark.parametrize("others", [(), ((3, 3),), ((9, 9), (7, 9))], ids=["one hole", "two holes", "common corners"])
@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_that_clips_the_cap_of_a_hole_and_comes_out_of_it_goes_on(engine, others):
    terrain = uneven((8, 8), *others)
    x, v = across_the_hole(8, 8)
    landed, fall = expected(terrain, x, v)
    known = landed & (fall[:, 1] == np.inf)
    engine = engine_over(engine, terrain)
    ends = fly(engine, flight(STICKY), x, v).deposits
    assert known.sum() > 50 and (ends.outcome[known] == STOPPED).all()
    assert clips(engine, x[known], v[known]) > 10


@pytest.mark.parametrize("engine", ENGINES)
def test_on_layered_terrain_too_a_rock_that_clips_a_cap_goes_on(engine):
    ground = uneven((8, 8))
    layered = joined(ground, surveyed([0.0, 1.0], [0.0, 1.0], np.full((2, 2), 9.0), [[False]]))
    x, v = across_the_hole(8, 8)
    landed, fall = expected(ground, x, v)
    engine = engine_over(engine, layered)
    ends = fly(engine, flight(STICKY), x, v).deposits
    known = landed & (fall[:, 1] == np.inf)
    assert engine.caps.layout.layered and clips(engine, x[known], v[known]) > 10
    assert (ends.outcome[known] == STOPPED).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_sphere_of_which_the_centre_clips_a_cap_goes_on(engine):
    x, v = across_the_hole(8, 8, 20)
    engine = engine_over(engine, uneven((8, 8)))
    ends = roll(engine, spheres(surface(0.0, 0.0, 60.0)), 0.02, x, v).deposits
    assert clips(engine, x, v) > 5 and (ends.outcome != LOST).all()


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_from_just_above_a_vertex_of_two_holes_that_clips_the_cap_of_one_goes_on(engine):
    terrain = uneven((8, 8), (7, 9))
    way = np.array([1.0, -1.0, 0.0]) / np.sqrt(2.0)
    x, v = np.array([[8.0, 9.0, 1e-9]]), 12.0 * way + (0.0, 0.0, 1.5)
    engine = engine_over(engine, terrain)
    ends = fly(engine, flight(STICKY), x, v).deposits
    assert clips(engine, x, v[None]) == 1 and ends.outcome[0] == STOPPED and ends.x[0, 0] > 9.0


@pytest.mark.parametrize("engine", ENGINES)
def test_a_passage_through_the_cap_of_a_hole_at_its_rim_counts_only_if_the_way_leads_into_the_hole(engine):
    caps = engine_over(engine, uneven((8, 8), (7, 9))).caps
    corners = np.asarray(caps.facets.corners).reshape(-1, 3, 3)
    first, second = (np.flatnonzero(is_over(corners, np.tile(place, (len(corners), 1)))) for place in INSIDE)
    ways = ((8.0 - 1e-12, 9.0 + 1e-12, 0.0), False), ((7.9, 9.05, 0.0), True)
    for start, below in ways:
        assert passes_below_ground(caps, int(first[0]), int(second[0]), start, INSIDE[1]) == below


def test_neighbours_are_caps_with_a_common_side_and_not_with_a_common_vertex():
    square = [[(0, 0, 0), (1, 0, 0), (1, 1, 0)], [(0, 0, 0), (1, 1, 0), (0, 1, 0)]]
    touching = [[(1, 1, 0), (2, 1, 0), (2, 2, 0)]]
    flat = [[(1, 1, 0)] * 3]
    found = neighbours_of(np.array(square + touching + flat, dtype=float)).reshape(-1, 3).tolist()
    assert found == [[NO_CAP, NO_CAP, 1], [0, NO_CAP, NO_CAP], [NO_CAP] * 3, [NO_CAP] * 3]


INSIDE = (7.9, 9.05, 0.0), (8.1, 8.85, 0.0)
"""A place in each of two holes, on both sides of their common vertex."""


def clips(engine, x, v):
    """Return how many rocks pass through a cap from above on their way, by the search for contacts of the engine."""
    found = 0
    for place, speed in zip(x.tolist(), v.tolist(), strict=True):
        arc = Arc(tuple(place), tuple(speed), G)
        crossing = first_contact(engine.caps.locator, engine.caps.facets, arc, NOTHING_LEFT, 0.15)
        found += crossing.facet >= 0 and crossing.side > 0.0
    return found


# --- random meshes ----------------------------------------------------------------------------------------------------


def random_terrain(seed, cells=16):
    """Return uneven ground of warped 1 m cells with a berm every 4 m, and many holes and bays between the berms."""
    rng = np.random.default_rng(seed)
    i, j = np.mgrid[: cells + 1, : cells + 1].astype(float)
    x, y = (k + 0.3 * rng.uniform(-1.0, 1.0, k.shape) for k in (i, j))
    crest = i % 4 == 2
    z = -rng.uniform(0.2, 1.0) * i + rng.uniform(1.0, 3.0) * crest + 0.3 * rng.normal(size=i.shape)
    missing = rng.random((cells, cells)) < np.where(i % 4 == 0, 0.6, 0.3)[:-1, :-1]
    triangles = grid_triangles(cells + 1, cells + 1)[np.tile(~missing.ravel(), 2)]
    return terrain_of(np.stack([x, y, z], axis=-1).reshape(-1, 3), triangles)


def random_rocks(terrain, seed, count=150):
    """Return positions and velocities (count, 3) of rocks that start above the ground, towards random pairs of gaps.

    Without the ground, each rock would fly through two places near the rim, up to 8 m apart.
    """
    rng = np.random.default_rng(seed + 1000)
    ends = rim_of(terrain).mean(axis=1) + rng.normal(0.0, 0.4, (len(rim_of(terrain)), 3))
    x, v = np.empty((0, 3)), np.empty((0, 3))
    while len(x) < count:
        first, second = ends[rng.integers(0, len(ends), (2, 500))]
        lasts = rng.uniform(0.2, 0.8, (500, 1))
        speed = (second - first) / lasts + 0.5 * G * lasts * (0.0, 0.0, 1.0)
        before = rng.uniform(0.02, 0.3, (500, 1))
        start = first - speed * before - 0.5 * G * before * before * (0.0, 0.0, 1.0)
        speed = speed + G * before * (0.0, 0.0, 1.0)
        above = heights_above(terrain.vertices[terrain.triangles], start) > 0.01
        near = np.linalg.norm((second - first)[:, :2], axis=1) < 8.0
        x, v = np.concatenate([x, start[above & near]]), np.concatenate([v, speed[above & near]])
    return x[:count], v[:count]


def heights_above(corners, places):
    """Return the heights (P,) m of places (P, 3) above the facets (F, 3, 3) m straight below or above; nan for none."""
    a, b, c = corners.transpose(1, 0, 2)
    n = np.cross(b - a, c - a)
    heights = np.full(len(places), np.nan)
    for row, place in enumerate(places):
        over = np.flatnonzero(is_over(corners, np.tile(place, (len(corners), 1))))
        if len(over):
            f = over[0]
            heights[row] = n[f] @ (place - a[f]) / n[f, 2]
    return heights


def is_over(corners, places):
    """Return flags (F,): true for facets (F, 3, 3) m that face up, if the place (F, 3) of each lies over it in plan."""
    over = np.ones(len(corners), bool)
    for k in range(3):
        way, to = ((end - corners[:, k])[:, :2] for end in (corners[:, (k + 1) % 3], places))
        over &= way[:, 0] * to[:, 1] - way[:, 1] * to[:, 0] >= 0.0
    return over


def expected(terrain, x, v):
    """Return flags (R,) of rocks that meet the free side of the ground first, and when (R, 2) s they must be lost.

    A path passes below the ground where it crosses a side of the rim in plan, below this side. The rock must be lost
    between this time and the crossing before, where it came over the gap. Both times are inf for a rock that does not
    pass below the ground before it meets the ground. The check is exact up to rounding, and compares all facets and
    sides of the rim with each path.

    x, v : (R, 3) m and m/s
    """
    corners, rim = terrain.vertices[terrain.triangles], rim_of(terrain)
    landed, fall = np.zeros(len(x), bool), np.full((len(x), 2), np.inf)
    for row, (place, speed) in enumerate(zip(x, v, strict=True)):
        t, landed[row] = first_hit(corners, place, speed)
        fall[row] = fall_below(rim, place, speed, t)
    return landed, fall


def rim_of(terrain):
    """Return both ends (S, 2, 3) m of all sides of facets without a neighbour."""
    sides = np.concatenate([terrain.triangles[:, [k, (k + 1) % 3]] for k in range(3)])
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    return terrain.vertices[sides[first[count == 1]]]


def first_hit(corners, x, v):
    """Return the time (s) when a path meets the first facet, and True if it meets the free side; inf, False for none.

    corners : (F, 3, 3) m, of facets that face up
    """
    a, b, c = corners.transpose(1, 0, 2)
    n = np.cross(b - a, c - a)
    p, q, r = -0.5 * G * n[:, 2], n @ v, np.einsum("fc,fc->f", n, x - a)
    root = np.sqrt(np.where(q * q - 4.0 * p * r >= 0.0, q * q - 4.0 * p * r, np.nan))
    best = np.inf, False
    for t, free in (((-q - root) / (2.0 * p), True), ((-q + root) / (2.0 * p), False)):
        places = x + v * t[:, None] + np.outer(t * t, (0.0, 0.0, -0.5 * G))
        times = t[is_over(corners, places) & (t > 0.0)]
        best = min(best, (float(times.min(initial=np.inf)), free))
    return best


def fall_below(rim, x, v, end):
    """Return the last time (s) at which a path comes over a gap before it passes below the rim, and when it does that.

    The result is (inf, inf) if the path does not pass below the rim before the time `end` (s).
    """
    begin, way = rim[:, 0], rim[:, 1] - rim[:, 0]
    turn = v[0] * way[:, 1] - v[1] * way[:, 0]
    begin, way, turn = begin[turn != 0.0], way[turn != 0.0], turn[turn != 0.0]
    to = begin - x
    t = (to[:, 0] * way[:, 1] - to[:, 1] * way[:, 0]) / turn
    share = (to[:, 0] * v[1] - to[:, 1] * v[0]) / turn
    crossed = (t > 0.0) & (t < end) & (share > 0.0) & (share < 1.0)
    height = x[2] + v[2] * t - 0.5 * G * t * t - (begin[:, 2] + share * way[:, 2])
    below = float(t[crossed & (height < 0.0)].min(initial=np.inf))
    return (float(t[crossed & (t < below)].max(initial=0.0)), below) if below < np.inf else (np.inf, np.inf)


def agree(engine, seed):
    """Return how many rocks of a random mesh pass below the ground and then meet its free side.

    Asserts that exactly the rocks that pass below the ground are lost, and in the gap through which they fell.
    """
    terrain = random_terrain(seed)
    x, v = random_rocks(terrain, seed)
    landed, fall = expected(terrain, x, v)
    ends = fly(engine_over(engine, terrain), flight(STICKY), x, v).deposits
    below = fall[:, 1] < np.inf
    lost = np.isin(ends.outcome, (LOST, LEFT))
    assert (lost == (below | ~landed)).all(), (seed, np.flatnonzero(lost != (below | ~landed)))
    assert (ends.outcome[~lost] == STOPPED).all()
    assert (ends.t[below] >= fall[below, 0] - 1e-9).all() and (ends.t[below] <= fall[below, 1] + 1e-9).all(), seed
    return int((landed & below).sum())


@pytest.mark.parametrize("engine", ENGINES)
def test_exactly_the_rocks_that_pass_below_the_ground_are_lost_on_random_meshes(engine):
    assert sum(agree(engine, seed) for seed in range(12)) > 20


def test_both_engines_lose_the_same_rocks_to_the_last_bit():
    for seed in range(4):
        terrain = random_terrain(seed)
        x, v = random_rocks(terrain, seed)
        physics = flight(surface(0.5, 0.8, 30.0))
        assert same_bits(*(fly(engine_over(name, terrain), physics, x, v) for name in ENGINES))
