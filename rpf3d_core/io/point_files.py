"""Points from a file: x y z first on each line of a text, the columns x, y, z of a CSV, or the points of GeoJSON."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.io.polygons import geometries
from rpf3d_core.terrain.frame import FloatArray

AXES = ("x", "y", "z")
GEOJSON = (".geojson", ".json")


def read_points(path: Path) -> FloatArray:
    """Points (N, 3) of a file, N >= 1, in the input's own coordinates (m).

    In a text, numbers are separated by blanks, commas or semicolons; what follows a `#` is a comment, and empty lines
    are skipped. A first line with the words x, y and z, in any order and beside others, says which columns are meant;
    without it they are the first three. A name that ends in .geojson or .json is GeoJSON with Points or MultiPoints.

    Raises
    ------
    InputError
        If the file cannot be read, holds no point, or holds anything but three finite numbers where a point should be;
        names the line, or the position in GeoJSON.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as fault:
        raise InputError(f"{path}: cannot be read as text ({fault})") from fault
    points = _geojson_points(path, text) if path.suffix.lower() in GEOJSON else _text_points(path, text)
    if not points:
        raise InputError(f"{path}: holds no point; each line must begin with x y z")
    return np.array(points)


def _text_points(path: Path, text: str) -> list[tuple[float, ...]]:
    """The points of a text or CSV."""
    words = ((i, _words(line)) for i, line in enumerate(text.splitlines(), start=1))
    numbered = [(i, line) for i, line in words if any(line)]
    columns = _header(path, *numbered[0]) if numbered else None
    if columns:
        return [_point(path, i, line, columns) for i, line in numbered[1:]]
    return [_point(path, i, [word for word in line if word], (0, 1, 2)) for i, line in numbered]


def _words(line: str) -> list[str]:
    """The words of a line; between separators a word may be empty, so that a CSV keeps its columns."""
    text = line.split("#")[0]
    for separator in (",", ";"):
        if separator in text:
            return [word.strip().strip('"') for part in text.split(separator) for word in part.split() or [""]]
    return text.split()


def _header(path: Path, number: int, words: list[str]) -> tuple[int, ...] | None:
    """The columns of x, y and z, if a line names any of them.

    Raises
    ------
    InputError
        It names one of them and not all, or one twice.
    """
    names = [word.lower() for word in words]
    if not any(axis in names for axis in AXES):
        return None
    if any(names.count(axis) != 1 for axis in AXES):
        raise InputError(f"{path}, line {number}: a header must name x, y and z once each, but is {' '.join(words)!r}")
    return tuple(names.index(axis) for axis in AXES)


def _point(path: Path, number: int, words: list[str], columns: tuple[int, ...]) -> tuple[float, ...]:
    """The point of a line."""
    try:
        point = tuple(float(words[column]) for column in columns)
    except (ValueError, IndexError):
        point = ()
    if len(point) != 3 or not all(map(math.isfinite, point)):
        found = " ".join(words)
        must = "begin with" if columns == (0, 1, 2) else "hold"
        raise InputError(f"{path}, line {number}: must {must} three finite numbers x y z, but is {found!r}")
    return point


def _geojson_points(path: Path, text: str) -> list[tuple[float, ...]]:
    """The points of GeoJSON."""
    try:
        content = json.loads(text)
    except ValueError as fault:
        raise InputError(f"{path}: cannot be read as GeoJSON ({fault})") from fault
    return [_position(path, position) for position in _positions(path, content)]


def _positions(path: Path, content: Any) -> Iterator[Any]:
    """What should be positions, in order."""
    for geometry in geometries(path, content, ("Point", "MultiPoint")):
        written = geometry.get("coordinates")
        if geometry["type"] == "Point":
            yield written
        elif isinstance(written, list):
            yield from written
        else:
            raise InputError(f"{path}: the coordinates of a MultiPoint must be a list, but are {str(written)[:40]!r}")


def _position(path: Path, position: Any) -> tuple[float, ...]:
    """Three finite numbers."""
    numbers = isinstance(position, list) and all(type(number) in (int, float) for number in position)
    if not numbers or len(position) != 3 or not all(map(math.isfinite, position)):
        raise InputError(f"{path}: a point must be three finite numbers [x, y, z], but is {str(position)[:60]}")
    return tuple(map(float, position))
