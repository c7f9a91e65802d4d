"""Tests of the column with masses in the file of end points: by number, by name, as a property; refusals."""

import json
from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.calibration.columns import column_of, doubt_on_masses
from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import read_points
from rpf3d_core.scene.calibration import CalibrationSpec

BEFORE = "id,mass,x,y,z\n1,500,10,20,0\n2,700.5,11,21,0\n"
NO_HEADER = "10,20,0,500\n11,21,0,700.5\n"
BLANKS = "10 20 500\n11 21 700.5\n"
WITHOUT_Z = "East,North,Mass\n10,20,500\n11,21,700.5\n"


def points(folder: Path, text: str, name: str = "stops.csv") -> Path:
    path = folder / name
    path.write_text(text)
    return path


def geojson(*masses: object) -> str:
    geometry = {"type": "Point", "coordinates": [1, 2]}
    features = [{"type": "Feature", "properties": {"mass": mass}, "geometry": geometry} for mass in masses]
    return json.dumps({"type": "FeatureCollection", "features": features})


def test_masses_are_converted_by_the_unit_in_the_header(tmp_path: Path) -> None:
    tonnes = points(tmp_path, BEFORE.replace("mass", "mass (t)"))
    for column in ("mass (t)", 2):
        np.testing.assert_allclose(column_of(tonnes, column, "mass_column"), [5e5, 7.005e5])
    in_json = points(tmp_path, geojson(2, 3).replace('"mass"', '"mass_t"'), "stops.geojson")
    np.testing.assert_allclose(column_of(in_json, "mass_t", "mass_column"), [2000.0, 3000.0])
    wide = points(tmp_path, BEFORE.replace("mass", "width (m)"))
    with pytest.raises(InputError, match=r"has masses in m, by the name of the column 'width \(m\)'"):
        column_of(wide, "width (m)", "mass_column")


def test_masses_with_a_doubtful_unit_are_warned_of_and_lengths_are_refused(tmp_path: Path) -> None:
    doubtful = points(tmp_path, BEFORE.replace("mass", "mass_t"))
    for column in ("mass_t", 2):
        told = doubt_on_masses(doubtful, column)
        assert told.startswith("`calibration.mass_column`: the name of the column 'mass_t' is read as a unit: its ")
        assert "converted from t to kg" in told
    assert doubt_on_masses(points(tmp_path, BEFORE.replace("mass", "mass (t)")), 2) == ""
    assert doubt_on_masses(points(tmp_path, NO_HEADER), 4) == ""
    with pytest.raises(InputError, match="has masses in m, by the name of the column 'mass_m'"):
        column_of(points(tmp_path, BEFORE.replace("mass", "mass_m")), 2, "mass_column")


@pytest.mark.parametrize(
    ("text", "column"),
    [(BEFORE, 2), (BEFORE, "mass"), (NO_HEADER, 4), (WITHOUT_Z, "mass"), (WITHOUT_Z, 3), (BLANKS, 3)],
)
def test_a_column_by_number_or_name(tmp_path: Path, text: str, column: int | str) -> None:
    path = points(tmp_path, text)
    assert CalibrationSpec(mass_column=column).mass_column == column
    np.testing.assert_array_equal(column_of(path, column, "mass_column"), [500.0, 700.5])
    assert len(read_points(path, "z", heights=False)) == 2


def test_a_property_of_geojson_points(tmp_path: Path) -> None:
    path = points(tmp_path, geojson(500, "700.5"), "stops.geojson")
    np.testing.assert_array_equal(column_of(path, "mass", "mass_column"), [500.0, 700.5])
    both = {"type": "MultiPoint", "coordinates": [[1, 2], [3, 4]]}
    path.write_text(json.dumps({"type": "Feature", "properties": {"mass": 9}, "geometry": both}))
    np.testing.assert_array_equal(column_of(path, "mass", "mass_column"), [9.0, 9.0])


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        (BEFORE, "weight", r"line 1: .* is 'weight', but the header has id, mass, x, y, z"),
        ("mass,Mass,x,y\n1,2,3,4\n", "mass", r"names it twice"),
        (BEFORE, "x", r"holds the coordinate 'x'"),
        (BEFORE, 4, r"holds the coordinate 'y'"),
        (BEFORE, 9, r"line 2, column 9: .* but is ''"),
        (NO_HEADER, "mass", r"has no header; give the number"),
        (NO_HEADER, 2, r"the first columns hold the coordinates"),
        ("x,y,mass\n1,2,heavy\n", "mass", r"line 2, column 3: .* must be a number above 0, but is 'heavy'"),
        ("x,y,mass\n1,2,nan\n", "mass", r"must be a number above 0, but is 'nan'"),
    ],
)
def test_a_wrong_column_is_refused(tmp_path: Path, text: str, column: int | str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        column_of(points(tmp_path, text), column, "mass_column")


@pytest.mark.parametrize(
    ("text", "column", "message"),
    [
        (geojson(5), 4, r"GeoJSON has no columns; give the name of a property"),
        (geojson(5, None), "mass", r"feature 2, property 'mass': .* but is None"),
        (geojson(True), "mass", r"feature 1, .* but is True"),
        ('{"type": "Point", "coordinates": [1, 2]}', "mass", r"feature 1, property 'mass': .* but is None"),
    ],
)
def test_a_wrong_property_is_refused(tmp_path: Path, text: str, column: int | str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        column_of(points(tmp_path, text, "stops.geojson"), column, "mass_column")


def test_files_whose_columns_are_not_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"columns of \.dxf are not read"):
        column_of(tmp_path / "stops.dxf", "mass", "mass_column")


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("x,y,z,mass\n1,2,3,500\n", 3), ("x,y,z,mass\n1,2,3,500\n", "z"), ("1,2,3,500\n", 3),
        ("x_m,y_m,z_m,mass\n1,2,3,500\n", 1), ("Easting (m),Northing (m),RL (m),mass\n1,2,3,500\n", 3),
    ],
)  # fmt: skip
def test_a_coordinate_is_no_mass(tmp_path: Path, text: str, column: int | str) -> None:
    with pytest.raises(InputError, match="coordinate"):
        column_of(points(tmp_path, text), column, "mass_column")


def test_an_underscore_in_a_number_is_refused_as_in_coordinates(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must be a number above 0, but is '1_000'"):
        column_of(points(tmp_path, "x,y,mass\n1,2,1_000\n"), "mass", "mass_column")
