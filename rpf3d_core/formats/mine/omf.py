"""Read the surfaces of an OMF 1 file (Global Mining Guidelines Group, Open Mining Format 0.9) as zones.

An OMF 1 file has a header of 60 bytes, arrays compressed by zlib, and JSON that describes the elements. Arrays are
expanded only up to a multiple of their size in the file, so that a small file cannot use up all memory.
"""

import json
import struct
import uuid
import zipfile
import zlib
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.terrain.frame import FloatArray

MAGIC, VERSION = b"\x84\x83\x82\x81", b"OMF-v0.9.0"
HEADER = struct.Struct("<4s32s16sQ")
MOST_EXPANDED, LEAST_LIMIT = 200, 2**24
"""Largest allowed expansion of a compressed array (-), and size (bytes) up to which any expansion is allowed."""
ZIP = b"PK\x03\x04"
FORMAT_2, INDEXES_2 = b"Open Mining Format", {"index.json.gz", "project.json"}
"""First bytes of the comment of an OMF 2 file, and the two possible names of the file with its index."""
MOST_NAMED = 3
"""Largest number of files in an archive that a message names."""

Element = dict[str, Any]


def read_omf(path: Path) -> FileMesh:
    """Return the triangles of all surfaces of an OMF 1 file, each surface a zone.

    The origins of the project and of the surface are added to the points.

    Raises
    ------
    TerrainError
        The file is not OMF 1, is damaged, or has no surface.
    """
    data = path.read_bytes()
    registry, root = _registry(path, data)
    try:
        elements = [registry[uid] for uid in registry[root]["elements"]]
        origin = np.array(registry[root].get("origin", [0.0, 0.0, 0.0]), dtype=float)
        surfaces = [element for element in elements if element.get("__class__") == "SurfaceElement"]
        names = _different([str(element.get("name") or "") for element in surfaces])
        meshes = [_surface(path, data, registry, element, origin) for element in surfaces]
    except (KeyError, TypeError, ValueError, AttributeError, IndexError) as fault:
        raise TerrainError(f"{path}: the description of its elements is damaged ({fault!r})") from fault
    if not meshes:
        raise TerrainError(f"{path}: holds no surface; it has {_others(elements) or 'no elements'}")
    begins = np.cumsum([0, *(len(points) for points, _ in meshes)])
    triangles = np.concatenate([triangles + begin for (_, triangles), begin in zip(meshes, begins[:-1], strict=True)])
    zone = np.repeat(np.arange(len(meshes), dtype=np.int32), [len(triangles) for _, triangles in meshes])
    others = _others([element for element in elements if element not in surfaces])
    remarks = (f"{path.name}: not read as ground: {others}",) if others else ()
    points = np.concatenate([points for points, _ in meshes])
    return FileMesh(points, triangles.astype(np.int32), zone=zone, zones=names, remarks=remarks)


def _registry(path: Path, data: bytes) -> tuple[dict[str, Element], str]:
    """Return the elements of the file by their identifiers, and the identifier of the project."""
    if data[:4] == ZIP:
        raise TerrainError(f"{path}: {_zip_in_words(path)}")
    if len(data) < HEADER.size or data[:4] != MAGIC:
        raise TerrainError(f"{path}: is not an OMF 1 file; one starts with the bytes 84 83 82 81")
    _, version, uid, begin = HEADER.unpack_from(data)
    if version.rstrip(b"\0") != VERSION:
        raise TerrainError(f"{path}: has the version {version[:20]!r}; known is {VERSION.decode()}")
    root = str(uuid.UUID(bytes=uid))
    try:
        registry = json.loads(data[min(begin, len(data)) :])
    except (ValueError, RecursionError) as fault:
        raise TerrainError(f"{path}: its description is not JSON; it is truncated or damaged ({fault})") from fault
    if not isinstance(registry, dict) or not isinstance(registry.get(root), dict):
        raise TerrainError(f"{path}: its description names no project; it is damaged")
    return registry, root


