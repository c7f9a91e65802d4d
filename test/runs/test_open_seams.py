"""Tests that open seams of the terrain are closed when it is read, and reported as closed or as still open."""

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from flights.scenes_of_facets import rough_grid, terrain_of
from programs.command_line import call

from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.setup.warnings.open_seams import open_seams
from rpf3d_core.terrain import closed_seams
from rpf3d_core.terrain.closed_seams import Seams, with_closed_seams
from rpf3d_core.terrain.facets import Terrain, tolerance_of
from rpf3d_core.terrain.mesh.edges import edges_of
from rpf3d_core.terrain.mesh.faults import FaultReport


def two_sheets(offset: tuple[float, float, float], side: float = 10.0) -> Terrain:
    """Return two level facets along a side (m); the second is cut in two at its middle, which is moved by an offset."""
    middle = (0.0 + offset[0], side / 2 + offset[1], offset[2])
    corners = [(0, 0, 0), (0, side, 0), (-side, 0, 0), (side, side / 2, 0), middle]
    return terrain_of(corners, [(0, 1, 2), (0, 3, 4), (4, 3, 1)])


def seams(terrain: Terrain) -> Seams:
    return with_closed_seams(terrain, edges_of(terrain.triangles, len(terrain.vertices))).seams


OFFSETS = [(1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1), (0.6, 0, -0.8)]


@pytest.mark.parametrize("offset", OFFSETS)
def test_a_t_junction_that_was_rounded_is_a_closed_seam_of_its_width(offset):
    found = seams(two_sheets(tuple(0.001 * c for c in offset)))
    assert (found.closed, found.vertex.tolist()) == (1, [])
    assert found.widest == pytest.approx(0.001)


@pytest.mark.parametrize("offset", OFFSETS)
def test_a_wider_seam_stays_open_with_its_width(offset):
    found = seams(two_sheets(tuple(0.03 * c for c in offset)))
    assert (found.closed, found.vertex.tolist()) == (0, [4])
    assert found.gap == pytest.approx([0.03])


@pytest.mark.parametrize("share", [0.0, 0.5])
def test_a_crack_that_no_rock_falls_through_is_none(share):
    crack = 64.0 * tolerance_of(two_sheets((0, 0, 0)))
    assert not seams(two_sheets((share * crack, 0, 0))).closed
    assert seams(two_sheets((2.0 * crack, 0, 0))).closed


@pytest.mark.parametrize(("offset", "side"), [((0.06, 0, 0), 10.0), ((0.021, 0, 0), 1.0), ((0, 0, 0.3), 100.0)])
def test_a_wide_gap_is_a_hole_or_a_step_and_no_seam(offset, side):
    found = seams(two_sheets(offset, side))
    assert not len(found.vertex) and not found.closed


def test_a_needle_at_the_rim_is_no_seam():
    needle = terrain_of([(0, 0, 0), (10, 0, 0), (5, 0.001, 0)], [(0, 1, 2)])
    found = seams(needle)
    assert not len(found.vertex) and not found.closed


@pytest.mark.parametrize("spacing", [0.001, 0.03, 1.0, 40.0])
def test_a_grid_has_no_seams_however_fine(spacing):
    found = seams(rough_grid(8, 8.0 * spacing, 0.3, 0.3 * spacing))
    assert not len(found.vertex) and not found.closed


def test_the_warning_has_the_number_and_the_widest_place():
    first, second = two_sheets((0.03, 0, 0)), two_sheets((0.04, 0, 0))
    corners = np.concatenate([first.vertices, second.vertices + np.array([100.0, 0.0, 0.0])])
    both = terrain_of(corners, np.concatenate([first.triangles, second.triangles + len(first.vertices)]))
    (sentence,) = open_seams(both, seams(both))
    assert sentence.startswith("2 vertices lie close to a side of another facet, but not on it: up to 40 mm off")
    assert "(100.040, 5.000, 0.000)" in sentence


def test_of_a_long_rim_evenly_spread_sides_are_searched_and_none_is_closed(monkeypatch):
    monkeypatch.setattr(closed_seams, "MOST_SIDES", 3)
    monkeypatch.setattr(closed_seams, "SAMPLED", 7)
    terrain = two_sheets((0.001, 0, 0))
    found = seams(terrain)
    assert found.sampled and not found.closed
    (sentence,) = open_seams(terrain, found)
    assert sentence.startswith("at least 1 vertex lies close")


def scene_of(folder: Path, *offsets: float) -> Path:
    """Write a scene of a facet whose side of 12 m has vertices near it; return its path.

    offsets : m, of each vertex from the side, in the plane of the facet
    """
    inside = [(offset, 9.97 * (n + 1) / 3, 7.31 * (n + 1) / 3) for n, offset in enumerate(offsets)]
    places = [(0, 0, 0), (0, 9.97, 7.31), (-10, 0, 0), (10, 5, 3), *inside]
    chain = [1, *range(5, 5 + len(inside)), 2]
    lines = [f"v {x:.3f} {y:.3f} {z:.3f}" for x, y, z in places]
    lines += ["f 1 2 3", *(f"f {a} 4 {b}" for a, b in pairwise(chain))]
    (folder / "cut.obj").write_text("\n".join(lines))
    (folder / "scene.yaml").write_text(
        "terrain: {files: [{path: cut.obj, zone: face}], crs: EPSG:32719}\n"
        "materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8}}\n"
        "sources: [{name: one, points: [[1, 4]], above_ground: 1}]\n"
        "outputs: {pictures: false, recording: false}\n"
    )
    return folder / "scene.yaml"


def test_a_file_with_rounded_t_junctions_is_closed_when_it_is_read(tmp_path):
    """The surface is exact; only the three decimals of the file open the seam."""
    terrain, report = read_terrain(read_scene(scene_of(tmp_path, 0.0)))
    assert not any("close to a side" in remark for remark in report.remarks)
    assert report.triangles == len(terrain.triangles) == 4 and report.pieces == 1
    assert report.describe()[-1] == "closed seams        1 (up to 0.466 mm wide; 1 facet added)"
    assert terrain.zone.tolist() == [0] * 4


def test_a_file_with_a_wider_gap_is_read_as_it_is_with_a_warning(tmp_path):
    terrain, report = read_terrain(read_scene(scene_of(tmp_path, 0.03)))
    assert len(terrain.triangles) == 3
    assert any(remark.startswith("1 vertex lies close to a side of another facet") for remark in report.remarks)
    assert not any(line.startswith("closed seams") for line in report.describe())


def test_a_report_without_closed_seams_has_no_keys_of_them(tmp_path):
    _, report = read_terrain(read_scene(scene_of(tmp_path)))
    assert type(report) is FaultReport


def test_check_and_run_print_the_closed_seams_and_the_summary_has_them(tmp_path, monkeypatch, capsys):
    path = scene_of(tmp_path, 0.0, 0.002)
    assert call(monkeypatch, "check", path) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "closed seams 2 (up to 2" in printed and "close to a side" not in printed
    assert call(monkeypatch, "run", path, "--out", tmp_path / "out") == 0
    assert "closed seams of the terrain: 2 (up to 2" in " ".join(capsys.readouterr().out.split())
    (summary,) = (tmp_path / "out").rglob("summary.json")
    terrain = json.loads(summary.read_text())["terrain"]
    assert terrain["triangles"] == terrain["faults"]["triangles"] == 6
    assert (terrain["faults"]["closed_seams"], terrain["faults"]["added_facets"]) == (2, 2)
    assert terrain["faults"]["widest_closed_seam"] == pytest.approx(0.002, abs=1e-3)
