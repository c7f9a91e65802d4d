import numpy as np
import pytest

from rpf3d_core.terrain.mesh.welding import weld

TOLERANCE = 1e-4


def test_equal_points_become_one_vertex_numbered_as_first_met():
    points = np.array([[3.0, 1, 2], [0, 0, 0], [3, 1, 2], [0, 0, 0], [9, 9, 9]])
    vertices, index = weld(points, 0.0)
    assert vertices.tolist() == [[3, 1, 2], [0, 0, 0], [9, 9, 9]]
    assert index.tolist() == [0, 1, 0, 1, 2]


@pytest.mark.parametrize("seed", range(4))
def test_a_pair_within_the_tolerance_is_welded_wherever_it_lies(seed):
    random = np.random.default_rng(seed)
    places = random.uniform(-500, 500, (2000, 3))
    direction = random.normal(size=(2000, 3))
    shift = 0.99 * TOLERANCE * direction / np.linalg.norm(direction, axis=1, keepdims=True)
    vertices, index = weld(np.concatenate([places, places + shift]), TOLERANCE)
    assert np.array_equal(vertices, places)
    assert np.array_equal(index[:2000], index[2000:])


def test_points_further_apart_than_the_tolerance_stay_apart():
    random = np.random.default_rng(5)
    places = np.round(random.uniform(-50, 50, (500, 3)))
    places = np.unique(places, axis=0)
    apart = places + np.array([1.01 * TOLERANCE, 0, 0])
    vertices, _ = weld(np.concatenate([places, apart]), TOLERANCE)
    assert len(vertices) == 2 * len(places)


def test_welding_agrees_with_a_comparison_of_every_pair():
    random = np.random.default_rng(6)
    points = random.uniform(0, 1, (400, 3))
    tolerance = 0.06  # so wide that chains of several points are common
    near = np.linalg.norm(points[:, None] - points[None], axis=2) <= tolerance
    expected = np.arange(len(points))
    for _ in range(len(points)):
        expected = np.where(near, expected[None], len(points)).min(axis=1)
    _, index = weld(points, tolerance)
    assert np.array_equal(index, np.unique(expected, return_inverse=True)[1])


def test_a_chain_of_near_points_becomes_one_vertex_on_the_first():
    points = np.array([[3.0, 0, 0], [0, 0, 0], [1, 0, 0], [2, 0, 0]]) * 0.9 * TOLERANCE
    vertices, index = weld(points, TOLERANCE)
    assert vertices.tolist() == [points[0].tolist()]
    assert index.tolist() == [0, 0, 0, 0]


def test_the_order_of_the_points_does_not_change_what_is_welded():
    random = np.random.default_rng(7)
    points = np.repeat(random.uniform(0, 100, (300, 3)), 3, axis=0)
    order = random.permutation(len(points))
    _, index = weld(points, TOLERANCE)
    _, shuffled = weld(points[order], TOLERANCE)
    assert len(np.unique(np.stack([index[order], shuffled], axis=1), axis=0)) == 300


def test_points_at_one_place_and_a_single_point_can_be_welded():
    assert weld(np.ones((5, 3)), TOLERANCE)[1].tolist() == [0] * 5
    assert weld(np.ones((1, 3)), TOLERANCE)[0].tolist() == [[1, 1, 1]]
