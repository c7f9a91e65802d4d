"""Tests of the border of a mesh: which sides of facets have no opposite side."""

from collections import Counter

import numpy as np
import pytest

from rpf3d_core.terrain.mesh import border
from rpf3d_core.terrain.mesh.border import border_of, left_over, without_opposite


@pytest.mark.parametrize("kind", [np.int32, np.int64])
@pytest.mark.parametrize("seed", range(30))
def test_sides_that_no_opposite_side_cancels_are_those_that_a_count_of_each_edge_leaves(seed, kind):
    random = np.random.default_rng(seed)
    sides = random.integers(0, random.integers(1, 12), (random.integers(0, 60), 3), dtype=kind)[:, :2]
    count = Counter((a, b) for a, b in sides.tolist() if a != b)
    expected = {side: n - count[side[::-1]] for side, n in count.items() if n > count[side[::-1]]}
    kept = left_over(sides)
    assert Counter(map(tuple, sides[kept].tolist())) == expected
    alone = Counter({side: n for side, n in count.items() if not count[side[::-1]]})
    assert Counter(map(tuple, sides[without_opposite(sides)].tolist())) == alone
    for side, n in expected.items():  # the first of several equal sides are kept
        equal = np.flatnonzero((sides == side).all(axis=1))
        assert kept[equal].tolist() == [True] * n + [False] * (len(equal) - n)


def test_edges_that_are_equal_in_their_last_32_bits_are_distinguished():
    """The key of an edge is the lower number times the number of vertices (2^31), plus the higher number."""
    far = 2**31 - 1
    for other in range(2, 100, 2):  # some of these edges have the same slot as the first
        assert left_over(np.array([[0, far], [far, other]], dtype=np.int32)).tolist() == [True, True]
    assert left_over(np.array([[0, far], [far, 0]], dtype=np.int32)).tolist() == [False, False]


@pytest.mark.parametrize("width", [1000, 1024, 32768])
def test_the_sides_of_a_grid_of_any_width_take_about_as_long(width):
    """The vertices of a window in a wide grid have numbers in steps of the width, which a poor hash repeats."""
    rows, columns = np.mgrid[0:70, 0:70]
    first = (rows * width + columns).ravel()
    sides = np.concatenate([np.stack([first, first + 1], 1), np.stack([first + width, first], 1)])
    assert longest_search(sides) < 60


def longest_search(sides):
    """Return the largest number of slots that the table of `left_over` searches for an edge."""
    table = border._counted(sides)[1]
    taken = np.flatnonzero(table.keys != border.FREE)
    # A search ends at the end of a run of taken slots.
    ends = np.flatnonzero(np.diff(taken, append=len(table.keys) + 1) > 1)
    return int(np.diff(ends, prepend=-1).max())


def test_the_border_of_a_square_with_a_hole_has_an_outer_and_an_inner_ring():
    at = np.array([[x, y, 0.0] for y in range(4) for x in range(4)])
    cells = [4 * y + x for y in range(3) for x in range(3) if (x, y) != (1, 1)]
    triangles = np.array([each for c in cells for each in ([c, c + 1, c + 5], [c, c + 5, c + 4])])
    sides = border_of(at, triangles)[:, :2, :2]
    turn = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    assert len(sides) == 12 + 4
    assert turn.sum() / 2.0 == 9.0 - 1.0  # the area: the inner ring is clockwise
