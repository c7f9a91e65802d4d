"""Read points from a file: a text with x y z first on each line, a CSV with named columns, or GeoJSON points.

Cells are read literally: a text between quotes is one cell, and only a plain number is a coordinate. Ambiguous content
(`1,234.5`, or a name before the coordinates) is refused, because a misread number would put rocks in wrong places.
"""

import csv
import io
import json
import math
import re
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.features import features_of
from rpf3d_core.formats.polygons import geometries
from rpf3d_core.formats.units import LENGTHS, unit_of_coordinate
from rpf3d_core.terrain.frame import FloatArray, Up

GEOJSON = (".geojson", ".json")
OTHERS = (".gpkg", ".shp", ".dxf", ".str")
"""Extensions of files of points that `features.py` reads: GeoPackage, Shapefile, DXF, Surpac strings."""
SEPARATORS = ";\t,"
"""Separators of cells in order of priority. The first separator that occurs in the first line separates all cells, so
a decimal comma does not separate cells in a file with semicolons or tabs."""

AXES = "xyz"
COLUMN_NAMES = {
    "x": ("east", "easting", "e"),
    "y": ("north", "northing", "n"),
    "z": ("elevation", "elev", "height", "altitude", "alt", "rl"),
}
"""Names that a coordinate's column may have in survey files in addition to x, y or z."""

FEWEST_COUNTED, MOST_COUNTED = 3, 1000
"""Smallest number of lines for which a first column may count as point numbers, and number of lines that are examined.

`_refuse_point_numbers` uses both numbers.
"""

QUOTED = re.compile(r'"[^"]*"')
REMARK = re.compile(r"\s#.*")
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")


