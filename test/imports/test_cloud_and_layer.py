"""Tests of `rpf3d import cloud`, which writes a terrain, and `rpf3d import layer`, which writes GeoJSON."""

import json
import math
import sys
from pathlib import Path

import numpy as np
import pytest
import shapely
from input_files.mine_files import EAST, NORTH, write_las, write_surpac, write_vector
from input_files.terrain_files import scene_of
from typer.testing import CliRunner

from rpf3d_core import cli, imports
from rpf3d_core.errors import InputError
from rpf3d_core.formats.mine import vector_files
from rpf3d_core.formats.mine.cloud import Cloud
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.formats.polylines import read_lines, read_lines_with_heights
from rpf3d_core.formats.reference_system import stated_reference_system
from rpf3d_core.imports.cloud import import_cloud
from rpf3d_core.imports.layer import import_layer
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.terrain.cloud_surface import CloudChoice


def points_of_hill(count: int = 5_000) -> np.ndarray:
    plan = np.random.default_rng(3).random((count, 2)) * 60.0
    points = np.column_stack([plan, 5.0 * np.sin(plan[:, 0] / 9.0)]) + np.array([EAST, NORTH, 800.0])
    return np.round(points, 3)


def test_two_clouds_become_one_terrain_with_every_digit(tmp_path):
    points = points_of_hill()
    np.savetxt(tmp_path / "a.xyz", points[:2_000], "%.3f")
    np.savetxt(tmp_path / "b.csv", points[2_000:], "%.3f", ",", header="x,y,z", comments="")
    made = import_cloud([tmp_path / "a.xyz", tmp_path / "b.csv"], tmp_path / "t.vtp", CloudChoice(cell=1.5))
    terrain, faults = read_terrain(scene_of(tmp_path / "t.vtp"))
    there = {tuple(point) for point in points.tolist()}
    back = np.round(terrain.frame.points_to_input(terrain.vertices), 3)
    assert all(tuple(point) in there for point in back.tolist())
    assert faults.triangles == len(made.surface.triangles) and faults.holes == len(made.surface.holes)
    assert faults.remarks == () and faults.flipped_facets == 0 and made.warnings == ()


def test_the_command_prints_density_holes_and_reference_system(tmp_path, monkeypatch, capsys):
    pytest.importorskip("laspy", reason="laspy is not installed: it is in the extra `mine`")
    classes = np.where(np.arange(5_000) % 2, 2, 5).astype(np.uint8)
    write_las(tmp_path / "a.laz", points_of_hill(), classes, crs=32719)
    arguments = ["import", "cloud", str(tmp_path / "a.laz"), "--out", str(tmp_path / "t.stl"), "--cell", "2"]
    monkeypatch.setattr(sys, "argv", ["rpf3d", *arguments])
    with pytest.raises(SystemExit) as end:
        cli.main()
    assert end.value.code == 0
    printed = capsys.readouterr()
    assert "5,000 points, 2,500 of them ground" in printed.out and "EPSG:32719" in printed.out
    assert "small holes closed" in printed.out and (tmp_path / "t.stl").exists()
    assert "t.stl: its coordinates have single precision" in printed.err


def test_classes_are_refused_with_the_file_that_has_none(tmp_path):
    pytest.importorskip("laspy", reason="laspy is not installed: it is in the extra `mine`")
    write_las(tmp_path / "a.laz", points_of_hill(), np.full(5_000, 2, np.uint8))
    np.savetxt(tmp_path / "b.xyz", points_of_hill(), "%.3f")
    with pytest.raises(InputError, match=r"b\.xyz: has no classes of points \(a text file needs a header with"):
        import_cloud([tmp_path / "a.laz", tmp_path / "b.xyz"], tmp_path / "t.vtp", CloudChoice(classes=(2,)))


def degrees_of(east: float, north: float) -> tuple[float, float]:
    """Return longitude and latitude (degrees) of a place (m) in UTM zone 19 south, WGS84, by Krueger's series.

    Karney 2011, Transverse Mercator with an accuracy of a few nanometers, equations 7 to 12 and table 1, order 4.
    """
    f = 1 / 298.257223563
    n = f / (2 - f)
    a = 6378137.0 / (1 + n) * (1 + n**2 / 4 + n**4 / 64)
    beta = (n / 2 - 2 * n**2 / 3 + 37 * n**3 / 96, n**2 / 48 + n**3 / 15, 17 * n**3 / 480)
    xi, eta = (north - 1e7) / (0.9996 * a), (east - 5e5) / (0.9996 * a)
    xi2 = xi - sum(b * math.sin(2 * j * xi) * math.cosh(2 * j * eta) for j, b in enumerate(beta, 1))
    eta2 = eta - sum(b * math.cos(2 * j * xi) * math.sinh(2 * j * eta) for j, b in enumerate(beta, 1))
    conformal = math.asin(math.sin(xi2) / math.cosh(eta2))
    e = math.sqrt(f * (2 - f))
    latitude = conformal
    for _ in range(20):
        s = math.sin(latitude)
        latitude = 2 * math.atan(
            math.tan(math.pi / 4 + conformal / 2) * ((1 + e * s) / (1 - e * s)) ** (e / 2)
        ) - math.pi / 2  # fmt: skip
    return -69.0 + math.degrees(math.atan2(math.sinh(eta2), math.cos(xi2))), math.degrees(latitude)


