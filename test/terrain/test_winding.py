import numpy as np
import pytest
from input_files.terrain_files import grid

from rpf3d_core.terrain.mesh.border import border_of
from rpf3d_core.terrain.mesh.components import components, components_of_facets
from rpf3d_core.terrain.mesh.edges import edges_of, shared_by_two
from rpf3d_core.terrain.mesh.winding import repair_winding

CUBE = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]], dtype=np.int32)
OUTWARD = SIDES[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)

CORNERS_OF_LIP = np.array([[x, y, z] for y in (0.0, 1.0) for x, z in [(0.0, 0.0), (4, 0), (3, -2), (8, -2)]])
LIP = np.array([t for k in range(3) for t in ([k, k + 1, k + 5], [k, k + 5, k + 4])], dtype=np.int32)
"""A surface that goes along, over a lip and back under it: the underside faces down."""


def turned(triangles, flags):
    out = triangles.copy()
    out[flags] = out[flags][:, [0, 2, 1]]
    return out


def repaired(vertices, triangles):
    return repair_winding(vertices, triangles, edges_of(triangles, len(vertices)))


@pytest.mark.parametrize("share", [0.0, 0.3, 0.5, 0.99, 1.0])
def test_an_open_surface_faces_up_whatever_share_of_it_was_turned(share):
    vertices, triangles = grid(20, 30)
    flags = np.random.default_rng(1).random(len(triangles)) < share
    winding = repaired(vertices, turned(triangles, flags))
    assert np.array_equal(winding.triangles, triangles)
    assert np.array_equal(winding.flipped, flags)
    assert (winding.areas[:, 2] > 0).all()


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_a_closed_body_faces_outwards(share):
    flags = np.random.default_rng(2).random(len(OUTWARD)) < share
    winding = repaired(CUBE + np.array([100.0, -50.0, 7.0]), turned(OUTWARD, flags))
    assert np.array_equal(winding.triangles, OUTWARD)
    assert np.array_equal(winding.flipped, flags)


def test_each_piece_is_turned_on_its_own():
    vertices, triangles = grid(5, 5)
    both = np.concatenate([vertices, vertices + np.array([100, 0, 0]), CUBE + np.array([0, 0, 50])])
    wound = np.concatenate(
        [triangles, turned(triangles, slice(None)) + len(vertices), turned(OUTWARD, slice(None)) + 2 * len(vertices)]
    ).astype(np.int32)
    winding = repaired(both, wound)
    expected = np.repeat([False, True, True], [len(triangles), len(triangles), len(OUTWARD)])
    assert np.array_equal(winding.flipped, expected)
    assert len(np.unique(winding.piece)) == 3


def test_an_overhang_keeps_the_winding_of_its_neighbours():
    winding = repaired(CORNERS_OF_LIP, turned(LIP, [0, 3]))
    assert np.array_equal(winding.triangles, LIP)
    assert (winding.areas[2:4, 2] < 0).all()


@pytest.mark.parametrize("corners", [[0, 1, 2], [1, 2, 0], [0, 2, 1]], ids=["copied", "rolled", "reversed"])
def test_a_copy_of_a_facet_faces_as_the_facet_does(corners):
    """A copy of a facet at the rim once faced down, and rocks had an impact on it from behind."""
    vertices, triangles = grid(4, 5)
    copies = triangles[::3]
    winding = repaired(vertices, np.concatenate([triangles, copies[:, corners]]))
    assert (winding.areas[:, 2] > 0).all()
    assert np.array_equal(winding.flipped[: len(triangles)], np.zeros(len(triangles), bool))
    assert winding.flipped[len(triangles) :].all() == (corners == [0, 2, 1])
    assert (winding.piece == 0).all()


def test_an_overhang_that_is_given_twice_keeps_its_winding():
    """Every inner edge has four facets, and no two neighbours share an edge alone."""
    once, twice = (repaired(CORNERS_OF_LIP, np.tile(LIP, (number, 1))) for number in (1, 2))
    assert np.array_equal(twice.triangles, np.tile(once.triangles, (2, 1)))
    assert np.array_equal(twice.areas, np.tile(once.areas, (2, 1)))
    assert (once.areas[2:4, 2] < 0).all()


