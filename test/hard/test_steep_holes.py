"""Test rocks released exactly on the rim of a hole, in a steep, rough face and elsewhere, and the caps of such holes.

A face is a height field over its own mean plane. So a place is below the ground if a facet covers it, seen along the
normal of that plane. This judgement shares no code with the simulator.
"""

import math

import numpy as np
import pytest
from flights.on_both_engines import ENGINES
from flights.scenes_of_facets import flight, fly, grid_triangles, same_bits, surface, terrain_of
from meshes.side_of_ground import is_above

from rpf3d_core.detection.caps import passes_below_ground
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.values import Outcome

G, COUNT = 9.81, 200
SHARES = np.array([0.01, 0.05, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.9, 0.97])
"""Shares of the time of a flight, and of the length of a slide, at which a rock's place is judged."""
FACES = [
    (28, 42.0), (551, 62.0), (11, 62.0), (50, 67.0), (14, 73.0), (511, 76.0), (28, 77.0), (262, 78.0), (223, 83.0),
    (114, 87.0),
]  # fmt: skip
"""Seeds of random faces with a hole, and their steepness in degrees."""
FEW = 5
"""Largest number of rocks of one face that may be lost although their way leads over the ground: this errs safely."""


def holed_face(seed, degrees):
    """Return a rough face with one irregular hole, and the matrix (3, 3) from the frame of the face.

    Results: terrain; vertices (V, 3) m in the frame of the face (down, along, outward); and the matrix.
    """
    rng = np.random.default_rng(seed)
    cells, step = int(rng.integers(8, 14)), rng.uniform(0.3, 2.0)
    down, along = (k * step for k in np.mgrid[: cells + 1, : cells + 1].astype(float))
    for k in (down, along):
        k[1:-1, 1:-1] += rng.uniform(-0.3, 0.3, (cells - 1, cells - 1)) * step
    out = rng.uniform(-1.0, 1.0, down.shape) * step * rng.choice([0.0, 1e-3, 0.01, 0.05, 0.1, 0.2])
    flat = np.stack([down, along, out], axis=-1).reshape(-1, 3)
    i, j = np.divmod(np.tile(np.arange(cells * cells), 2), cells)
    (first_i, first_j), (high, wide) = rng.integers(1, cells - 4, 2), rng.integers(1, 4, 2)
    missing = (i >= first_i) & (i < first_i + high) & (j >= first_j) & (j < first_j + wide)
    missing &= rng.random(len(i)) < rng.choice([0.8, 1.0])
    a = math.radians(degrees)
    frame = np.array([[math.cos(a), 0.0, math.sin(a)], [0.0, 1.0, 0.0], [-math.sin(a), 0.0, math.cos(a)]])
    return terrain_of(flat @ frame.T, grid_triangles(cells + 1, cells + 1)[~missing]), flat, frame


def from_the_rim(terrain, flat, seed):
    """Return places (COUNT, 3) m on the rim of the hole, half of them on corners, and velocities (COUNT, 3) m/s."""
    rng = np.random.default_rng(seed)
    sides = terrain.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    both = {tuple(side) for side in sides.tolist()}
    outer = (flat[:, :2] == flat[:, :2].min(axis=0)) | (flat[:, :2] == flat[:, :2].max(axis=0))
    rim = [(p, q) for p, q in sorted(both) if (q, p) not in both and not (outer[p] & outer[q]).any()]
    begin, end = terrain.vertices[np.array(rim)[rng.integers(0, len(rim), COUNT)]].transpose(1, 0, 2)
    share = np.where(rng.random(COUNT) < 0.5, 0.0, rng.random(COUNT))[:, None]
    way = rng.normal(size=(COUNT, 3))
    speed = rng.choice([0.0, 0.1, 1.0, 5.0, 10.0], COUNT)
    return begin + share * (end - begin), way * (speed / np.linalg.norm(way, axis=1))[:, None]


def places_of(flights):
    """Return places (N, 3) m along all flights and slides, and the row (N,) of each place."""
    paths = flights.paths
    goes_on = np.append(paths.row[1:] == paths.row[:-1], False)  # the last place of a rock ends its path
    last = np.append(paths.x[1:], paths.x[-1:], axis=0)
    t = SHARES[:, None, None] * np.diff(paths.t, append=0.0)[:, None]
    flown = paths.x + paths.v * t - (0.0, 0.0, 0.5 * G) * t * t
    slid = paths.x + SHARES[:, None, None] * (last - paths.x)
    between = np.where((paths.mode == 0)[:, None], flown, slid)[:, goes_on]
    return between.reshape(-1, 3), np.tile(paths.row[goes_on], len(SHARES))


