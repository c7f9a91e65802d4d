"""Tests of the components of a terrain: their facets, their borders, and whether two components may intersect."""

import numpy as np
import pytest

from rpf3d_core.simulation.capped import APART, piece_numbers, pieces_that_cross
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.overlaps import may_cross, pieces_of, rims_of


def squares(*places: tuple[float, float, float, float, float]) -> Terrain:
    """Return squares of two facets each, from (x, y, z of the low corner, side, rise towards +x), all in m."""
    corners = [
        (x + i * a, y + j * a, z + i * h) for x, y, z, a, h in places for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    facets = [(4 * k, 4 * k + 1 + i, 4 * k + 2 + i) for k in range(len(places)) for i in range(2)]
    return Terrain(np.array(corners), np.array(facets, dtype=np.int32), np.zeros(len(facets), np.int32), ("",))


@pytest.mark.parametrize(
    ("places", "cross"),
    [
        ([(0, 0, 0, 4, 1)], False),
        ([(0, 0, 0, 4, 1), (4, 0, 1, 4, 1)], False),  # tiles that touch
        ([(0, 0, 0, 4, 1), (3, 1, 0, 2, 2)], True),  # one cuts through the other
        ([(0, 0, 0, 4, 1), (20, 20, 0, 4, 1), (3, 1, 0, 2, 2)], True),
        ([(0, 0, 0, 4, 1), (1, 1, 9, 1, 1)], False),  # one above the other
        ([(0, 0, 0, 4, 0), (1, 1, -1, 2, 3)], True),  # a level component, whose box is flat
        ([(0, 0, 0, 4, 0), (1, 1, 0, 2, 1)], True),  # a component that stands on a level one
    ],
)
def test_pieces_may_cross_if_their_boxes_overlap(places, cross):
    terrain = squares(*places)
    assert may_cross(terrain, pieces_of(terrain)) == cross
    assert (piece_numbers(terrain) is not None) == cross
    assert (pieces_that_cross(terrain) is APART) == (not cross)


def test_of_many_pieces_any_two_are_found():
    """In any order, 3,600 separate components do not intersect until one more is added that cuts through one."""
    places = [(3.0 * i, 3.0 * j, 0.0, 2.0, 0.5) for i in range(60) for j in range(60)]
    draw = np.random.default_rng(2)
    draw.shuffle(places)
    apart, cut = squares(*places), squares(*places, (91.0, 91.0, 0.0, 2.0, 0.4))
    assert not may_cross(apart, pieces_of(apart))
    assert may_cross(cut, pieces_of(cut))


def test_facets_with_a_common_vertex_are_one_piece():
    terrain = squares((0, 0, 0, 4, 1), (10, 0, 0, 4, 1))
    assert len(set(pieces_of(terrain).tolist())) == 2
    terrain.triangles[2, 0] = 2  # the second square's first facet shares a corner with the first square
    assert len(set(pieces_of(terrain).tolist())) == 1


def test_an_edge_of_one_facet_is_at_the_rim():
    """The diagonal of a square, not at the rim, is the last edge of its first facet and the first of its second."""
    assert rims_of(squares((0, 0, 0, 4, 1), (2, 2, 0, 4, 1))).tolist() == [0b011, 0b110] * 2
