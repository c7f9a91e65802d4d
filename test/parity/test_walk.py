"""Tests that the walk through the bucket grid finds the same contacts as a search of all facets, to the last bit.

The tests run in plain Python, also without numba; the compiled walk consists of the same functions.
"""

import math

import numpy as np
import pytest
from flights.scenes_of_facets import box, floor, joined, rough_grid, strip, terrain_of, turned

from rpf3d_core.arc import Arc, position
from rpf3d_core.detection.bucket_locator import BucketLocator, bucket_locator, first_contact_in_buckets
from rpf3d_core.detection.contact import NO_CONTACT, NOTHING_LEFT, Contact, PreviousContact
from rpf3d_core.detection.narrow_phase import earlier_contact
from rpf3d_core.detection.plan_boxes import PARTS, overlap, packed_box, packed_probe, part_of
from rpf3d_core.detection.search import flight_end
from rpf3d_core.detection.slabs import LEVELS, SHIFT, flies_over, width_of
from rpf3d_core.terrain.facets import Facets, Terrain, facets_of, plain

ARCS = 90
"""Number of arcs of each kind over each terrain."""


def needles() -> Terrain:
    """Return a terrain of slivers, a thousand times as long as wide, in all directions, one above another."""
    blade = np.array([[-6.0, 0.0, 0.0], [6.0, 0.0, 1.0], [6.0, 0.012, 1.0]])
    step = np.array([0.3, -0.2, 0.1])
    turns = [turned(blade, angle) + k * step for k, angle in enumerate(np.linspace(0, 340, 40))]
    return terrain_of(np.concatenate(turns), np.arange(120).reshape(-1, 3))


def benches() -> Terrain:
    """Return level berms and steep walls, turned so that no edge is parallel to the grid, and one vertical wall."""
    profile = [(x, z) for k in range(6) for x, z in ((3.5 * k, -12.0 * k), (3.5 * k + 3.0, -12.0 * k))]
    wall = strip([(25.0, -60.0), (25.0, -20.0)], half_width=9.0, across=9, strike=20.0)
    return joined(strip(profile, half_width=12.0, across=16, strike=20.0), wall)


STRAY = terrain_of([(9e3, 9e3, 40.0), (9e3 + 1, 9e3, 40.0), (9e3, 9e3 + 1, 41.0)], [(0, 1, 2)])
TERRAINS = {
    "rough ground": rough_grid(24, 24.0, 0.5, 0.4, seed=2),
    "steep ground": rough_grid(20, 20.0, 2.5, 0.5, seed=3),
    "benches": benches(),
    "a box": box(),
    "needles": needles(),
    "needles over rough ground": joined(needles(), rough_grid(16, 16.0, 0.2, 0.3, seed=5, centred=True, z=-2.0)),
    "a stray facet far off": joined(rough_grid(20, 20.0, 0.3, 0.3, seed=4), STRAY),
    "wide facets below": joined(rough_grid(20, 20.0, 0.3, 0.3, seed=4), floor(500.0, z=-30.0, cells=2)),
    "two sheets": joined(rough_grid(12, 24.0, 0.0, 0.5, seed=6), rough_grid(12, 24.0, 0.1, 0.5, seed=7, z=4.0)),
}


def over_all(facets: Facets, arc: Arc, left: PreviousContact) -> Contact:
    """Return the earliest contact among all facets."""
    best = NO_CONTACT
    for f in range(len(facets.zone)):
        best = earlier_contact(facets, f, arc, left, best)
    return best


def vector(values: np.ndarray) -> tuple[float, float, float]:
    return tuple(float(v) for v in values)


def flights_from_the_air(facets: Facets, rng: np.random.Generator) -> list[tuple[Arc, PreviousContact]]:
    """Return arcs from places in and around the terrain at all speeds; some along an axis, some vertical."""
    middle = facets.corners.reshape(-1, 3)
    low, high = np.quantile(middle, 0.02, axis=0), np.quantile(middle, 0.98, axis=0)
    size = high - low
    arcs = []
    for k in range(ARCS):
        x = rng.uniform(low - 0.3 * size, high + 0.3 * size + (0.0, 0.0, 5.0))
        v = rng.normal(0.0, 10.0 ** rng.uniform(-1.0, 1.5), 3) * ((1, 1, 1), (1, 0, 1), (0, 1, 1), (0, 0, 1))[k % 4]
        arcs.append((Arc(vector(x), vector(v), 9.81), NOTHING_LEFT))
    return arcs


def bounces(facets: Facets, rng: np.random.Generator) -> list[tuple[Arc, PreviousContact]]:
    """Return arcs that leave a facet from inside, an edge or a corner, some by less than a nanometre."""
    arcs = []
    for k in range(ARCS):
        f = int(rng.integers(len(facets.zone)))
        weights = (rng.dirichlet((1, 1, 1)), (0.5, 0.5, 0.0), (1.0, 0.0, 0.0))[k % 3]
        x = np.array(weights) @ facets.corners[f].reshape(3, 3)
        n = facets.normals[f]
        v = rng.normal(0.0, 10.0 ** rng.uniform(-9.0, 1.3), 3)
        arcs.append(
            (Arc(vector(x), vector(v - 2.0 * min(v @ n, 0.0) * n), 9.81), PreviousContact(f, -1, 1.0, False, -1))
        )
    return arcs


