"""Tests of points from text, CSV and GeoJSON files, and of refusals."""

import json
from pathlib import Path

import pytest

from rpf3d_core.errors import InputError
from rpf3d_core.formats.mine.xyz import read_xyz
from rpf3d_core.formats.points import read_points

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
        ("a.csv", 'name,x,y,z\nBlock 30,1,2,3\n"30, the other",4,-5.5,6e3\n'),
        ("a.csv", "# survey\nEasting (m),Northing (m),Elevation (m),id\n1,2,3,a\n# done\n4,-5.5,6e3,#b\n"),
        ("a.txt", "E\tN\tz\n1\t2\t3\n4\t-5.5\t6e3\n"),
        ("a.csv", "X_m,Y_m,Z_m,height\n1,2,3,99\n4,-5.5,6e3,99\n"),
    ],
    ids=[
        "blanks",
        "commas",
        "CSV",
        "columns-in-another-order",
        "semicolons-and-a-mark",
        "header-in-text",
        "names-with-blanks-and-separators",
        "eastings",
        "tabs",
        "a-height-beside-z",
    ],
)
def test_points_are_read_from_text_and_csv(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_bytes(text.encode())
    assert read_points(tmp_path / name).tolist() == TWO


@pytest.mark.parametrize(
    ("header", "metres"),
    [
        ("E (mm),N (mm),RL (mm)", [0.001] * 3), ("E (m),N (m),Z (m)", [1.0] * 3),
        ("x [cm],y [cm],z", [0.01, 0.01, 1.0]),
        ("Easting (ft),Northing (feet),Elev (m)", [0.3048, 0.3048, 1.0]), ("x_mm,y_mm,z_mm", [0.001] * 3),
        ("E (US ft),N (US ft),Z (US ft)", [1200.0 / 3937.0] * 3), ("E m,N m,Z m", [1.0] * 3),
    ],
)  # fmt: skip
def test_coordinates_are_converted_from_the_unit_of_their_header(
    tmp_path: Path, header: str, metres: list[float]
) -> None:
    (tmp_path / "a.csv").write_text(f"{header}\n1,2,3\n400,500,600\n")
    points = [[1.0, 2.0, 3.0], [400.0, 500.0, 600.0]]
    expected = [[value * unit for value, unit in zip(point, metres, strict=True)] for point in points]
    assert read_points(tmp_path / "a.csv").tolist() == expected
    assert read_xyz(tmp_path / "a.csv").points.tolist() == expected


@pytest.mark.parametrize("unknown", ["chains", "UTM"])
def test_a_coordinate_with_an_unknown_unit_is_refused(tmp_path: Path, unknown: str) -> None:
    (tmp_path / "a.csv").write_text(f"E (m),N (m),RL ({unknown}),Dip (deg)\n1,2,3,4\n")
    with pytest.raises(InputError, match=rf"line 1: the column 'RL \({unknown}\)' has .* no known unit of length \(mm"):
        read_points(tmp_path / "a.csv")


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "id,easting,northing\nb,1,2\n"),
        ("a.xyz", "1 2\n"),
        ("a.xyz", "1 2 0\n"),
        ("a.geojson", '{"type": "Point", "coordinates": [1, 2]}'),
    ],
)
def test_points_in_plan_will_do_where_no_height_is_needed(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text)
    assert read_points(tmp_path / name, heights=False).tolist() == [[1.0, 2.0, 0.0]]