def covered(facets, places, depth):
    """Return flags (N,), True for places (N, 3) m that a facet covers by more than a depth (m), in the face's frame."""
    lowered = places + np.array([0.0, 0.0, depth])
    return np.any([is_above(facet, lowered) for facet in facets], axis=0)


@pytest.fixture(scope="module", params=FACES, ids=lambda face: f"seed {face[0]}, {face[1]:g} degrees")
def flown(request):
    """Return the flights, the facets (F, 3, 3) m in the frame of the face, and the matrix of this frame."""
    terrain, flat, frame = holed_face(*request.param)
    ground = surface(0.5, 0.9, 30.0)
    flights = fly(engine_over("compiled", terrain), flight(ground), *from_the_rim(terrain, flat, request.param[0]))
    return flights, flat[terrain.triangles], frame


def test_no_rock_from_the_rim_flies_below_the_ground(flown):
    flights, facets, frame = flown
    places, row = places_of(flights)
    assert not sorted({int(k) for k in row[covered(facets, places @ frame, 1e-5)]})
    assert (flights.deposits.outcome == Outcome.LOST_TO_HOLE).sum() > 10


def test_hardly_a_rock_is_lost_whose_way_leads_over_the_ground(flown):
    flights, facets, frame = flown
    lost = np.flatnonzero(flights.deposits.outcome == Outcome.LOST_TO_HOLE)
    last = np.searchsorted(flights.paths.row, lost, side="right") - 1
    further = (flights.deposits.x[lost] + 1e-4 * flights.paths.v[last] - (0.0, 0.0, 0.5e-8 * G)) @ frame
    on_plan, lid = (1.0, 1.0, 0.0), (0.0, 0.0, 1.0)  # a facet at height 1 covers every place within its outline
    over_ground = np.any([is_above(facet * on_plan + lid, further * on_plan) for facet in facets], axis=0)
    assert (over_ground & ~covered(facets, further, 1e-10)).sum() <= FEW < len(lost) / 5


def test_both_engines_have_the_same_flights_to_the_last_bit():
    terrain, flat, _ = holed_face(262, 78.0)
    x, v = (each[:60] for each in from_the_rim(terrain, flat, 262))
    assert same_bits(*(fly(engine_over(name, terrain), flight(surface(0.5, 0.9, 30.0)), x, v) for name in ENGINES))


# --- other holes ------------------------------------------------------------------------------------------------------


def level_grid(size, missing):
    """Return vertices (V, 3) m and triangles of a level grid of 1 m; missing(i, j) is True for squares of a hole."""
    i, j = (k.astype(float) for k in np.mgrid[: size + 1, : size + 1])
    row, column = np.divmod(np.tile(np.arange(size * size), 2), size)
    gone = np.array([missing(a, b) for a, b in zip(row, column, strict=True)])
    return np.stack([i.ravel(), j.ravel(), 0.0 * i.ravel()], axis=1), grid_triangles(size + 1, size + 1)[~gone]


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("degrees", [200.0, 225.0, 250.0])
def test_a_rock_that_leaves_the_corner_of_a_single_missing_facet_is_not_ended_there(engine, degrees):
    vertices, triangles = level_grid(6, lambda i, j: False)
    vertices[:, 2] = -0.5 * np.maximum(3.0 - vertices[:, :2], 0.0).sum(axis=1)
    corner = 3 * 7 + 3
    hole = {corner, corner + 7, corner + 8}
    there = [facet for facet in triangles.tolist() if set(facet) != hole]
    way = (20.0 * math.cos(math.radians(degrees)), 20.0 * math.sin(math.radians(degrees)), 0.0)
    flights = fly(engine_over(engine, terrain_of(vertices, there)), flight(surface()), vertices[corner], way)
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN and flights.deposits.path[0] > 1.0


