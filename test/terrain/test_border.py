"""Tests of the border of a mesh: which sides of facets have no opposite side."""

from collections import Counter

import numpy as np
import pytest

from rpf3d_core.terrain.mesh.border import border_of, left_over


@pytest.mark.parametrize("seed", range(30))
def test_sides_that_no_opposite_side_cancels_are_those_that_a_count_of_each_edge_leaves(seed):
    random = np.random.default_rng(seed)
    sides = random.integers(0, random.integers(1, 12), (random.integers(0, 60), 2))
    count = Counter((a, b) for a, b in sides.tolist() if a != b)
    expected = {side: n - count[side[::-1]] for side, n in count.items() if n > count[side[::-1]]}
    kept = left_over(sides)
    assert Counter(map(tuple, sides[kept].tolist())) == expected
    for side, n in expected.items():  # the first of several equal sides are kept
        equal = np.flatnonzero((sides == side).all(axis=1))
        assert kept[equal].tolist() == [True] * n + [False] * (len(equal) - n)


def test_large_vertex_numbers_are_distinguished():
    far = 2**31 - 2
    sides = np.array([[far, far - 1], [far - 1, far], [0, far], [far, 1], [1, 0]])
    assert left_over(sides).tolist() == [False, False, True, True, True]


def test_the_border_of_a_square_with_a_hole_has_an_outer_and_an_inner_ring():
    at = np.array([[x, y, 0.0] for y in range(4) for x in range(4)])
    cells = [4 * y + x for y in range(3) for x in range(3) if (x, y) != (1, 1)]
    triangles = np.array([each for c in cells for each in ([c, c + 1, c + 5], [c, c + 5, c + 4])])
    sides = border_of(at, triangles)[:, :2, :2]
    turn = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    assert len(sides) == 12 + 4
    assert turn.sum() / 2.0 == 9.0 - 1.0  # the area: the inner ring is clockwise