SPREADSHEETS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""First bytes of .xlsx and .ods files (a zip archive), and of .xls files."""


class AxisColumn(NamedTuple):
    """The column of a coordinate in a table.

    place : index of the column, from 0; unit : length (m) of the unit that its header states, 1 if it states none
    """

    place: int
    unit: float = 1.0


class Row(NamedTuple):
    """The cells of one line of a text or CSV file; `line` is counted from 1, for messages."""

    line: int
    cells: list[str]


def read_points(path: Path, up: Up = "z", heights: bool = True) -> FloatArray:
    """Return the points (N, 3) m of a file, such as rock sources; N >= 1, in the coordinates of the file.

    In a text, numbers are separated by blanks, and `#` starts a comment. If the first line has a comma, semicolon or
    tab, the file is a CSV: this character separates cells, and a line that begins with `#` is a comment. Empty lines
    are skipped. A first line without any number is a header that names the columns (`COLUMN_NAMES`); without a header,
    the coordinates are the first three columns, and a first column that counts the lines is refused. Coordinates are
    converted to m if the header states another unit of length, such as `E (mm)`. A file with the extension .geojson or
    .json is GeoJSON with Points or MultiPoints; GeoPackages, Shapefiles, DXF and Surpac strings are read as
    `features.py` describes.

    Parameters
    ----------
    up : the input axis that points up; with "y", names such as easting, northing or elevation are refused
    heights : True if each point needs a height; if False, points in plan are accepted, and a missing height is 0

    Raises
    ------
    InputError
        The file cannot be read or has no point, its header does not name the coordinates or states an unknown unit, or
        a coordinate is not a finite number. The message names the line and the column, or shows the position in
        GeoJSON.
    """
    if path.suffix.lower() in OTHERS:
        content = features_of(path, "point")
        return _some(path, [_position(path, position, up, heights) for position in _positions(path, content)])
    text = text_of(path)
    is_geojson = path.suffix.lower() in GEOJSON
    points = _geojson_points(path, text, up, heights) if is_geojson else _text_points(path, text, up, heights)
    return _some(path, points)


def text_of(path: Path) -> str:
    """Return the text of a file, without a byte order mark.

    Raises
    ------
    InputError
        The file cannot be opened, is a spreadsheet, or is not UTF-8 text.
    """
    try:
        with path.open("rb") as file:
            begin = file.read(max(map(len, SPREADSHEETS)))
        if begin.startswith(SPREADSHEETS):
            raise InputError(f"{path}: is a spreadsheet, such as of Excel; save it as CSV, and name that file")
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as fault:
        raise InputError(f"{path}: cannot be read as text ({fault}); save it as UTF-8 (in Excel: CSV UTF-8)") from fault
    except OSError as fault:
        raise InputError(f"{path}: cannot be read as text ({fault})") from fault


def decimal_comma(text: str) -> str:
    """Return advice for a cell with a decimal comma, such as "0,97", as the end of a message; "" for other cells."""
    with_point = text.replace(",", ".")
    is_number = text.count(",") == 1 and NUMBER.fullmatch(with_point)
    return f"; write {with_point}, if the comma is a decimal comma" if is_number else ""


def _some(path: Path, points: list[tuple[float, ...]]) -> FloatArray:
    """Return points as an array (N, 3) m; raise an InputError if there are none."""
    if not points:
        raise InputError(f"{path}: holds no point; each line must begin with x y z")
    return np.array(points)


def _text_points(path: Path, text: str, up: Up, heights: bool) -> list[tuple[float, ...]]:
    """Return the points of a text or CSV file, with or without a header."""
    rows = list(rows_of(path, text))
    if not rows:
        return []
    first = rows[0]
    if not any(NUMBER.fullmatch(cell) for cell in first.cells):
        columns = _named_columns(path, first, up, heights)
        return [_point(path, row, columns, first.cells) for row in rows[1:]]
    _refuse_point_numbers(path, rows)
    axes = _plan_axes(up) if not heights and len(first.cells) == 2 else AXES
    columns = {axis: AxisColumn(place) for place, axis in enumerate(axes)}
    return [_point(path, row, columns, None) for row in rows]


def _refuse_point_numbers(path: Path, rows: Sequence[Row]) -> None:
    """Refuse lines without a header if their first cells count the lines and three or more cells follow.

    Survey programs often write the number of a point first. This number would be read as x, and x as y. Along a row of
    a raster, x may grow by 1 as well, but y is the same on all lines: such lines are accepted.
    """
    counted = rows[:MOST_COUNTED]
    if len(counted) < FEWEST_COUNTED or not all(len(row.cells) > 3 and row.cells[0].isdecimal() for row in counted):
        return
    numbers = [int(row.cells[0]) for row in counted]
    is_row = len({row.cells[1] for row in counted}) == 1
    if not is_row and all(after == before + 1 for before, after in pairwise(numbers)):
        raise InputError(
            f"{path}, line {rows[0].line}: the first column grows by 1 in each line ({numbers[0]}, {numbers[1]}, ...), "
            "so it may be the numbers of the points, not x; name the columns in a first line, such as id,x,y,z or x,y,z"
        )


def rows_of(path: Path, text: str) -> Iterator[Row]:
    """Return the lines of a text or CSV file as rows of cells, without empty lines, comments and surrounding blanks.

    The rows are read one by one; a line that is not valid CSV then raises an `InputError`.

    path : the file, for messages; text : content of the file
    """
    separator = _separator(text)
    rows = _blank_rows(text) if separator is None else _csv_rows(path, text, separator)
    return (row for row in rows if any(row.cells) and not row.cells[0].startswith("#"))


def columns_of(path: Path, text: str) -> tuple[str | None, int, tuple[AxisColumn, ...]]:
    """Return the layout of a text or CSV file: separator of cells, number of lines to skip, and columns of x, y and z.

    The separator is None for blanks. The lines to skip end with the header; 0 without a header.

    text : the first lines of the file

    Raises
    ------
    InputError
        A header does not name x, y and z, or states an unknown unit; or the first column has the numbers of points.
    """
    rows = rows_of(path, text)
    first = next(rows, None)
    if first is None or any(NUMBER.fullmatch(cell) for cell in first.cells):
        _refuse_point_numbers(path, [*([] if first is None else [first]), *rows])
        return _separator(text), 0, (AxisColumn(0), AxisColumn(1), AxisColumn(2))
    columns = _named_columns(path, first, "z", True)
    return _separator(text), first.line, tuple(columns[axis] for axis in AXES)


def further_columns_of(path: Path, text: str) -> dict[int, str]:
    """Return the place, from 0, and the name of each column of a text or CSV file that is not x, y or z.

    The name is the cell of the header, or, without a header, the number of the column from 1. Columns without a name,
    or without content in the first line, are left out.

    text : the first lines of the file; errors are as in `columns_of`
    """
    first = next(iter(rows_of(path, text)), None)
    if first is None:
        return {}
    _, header, columns = columns_of(path, text)
    read = [column.place for column in columns]
    return {place: cell if header else str(place + 1)
            for place, cell in enumerate(first.cells) if cell and place not in read}  # fmt: skip


def _separator(text: str) -> str | None:
    """Return the separator of cells, found in the first line with content; None if blanks separate the cells."""
    begin = next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")
    return next((mark for mark in SEPARATORS if mark in REMARK.sub("", QUOTED.sub("", begin))), None)


def _blank_rows(text: str) -> Iterator[Row]:
    for number, line in enumerate(text.splitlines(), start=1):
        yield Row(number, [word.strip('"') for word in line.split("#")[0].split()])


def _csv_rows(path: Path, text: str, separator: str) -> Iterator[Row]:
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator, skipinitialspace=True, strict=True)
    try:
        for cells in reader:
            yield Row(reader.line_num, [cell.strip() for cell in cells])
    except csv.Error as fault:
        raise InputError(f"{path}, line {reader.line_num}: cannot be read as CSV ({fault})") from fault


def _plan_axes(up: Up) -> str:
    """Return the names of the two horizontal axes: "xy", or "xz" if y is up."""
    return "xy" if up == "z" else "xz"


def _named_columns(path: Path, header: Row, up: Up, heights: bool) -> dict[str, AxisColumn]:
    """Return the column of each axis, found by the names in a header; an optional height may have no column.

    Raises
    ------
    InputError
        A coordinate has no column, or more than one; the message lists the known names. Or its unit is not known.
    """
    names = [unit_of_coordinate(cell)[0] for cell in header.cells]
    columns = {}
    for axis in AXES:
        # A file with z may also have a column height, such as the height of a tree.
        found = [i for i, name in enumerate(names) if name == axis] or [
            i for i, name in enumerate(names) if up == "z" and name in COLUMN_NAMES[axis]
        ]
        if len(found) == 1:
            columns[axis] = AxisColumn(found[0], _unit_of(path, header, found[0]))
        elif found or heights or axis in _plan_axes(up):
            raise InputError(
                f"{path}, line {header.line}: a header must name {_listed(AXES if heights else _plan_axes(up))} once "
                f"each, but is {', '.join(header.cells)!r}; known are {_known(up)}"
            )
    return columns


def _unit_of(path: Path, header: Row, place: int) -> float:
    """Return the length (m) of the unit that the header of a coordinate states; 1 if the header states no unit.

    place : number of the column, from 0; an unknown unit raises an `InputError`
    """
    _, unit, length = unit_of_coordinate(header.cells[place])
    if length is None:
        raise InputError(
            f"{path}, line {header.line}: the column {header.cells[place]!r} has {unit!r} in brackets, which is no "
            f"known unit of length ({', '.join(LENGTHS)}); convert its numbers to one of them, or take the brackets "
            "away if they name no unit: numbers without a unit are read in m"
        )
    return length


def _listed(axes: Sequence[str]) -> str:
    return f"{', '.join(axes[:-1])} and {axes[-1]}"


def _known(up: Up) -> str:
    """Return the names that coordinate columns may have, as text for a message."""
    names = [", ".join((axis, *(COLUMN_NAMES[axis] if up == "z" else ()))) for axis in AXES]
    return "; ".join(names) + ", in capitals too, with or without a unit, such as x_m, E (m), N (mm) or z [ft]"


def _point(path: Path, row: Row, columns: dict[str, AxisColumn], header: Sequence[str] | None) -> tuple[float, ...]:
    """Return the point (3,) m in one line of a file; a coordinate without a column is 0.

    Raises
    ------
    InputError
        A cell is missing or not a plain, finite number.
    """
    point = dict.fromkeys(AXES, 0.0)
    for axis, (column, unit) in columns.items():
        cell = row.cells[column] if column < len(row.cells) else ""
        if not NUMBER.fullmatch(cell) or not math.isfinite(float(cell)):
            named = f" ({header[column]})" if header else ""
            found = f"is {cell!r}" if cell else "is missing"
            must = "" if header else "; without a header the first columns must be x y z"
            raise InputError(
                f"{path}, line {row.line}, column {column + 1}{named}: {axis} must be a plain, finite number, but "
                f"{found}{must}{decimal_comma(cell)}"
            )
        point[axis] = float(cell) * unit
    return tuple(point.values())


def _geojson_points(path: Path, text: str, up: Up, heights: bool) -> list[tuple[float, ...]]:
    """Return the points of a GeoJSON file, given its text."""
    try:
        content = json.loads(text)
    except ValueError as fault:
        raise InputError(f"{path}: cannot be read as GeoJSON ({fault})") from fault
    return [_position(path, position, up, heights) for position in _positions(path, content)]


def _positions(path: Path, content: Any) -> Iterator[Any]:
    """Yield the coordinates of all GeoJSON points in order; the coordinates themselves are not checked.

    Raise an InputError if the content has other geometries than points, or a MultiPoint without a list of points.
    """
    for geometry in geometries(path, content, ("Point", "MultiPoint")):
        written = geometry.get("coordinates")
        if geometry["type"] == "Point":
            yield written
        elif isinstance(written, list):
            yield from written
        else:
            raise InputError(f"{path}: the coordinates of a MultiPoint must be a list, but are {str(written)[:40]!r}")


def _position(path: Path, position: Any, up: Up, heights: bool) -> tuple[float, ...]:
    """Return the coordinates (3,) m of a GeoJSON position; raise an InputError if they are not finite numbers.

    If heights are optional, two horizontal coordinates are enough; the height is then 0.
    """
    numbers = isinstance(position, list) and all(type(number) in (int, float) for number in position)
    counts = (3,) if heights else (2, 3)
    if not numbers or len(position) not in counts or not all(map(math.isfinite, position)):
        without = "; two will do where the source has `above_ground`" if heights else ""
        raise InputError(
            f"{path}: a point must be three finite numbers [x, y, z], but is {str(position)[:60]}{without}"
        )
    if len(position) == 2:
        position = [position[0], position[1], 0.0] if up == "z" else [position[0], 0.0, position[1]]
    return tuple(map(float, position))