@pytest.mark.parametrize("engine", ENGINES)
def test_an_upright_hole_far_along_the_crest_does_not_catch_a_rock_at_the_corner_of_another_hole(engine):
    rows, last = [(0, 10), (2, 10), (4, 10), (6, 10), (6, 8), (6, 6), (6, 4), (8, 0), (40, -60)], 30
    vertices = np.array([(x, 2.0 * y, z - 0.24 * max(4 - y, 0) * (z == 10)) for x, z in rows for y in range(last + 1)])
    row, column = np.divmod(np.tile(np.arange((len(rows) - 1) * last), 2), last)
    gone = ((row == 2) & (column == 4)) | ((row == 4) & (column == 20))
    terrain = terrain_of(vertices, grid_triangles(len(rows), last + 1)[~gone])
    ends = fly(engine_over(engine, terrain), flight(surface()), (6.0, 8.0, 10.0), (0.0, -20.0, 0.0)).deposits
    assert ends.outcome[0] == Outcome.LEFT_TERRAIN


@pytest.mark.parametrize("engine", ENGINES)
def test_a_rock_comes_to_rest_on_ground_inside_a_hole_with_an_upright_facet_at_its_rim(engine):
    vertices, triangles = level_grid(10, lambda i, j: 3 <= i < 7 and 3 <= j < 7)
    vertices[3 * 11 + 5] = (2.0, 5.0, -0.5)
    inner = np.array([(4.1, 4.1, -0.3), (6.1, 4.1, -0.3), (6.1, 6.1, -0.3), (4.1, 6.1, -0.3)])
    both = np.concatenate([triangles, len(vertices) + np.array([(0, 1, 2), (0, 2, 3)])])
    terrain = terrain_of(np.concatenate([vertices, inner]), both)
    ends = fly(engine_over(engine, terrain), flight(surface(0.2, 0.5, 40.0)), (5.0, 5.0, 1.0), (0.1, 0.0, 0.0)).deposits
    assert ends.outcome[0] == Outcome.STOPPED


def tilted(points, degrees):
    """Return points (N, 3) m, turned about the y axis so that a level plane falls towards +x by some degrees."""
    a = math.radians(degrees)
    return points @ np.array([[math.cos(a), 0.0, -math.sin(a)], [0.0, 1.0, 0.0], [math.sin(a), 0.0, math.cos(a)]])


@pytest.mark.parametrize(("lift", "steep"), [(0.0, False), (-0.6, True)], ids=["even rim", "overhanging rim"])
def test_a_hole_in_a_face_of_65_degrees_is_closed_in_its_plane_if_its_rim_overhangs(lift, steep):
    vertices, triangles = level_grid(8, lambda i, j: 3 <= i < 5 and 3 <= j < 5)
    vertices[3 * 9 + 4, 2] = lift  # a vertex at the upper side of the hole
    caps = engine_over("reference", terrain_of(tilted(vertices, 65.0), triangles)).caps
    middle = tilted(np.asarray(caps.facets.corners).reshape(-1, 3, 3).mean(axis=1), -65.0)
    inside = (np.abs(middle[:, :2] - 4.0) < 1.0).all(axis=1)
    assert inside.any() and ((np.asarray(caps.layout.ring)[inside] >= 0) == steep).all()


def test_a_way_through_a_steep_hole_below_a_peninsula_of_its_rim_is_below_the_ground():
    vertices, triangles = level_grid(8, lambda i, j: 3 <= i < 5 and 3 <= j < 6 and (i, j) != (3, 4))
    caps = engine_over("reference", terrain_of(tilted(vertices, 85.0), triangles)).caps
    corners = tilted(np.asarray(caps.facets.corners).reshape(-1, 3), -85.0).reshape(-1, 3, 3)
    places = np.array([(3.53, 3.21, 0.0), (3.47, 5.83, 0.0), (4.52, 5.41, 0.0), (4.48, 3.33, 0.0)])
    lower, upper = places - (0.0, 0.0, 0.1), places + np.array([0.0, 0.0, 0.1])
    over = np.array([is_above(cap, lower) & ~is_above(cap, upper) for cap in corners])
    on_cap = over.argmax(axis=0).tolist()
    left, right, lower_right, lower_left = zip(on_cap, map(tuple, tilted(places, 85.0)), strict=True)

    def is_below(begin, end):
        return passes_below_ground(caps, begin[0], end[0], begin[1], end[1])

    assert is_below(left, right)
    assert not is_below(lower_left, lower_right)
    assert not is_below(left, lower_left)
