"""Read a column of numbers from the file of observed end points, such as the mass of each block."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.formats.features import features_of
from rpf3d_core.formats.points import COLUMN_NAMES, GEOJSON, NUMBER, OTHERS, Row, rows_of, text_of
from rpf3d_core.formats.polygons import geometries
from rpf3d_core.formats.units import doubt_on_unit, other_quantity, unit_of_column, unit_of_coordinate

FloatArray = NDArray[np.float64]

MASS = "mass_column"
"""Key of the scene's `calibration` that names the column with the masses."""


class ColumnCell(NamedTuple):
    """The content of a column for one end point.

    place : where the cell is in the file, for messages; content : text of the cell, or value of a GeoJSON property
    name : of the column in the header; "" without a header
    """

    place: str
    content: Any
    name: str = ""


def column_of(path: Path, column: int | str, key: str) -> FloatArray:
    """Return the numbers (N,) in a column of a file of N points, each above 0.

    Masses are returned in kg: if the header states another unit, such as `mass (t)`, the masses are converted.

    Parameters
    ----------
    path : file of the end points: text, CSV or GeoJSON
    column : number of the column of a text or CSV, from 1; the name in its header; or a property of GeoJSON points
    key : the scene's key with the column, for messages

    Raises
    ------
    InputError
        The file is in another format or has no such column; the column holds a coordinate; a cell is not a number above
        0; or the header of masses states a unit of another quantity.
    """
    cells = _all_cells(path, column, key)
    for cell in cells:
        if not 0.0 < _number(cell.content) < np.inf:
            raise InputError(f"{path}, {cell.place}: `calibration.{key}` must be a number above 0, but is "
                             f"{cell.content!r}")  # fmt: skip
    factor = _factor(path, cells[0].name, key) if cells and key == MASS else 1.0
    return factor * np.array([_number(cell.content) for cell in cells])


def doubt_on_masses(path: Path, column: int | str) -> str:
    """Return a sentence if the unit in the name of a column of masses is uncertain or unknown; "" without doubt.

    path : file of the end points; column : as in `column_of`
    """
    cells = _all_cells(path, column, MASS)
    doubt = doubt_on_unit(cells[0].name, "mass") if cells else ""
    return f"`calibration.{MASS}`: {doubt}" if doubt else ""


def _all_cells(path: Path, column: int | str, key: str) -> list[ColumnCell]:
    """Return the cells of a column of a text, CSV or GeoJSON, without the header; parameters as in `column_of`.

    Raise InputError for a file in another format.
    """
    suffix = path.suffix.lower()
    if suffix in OTHERS:
        raise InputError(f"{path}: `calibration.{key}` needs a CSV, text or GeoJSON; columns of {suffix} are not read")
    return list(_properties(path, column, key) if suffix in GEOJSON else _cells(path, column, key))


def _factor(path: Path, name: str, key: str) -> float:
    """Return the factor that converts a column of masses to kg, such as 1000 for `mass (t)`; 1 without a unit.

    Raise InputError for a unit of another quantity, such as metres.

    name : of the column, with the unit; key : the scene's key with the column, for messages
    """
    unit = unit_of_column(name, "mass")
    if unit is not None and unit.quantity != "mass":
        raise InputError(f"{path}: `calibration.{key}` has masses {other_quantity(name, unit, 'mass')}")
    return 1.0 if unit is None else unit.factor


def _number(content: Any) -> float:
    """Return a cell or property as a number; NaN if it is not a number."""
    if isinstance(content, bool) or not isinstance(content, int | float | str):
        return math.nan
    if isinstance(content, str) and not NUMBER.fullmatch(content):
        return math.nan
    return float(content)


def _cells(path: Path, column: int | str, key: str) -> Iterator[ColumnCell]:
    """Yield the cells of a column of a text or CSV, without its header; parameters as in `column_of`."""
    rows = list(rows_of(path, text_of(path)))
    header = rows[0] if rows and all(math.isnan(_number(cell)) for cell in rows[0].cells) else None
    place = _place_of(path, header, column, key) if header else _place_without_names(path, rows, column, key)
    for row in rows if header is None else rows[1:]:
        content = row.cells[place] if place < len(row.cells) else ""
        name = header.cells[place] if header is not None and place < len(header.cells) else ""
        yield ColumnCell(f"line {row.line}, column {place + 1}", content, name)


def _place_without_names(path: Path, rows: list[Row], column: int | str, key: str) -> int:
    """Return the index of a column, from 0, in a file without a header; `column` counts from 1.

    The first two columns are coordinates and, if there are more than three columns, also the third. Raise InputError if
    `column` is the number of a column of coordinates, or a name.

    rows : of the file; key : the scene's key with the column, for messages
    """
    if isinstance(column, str):
        raise InputError(f"{path}: `calibration.{key}` is {column!r}, but the file has no header; give the number "
                         "of the column")  # fmt: skip
    if column <= 2 or (column == 3 and len(rows[0].cells) > 3):
        raise InputError(f"{path}: `calibration.{key}` is {column}, but the first columns hold the coordinates")
    return column - 1


def _place_of(path: Path, header: Row, column: int | str, key: str) -> int:
    """Return the index of a column, from 0, in a file with a header; `column` is a name, or a number from 1.

    Raise InputError for a column of coordinates, and for a name that is missing in the header or occurs twice.

    header : first row of the file; key : the scene's key with the column, for messages
    """
    names = [cell.lower() for cell in header.cells]
    if isinstance(column, str) and names.count(column.lower()) != 1:
        found = "names it twice" if column.lower() in names else f"has {', '.join(header.cells)}"
        raise InputError(f"{path}, line {header.line}: `calibration.{key}` is {column!r}, but the header {found}")
    place = names.index(column.lower()) if isinstance(column, str) else column - 1
    coordinates = {*COLUMN_NAMES, *(name for names in COLUMN_NAMES.values() for name in names)}
    if place < len(names) and unit_of_coordinate(names[place])[0] in coordinates:
        raise InputError(f"{path}, line {header.line}: `calibration.{key}` is {column!r}, but this column holds the "
                         f"coordinate {header.cells[place]!r}")  # fmt: skip
    return place


def _properties(path: Path, column: int | str, key: str) -> Iterator[ColumnCell]:
    """Yield the value of a property for each point of a GeoJSON file, in the order of the points.

    Raise InputError if `column` is a number.

    column : name of the property; key : the scene's key with this name, for messages
    """
    if not isinstance(column, str):
        raise InputError(f"{path}: `calibration.{key}` is {column}, but GeoJSON has no columns; give the name of a "
                         "property")  # fmt: skip
    content = features_of(path, "point")
    features = content.get("features", [content]) if isinstance(content, dict) else [content]
    for number, feature in enumerate(features, start=1):
        properties = feature.get("properties") if isinstance(feature, dict) else None
        value = properties.get(column) if isinstance(properties, dict) else None
        for geometry in geometries(path, feature, ("Point", "MultiPoint")):
            points = 1 if geometry["type"] == "Point" else len(geometry["coordinates"])
            yield from [ColumnCell(f"feature {number}, property {column!r}", value, column)] * points