def test_areas_in_degrees_are_transformed_to_the_terrain(tmp_path):
    pytest.importorskip("pyproj", reason="pyproj is not installed: it is in the extra `mine`")
    corners = [(EAST, NORTH), (EAST + 100.0, NORTH), (EAST + 100.0, NORTH + 50.0)]
    ring = [list(degrees_of(*corner)) for corner in (*corners, corners[0])]
    (tmp_path / "a.geojson").write_text(json.dumps({"type": "Polygon", "coordinates": [ring]}))
    out = tmp_path / "b.geojson"
    with pytest.raises(InputError, match="states no coordinate reference system; name it with --from"):
        import_layer(tmp_path / "a.geojson", out, end="EPSG:32719")
    assert import_layer(tmp_path / "a.geojson", out, begin="EPSG:4326", end="EPSG:32719") == (1, ())
    found = shapely.get_coordinates(read_polygons(out))
    assert np.abs(found - [*corners, corners[0]]).max() < 1e-3
    assert stated_reference_system(out) == "EPSG:32719"


def test_a_layer_of_a_geopackage_is_written_with_its_reference_system(tmp_path):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    path = write_vector(tmp_path / "a.gpkg", [shapely.box(0, 0, 1, 2)], layer="walls")
    write_vector(path, [shapely.box(5, 5, 8, 9)], layer="dumps")
    import_layer(path, tmp_path / "dumps.geojson", layer="dumps")
    assert read_polygons(tmp_path / "dumps.geojson").bounds == (5, 5, 8, 9)
    assert stated_reference_system(tmp_path / "dumps.geojson") == "EPSG:32719"
    with pytest.raises(InputError, match="has no layer 'roads'; it has walls"):
        import_layer(path, tmp_path / "c.geojson", layer="roads")


@pytest.mark.parametrize("kept", [vector_files.MOST_KEPT, 0])
def test_each_layer_of_a_geopackage_has_its_own_reference_system(tmp_path, monkeypatch, kept):
    """This holds also if one process imports several layers of a file, or the layers are too large to be cached."""
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    monkeypatch.setattr(vector_files, "MOST_KEPT", kept)
    systems = {"walls": "EPSG:31287", "dumps": "EPSG:32719", "roads": "EPSG:32633"}
    for layer, system in systems.items():
        path = write_vector(tmp_path / "a.gpkg", [shapely.box(0, 0, 1, 2)], layer=layer, crs=system)
    for layer, system in systems.items():
        import_layer(path, tmp_path / f"{layer}.geojson", layer=layer)
        assert stated_reference_system(tmp_path / f"{layer}.geojson") == system


def test_a_line_and_a_polygon_of_one_geopackage_have_their_own_reference_systems(tmp_path):
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    path = write_vector(tmp_path / "a.gpkg", [shapely.box(0, 0, 1, 2)], layer="walls", crs="EPSG:31287")
    write_vector(path, [shapely.LineString([(0, 0), (1, 2)])], layer="crest")
    assert read_polygons(path) and read_lines(path)
    assert [stated_reference_system(path, kind) for kind in ("polygon", "line")] == ["EPSG:31287", "EPSG:32719"]


CREST = [[0.0, 0.0, 812.5], [30.0, 1.0, 813.25], [60.0, -2.0, 815.0]]
"""Points (m) of a crest line with heights."""


def write_crest(path: Path) -> Path:
    """Write the line CREST to a GeoJSON, GeoPackage, Shapefile, DXF or Surpac file."""
    if path.suffix == ".geojson":
        path.write_text(json.dumps({"type": "LineString", "coordinates": CREST}))
    elif path.suffix == ".dxf":
        document = pytest.importorskip("ezdxf", reason="ezdxf is not installed: it is in the extra `test`").new("R2010")
        document.modelspace().add_polyline3d(CREST, dxfattribs={"layer": "CREST"})
        document.saveas(path)
    elif path.suffix == ".str":
        write_surpac(path.with_suffix(".dtm"), np.array(CREST), np.array([[0, 1, 2]]))
    else:
        pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
        write_vector(path, [shapely.LineString(CREST)])
    return path


@pytest.mark.parametrize("end", [None, "EPSG:32719"])
@pytest.mark.parametrize("name", ["a.geojson", "a.gpkg", "a.shp", "a.dxf", "a.str"])
def test_a_line_keeps_its_heights_whatever_its_format(tmp_path: Path, name: str, end: str | None) -> None:
    if end is not None:
        pytest.importorskip("pyproj", reason="pyproj is not installed: it is in the extra `mine`")
    import_layer(write_crest(tmp_path / name), tmp_path / "out.geojson", "line", begin="EPSG:32719", end=end)
    (line,) = read_lines_with_heights(tmp_path / "out.geojson")
    assert line == pytest.approx(np.array(CREST), abs=1e-3)


