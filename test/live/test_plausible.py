"""Tests that surveys with impossible shapes are refused: heights that mean "no data", and grids that fold back."""

import numpy as np
import pytest
from live_sites.surveyed_hills import cloud, grid, mesh

from rpf3d_core.errors import TerrainError
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.survey import CloudSurvey, GridSurvey, MeshSurvey

CUT = r"facets are steeper than 80 degrees and taller than 50 m; .* publish NaN or leave the point out"


def with_no_data(survey, height):
    """Return the grid survey with `height` (m), which stands for "no data", in three of its columns."""
    points = survey.points.copy()
    points[:, 20:23, 2] = height
    return GridSurvey(points)


@pytest.mark.parametrize("height", [-9999.0, -32768.0, -400.0, 1000.0])
@pytest.mark.parametrize("kind", ["grid", "mesh", "cloud"])
def test_heights_that_mean_no_data_are_refused_because_rocks_would_stop_in_their_false_canyon(kind, height):
    survey = with_no_data(grid(), height)
    if kind == "mesh":
        survey = mesh(survey)
    if kind == "cloud":
        survey = CloudSurvey(survey.points.reshape(-1, 3))
    with pytest.raises(TerrainError, match=CUT):
        Workshop(reference=True).whole(survey)


def test_the_sentence_names_the_place_and_the_two_heights():
    survey = with_no_data(grid(), -400.0)
    with pytest.raises(TerrainError, match=r"is at \(50(19|2[0-3])\.\d, 30\d\d\.\d\), from height -400\.0 to"):
        Workshop(reference=True).whole(survey)


def test_a_face_is_real_if_the_user_says_how_tall_faces_are():
    survey = with_no_data(grid(), -400.0)
    assert Workshop(reference=True, tallest_face=500.0).whole(survey)


def test_an_upright_face_of_45_m_is_ground():
    points = grid().points.copy()
    points[:, 20:, 2] += 45.0 - (points[:, 20, 2] - points[:, 19, 2]).max()
    assert Workshop(reference=True).whole(GridSurvey(points))


def test_scans_that_overlap_in_one_grid_are_refused():
    """Rocks would stop between the overlapping layers and never reach the road."""
    points = grid().points
    folded = GridSurvey(np.concatenate([points[:20], points[13:]]))
    with pytest.raises(TerrainError, match=r"folds back over itself in plan at 43 squares, by up to 6\.0 m at"):
        Workshop(reference=True).whole(folded)


def test_a_scan_whose_rows_alternate_in_direction_is_refused():
    points = grid().points.copy()
    points[1::2] = points[1::2, ::-1]
    with pytest.raises(TerrainError, match="publish one scan whose rows run in the same direction"):
        Workshop(reference=True).whole(GridSurvey(points))


@pytest.mark.parametrize("back", [0.6, 1.9])
def test_a_small_overhang_is_ground_and_a_wide_one_is_a_fold(back):
    """A column of points lies `back` (m) behind the previous column: less or more than FOLD."""
    points = grid().points.copy()
    points[:, 20, 0] = points[:, 19, 0] - back
    survey = GridSurvey(points)
    if back < 1.0:
        assert Workshop(reference=True).whole(survey)
    else:
        with pytest.raises(TerrainError, match="folds back"):
            Workshop(reference=True).whole(survey)


def test_a_scan_that_goes_back_in_steps_below_a_metre_is_refused_by_the_whole_way_back():
    """The scanner moves back and forth: no step is longer than 0.5 m, but 14 m are scanned twice."""
    points = grid(step=0.5).points
    nodding = GridSurvey(np.concatenate([points[:38], points[36:8:-1]]))
    with pytest.raises(TerrainError, match=r"folds back over itself in plan at 1,204 squares, by up to 14\.0 m"):
        Workshop(reference=True).whole(nodding)


def test_a_patch_with_heights_that_mean_no_data_is_refused_and_changes_nothing():
    """The terrain is wide, so that the patch does not extend far beyond it."""
    workshop = Workshop(reference=True)
    ground = workshop.whole(grid(80, 80, step=10.0))
    patch = with_no_data(grid(20, 40, 200.0, 200.0, seed=1), -400.0)
    with pytest.raises(TerrainError, match=CUT):
        workshop.patched(ground, patch)
    assert workshop.patched(ground, grid(20, 40, 200.0, 200.0, seed=1)).patches == 1


def test_a_facet_without_an_area_has_no_slope():
    survey = mesh(grid(step=3.0))
    line = np.array([[0.0, 0.0, 0.0], [30.0, 0.0, 30.0], [60.0, 0.0, 60.0]]) + survey.vertices.min(axis=0)
    with_line = MeshSurvey(
        np.concatenate([survey.vertices, line]),
        np.concatenate([survey.triangles, [np.arange(3) + len(survey.vertices)]]).astype(np.int32),
    )
    assert Workshop(reference=True).whole(with_line)


def test_layers_of_a_cloud_are_no_fold():
    points = np.concatenate([cloud(400, 0.0, 0.0, 20.0).points, cloud(400, 10.0, 0.0, 20.0, seed=1).points])
    assert Workshop(reference=True).whole(CloudSurvey(points))
