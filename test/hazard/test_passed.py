"""Facets under a path: against a test of every facet with every segment."""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.hazard import passed as passed_module
from rpf3d_core.hazard.passed import passed_facets, touching
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.terrain.squares import grid_triangles
from rpf3d_core.terrain.survey import mesh_terrain

CELLS = 8
BYTES_A_PAIR = 700
"""Of the arrays that a test of pairs makes, generously; 4 million pairs at once would take 2 GB."""


def floor():
    """A floor of 8 x 8 squares of 1 m, x and y from -4 to 4 in the local frame."""
    y, x = np.mgrid[0 : CELLS + 1, 0 : CELLS + 1].astype(float)
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    return facets_of(mesh_terrain(points, grid_triangles(np.ones(x.shape, dtype=bool)), "floor"))


FLOOR = floor()
BUCKETS = bucket_locator(FLOOR)
INSIDE = st.floats(-3.9, 3.9)


def passed(begin, end):
    return passed_facets(BUCKETS, FLOOR.corners, np.array([begin]), np.array([end])).tolist()


def test_a_short_path_inside_a_facet_passes_that_facet_only():
    centroid = FLOOR.corners[17].reshape(3, 3)[:, :2].mean(axis=0)
    assert passed(centroid, centroid + 0.01) == [17]


def test_a_path_along_a_row_of_squares_passes_both_facets_of_each():
    steps = np.stack([np.linspace(-3.9, 3.9, 40), np.full(40, 0.3)], axis=-1)
    assert len(passed_facets(BUCKETS, FLOOR.corners, steps[:-1], steps[1:])) == 2 * CELLS


def test_a_path_beside_the_terrain_passes_nothing():
    assert passed([9.0, 9.0], [9.5, 9.1]) == []


@pytest.mark.parametrize("pairs", [1, 2, 7, 1000])
def test_how_many_pairs_are_tested_at_once_changes_nothing(monkeypatch, pairs):
    ends = np.random.default_rng(4).uniform(-3.9, 3.9, (30, 2))
    steps = ends[:, None] + np.linspace(0.0, 0.9 * BUCKETS.cell, 2)[:, None] * np.array([1.0, 0.3])
    whole = passed_facets(BUCKETS, FLOOR.corners, steps[:, 0], steps[:, 1])
    monkeypatch.setattr(passed_module, "PAIRS_AT_ONCE", pairs)
    assert np.array_equal(passed_facets(BUCKETS, FLOOR.corners, steps[:, 0], steps[:, 1]), whole)


def test_a_full_bucket_asks_for_no_more_memory_than_an_empty_one():
    facets = 2000
    full = BUCKETS._replace(cell=100.0, nx=1, ny=1, starts=np.array([0, facets]), ids=np.arange(facets, dtype=np.int32))
    corners = np.tile(FLOOR.corners[:1], (facets, 1))
    beside = np.full((facets, 2), 30.0)
    tracemalloc.start()
    assert passed_facets(full, corners, beside, beside + 1.0).size == 0
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < BYTES_A_PAIR * passed_module.PAIRS_AT_ONCE


def test_no_path_passes_nothing():
    assert passed_facets(BUCKETS, FLOOR.corners, np.empty((0, 2)), np.empty((0, 2))).tolist() == []


@given(x=INSIDE, y=INSIDE, along=st.floats(-1.0, 1.0), across=st.floats(-1.0, 1.0))
def test_looking_into_buckets_finds_what_looking_at_all_facets_finds(x, y, along, across):
    begin = np.array([x, y])
    end = begin + BUCKETS.cell * np.array([along, across])
    plan = FLOOR.corners.reshape(-1, 3, 3)[:, :, :2]
    every = touching(np.tile(begin, (len(plan), 1)), np.tile(end, (len(plan), 1)), plan)
    assert passed(begin, end) == np.flatnonzero(every).tolist()


@pytest.mark.parametrize(
    ("begin", "end", "touches"),
    [
        ((0.2, 0.2), (0.3, 0.3), True),
        ((-1.0, 0.5), (2.0, 0.5), True),
        ((-1.0, -0.1), (2.0, -0.1), False),
        ((1.5, -0.5), (0.6, 0.6), False),
        ((-0.5, 0.4), (-0.1, 0.4), False),
        ((-0.5, 0.0), (-0.1, 0.0), False),
        ((-0.5, 0.0), (0.0, 0.0), True),
        ((0.25, 0.25), (0.25, 0.25), True),
    ],
)
def test_a_segment_touches_a_triangle_where_they_share_a_point(begin, end, touches):
    triangle = np.array([[[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]])
    assert touching(np.array([begin]), np.array([end]), triangle).tolist() == [touches]
