"""Points from text, CSV and GeoJSON, and what is refused of them."""

import json
from pathlib import Path

import pytest

from rpf3d_core.errors import InputError
from rpf3d_core.io.point_files import read_points

TWO = [[1.0, 2.0, 3.0], [4.0, -5.5, 6e3]]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.xyz", "1 2 3\n\n4 -5.5 6e3 # the last\n"),
        ("a.txt", "# x y z\n1,2,3,9\n4, -5.5, 6e3, 9\n"),
        ("a.csv", "x,y,z\n1,2,3\n4,-5.5,6000\n"),
        ("a.csv", '"id","Z","X","note","Y"\r\n7,3,1,,2\r\n8,6000,4,seen,-5.5\r\n'),
        ("a.csv", "\ufeffx;y;z;date\n1;2;3;2020-01-02\n4;-5.5;6e3;2020-01-02\n"),
        ("a.xyz", "x y z\n1 2 3\n4 -5.5 6e3\n"),
    ],
    ids=["blanks", "commas", "CSV", "columns-in-another-order", "semicolons-and-a-mark", "header-in-text"],
)
def test_points_are_read_from_text_and_csv(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_bytes(text.encode())
    assert read_points(tmp_path / name).tolist() == TWO


POINTS = [{"type": "Point", "coordinates": point} for point in TWO]


@pytest.mark.parametrize(
    "content",
    [
        {"type": "MultiPoint", "coordinates": TWO},
        {"type": "GeometryCollection", "geometries": POINTS},
        {"type": "FeatureCollection", "features": [{"type": "Feature", "geometry": point} for point in POINTS]},
    ],
    ids=lambda content: content["type"],
)
@pytest.mark.parametrize("name", ["a.geojson", "a.JSON"])
def test_points_are_read_from_geojson(tmp_path: Path, name: str, content: object) -> None:
    (tmp_path / name).write_text(json.dumps(content))
    assert read_points(tmp_path / name).tolist() == TWO


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("a.xyz", "", "holds no point; each line must begin with x y z"),
        ("a.csv", "x,y,z\n", "holds no point"),
        ("a.xyz", "1 2 3\n1 nan 3\n", "line 2: must begin with three finite numbers x y z, but is '1 nan 3'"),
        ("a.xyz", "1 2\n", "line 1: must begin with three finite numbers x y z, but is '1 2'"),
        ("a.csv", "id,x,y\n1,2,3\n", "line 1: a header must name x, y and z once each, but is 'id x y'"),
        ("a.csv", "x,y,z,X\n1,2,3,4\n", "line 1: a header must name x, y and z once each"),
        ("a.csv", "id,x,y,z\n1,2,,4\n", "line 2: must hold three finite numbers x y z"),
        ("a.csv", "id,x,y,z\n1,2,3\n", "line 2: must hold three finite numbers x y z"),
        ("a.csv", "east,north,up\n1,2,3\n", "line 1: must begin with three finite numbers x y z, but is 'east north"),
        ("a.geojson", "{", "cannot be read as GeoJSON"),
        ("a.geojson", '{"type": "Polygon", "coordinates": []}', "must be GeoJSON that holds points only, but has 'Pol"),
        ("a.geojson", '{"type": "Point", "coordinates": [1, 2]}', "a point must be three finite numbers"),
        ("a.geojson", '{"type": "Point", "coordinates": [1, 2, NaN]}', "a point must be three finite numbers"),
        ("a.geojson", '{"type": "Point", "coordinates": [1, 2, true]}', "a point must be three finite numbers"),
        ("a.geojson", '{"type": "Point"}', "a point must be three finite numbers [x, y, z], but is None"),
        ("a.geojson", '{"type": "MultiPoint", "coordinates": 3}', "the coordinates of a MultiPoint must be a list"),
        ("a.geojson", '{"type": "FeatureCollection", "features": []}', "holds no point"),
    ],
)
def test_a_damaged_file_of_points_is_refused_with_its_name_and_line(
    tmp_path: Path, name: str, text: str, sentence: str
) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError) as caught:
        read_points(tmp_path / name)
    assert str(caught.value).startswith(f"{tmp_path / name}") and sentence in str(caught.value)
