"""Test rocks released exactly on the rim of a hole in a steep, rough face: none may fly below the ground unnoticed.

The face is a height field over its own mean plane. So a place is below the ground if a facet covers it, seen along the
normal of that plane. This judgement shares no code with the simulator.
"""

import math

import numpy as np
import pytest
from flights.scenes_of_facets import flight, fly, grid_triangles, surface, terrain_of
from meshes.side_of_ground import is_above

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
    beside = np.any([is_above(facet * on_plan + lid, further * on_plan) for facet in facets], axis=0)
    assert (beside & ~covered(facets, further, 1e-10)).sum() <= FEW < len(lost) / 5