SLIVER = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [1, -1, 0], [0, -1, 0]])
BESIDE_SLIVER = np.array([[0, 2, 3], [0, 1, 2], [0, 4, 1], [1, 4, 2]], dtype=np.int32)
"""A level surface; facet 1 has no area, because its vertices lie on one straight line."""


@pytest.mark.parametrize("copied", [1, 3], ids=["without_area", "with_area"])
@pytest.mark.parametrize("corners", [[0, 1, 2], [1, 2, 0], [0, 2, 1]], ids=["copied", "rolled", "reversed"])
def test_a_facet_without_area_turns_with_its_neighbours_if_a_facet_has_a_copy(copied, corners):
    copy = BESIDE_SLIVER[[copied]][:, corners]
    up = repaired(SLIVER, np.concatenate([BESIDE_SLIVER, copy]))
    down = repaired(SLIVER, turned(np.concatenate([BESIDE_SLIVER, copy]), slice(None)))
    assert up.flipped.tolist() == 4 * [False] + [corners == [0, 2, 1]]
    assert np.array_equal(down.flipped, ~up.flipped)
    assert len(border_of(SLIVER, down.triangles)) == len(border_of(SLIVER, up.triangles)) == 4 + 3


def test_a_moebius_strip_is_left_as_it_is_and_counted():
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    rim = [
        [(3 + s * np.cos(a / 2)) * np.cos(a), (3 + s * np.cos(a / 2)) * np.sin(a), s * np.sin(a / 2)]
        for a in angle
        for s in (-1, 1)
    ]
    quads = [(2 * k, 2 * k + 1, 2 * k + 3, 2 * k + 2) for k in range(11)] + [(22, 23, 0, 1)]
    triangles = np.array([t for a, b, c, d in quads for t in ([a, b, c], [a, c, d])], dtype=np.int32)
    winding = repaired(np.array(rim), triangles)
    assert winding.one_sided == 1
    assert winding.flipped.all() or not winding.flipped.any()


def test_a_facet_on_one_vertex_twice_does_not_part_its_neighbours():
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
    triangles = np.array([[0, 1, 2], [1, 2, 2], [1, 2, 3]], dtype=np.int32)
    winding = repaired(vertices, triangles)
    assert winding.flipped.tolist() == [False, False, True]
    assert winding.piece[0] == winding.piece[2]


def test_edges_are_the_same_from_the_fast_sort_and_from_the_general_one(monkeypatch):
    vertices, triangles = grid(9, 11)
    triangles = np.random.default_rng(3).permutation(triangles)
    fast = edges_of(triangles, len(vertices))
    monkeypatch.setattr("rpf3d_core.terrain.mesh.ordering.LARGEST_BITS", 0)
    general = edges_of(triangles, len(vertices))
    assert all(np.array_equal(a, b) for a, b in zip(fast[:4], general[:4], strict=True))
    for ours, theirs in zip(shared_by_two(fast)[:2], shared_by_two(general)[:2], strict=True):
        assert len(ours) == len(theirs) > 0
    assert np.array_equal(np.sort(shared_by_two(fast)[:2], axis=0), np.sort(shared_by_two(general)[:2], axis=0))


def test_components_name_the_smallest_node_of_each():
    a, b = np.array([[5, 4], [4, 2], [0, 7], [7, 7]], dtype=np.int32).T
    assert components(8, a, b).tolist() == [0, 1, 2, 3, 2, 2, 6, 0]
    chain = np.random.default_rng(4).permutation(1000).astype(np.int32)
    assert not components(1000, chain[1:], chain[:-1]).any()


def test_components_of_facets_are_those_of_their_edges():
    triangles = np.random.default_rng(5).integers(0, 300, (80, 3)).astype(np.int32)
    expected = components(300, triangles[:, :2].ravel(), triangles[:, 1:].ravel())
    assert np.array_equal(components_of_facets(300, triangles), expected)
    assert 50 < len(np.unique(expected)) < 299
