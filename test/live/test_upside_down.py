"""Tests of terrain with z down: a mesh that faces down is refused, and sources far above the ground are doubtful."""

import numpy as np
import pytest
from live_sites.alert_evidence import NOW, S
from live_sites.surveyed_hills import grid
from live_sites.watched_road import ON_THE_SLOPE, slope, standing_over

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.released import ReleaseSpread, released_over
from rpf3d_core.live.survey import MeshSurvey
from rpf3d_core.live.triggers import trigger_of
from rpf3d_core.terrain.grid_rows import grid_mesh


def surveyed(turned):
    made = grid_mesh(grid().points)
    triangles = made.triangles[:, ::-1] if turned else made.triangles
    return MeshSurvey(made.vertices, triangles)


def test_a_mesh_that_faces_down_is_refused_where_that_is_wanted():
    workshop = Workshop(must_face_up=True)
    workshop.whole(surveyed(turned=False))
    with pytest.raises(TerrainError, match=r"facets face down; z must point up"):
        workshop.whole(surveyed(turned=True))
    north_east_down = surveyed(turned=False)
    with pytest.raises(TerrainError, match="face down"):
        workshop.whole(MeshSurvey(north_east_down.vertices[:, [1, 0, 2]] * (1.0, 1.0, -1.0), north_east_down.triangles))


def doubt(points, place, above=None, highest=20.0):
    trigger = trigger_of(np.array([place]), np.zeros((1, 3)), None, NOW - S)
    spread = ReleaseSpread(above_ground=above, highest=highest)
    return released_over(standing_over(points), trigger, spread).doubtful


@pytest.mark.parametrize("above", [None, 2.0])
def test_a_source_far_from_the_ground_is_doubtful(above):
    assert doubt(slope(), ON_THE_SLOPE, above) == ""
    turned = slope() * (1.0, 1.0, -1.0)
    assert "1 of 1 sources are more than 20 m from the ground" in doubt(turned, ON_THE_SLOPE, above)
    assert doubt(turned, ON_THE_SLOPE, above, highest=62.0) == ""


@pytest.mark.parametrize(("height", "is_doubtful"), [(19.9, False), (20.1, True)])
def test_the_height_is_that_above_the_ground_below(height, is_doubtful):
    assert bool(doubt(slope(), (10.0, 20.0, 30.0 + height))) is is_doubtful


def test_a_source_far_below_the_ground_is_doubtful_where_its_height_is_not_used():
    assert "more than 20 m" in doubt(slope(), (10.0, 20.0, -31.0), above=2.0)
