"""Tests of sources along lines of a file, and of sources with points in plan, above the ground."""

import json
from pathlib import Path

import numpy as np
import pytest
from input_files.mine_files import write_vector
from input_files.terrain_files import write_binary_stl

import rpf3d_core as rpf3d
from rpf3d_core.scene.reading import read_scene, scene_digest
from rpf3d_core.setup.warnings.extents import other_extents

SCENE = """\
terrain: {{up: {up}, files: [{{path: slope.stl}}]}}
materials: {{default: {{normal_restitution: 0.4, tangential_restitution: 0.8}}}}
sources: [{{name: crest, rocks: {rocks}, {source}}}]
outputs: {{pictures: false, recording: false}}
"""
LINES = [[[0.0, 0.0], [0.0, 6.0]], [[10.0, 8.0], [10.0, 10.0]]]
"""Two lines, 6 and 2 m long and 10 m apart."""


def slope(x: np.ndarray) -> np.ndarray:
    return 0.5 * x + 3.0


def write(folder: Path, source: str, up: str = "z", rocks: int = 400) -> Path:
    """Write a scene over a slope in x, with a file of two lines; return its path."""
    corners = np.array([[x, y, slope(x)] for x, y in ((-50, -50), (50, -50), (50, 50), (-50, 50))], dtype=float)
    turned = corners if up == "z" else np.stack([corners[:, 0], corners[:, 2], -corners[:, 1]], axis=1)
    write_binary_stl(folder / "slope.stl", turned[[[0, 1, 2], [0, 2, 3]]])
    geometry = {"type": "MultiLineString", "coordinates": LINES}
    (folder / "crest.geojson").write_text(json.dumps(geometry))
    (folder / "scene.yaml").write_text(SCENE.format(up=up, source=source, rocks=rocks))
    return folder / "scene.yaml"


def released(path: Path) -> np.ndarray:
    run = rpf3d.simulate(path, engine="reference")
    return run.terrain.frame.points_to_input(run.flights.deposits.release)


def refusal(path: Path) -> str:
    with pytest.raises(rpf3d.InputError) as caught:
        rpf3d.simulate(path, engine="reference")
    return str(caught.value)


@pytest.mark.parametrize("up", ["z", "y"])
def test_rocks_start_evenly_along_all_lines_of_a_file_and_not_between_them(tmp_path: Path, up: str) -> None:
    x = released(write(tmp_path, "line: crest.geojson, above_ground: 0.5", up))
    plan, height = (x[:, :2], x[:, 2]) if up == "z" else (x[:, ::2], x[:, 1])
    first = np.isclose(plan[:, 0], 0.0) & (plan[:, 1] >= 0.0) & (plan[:, 1] <= 6.0)
    second = np.isclose(plan[:, 0], 10.0) & (plan[:, 1] >= 8.0) & (plan[:, 1] <= 10.0)
    assert (first | second).all()
    assert first.mean() == pytest.approx(6.0 / 8.0, abs=4.0 * np.sqrt(0.75 * 0.25 / 400))
    np.testing.assert_allclose(height, slope(plan[:, 0]) + 0.5, atol=1e-9)


def test_a_geopackage_will_do_for_a_crest(tmp_path: Path) -> None:
    pytest.importorskip("pyogrio")
    shapely = pytest.importorskip("shapely")
    write_vector(tmp_path / "crest.gpkg", [shapely.LineString(LINES[0])], crs=None, layer="crest")
    x = released(write(tmp_path, "line: crest.gpkg, above_ground: 0.5"))
    assert (np.isclose(x[:, 0], 0.0) & (x[:, 1] >= 0.0) & (x[:, 1] <= 6.0)).all()


@pytest.mark.parametrize(
    ("source", "same"),
    [
        ("line: [[0, 0], [0, 6]], above_ground: 0.5", "line: [[0, 0, 77], [0, 6, 78]], above_ground: 0.5"),
        ("points: [[1, 2], [3, 4]], above_ground: 0.5", "points: [[1, 2, 0], [3, 4, 0]], above_ground: 0.5"),
    ],
)
def test_points_in_plan_start_where_points_with_any_height_start(tmp_path: Path, source: str, same: str) -> None:
    np.testing.assert_allclose(released(write(tmp_path, source)), released(write(tmp_path, same)), atol=1e-12)


def test_points_in_plan_are_x_and_z_where_y_is_up(tmp_path: Path) -> None:
    x = released(write(tmp_path, "points: [[4, -3]], above_ground: 1", "y", 1))
    np.testing.assert_allclose(x, [[4.0, slope(np.array(4.0)) + 1.0, -3.0]])


def test_a_file_of_lines_without_above_ground_is_refused_with_what_is_missing(tmp_path: Path) -> None:
    sentence = refusal(write(tmp_path, "line: crest.geojson"))
    assert "`sources[0].line` is a file of lines in plan, so it needs `above_ground`" in sentence


def test_points_in_plan_without_above_ground_are_refused(tmp_path: Path) -> None:
    assert "three numbers [x, y, z]" in refusal(write(tmp_path, "points: [[4, 3]]"))
    assert "`sources[0].line" in refusal(write(tmp_path, "line: [[4, 3], [5, 5]]"))


def test_a_file_without_lines_is_refused_before_the_terrain_is_read(tmp_path: Path) -> None:
    path = write(tmp_path, "line: crest.geojson, above_ground: 1")
    (tmp_path / "crest.geojson").write_text(json.dumps({"type": "Point", "coordinates": [0, 0]}))
    (tmp_path / "slope.stl").write_bytes(b"no mesh")
    assert "crest.geojson" in refusal(path)


def test_extents_and_digests_know_the_file_of_a_line(tmp_path: Path) -> None:
    path = write(tmp_path, "line: crest.geojson, above_ground: 1")
    scene = read_scene(path)
    (extent,) = other_extents(scene)
    assert extent.file == tmp_path / "crest.geojson"
    assert extent.low[:2].tolist() == [0.0, 0.0] and extent.high[:2].tolist() == [10.0, 10.0]
    before = scene_digest(scene)
    (tmp_path / "crest.geojson").write_text(json.dumps({"type": "LineString", "coordinates": LINES[0]}))
    assert scene_digest(read_scene(path)) != before
