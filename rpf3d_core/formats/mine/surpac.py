"""Read Surpac files in text: triangles in a .dtm file, their points and strings in the .str file of the same name.

A string file has two header lines, and a point on each further line: number of the string, northing, easting,
elevation, descriptions. A line with string number 0 separates segments; the last line of the file has END. (Surpac
Software International, String and DTM files.) A .dtm file has a triangle on each line, with the numbers of its three
points, from 1. It is not documented whether this numbering counts the separating lines. The reader assumes that the
numbering counts them only if a triangle has a number above the number of points.
"""

from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.terrain.frame import FloatArray

HEADER = 2
"""Number of header lines of a string file."""
LONGEST_LINE = 10_000
"""Largest length of a line (bytes)."""


class Strings(NamedTuple):
    """The records of a Surpac string file, without its header and its last line.

    number : (R,) number of the string; 0 for a record that separates segments
    points : (R, 3) m, easting first
    """

    number: NDArray[np.int64]
    points: FloatArray


def read_dtm(path: Path) -> FileMesh:
    """Return the triangles of a .dtm file, with the points of the .str file next to it.

    If the file has triangles of several objects, each object is a zone; otherwise the file states no zones.

    Raises
    ------
    TerrainError
        A file is missing, binary or damaged, or a triangle names a point that does not exist. The message names the
        file and, if known, the line.
    """
    companion = strings_of(path)
    if companion is None:
        raise TerrainError(f"{path}: its points are in {path.with_suffix('.str').name} next to it, which is missing")
    strings = read_strings(companion)
    triangles, objects = _triangles(path)
    is_point = strings.number != 0
    largest, remarks = int(triangles.max(initial=0)), list[str]()
    points = strings.points[is_point]
    if len(points) < largest <= len(strings.points):
        points = strings.points
        remarks.append(f"{path.name}: its point numbers count the lines that separate strings (unconfirmed)")
    if len(triangles) and (triangles.min() < 1 or largest > len(points)):
        wrong = largest if largest > len(points) else int(triangles.min())
        raise TerrainError(f"{path}: a triangle names point {wrong}, but the .str file has points 1 to {len(points):,}")
    names = tuple(dict.fromkeys(f"object_{number}" for number in objects.tolist()))
    numbers = {name: i for i, name in enumerate(names)}
    zone = np.array([numbers[f"object_{number}"] for number in np.unique(objects)], np.int32)
    zone = zone[np.searchsorted(np.unique(objects), objects)]
    several = len(names) > 1
    return FileMesh(
        points, (triangles - 1).astype(np.int32), zone=zone if several else None, zones=names if several else (),
        remarks=tuple(remarks),
    )  # fmt: skip


def read_strings(path: Path) -> Strings:
    """Return the records of a Surpac string file.

    Raises
    ------
    TerrainError
        The file is binary, truncated or damaged; the message names the line.
    """
    lines = _lines(path)
    end = next((i for i, line in enumerate(lines) if i >= HEADER and line.rstrip(b" \t,").upper().endswith(b"END")), -1)
    if end < 0:
        raise TerrainError(f"{path}: ends after line {len(lines):,} without END; it is truncated, or no string file")
    table = _table(path, lines[HEADER:end], HEADER + 1, "string number, northing, easting, elevation")
    return Strings(number=table[:, 0].astype(np.int64), points=table[:, [2, 1, 3]])


def string_segments(strings: Strings) -> list[FloatArray]:
    """Return the segments (P, 3) m of all strings: consecutive points of one string with no separator between them."""
    breaks = np.flatnonzero(np.diff(strings.number) != 0) + 1
    parts = np.split(np.arange(len(strings.number)), breaks)
    return [strings.points[part] for part in parts if len(part) and strings.number[part[0]] != 0]


def strings_of(path: Path) -> Path | None:
    """Return the path of the string file (.str) that has the same name as a .dtm file; None if it is missing."""
    return next((other for end in (".str", ".STR", ".Str") if (other := path.with_suffix(end)).is_file()), None)


def _lines(path: Path) -> list[bytes]:
    try:
        data = path.read_bytes()
    except OSError as fault:
        raise TerrainError(f"{path}: cannot be read ({fault.strerror or fault})") from fault
    if b"\0" in data:
        raise TerrainError(f"{path}: is a binary Surpac file; save it as text (Surpac: save as type ASCII)")
    return data.splitlines()


def _triangles(path: Path) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the point numbers (T, 3), from 1, of the triangles of a .dtm file, and the object number (T,) of each."""
    lines = _lines(path)
    words = [line.strip().upper() for line in lines]
    if not any(word.startswith(b"TRISOLATION") for word in words):
        raise TerrainError(f"{path}: is not a Surpac DTM file; one has a line TRISOLATION before its triangles")
    if not words[-1].startswith(b"END"):
        raise TerrainError(f"{path}: ends after line {len(lines):,} without END; it is truncated")
    parts, objects, current, begin = [np.empty((0, 4))], [np.empty(0, np.int64)], 1, len(lines)
    for i, word in enumerate(words):
        if word[:1].isalpha():
            if i > begin:
                parts.append(_table(path, lines[begin:i], begin + 1, "triangle number, and three point numbers"))
                objects.append(np.full(len(parts[-1]), current))
            if word.startswith(b"OBJECT"):
                current = _object(path, i, word)
            begin = i + 1 if word.startswith(b"TRISOLATION") else len(lines)
    table = np.concatenate(parts)
    if (np.abs(table) > 2**31).any() or (table != np.floor(table)).any():
        raise TerrainError(f"{path}: the points of a triangle must be whole numbers from 1")
    return table[:, 1:].astype(np.int64), np.concatenate(objects)


def _object(path: Path, i: int, word: bytes) -> int:
    number = word.split(b",")[1].strip() if b"," in word else b""
    if not number.isdigit() or len(number) > 9:
        raise TerrainError(f"{path}, line {i + 1:,}: must be `OBJECT, number`, but is {_shown(word)}")
    return int(number)


def _table(path: Path, lines: list[bytes], first: int, must: str) -> FloatArray:
    """Return the first four numbers (N, 4) of each line of a Surpac file; raise a TerrainError for a wrong line.

    first, must : number of the first line, and what a line must be, for messages
    """
    try:
        words = [word for line in lines for word in line.split(b",", 4)[:4]]
        if len(words) != 4 * len(lines):
            raise ValueError
        table = np.array(words, dtype=float).reshape(-1, 4)
    except ValueError:
        number, wrong = next((n, line) for n, line in enumerate(lines, start=first) if not _is_row(line))
        raise TerrainError(f"{path}, line {number:,}: must be {must}, but is {_shown(wrong)}") from None
    if not np.isfinite(table).all():
        number = first + int(np.flatnonzero(~np.isfinite(table).all(axis=1))[0])
        raise TerrainError(f"{path}, line {number:,}: every number must be finite")
    return table


def _is_row(line: bytes) -> bool:
    words = line.split(b",", 4)[:4]
    try:
        return len(words) == 4 and np.array(words, dtype=float).shape == (4,)
    except ValueError:
        return False


def _shown(line: bytes) -> str:
    return repr(line[:60].decode("utf-8", "replace"))
