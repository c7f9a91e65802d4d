import numpy as np
import pytest
from input_files.terrain_files import grid
from shapely.geometry import MultiPolygon, box

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.zones import centroids_in_plan, covered, in_plan, with_zone


def square_terrain(frame):
    vertices, triangles = grid(5, 5)
    return Terrain(vertices, triangles, np.zeros(len(triangles), np.int32), ("ground",), frame)


@pytest.mark.parametrize(
    ("frame", "polygon"),
    [
        (Frame((1000.0, 2000.0, 0.0), "z"), box(1000, 2000, 1001, 2004)),
        (Frame((1000.0, -2000.0, 0.0), "y"), box(1000, 1996, 1001, 2000)),
    ],
    ids=["z up: x y", "y up: x z"],
)
def test_a_polygon_in_input_plan_coordinates_covers_the_facets_above_it(frame, polygon):
    terrain = square_terrain(frame)
    inside = covered(MultiPolygon([polygon]), centroids_in_plan(terrain))
    centroids = terrain.vertices[terrain.triangles].mean(axis=1)
    assert np.array_equal(inside, centroids[:, 0] < 1.0)


def test_plan_coordinates_leave_out_the_axis_that_is_up():
    point = np.array([[1.0, 2.0, 3.0]])
    assert in_plan(Frame(), point).tolist() == [[1.0, 2.0]]
    assert in_plan(Frame(up="y"), point).tolist() == [[1.0, -2.0]]


def test_a_new_zone_comes_last_and_a_known_one_keeps_its_number():
    terrain = square_terrain(Frame())
    half = np.arange(len(terrain.triangles)) < 10
    spill = with_zone(terrain, "spill", half)
    assert spill.zones == ("ground", "spill")
    assert np.array_equal(spill.zone, half.astype(int))
    again = with_zone(spill, "ground", half)
    assert again.zones == spill.zones
    assert not again.zone.any()
    assert not terrain.zone.any()
