"""Read PLY meshes, ASCII or binary in both byte orders (Turk 1994, The PLY Polygon File Format).

vtkPLYReader is not used, because it crashes on a truncated binary file, and fills the mesh of a truncated text file
with arbitrary memory. This reader first compares every count with the size of the file. Polygons are split into fans of
triangles.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh

_WHOLE_TYPES = {"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4"}
_WHOLE_TYPES |= {"int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"}
_TYPES = _WHOLE_TYPES | {"float": "f4", "double": "f8", "float32": "f4", "float64": "f8"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_HEADER_LIMIT = 100_000
"""Largest size of the header of a PLY file (bytes); a file without an end of its header is refused early."""


class Element(NamedTuple):
    """The description of one table in a PLY file, from the file's header.

    columns : for each column (name, type) or, for a column of lists, (name, type of the length, type of the numbers); a
        type is a code of numpy, such as "f4"
    """

    name: str
    rows: int
    columns: tuple[tuple[str, ...], ...]


def read_ply(path: Path) -> FileMesh:
    """Return the vertices and faces of a PLY file.

    Raises
    ------
    TerrainError
        The file is not a PLY mesh with vertices x, y, z followed by faces, or has less data than its header states.
    """
    data = path.read_bytes()
    order, elements, begin = _header(path, data)
    vertex, face = _mesh_elements(path, elements)
    try:
        if order:
            points, faces = _binary_tables(data, begin, order, vertex, face)
        else:
            points, faces = _text_tables(data[begin:], vertex, face)
    except (ValueError, IndexError, OverflowError) as fault:
        raise TerrainError(
            f"{path}: does not hold the {vertex.rows:,} vertices and {face.rows:,} faces that its header announces; "
            f"it is truncated or damaged ({fault})"
        ) from fault
    return FileMesh(points, faces)


def _header(path: Path, data: bytes) -> tuple[str, list[Element], int]:
    """Return byte order ("" for text), tables and offset (bytes) of the data, from the header of a PLY file."""
    end = data.find(b"end_header", 0, _HEADER_LIMIT)
    line_end = data.find(b"\n", end)
    if not data.startswith(b"ply") or end < 0 or line_end < 0:
        raise TerrainError(f"{path}: is no PLY file; one starts with `ply` and its header ends with `end_header`")
    order, elements, line = "?", list[Element](), ""
    try:
        for line in data[:end].decode("ascii", "replace").splitlines():
            words = line.split()
            if words[:1] == ["format"]:
                order = _ORDERS[words[1]]
            elif words[:1] == ["element"]:
                elements.append(Element(name=words[1], rows=_count(words[2]), columns=()))
            elif words[:1] == ["property"]:
                elements[-1] = elements[-1]._replace(columns=(*elements[-1].columns, _column(words[1:])))
    except (KeyError, ValueError, IndexError) as fault:
        raise TerrainError(f"{path}: the line {line[:60]!r} of the PLY header is damaged") from fault
    if order == "?":
        raise TerrainError(f"{path}: the PLY header must have a line `format`, such as `format ascii 1.0`")
    return order, elements, line_end + 1


def _count(word: str) -> int:
    count = int(word)
    if count < 0:
        raise ValueError(word)
    return count


def _column(words: list[str]) -> tuple[str, ...]:
    if words[0] == "list":
        return words[3], _WHOLE_TYPES[words[1]], _WHOLE_TYPES[words[2]]
    return words[1], _TYPES[words[0]]


def _mesh_elements(path: Path, elements: list[Element]) -> tuple[Element, Element]:
    """Return the vertex table and the face table; refuse a file in which they are not the first two tables."""
    if [element.name for element in elements[:2]] != ["vertex", "face"]:
        raise TerrainError(f"{path}: must have the elements vertex and face, in this order and first")
    vertex, face = elements[:2]
    plain = all(len(column) == 2 for column in vertex.columns)
    if not plain or not {"x", "y", "z"} <= {column[0] for column in vertex.columns}:
        raise TerrainError(f"{path}: each vertex must have the plain properties x, y and z")
    if len(face.columns) == 0 or len(face.columns[0]) != 3 or any(len(column) == 3 for column in face.columns[1:]):
        raise TerrainError(f"{path}: each face must have the list of its vertices first, and no other list")
    return vertex, face


def _binary_tables(
    data: bytes, begin: int, order: str, vertex: Element, face: Element
) -> tuple[NDArray[Any], NDArray[np.int32]]:
    row = np.dtype([(name, order + kind) for name, kind in vertex.columns])
    table = np.frombuffer(data, row, vertex.rows, begin)
    points = np.stack([table[axis] for axis in "xyz"], axis=1)
    begin += row.itemsize * vertex.rows
    _, count_kind, kind = face.columns[0]
    tail = [(f"{k}", order + column[1]) for k, column in enumerate(face.columns[1:])]
    triangle = np.dtype([("#", order + count_kind), ("corners", order + kind, (3,)), *tail])
    if face.rows * triangle.itemsize <= len(data) - begin:
        faces = np.frombuffer(data, triangle, face.rows, begin)
        if (faces["#"] == 3).all():
            return points, _indices(faces["corners"])
    return points, _fans(_binary_polygons(data, begin, order, face))


def _binary_polygons(data: bytes, begin: int, order: str, face: Element) -> list[list[int]]:
    """Return the point indices of each face's corners in a binary file, for faces with different numbers of corners.

    begin : offset (bytes) of the face table in `data`; order : byte order, "<" or ">"; face : the face table
    """
    _, count_kind, kind = face.columns[0]
    count_type, corner_type = np.dtype(order + count_kind), np.dtype(order + kind)
    tail = sum(np.dtype(column[1]).itemsize for column in face.columns[1:])
    polygons = list[list[int]]()
    for _ in range(face.rows):
        count = int(np.frombuffer(data, count_type, 1, begin)[0])
        begin += count_type.itemsize
        _refuse_few_corners(len(polygons), count)
        polygons.append(np.frombuffer(data, corner_type, count, begin).tolist())
        begin += count * corner_type.itemsize + tail
    return polygons


def _text_tables(data: bytes, vertex: Element, face: Element) -> tuple[NDArray[Any], NDArray[np.int32]]:
    lines = [line for line in data.decode("ascii").splitlines() if line.strip()]
    if len(lines) < vertex.rows + face.rows:
        raise ValueError(f"it has {len(lines):,} lines of data")
    names = [column[0] for column in vertex.columns]
    table = np.array([_numbers(line, len(names)) for line in lines[: vertex.rows]]).reshape(-1, len(names))
    points = table[:, [names.index(axis) for axis in "xyz"]]
    polygons = list[list[int]]()
    for line in lines[vertex.rows : vertex.rows + face.rows]:
        words = [int(word) for word in line.split()[: 1 + int(line.split(maxsplit=1)[0])]]
        if len(words) != 1 + words[0]:
            raise ValueError(f"the face {line[:60]!r} announces {words[0]} corners")
        _refuse_few_corners(len(polygons), words[0])
        polygons.append(words[1:])
    return points, _fans(polygons)


def _numbers(line: str, count: int) -> list[float]:
    numbers = [float(word) for word in line.split()]
    if len(numbers) != count:
        raise ValueError(f"the vertex {line[:60]!r} must have {count} numbers")
    return numbers


def _refuse_few_corners(face: int, corners: int) -> None:
    if corners < 3:
        raise ValueError(f"face number {face} (from 0) has {corners} corners, fewer than 3")


def _fans(polygons: list[list[int]]) -> NDArray[np.int32]:
    """Return polygons cut into triangles (F, 3), which fan out from the first corner of each polygon."""
    triangles = [(p[0], p[k], p[k + 1]) for p in polygons for k in range(1, len(p) - 1)]
    return _indices(np.array(triangles, dtype=np.int64).reshape(-1, 3))


def _indices(corners: NDArray[Any]) -> NDArray[np.int32]:
    """Return point indices (any shape) in 32 bits; a wrong index (negative or too large) becomes -1, refused later."""
    fits = (corners >= 0) & (corners < 2**31)
    return np.where(fits, corners, -1).astype(np.int32)
