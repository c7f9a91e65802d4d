"""Tests of areas, lines and points from GeoPackage, Shapefile, DXF and Surpac strings, for zones, berms, sources."""

import os
import re
import sqlite3

import numpy as np
import pytest
import shapely
from input_files.mine_files import write_surpac, write_vector
from input_files.terrain_files import grid

from rpf3d_core.errors import InputError
from rpf3d_core.formats.apart import read_apart
from rpf3d_core.formats.mine import vector_files
from rpf3d_core.formats.mine.vector_files import read_vector, vector_crs
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.formats.polylines import read_lines

SQUARE = shapely.Polygon([(0, 0), (9, 0), (9, 9), (0, 9)], [[(2, 2), (4, 2), (4, 4), (2, 4)]])
OTHER = shapely.Polygon([(20, 0), (29, 0), (29, 9)])
ROAD = shapely.LineString([(1, 2), (3, 4), (5, 5)])
PLACES = np.array([[1.25, 2.5, 3.0], [4.0, 5.0, 6.75]])
VECTOR = "pyogrio is not installed: it is in the extra `mine`"
EZDXF = "ezdxf is not installed: it is in the extra `test`"

vector = pytest.mark.parametrize("name", ["a.gpkg", "a.shp"])


@vector
def test_polygons_lines_and_points_are_those_that_were_written(tmp_path, name):
    pytest.importorskip("pyogrio", reason=VECTOR)
    for kind in ("areas", "roads", "places"):
        (tmp_path / kind).mkdir()
    read = read_polygons(write_vector(tmp_path / "areas" / name, [SQUARE, OTHER]))
    assert read.equals(shapely.MultiPolygon([SQUARE, OTHER]))
    (line,) = read_lines(write_vector(tmp_path / "roads" / name, [ROAD]))
    assert line.tolist() == [[1, 2], [3, 4], [5, 5]]
    assert np.array_equal(read_points(write_vector(tmp_path / "places" / name, list(shapely.points(PLACES)))), PLACES)


def test_one_of_several_layers_is_chosen_by_its_kind_and_two_of_a_kind_are_refused(tmp_path):
    pytest.importorskip("pyogrio", reason=VECTOR)
    path = write_vector(tmp_path / "a.gpkg", [SQUARE], layer="walls")
    write_vector(path, [ROAD], layer="road")
    assert read_polygons(path).area == SQUARE.area and len(read_lines(path)) == 1
    with pytest.raises(InputError, match=r"no layer of points; it has walls \(Polygon\), road \(LineString\)"):
        read_points(path)
    write_vector(path, [OTHER], layer="dumps")
    out = re.escape(str(tmp_path / "walls.geojson"))
    command = rf"rpf3d import layer {re.escape(str(path))} --kind polygon --layer walls --out {out}"
    with pytest.raises(InputError, match=f"several layers of polygons: walls, dumps; .*{command}"):
        read_polygons(path)


def test_a_file_of_another_format_is_refused_with_the_formats_that_are_read(tmp_path):
    (tmp_path / "ramp.csv").write_text("x,y\n1,2\n")
    sentence = r"ramp\.csv: polygons are not read from \.csv files; save them as GeoJSON .*shp"
    with pytest.raises(InputError, match=sentence):
        read_polygons(tmp_path / "ramp.csv")
    (tmp_path / "ramp.csv").write_text('{"type": "Polygon", "coordinates": [[[0, 0], [9, 0], [9, 9], [0, 0]]]}')
    assert read_polygons(tmp_path / "ramp.csv").area == 40.5


@vector
def test_a_file_is_read_once_by_a_process_until_it_changes(tmp_path, name, monkeypatch):
    pytest.importorskip("pyogrio", reason=VECTOR)
    path = write_vector(tmp_path / name, [SQUARE])
    started = []
    monkeypatch.setattr(vector_files, "read_apart", lambda *words: started.append(words) or read_apart(*words))
    for _ in range(3):
        assert read_polygons(path).equals(shapely.MultiPolygon([SQUARE]))
        assert vector_crs(path, "polygon") == "EPSG:32719"
    assert len(started) == 1
    os.utime(path, ns=(1, 1))
    assert read_polygons(path).equals(shapely.MultiPolygon([SQUARE])) and len(started) == 2
    monkeypatch.setattr(vector_files, "MOST_KEPT", 0)
    os.utime(path, ns=(2, 2))
    assert read_polygons(path) == read_polygons(path) and len(started) == 4, "too large to be kept"


def test_only_the_latest_layers_are_kept(tmp_path, monkeypatch):
    pytest.importorskip("pyogrio", reason=VECTOR)
    monkeypatch.setattr(vector_files, "MOST_ENTRIES", 2)
    paths = [write_vector(tmp_path / f"{name}.gpkg", [SQUARE]) for name in "abc"]
    for path in paths:
        read_polygons(path)
    kept = [path for path, *_ in vector_files._kept]
    assert kept == paths[1:]
    size = vector_files._size(vector_files._kept[paths[2], "polygon", ""][1])
    monkeypatch.setattr(vector_files, "MOST_KEPT", size)
    read_polygons(paths[0])
    assert [path for path, *_ in vector_files._kept] == [paths[0]], "two layers are too large together"