def test_the_plan_of_an_input_that_points_up_along_y_is_x_and_z_and_has_no_eastings(tmp_path: Path) -> None:
    (tmp_path / "a.xyz").write_text("1 2\n")
    (tmp_path / "a.csv").write_text("x,z\n1,2\n")
    for name in ("a.xyz", "a.csv"):
        assert read_points(tmp_path / name, up="y", heights=False).tolist() == [[1.0, 0.0, 2.0]]
    (tmp_path / "a.csv").write_text("easting,northing,elevation\n1,2,3\n")
    with pytest.raises(InputError, match=r"a header must name x, y and z once each.*; known are x; y; z, in capitals"):
        read_points(tmp_path / "a.csv", up="y")


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
        ("a.xyz", "1 2 3\n1 nan 3\n", "line 2, column 2: y must be a plain, finite number, but is 'nan'; without a h"),
        ("a.xyz", "1 2\n", "line 1, column 3: z must be a plain, finite number, but is missing; without"),
        ("a.csv", "id,x,y\n1,2,3\n", "line 1: a header must name x, y and z once each, but is 'id, x, y'; known are"),
        ("a.csv", "x,y,z,X\n1,2,3,4\n", "line 1: a header must name x, y and z once each"),
        ("a.csv", "id,x,Y_m,z\n1,2,,4\n", "line 2, column 3 (Y_m): y must be a plain, finite number, but is missing"),
        ("a.csv", "id,x,y,z\n1,2,3\n", "line 2, column 4 (z): z must be a plain, finite number, but is missing"),
        ("a.csv", 'x,y,z\n"1,234.5",150,60\n', "line 2, column 1 (x): x must be a plain, finite number, but is '1,23"),
        ("a.csv", "x;y;z\n1,5;2,5;3,5\n", "line 2, column 1 (x): x must be a plain, finite number, but is '1,5'"),
        ("a.csv", "x,y,z\n1_000,2,3\n", "line 2, column 1 (x): x must be a plain, finite number, but is '1_000'"),
        ("a.csv", "Block 30,100,150,60\n", "line 1, column 1: x must be a plain, finite number, but is 'Block 30'"),
        ("a.csv", 'x,y,z\n1,"2,3\n', "line 2: cannot be read as CSV"),
        ("a.csv", "easting,northing,E,z\n1,2,3,4\n", "line 1: a header must name x, y and z once each"),
        ("a.xyz", "1 2 3\n4,5,6\n", "line 2, column 1: x must be a plain, finite number, but is '4,5,6'"),
        ("a.csv", "oost,noord,hoogte\n1,2,3\n", "known are x, east, easting, e; y, north, northing, n; z, el"),
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


NUMBERED = "1,512000.5,6712000.25,420.1\n2,512001.5,6712000.25,420.2\n3,512002.5,6712000.25,420.3\n"
ROW = "512000 6712000 400 35\n512001 6712000 401 36\n512002 6712000 402 35\n"


@pytest.mark.parametrize("begin", ["", "# exported\n"])
@pytest.mark.parametrize("blanks", [True, False])
@pytest.mark.parametrize("read", [read_points, read_xyz], ids=["points", "cloud"])
def test_numbers_of_points_without_a_header_are_not_read_as_x(tmp_path: Path, read, blanks: bool, begin: str) -> None:
    path = tmp_path / "points.csv"
    path.write_text(begin + (NUMBERED.replace(",", " ") if blanks else NUMBERED))
    with pytest.raises(InputError, match=r"first column grows by 1 in each line \(1, 2, ...\).*such as id,x,y,z"):
        read(path)
    path.write_text(f"id,x,y,z\n{NUMBERED}")
    read_again = read(path)
    points = read_again if read is read_points else read_again.points
    assert points[0].tolist() == [512000.5, 6712000.25, 420.1]


@pytest.mark.parametrize(
    "text",
    ["0 0 5.1 12\n1 0 5.2 13\n0 1 5.3 13\n1 1 5.3 9\n", "1 2 3\n2 2 3\n3 2 3\n", "1,2,3,4\n2,2,3,4\n",
     "1.0 2 3 4\n2.0 2.5 3 4\n3.0 2 3 4\n", ROW],
    ids=["grid", "three columns", "two lines", "decimals", "a row of a raster"],
)  # fmt: skip
def test_whole_numbers_that_may_be_coordinates_are_read(tmp_path: Path, text: str) -> None:
    path = tmp_path / "points.xyz"
    path.write_text(text)
    assert len(read_points(path)) == len(read_xyz(path).points) == text.count("\n")
