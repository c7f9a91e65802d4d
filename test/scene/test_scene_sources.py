"""Tests of sources over a terrain: polygons, zones, directions in the input's axes, and refusals."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import write_binary_stl

import rpf3d_core as rpf3d
from rpf3d_core.setup.sources import scene_sources
from rpf3d_core.terrain.clipping import areas_of
from rpf3d_core.terrain.zones import in_plan

SCENE = """\
terrain: {{up: {up}, files: [{{path: flat.stl, zone: berm_1}}, {{path: face.stl, zone: face_1}}]}}
materials: {{default: {{normal_restitution: 0.5, tangential_restitution: 0.8}}}}
sources:
  - {{name: first, points: [[0, 0, 0]], above_ground: 1}}
  - {{name: area, rocks: 500, {source}}}
"""
ON_THE_GROUND = 1e-9
"""Largest error (m) of places that are computed from coordinates of tens of metres."""
STEEP = math.degrees(math.atan(2.0))


def write_terrain(folder: Path, up: str) -> None:
    """Write a level berm, x from -10 to 10 m, and a face that falls by 2 m per metre, x from 10 to 15 m, as STL."""
    flat = np.array([[-10, -8, 0], [10, -8, 0], [10, 8, 0], [-10, 8, 0]], dtype=float)
    face = np.array([[10, -8, 0], [15, -8, -10], [15, 8, -10], [10, 8, 0]], dtype=float)
    for name, corners in (("flat", flat), ("face", face)):
        turned = corners if up == "z" else np.stack([corners[:, 0], corners[:, 2], -corners[:, 1]], axis=1)
        write_binary_stl(folder / f"{name}.stl", turned[[[0, 1, 2], [0, 2, 3]]])


def read(folder: Path, source: str, up: str = "z") -> rpf3d.Run:
    write_terrain(folder, up)
    (folder / "scene.yaml").write_text(SCENE.format(source=source, up=up))
    return rpf3d.simulate(folder / "scene.yaml", engine="reference")


def refusal(folder: Path, source: str) -> str:
    with pytest.raises(rpf3d.InputError) as caught:
        read(folder, source)
    return str(caught.value).replace(f"{folder}/", "")


def released(run: rpf3d.Run) -> np.ndarray:
    """Return the release points (N, 3) m of the second source's rocks, in the input's coordinates."""
    deposits = run.flights.deposits
    return run.terrain.frame.points_to_input(deposits.release[deposits.source == 1])


@pytest.mark.parametrize("up", ["z", "y"])
@pytest.mark.parametrize("how", ["corners", "file"])
def test_a_polygon_is_drawn_in_the_plan_of_the_input(tmp_path: Path, how: str, up: str) -> None:
    corners = [[8.0, -2.0], [12.0, -2.0], [12.0, 5.0], [8.0, 5.0]]
    rings = {"type": "Polygon", "coordinates": [[*corners, corners[0]]]}
    (tmp_path / "scar.geojson").write_text(json.dumps(rings))
    run = read(tmp_path, f"polygon: {'scar.geojson' if how == 'file' else corners}", up)
    x = released(run)
    plan, height = (x[:, :2], x[:, 2]) if up == "z" else (x[:, ::2], x[:, 1])
    assert plan.min(axis=0) == pytest.approx([8.0, -2.0], abs=0.2)
    assert plan.max(axis=0) == pytest.approx([12.0, 5.0], abs=0.2)
    np.testing.assert_allclose(height, np.minimum(0.0, 20.0 - 2.0 * plan[:, 0]), atol=ON_THE_GROUND)
    share = math.sqrt(5.0) / (1.0 + math.sqrt(5.0))  # of the true area; in plan the face has half
    assert (plan[:, 0] > 10.0).mean() == pytest.approx(share, abs=4.0 * math.sqrt(share * (1 - share) / 500))


@pytest.mark.parametrize(("up", "header"), [("z", "name,easting,northing"), ("y", "name,x,z")])
def test_a_file_of_points_in_plan_will_do_for_rocks_that_start_above_the_ground(
    tmp_path: Path, up: str, header: str
) -> None:
    (tmp_path / "holes.csv").write_text(f"{header}\nBlock 30,12,3\n")
    x = released(read(tmp_path, "points_file: holes.csv, above_ground: 1", up))
    expected = [12.0, 3.0, -3.0] if up == "z" else [12.0, -3.0, 3.0]
    np.testing.assert_allclose(x, np.tile(expected, (500, 1)), atol=ON_THE_GROUND)
    with pytest.raises(rpf3d.InputError, match=r"holes.csv, line 1: a header must name x, y and z once each"):
        read(tmp_path, "points_file: holes.csv", up)


def test_a_hole_in_a_polygon_and_parts_that_overlap_are_respected(tmp_path: Path) -> None:
    def square(west: float, south: float, side: float) -> list[list[float]]:
        ring = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
        return [[west + side * u, south + side * v] for u, v in ring]

    parts = [[square(-6, -6, 8), square(-4, -4, 2)], [square(-1, -6, 8)]]
    (tmp_path / "parts.geojson").write_text(json.dumps({"type": "FeatureCollection", "features": [
        {"type": "Feature", "geometry": {"type": "Polygon", "coordinates": part}} for part in parts]}))  # fmt: skip
    run = read(tmp_path, "polygon: parts.geojson")
    plan = released(run)[:, :2]
    assert not (np.abs(plan + 3.0) < 1.0).all(axis=1).any()
    source = scene_sources(run.scene, run.terrain)[1]
    assert source.triangles is not None
    assert source.triangles.reached[-1] == pytest.approx(64 - 4 + 64 - 3 * 8, rel=1e-12)


def test_the_steep_facets_of_a_zone_are_a_source(tmp_path: Path) -> None:
    for source, share in ((f"zone: '*', steeper_than_deg: {STEEP - 0.1}", 1.0), ("zone: face_1", 1.0)):
        assert (released(read(tmp_path, source))[:, 0] > 10.0).mean() == share
    mixed = (released(read(tmp_path, "zone: '*'"))[:, 0] > 10.0).mean()
    expected = 80.0 * math.sqrt(5.0) / (320.0 + 80.0 * math.sqrt(5.0))
    assert mixed == pytest.approx(expected, abs=4.0 * math.sqrt(expected * (1 - expected) / 500))


@pytest.mark.parametrize(
    ("source", "sentence"),
    [
        ("polygon: [[100, 0], [110, 0], [110, 10]]",
         "`sources[1].polygon` lies off the terrain: it goes from (100, 0) to (110, 10), the terrain from (-10, -8)"),
        ("zone: fase", "`sources[1].zone` is 'fase', but the zones are berm_1, face_1; did you mean 'face_1'?"),
        ("zone: FACES_*", "`sources[1].zone` is 'FACES_*', but the zones are berm_1, face_1; did you mean 'face_1'?"),
        (f"zone: '*', steeper_than_deg: {STEEP + 0.1}",
         "`sources[1].steeper_than_deg` is 63.5349, but the steepest facet of '*' has 63.4 degrees"),
        ("polygon: empty.geojson", "`sources[1].polygon` names a file that cannot be used: empty.geojson: holds"),
    ],
)  # fmt: skip
def test_an_area_without_facets_is_refused_with_what_there_is(tmp_path: Path, source: str, sentence: str) -> None:
    (tmp_path / "empty.geojson").write_text('{"type": "FeatureCollection", "features": []}')
    assert re.match(rf"scene\.yaml, line \d+: {re.escape(sentence)}", refusal(tmp_path, source))


@pytest.mark.parametrize("steep", ["", ", steeper_than_deg: 10"])
def test_a_zone_whose_facets_have_no_area_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, steep: str
) -> None:
    thin = np.array([[[-5.0, 0.0, 0.0], [0.0, 0.0, 0.0], [5.0, 0.0, 0.0]]])  # a break line that is saved as a triangle
    write_binary_stl(tmp_path / "thin.stl", thin)
    with_thin = SCENE.replace("zone: face_1}}", "zone: face_1}}, {{path: thin.stl, zone: thin}}")
    monkeypatch.setattr(f"{__name__}.SCENE", with_thin)
    sentence = refusal(tmp_path, f"zone: thin{steep}")
    assert "`sources[1].zone` is 'thin', but no facet of this zone has an area" in sentence


@pytest.mark.parametrize(("up", "north"), [("z", [0, 1, 0]), ("y", [0, 0, -1])])
def test_azimuth_zero_is_north_in_the_axes_of_the_input(tmp_path: Path, up: str, north: list[float]) -> None:
    run = read(tmp_path, "zone: berm_1, speed: 3, azimuth_deg: 0, above_ground: 1", up)
    first = np.searchsorted(run.flights.paths.row, 1)
    v = run.terrain.frame.directions_to_input(run.flights.paths.v[first])
    np.testing.assert_allclose(v, 3.0 * np.array(north), atol=1e-12)


def test_a_source_that_is_dealt_no_rock_leaves_the_draws_and_names_of_the_others_alone(tmp_path: Path) -> None:
    whole = read(tmp_path, "zone: face_1")
    few = rpf3d.simulate(whole.scene, rocks=100, engine="reference")
    assert set(few.flights.deposits.source.tolist()) == {1}, "the first source has 1 rock of 501"
    np.testing.assert_array_equal(released(few), released(whole)[:100])


def test_patches_are_parts_of_the_terrain(tmp_path: Path) -> None:
    run = read(tmp_path, "polygon: [[-3, -3], [3, -3], [0, 4]]")
    source = scene_sources(run.scene, run.terrain)[1]
    assert source.triangles is not None
    assert areas_of(source.triangles.corners).sum() == pytest.approx(21.0, rel=1e-12)
    assert in_plan(run.terrain.frame, source.triangles.corners.reshape(-1, 3)).max() == pytest.approx(4.0)
