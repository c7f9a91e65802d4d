import dataclasses

import numpy as np
import pytest
from input_files.terrain_files import grid

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.faults import fault_report
from rpf3d_core.terrain.mesh.winding import repair_winding

SQUARE = np.array([[0.0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]])
HALVES = [[0, 1, 2], [0, 2, 3]]

ROUNDING = 1e-12  # largest relative error of a sum of the areas of a few hundred facets


def report_on(vertices, triangles, zone=None, zones=("ground",), frame=None):
    triangles = np.array(triangles, dtype=np.int32)
    zone = np.zeros(len(triangles), np.int32) if zone is None else np.array(zone, np.int32)
    edges = edges_of(triangles, len(vertices))
    winding = repair_winding(vertices, triangles, edges)
    terrain = Terrain(vertices, winding.triangles, zone, zones, frame or Frame())
    return fault_report(terrain, winding, edges, ("square.stl",))


def test_a_sound_square_has_no_faults():
    report = report_on(SQUARE, HALVES)
    assert (report.triangles, report.vertices, report.edges, report.boundary_edges) == (2, 4, 5, 4)
    assert report.area == pytest.approx(4.0, rel=ROUNDING)
    faults = (report.holes, report.non_manifold_edges, report.zero_area_facets, report.duplicate_facets)
    assert faults == (0, 0, 0, 0)
    assert report.pieces == 1
    assert report.flipped_facets == 0
    assert report.steepest_deg == 0.0
    assert report.median_edge == 2.0


def test_areas_are_told_by_zone_and_add_up():
    report = report_on(SQUARE, HALVES, zone=[1, 0], zones=("a", "b", "empty"))
    assert report.area_by_zone == {"a": 2.0, "b": 2.0, "empty": 0.0}


def test_facets_without_area_are_counted_and_kept():
    vertices = np.concatenate([SQUARE, [[1.0, 0, 0], [0.1, 0.3, 0.7], [0.2, 0.6, 1.4], [0.3, 0.9, 2.1]]])
    report = report_on(vertices, [*HALVES, [0, 1, 4], [2, 2, 3], [5, 6, 7]])
    assert report.zero_area_facets == 3
    assert report.triangles == 5


def test_a_facet_is_a_duplicate_on_the_same_vertices_in_any_order():
    report = report_on(SQUARE, [*HALVES, [2, 0, 1], [1, 0, 2], [0, 2, 3]])
    assert report.duplicate_facets == 3


def test_an_edge_of_three_facets_is_non_manifold_and_still_holds_them_together():
    vertices = np.concatenate([SQUARE, [[1.0, 1, 5]]])
    report = report_on(vertices, [*HALVES, [0, 2, 4]])
    assert report.non_manifold_edges == 1
    assert report.pieces == 1


def test_holes_are_rings_of_boundary_besides_the_outer_one():
    vertices, triangles = grid(8, 8)
    squares = triangles.reshape(7, 7, 2, 3)
    kept = np.ones((7, 7), bool)
    kept[2, 2] = kept[4, 4:6] = False
    report = report_on(vertices, squares[kept].reshape(-1, 3))
    assert report.holes == 2
    assert report.boundary_edges == 4 * 7 + 4 + 6
    two = np.concatenate([vertices, vertices + np.array([100, 0, 0])])
    report = report_on(two, np.concatenate([squares[kept].reshape(-1, 3), triangles + len(vertices)]))
    assert (report.pieces, report.holes) == (2, 2)


def test_the_extent_is_told_in_the_axes_of_the_input():
    report = report_on(SQUARE + np.array([0, 0, 9]), HALVES, frame=Frame((10.0, 20.0, 30.0), "y"))
    assert report.low == (10.0, 39.0, -22.0)
    assert report.high == (12.0, 39.0, -20.0)


def test_steepness_counts_overhangs_beyond_a_right_angle():
    wall = np.array([[0.0, 0, 0], [4, 0, 0], [3, 0, -4], [0, 1, 0], [4, 1, 0], [3, 1, -4]])
    report = report_on(wall, [[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    assert report.steepest_deg == pytest.approx(180 - np.degrees(np.arctan2(4, 1)), rel=ROUNDING)


def test_the_report_cannot_be_changed_and_reads_as_lines():
    report = report_on(SQUARE, HALVES)
    with pytest.raises(dataclasses.FrozenInstanceError):
        report.triangles = 3
    text = "\n".join(report.describe())
    assert all(word in text for word in ("square.stl", "boundary edges      4", "area                4 m2 (ground 4)"))


def test_zones_that_differ_in_a_number_are_one_entry_of_the_report():
    zones = ("bench_1", "ramp", "bench_2", "bench_30", "area_7")
    report = report_on(SQUARE, [*HALVES, *HALVES, HALVES[0]], zone=[0, 1, 2, 3, 4], zones=zones)
    assert "(bench_* (3 zones) 6, ramp 2, area_7 2)" in report.describe()[2]
    assert list(report.area_by_zone) == list(zones)