def test_a_line_of_a_geopackage_of_which_some_points_have_no_height_keeps_the_others(tmp_path: Path) -> None:
    pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
    crest = [CREST[0], [*CREST[1][:2], math.nan], CREST[2]]
    lines = shapely.MultiLineString([crest, CREST])
    import_layer(write_vector(tmp_path / "a.gpkg", [lines]), tmp_path / "out.geojson", "line")
    first, second = read_lines_with_heights(tmp_path / "out.geojson")
    assert np.array_equal(first, crest, equal_nan=True) and second.tolist() == CREST


@pytest.mark.parametrize(("name", "lost"), [("a.gpkg", True), ("a.geojson", False)])
def test_the_command_states_that_areas_lose_their_heights(tmp_path: Path, name: str, lost: bool) -> None:
    area, out = shapely.Polygon([*CREST, [0, 9, 814]]), tmp_path / "out.geojson"
    if name.endswith(".gpkg"):
        pytest.importorskip("pyogrio", reason="pyogrio is not installed: it is in the extra `mine`")
        write_vector(tmp_path / name, [area])
    else:
        (tmp_path / name).write_text(shapely.to_geojson(area))
    printed = CliRunner().invoke(cli.app, ["import", "layer", str(tmp_path / name), "--out", str(out)])
    assert ("heights of the file, if it has any, are left out" in " ".join(printed.stderr.split())) is lost
    (written,) = json.loads(out.read_text())["features"]
    assert shapely.from_geojson(json.dumps(written["geometry"])).has_z is not lost


@pytest.mark.parametrize(("begin", "noted"), [("EPSG:2225", True), ("EPSG:26941", False)])
def test_heights_that_may_stay_in_feet_are_noted(tmp_path: Path, begin: str, noted: bool) -> None:
    pytest.importorskip("pyproj", reason="pyproj is not installed: it is in the extra `mine`")
    (tmp_path / "a.geojson").write_text(json.dumps({"type": "Point", "coordinates": [2e6, 5e5, 812.5]}))
    _, notes = import_layer(tmp_path / "a.geojson", tmp_path / "b.geojson", "point", begin=begin, end="EPSG:26941")
    assert read_points(tmp_path / "b.geojson")[0, 2] == 812.5
    assert [note.partition(" like ")[0] for note in notes] == [
        "heights, if the file has any, did not change: if they are in US survey feet"
    ] * noted


def test_clouds_in_feet_state_the_keys_that_the_scene_needs(tmp_path: Path) -> None:
    pytest.importorskip("laspy", reason="laspy is not installed: it is in the extra `mine`")
    path = write_las(tmp_path / "a.laz", points_of_hill(), crs=2225)
    made = import_cloud([path], tmp_path / "t.vtp")
    assert "the files state EPSG:2225, which is in US survey feet" in made.sentences[-1]
    assert "give the mesh `unit: us_ft` in the scene" in made.sentences[-1] and made.crs == "EPSG:2225"


def test_clouds_in_a_reference_system_that_is_unknown_become_a_terrain(tmp_path: Path, monkeypatch) -> None:
    """The system does not change the points, so only two clouds in different systems are refused."""
    names = {"a.las": "EPSG:999999", "b.las": "EPSG:999998"}
    monkeypatch.setattr(imports.cloud, "read_cloud", lambda path: Cloud(points_of_hill(), crs=names[path.name]))
    made = import_cloud([tmp_path / "a.las"], tmp_path / "t.vtp")
    assert made.sentences[-1].startswith("the files state EPSG:999999, which is no known coordinate reference system")
    with pytest.raises(InputError, match=r"b\.las: is in 'EPSG:999998', but a\.las in 'EPSG:999999'; reproject one"):
        import_cloud([tmp_path / "a.las", tmp_path / "b.las"], tmp_path / "t.vtp")


@pytest.mark.parametrize("name", ["gone.shp", "gone.gpkg", "gone.geojson"])
def test_a_missing_file_of_areas_is_refused_in_one_sentence(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="there is no such file"):
        import_layer(tmp_path / name, tmp_path / "out.geojson")


@pytest.mark.parametrize(("count", "told"), [(1, "1 geometry in "), (2, "2 geometries in ")])
def test_the_command_counts_the_geometries(tmp_path: Path, count: int, told: str) -> None:
    area = {"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 0]]]}
    (tmp_path / "a.geojson").write_text(json.dumps({"type": "GeometryCollection", "geometries": [area] * count}))
    words = ["import", "layer", str(tmp_path / "a.geojson"), "--out", str(tmp_path / "b.geojson")]
    assert CliRunner().invoke(cli.app, words).output.startswith(told)


def test_an_existing_output_of_a_layer_is_named_as_such(tmp_path):
    (tmp_path / "out.geojson").write_text("{}")
    with pytest.raises(InputError, match=r"out\.geojson: exists already; delete it or give another name"):
        import_layer(tmp_path / "a.geojson", tmp_path / "out.geojson")
