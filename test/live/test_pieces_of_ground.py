"""Tests that intersecting components of a live terrain are found in a mesh survey, and again after a patch."""

import numpy as np
from flights.scenes_of_facets import flight, fly, surface
from live_sites.surveyed_hills import EAST, NORTH, grid, heights, mesh

from rpf3d_core.live.ground import LiveTerrain, Workshop
from rpf3d_core.live.survey import MeshSurvey

TOP, STEEP = np.array([22.0, 20.0]), 2.25
"""Place in plan (m, from the corner of the hills) of the muck pile's top, and the slope (m/m) of its four sides."""


def top() -> np.ndarray:
    """Return the top (3,) m of the muck pile, 3 m above the hills."""
    return np.array([EAST + TOP[0], NORTH + TOP[1], heights(*TOP[:, None], 0)[0] + 3.0])


def with_a_muck_pile() -> MeshSurvey:
    """Return the hills and, with separate vertices, a pyramid of 8 m by 8 m that cuts through them."""
    hills = mesh(grid())
    pile = top() + 4.0 * np.array([(0, 0, 0), *((i, j, -STEEP) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1)))])
    sides = len(hills.vertices) + np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)], dtype=np.int32)
    return MeshSurvey(np.vstack([hills.vertices, pile]), np.vstack([hills.triangles, sides]))


def passed_below(ground: LiveTerrain) -> int:
    """Let 60 rocks start towards the pile from all sides; return how many get inside it."""
    angle = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    way, tip = np.column_stack([np.cos(angle), np.sin(angle)]), top() - np.array(ground.terrain.frame.origin)
    x = np.column_stack([tip[:2] - 3.0 * way, np.full(60, 99.0)])
    x[:, 2] -= ground.engine.ground_below(x)[:, 0]
    paths = fly(ground.engine, flight(surface(0.0, 1.0, 5.0)), x, np.column_stack([3.0 * way, np.zeros(60)])).paths
    aside = np.abs(paths.x[:, :2] - tip[:2]).max(axis=1)
    inside = (aside < 4.0) & (paths.x[:, 2] < tip[2] - STEEP * aside - 1e-6)
    return len(np.unique(paths.row[inside]))


def test_a_rock_does_not_slide_below_a_muck_pile_of_a_mesh_survey():
    ground = Workshop().whole(with_a_muck_pile())
    assert ground.pieces.overlap
    assert passed_below(ground) == 0


def test_after_a_patch_elsewhere_the_pieces_are_found_again():
    workshop = Workshop()
    ground = workshop.whole(with_a_muck_pile())
    after = workshop.patched(ground, grid(6, 6, 33.37, 5.21, seed=1))
    assert after.pieces.overlap
    assert len(after.pieces.number) == len(after.terrain.triangles)
    assert passed_below(after) == 0


def test_a_patch_over_the_muck_pile_leaves_one_piece():
    workshop = Workshop()
    after = workshop.patched(workshop.whole(with_a_muck_pile()), grid(14, 14, 15.37, 13.21, seed=1))
    assert not after.pieces.overlap


def test_every_ground_has_pieces_of_one_kind_so_that_a_survey_compiles_nothing():
    workshop = Workshop()
    cut, whole = workshop.whole(with_a_muck_pile()), workshop.whole(grid())
    assert not whole.pieces.overlap
    assert type(cut.engine.pieces) is type(whole.engine.pieces)
    kinds = [[part.dtype for part in ground.pieces[:2]] for ground in (cut, whole)]
    assert kinds[0] == kinds[1]