@pytest.mark.parametrize("damage", ["view", "system"])
def test_a_damaged_first_layer_does_not_matter_if_another_is_named(tmp_path, damage):
    pytest.importorskip("pyogrio", reason=VECTOR)
    path = write_vector(tmp_path / "a.gpkg", [SQUARE], layer="bad", crs="EPSG:31287")
    write_vector(path, [OTHER], layer="walls")
    with sqlite3.connect(path) as database:
        if damage == "view":
            database.execute("ALTER TABLE bad RENAME TO gone")
            database.execute("CREATE VIEW bad AS SELECT * FROM missing")
        else:
            database.execute("UPDATE gpkg_geometry_columns SET srs_id = 999999 WHERE table_name = 'bad'")
    database.close()
    found = read_vector(path, "polygon", "walls")
    assert [shapely.geometry.shape(each) for each in found.geometries] == [OTHER]
    assert found.crs == "EPSG:32719"


def test_another_reference_system_of_a_shapefile_is_noticed(tmp_path):
    pytest.importorskip("pyogrio", reason=VECTOR)
    path = write_vector(tmp_path / "a.shp", [SQUARE])
    assert read_polygons(path) and vector_crs(path, "polygon") == "EPSG:32719"
    (tmp_path / "a.prj").unlink()
    assert vector_crs(path, "polygon") is None


def test_a_layer_that_is_computed_is_refused_because_it_may_never_end(tmp_path):
    pytest.importorskip("pyogrio", reason=VECTOR)
    path = write_vector(tmp_path / "a.gpkg", [SQUARE], layer="walls")
    with sqlite3.connect(path) as database:
        database.execute("ALTER TABLE walls RENAME TO kept")
        database.execute(
            "CREATE VIEW walls AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) "
            "SELECT n.i AS fid, geom FROM kept, n"
        )
    database.close()
    with pytest.raises(InputError, match="is computed"):
        read_polygons(path)


def test_a_missing_library_is_named_with_the_way_to_install_it(tmp_path, monkeypatch):
    import importlib

    def missing(name: str) -> None:
        raise ImportError(f"No module named {name!r}")

    monkeypatch.setattr(importlib, "import_module", missing)
    (tmp_path / "a.gpkg").write_bytes(b"SQLite")
    with pytest.raises(InputError, match=r"a\.gpkg: .*library pyogrio.*pip install 'rpf3d\[mine\]'"):
        read_polygons(tmp_path / "a.gpkg")


def test_polylines_of_a_dxf_are_lines_and_closed_ones_are_areas(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason=EZDXF)
    document = ezdxf.new("R2010")
    space = document.modelspace()
    space.add_lwpolyline([(0, 0), (9, 0), (9, 9)], close=True)
    space.add_polyline3d([(20, 0, 5), (29, 0, 5), (29, 9, 6)], close=True)
    space.add_lwpolyline([(-40, 0), (-49, 0), (-49, 9)], close=True, dxfattribs={"extrusion": (0, 0, -1)})
    document.saveas(tmp_path / "areas.dxf")
    whole = read_polygons(tmp_path / "areas.dxf")
    assert [part.bounds for part in whole.geoms] == [(0, 0, 9, 9), (40, 0, 49, 9), (20, 0, 29, 9)]
    space.add_line((1, 2, 3), (4, 5, 6), dxfattribs={"layer": "crest"})
    space.add_point((7, 8, 9))
    document.saveas(tmp_path / "all.dxf")
    lines = read_lines(tmp_path / "all.dxf")
    assert len(lines) == 4 and lines[0].tolist() == [[1, 2], [4, 5]] and len(lines[1]) == 4
    assert read_points(tmp_path / "all.dxf").tolist() == [[7, 8, 9]]
    with pytest.raises(InputError, match=r"the line on layer 'crest' is not closed.*import layer --layer` \(.*crest"):
        read_polygons(tmp_path / "all.dxf")


def test_arcs_and_curves_of_a_dxf_are_refused(tmp_path):
    ezdxf = pytest.importorskip("ezdxf", reason=EZDXF)
    document = ezdxf.new("R2010")
    document.modelspace().add_lwpolyline([(0, 0, 0.5), (9, 0, 0)], format="xyb")
    document.saveas(tmp_path / "arc.dxf")
    with pytest.raises(InputError, match="arcs"):
        read_lines(tmp_path / "arc.dxf")
    document.modelspace().add_circle((0, 0), 5)
    document.saveas(tmp_path / "arc.dxf")
    with pytest.raises(InputError, match="1, the first a CIRCLE"):
        read_lines(tmp_path / "arc.dxf")


def test_surpac_strings_are_lines_points_and_areas(tmp_path):
    vertices, triangles = grid(3, 3)
    write_surpac(tmp_path / "pit.dtm", vertices, triangles)
    assert np.allclose(read_points(tmp_path / "pit.str"), np.round(vertices, 3))
    (tmp_path / "crest.str").write_text(
        "crest,,,\n0,0,0,0,0,0,0\n1, 20, 10, 5,\n1, 21, 11, 5, note, more\n0, 0, 0, 0,\n"
        "1, 30, 10, 5,\n1, 31, 11, 5,\n2, 0, 0, 1,\n2, 5, 0, 1,\n2, 5, 5, 1,\n2, 0, 0, 1,\n0, 0, 0, 0, END\n"
    )
    lines = read_lines(tmp_path / "crest.str")
    assert [line.tolist() for line in lines[:2]] == [[[10, 20], [11, 21]], [[10, 30], [11, 31]]]
    assert lines[2].tolist() == [[0, 0], [0, 5], [5, 5], [0, 0]]
    with pytest.raises(InputError, match=r"the line number 1 \(from 1\) is not closed"):
        read_polygons(tmp_path / "crest.str")
