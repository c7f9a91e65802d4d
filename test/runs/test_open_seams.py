"""Tests that vertices close to a side of another facet, but not on it, are reported: rocks can fall through there."""

import numpy as np
import pytest
from scenes_of_facets import rough_grid, terrain_of

from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup import open_seams as open_seams_module
from rpf3d_core.setup.open_seams import open_seams, seams_of
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.facets import Terrain, tolerance_of
from rpf3d_core.terrain.mesh.edges import edges_of


def two_sheets(offset: tuple[float, float, float], side: float = 10.0) -> Terrain:
    """Return two level facets along a side (m); the second is cut in two at its middle, which is moved by an offset."""
    middle = (0.0 + offset[0], side / 2 + offset[1], offset[2])
    corners = [(0, 0, 0), (0, side, 0), (-side, 0, 0), (side, side / 2, 0), middle]
    return terrain_of(corners, [(0, 1, 2), (0, 3, 4), (4, 3, 1)])


def seams(terrain: Terrain) -> tuple[np.ndarray, np.ndarray]:
    vertex, gap, _ = seams_of(terrain, edges_of(terrain.triangles, len(terrain.vertices)))
    return vertex, gap


@pytest.mark.parametrize("offset", [(0.001, 0, 0), (-0.001, 0, 0), (0, 0, 0.001), (0, 0, -0.001), (6e-4, 0, -8e-4)])
def test_a_t_junction_that_was_rounded_is_an_open_seam_of_its_width(offset):
    vertex, gap = seams(two_sheets(offset))
    assert vertex.tolist() == [4]
    assert gap == pytest.approx([0.001])


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_crack_that_no_rock_falls_through_is_none(share):
    crack = 64.0 * tolerance_of(two_sheets((0, 0, 0)))
    assert not len(seams(two_sheets((share * crack, 0, 0)))[0])
    assert len(seams(two_sheets((2.0 * crack, 0, 0)))[0])


@pytest.mark.parametrize(("offset", "side"), [((0.06, 0, 0), 10.0), ((0.011, 0, 0), 1.0), ((0, 0, 0.3), 100.0)])
def test_a_wide_gap_is_a_hole_or_a_step_and_no_seam(offset, side):
    assert not len(seams(two_sheets(offset, side))[0])


def test_a_needle_at_the_rim_is_no_seam():
    needle = terrain_of([(0, 0, 0), (10, 0, 0), (5, 0.001, 0)], [(0, 1, 2)])
    assert not len(seams(needle)[0])


@pytest.mark.parametrize("spacing", [0.001, 0.03, 1.0, 40.0])
def test_a_grid_has_no_seams_however_fine(spacing):
    assert not len(seams(rough_grid(8, 8.0 * spacing, 0.3, 0.3 * spacing))[0])


def test_the_warning_has_the_number_and_the_widest_place():
    first, second = two_sheets((0.001, 0, 0)), two_sheets((0.002, 0, 0))
    corners = np.concatenate([first.vertices, second.vertices + np.array([100.0, 0.0, 0.0])])
    both = terrain_of(corners, np.concatenate([first.triangles, second.triangles + len(first.vertices)]))
    (sentence,) = open_seams(both, edges_of(both.triangles, len(both.vertices)))
    assert sentence.startswith("2 vertices lie close to a side of another facet, but not on it: up to 2 mm off")
    assert "(100.002, 5.000, 0.000)" in sentence


def test_of_a_long_rim_evenly_spread_sides_are_searched(monkeypatch):
    monkeypatch.setattr(open_seams_module, "MOST_SIDES", 3)
    terrain = two_sheets((0.001, 0, 0))
    edges = edges_of(terrain.triangles, len(terrain.vertices))
    assert seams_of(terrain, edges)[2]
    for sentence in open_seams(terrain, edges):
        assert sentence.startswith("at least 1 vertex lies close")


def test_a_file_with_rounded_t_junctions_is_reported_when_it_is_read(tmp_path):
    """The surface is exact; only the three decimals of the file open the seam."""
    lines = ["v 0 0 0", "v 0 9.97 7.31", "v -10 0 0", "v 10 5 3", f"v 0 {9.97 / 3:.3f} {7.31 / 3:.3f}"]
    (tmp_path / "cut.obj").write_text("\n".join([*lines, "f 1 2 3", "f 1 4 5", "f 5 4 2"]))
    (tmp_path / "scene.yaml").write_text(
        "terrain: {files: [{path: cut.obj}], crs: EPSG:32719}\n"
        "materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}\n"
        "sources: [{name: one, points: [[1, 4]], above_ground: 1}]\n"
    )
    _, report = read_terrain(read_scene(tmp_path / "scene.yaml"))
    assert any(remark.startswith("1 vertex lies close to a side of another facet") for remark in report.remarks)