def _zip_in_words(path: Path) -> str:
    """Return the kind of a ZIP archive with the ending .omf, and advice for the user, as text.

    An OMF 2 file is a ZIP archive with an index of its elements; its comment names the format.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            names, comment = archive.namelist(), archive.comment
    except (OSError, ValueError, zipfile.BadZipFile):
        return "is a damaged ZIP archive, neither OMF 1 nor OMF 2; export it again as OMF 1 (version 0.9)"
    if comment.startswith(FORMAT_2) or not INDEXES_2.isdisjoint(names):
        return "is an OMF 2 file; export OMF 1 (version 0.9)"
    shown = ", ".join(names[:MOST_NAMED]) + (", ..." if len(names) > MOST_NAMED else "")
    return (f"is a ZIP archive of {shown or 'no files'}, neither OMF 1 nor OMF 2; unpack it, and name the terrain file "
            "in it")  # fmt: skip


def _surface(
    path: Path, data: bytes, registry: dict[str, Element], element: Element, origin: FloatArray
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the points (V, 3) m and triangles (F, 3) of one surface, which is a mesh or a grid of heights.

    data : bytes of the file; registry : elements of the file by identifier; element : the surface
    origin : (3,) m, of the project
    """
    geometry = registry[element["geometry"]]
    origin = origin + np.array(geometry.get("origin", [0.0, 0.0, 0.0]), dtype=float)
    if geometry["__class__"] == "SurfaceGridGeometry":
        return _grid(path, data, registry, geometry, origin)
    points = _array(path, data, registry[geometry["vertices"]], "<f8", 3) + origin
    triangles = _array(path, data, registry[geometry["triangles"]], "<i8", 3)
    if len(triangles) and (triangles.min() < 0 or triangles.max() >= len(points)):
        raise TerrainError(f"{path}: a triangle of {element.get('name')!r} names a point that does not exist")
    return points, triangles


def _grid(
    path: Path, data: bytes, registry: dict[str, Element], geometry: Element, origin: FloatArray
) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return a grid of heights as points (V, 3) m and triangles (F, 3).

    The points are in rows along the axis u, one row after another along the axis v. A height is an offset along the
    vector product of u and v.

    data : bytes of the file; registry : elements of the file by identifier
    geometry : element that describes the grid
    origin : (3,) m, sum of the origins of the project and of the surface
    """
    u, v = (np.array(geometry[f"axis_{axis}"], dtype=float) for axis in "uv")
    along = [np.concatenate([[0.0], np.cumsum(np.array(geometry[f"tensor_{axis}"], dtype=float))]) for axis in "uv"]
    b, a = np.meshgrid(along[1], along[0], indexing="ij")
    points = origin + a.reshape(-1, 1) * u + b.reshape(-1, 1) * v
    if geometry.get("offset_w"):
        points = points + _array(path, data, registry[geometry["offset_w"]], "<f8", 1) * np.cross(u, v)
    number = np.arange(a.size).reshape(a.shape)
    p, q, r, s = number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]
    return points, np.stack([p, q, r, p, r, s], axis=-1).reshape(-1, 3)


def _array(path: Path, data: bytes, holder: Element, kind: str, columns: int) -> NDArray[Any]:
    """Return an array of the file as rows (N, columns).

    data : bytes of the file; holder : element that states the place of the array
    kind : type of its numbers, such as "<f8"
    """
    place = holder["array"]
    begin, length = int(place["start"]), int(place["length"])
    if place["dtype"] != kind or begin < 0 or length < 0 or begin + length > len(data):
        raise TerrainError(f"{path}: an array lies outside of the file, or is not of type {kind}; it is damaged")
    limit = max(LEAST_LIMIT, MOST_EXPANDED * length)
    try:
        expand = zlib.decompressobj()
        content = expand.decompress(data[begin : begin + length], limit)
    except zlib.error as fault:
        raise TerrainError(f"{path}: an array cannot be expanded ({fault})") from fault
    if not expand.eof:
        over = len(content) >= limit
        raise TerrainError(f"{path}: an array " + (f"expands beyond {limit:,} bytes" if over else "is truncated"))
    return np.frombuffer(content, kind).reshape(-1, columns)


def _different(names: list[str]) -> tuple[str, ...]:
    """Return distinct names: an empty or repeated name gets a number at the end that no other name has."""
    taken, out = set(names), list[str]()
    for number, name in enumerate(names, start=1):
        if not name or name in out:
            free = (f"{name or 'surface'}_{n}" for n in count(number))
            name = next(each for each in free if each not in taken)
            taken.add(name)
        out.append(name)
    return tuple(out)


def _others(elements: list[Element]) -> str:
    kinds = [str(element.get("__class__")) for element in elements]
    return ", ".join(f"{kinds.count(kind)} {kind}" for kind in dict.fromkeys(kinds))