def aimed_at_vertices(facets: Facets, rng: np.random.Generator) -> list[tuple[Arc, PreviousContact]]:
    """Return arcs that pass, within rounding, through a vertex or the middle of an edge."""
    arcs = []
    for k in range(ARCS):
        corners = facets.corners[rng.integers(len(facets.zone))].reshape(3, 3)
        aim = corners[0] if k % 2 else 0.5 * (corners[0] + corners[1])
        t, v = rng.uniform(0.1, 2.0), rng.normal(0.0, 6.0, 3)
        x = aim - v * t + (0.0, 0.0, 0.5 * 9.81 * t * t)
        arcs.append((Arc(vector(x), vector(v), 9.81), NOTHING_LEFT))
    return arcs


@pytest.mark.parametrize("kind", [flights_from_the_air, bounces, aimed_at_vertices])
@pytest.mark.parametrize("name", TERRAINS)
def test_the_walk_finds_what_looking_at_every_facet_finds(name, kind):
    facets = facets_of(TERRAINS[name])
    locator = bucket_locator(facets)
    floats = plain(facets)
    hits = 0
    for arc, left in kind(facets, np.random.default_rng(len(name))):
        end = flight_end(floats, arc, 0.0)
        found, expected = (first_contact_in_buckets(locator, floats, arc, left, end), over_all(floats, arc, left))
        assert found == expected or min(found.t, expected.t) > end, (arc, left)
        hits += found.t < math.inf
    assert hits > 0 or (name == "needles" and kind is flights_from_the_air)


def cells_of(locator: BucketLocator, level: int) -> list[tuple[int, set[int]]]:
    """Return (cell, facets of its buckets) for each cell of a level of the locator."""
    columns = width_of(locator.nx, level)
    members: dict[int, set[int]] = {}
    for j in range(locator.ny):
        for i in range(locator.nx):
            k = j * locator.nx + i
            cell = (j >> SHIFT * level) * columns + (i >> SHIFT * level)
            members.setdefault(cell, set()).update(locator.ids[locator.starts[k] : locator.starts[k + 1]].tolist())
    return list(members.items())


@pytest.mark.parametrize("level", range(LEVELS))
@pytest.mark.parametrize("name", TERRAINS)
def test_a_slab_lies_above_every_facet_of_its_cell_and_never_leans_over(name, level):
    facets = facets_of(TERRAINS[name])
    locator = bucket_locator(facets)
    planes = locator.slabs.planes.reshape(-1, 4)[locator.slabs.first[level] :]
    for cell, members in cells_of(locator, level):
        n, high = planes[cell, :3], planes[cell, 3]
        assert n[2] >= 0.0 and abs(np.linalg.norm(n) - 1.0) < 1e-12
        corners = facets.corners[sorted(members)].reshape(-1, 3)
        assert (corners @ n <= high + facets.tolerance).all()
        assert members or high == -math.inf


def test_an_arc_over_a_slab_at_both_ends_is_over_it_in_between():
    facets = facets_of(TERRAINS["steep ground"])
    locator = bucket_locator(facets)
    planes = locator.slabs.planes.reshape(-1, 4)
    rng, over = np.random.default_rng(8), 0
    for _ in range(3000):
        k = int(rng.integers(locator.nx * locator.ny))
        arc = Arc(vector(rng.uniform(facets.low, facets.high)), vector(rng.normal(0.0, 8.0, 3)), 9.81)
        begin, end = sorted(rng.uniform(0.0, 2.0, 2))
        if flies_over(locator.slabs, 0, k, position(arc, begin), position(arc, end), facets.tolerance):
            over += 1
            points = np.array([position(arc, t) for t in np.linspace(begin, end, 9)])
            assert (points @ planes[k, :3] > planes[k, 3]).all()
    assert over > 300


def test_boxes_that_overlap_in_metres_overlap_in_parts():
    rng = np.random.default_rng(9)
    low, high = np.sort(rng.uniform(-0.5, 1.5, (2, 4000, 2, 2)), axis=0)
    low[::7] = high[::7]  # points
    low[::11, 0] = high[::11, 1] = np.maximum(low[::11, 0], high[::11, 1])  # boxes that touch at a corner
    high[::11, 0] = np.maximum(high[::11, 0], low[::11, 0])
    together = ((low[:, 0] <= high[:, 1]) & (low[:, 1] <= high[:, 0])).all(axis=1)
    metres = 5.0 + 2.0 * np.stack([low, high])  # cell 2 of side 2 m from x = 1 m on
    parts = np.reshape([part_of(v, 1.0, 0.5, 2) for v in metres.ravel().tolist()], metres.shape)
    assert parts.min() == 0 and parts.max() == PARTS - 1
    for k in range(len(low)):
        (ax, ay), (bx, by) = parts[0, k, 0], parts[1, k, 0]
        (px, py), (qx, qy) = parts[0, k, 1], parts[1, k, 1]
        told = overlap(packed_box(ax, bx, ay, by), packed_probe(px, qx, py, qy))
        assert told == (ax <= qx and px <= bx and ay <= qy and py <= by)
        assert told or not together[k]
    assert 500 < together.sum() < 3500
