"""Pieces of a terrain that overlap, and what is reported of them to a user."""

import numpy as np
import pytest

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.overlaps import MOST_COMPARED, overlap_warnings, pieces_that_overlap


def pieces(*squares: tuple[float, float, float, float]) -> Terrain:
    """Squares of two facets each: x and y of the low corner, side, and height of the side at high x (m)."""
    corners = [(x + i * a, y + j * a, i * h) for x, y, a, h in squares for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    facets = [(4 * k, 4 * k + 1 + i, 4 * k + 2 + i) for k in range(len(squares)) for i in range(2)]
    return Terrain(np.array(corners), np.array(facets, dtype=np.int32), np.zeros(len(facets), np.int32), ("",))


@pytest.mark.parametrize(
    ("squares", "count"),
    [
        ([(0, 0, 4, 1)], 0),
        ([(0, 0, 4, 1), (4, 0, 4, 1)], 0),  # tiles that touch
        ([(0, 0, 4, 1), (3, 1, 2, 2)], 2),  # one cuts through the other
        ([(0, 0, 4, 1), (3, 1, 2, 2), (20, 20, 4, 1)], 2),
        ([(0, 0, 9, 1), (1, 1, 1, 1), (5, 5, 1, 1)], 3),
    ],
)
def test_pieces_with_a_common_volume_of_their_boxes_are_counted(squares, count):
    assert pieces_that_overlap(pieces(*squares)) == count


def test_a_user_is_told_how_many_and_what_to_do():
    assert list(overlap_warnings(pieces((0, 0, 4, 1)), 1)) == []
    (sentence,) = overlap_warnings(pieces((0, 0, 4, 1), (3, 1, 2, 2)), 2)
    assert sentence.startswith("2 pieces of the terrain") and sentence.endswith("merge them into one surface")


def test_of_very_many_pieces_the_widest_are_compared():
    small = [(10.0 * k, 50.0, 1.0, 1.0) for k in range(MOST_COMPARED)]
    assert pieces_that_overlap(pieces(*small, (0, 0, 9, 1), (3, 1, 2, 2))) == 2
