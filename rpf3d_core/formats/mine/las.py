"""Read clouds of points from LAS and LAZ files (ASPRS LAS 1.4), with laspy and lazrs, in a separate process."""

from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.apart import Arrays, read_apart
from rpf3d_core.formats.mine.cloud import MOST_POINTS, Cloud
from rpf3d_core.formats.mine.need import needed

CHUNK = 2_000_000
"""Number of points that are read in one step."""
MAGIC, LEAST_HEADER, RECORD = b"LASF", 227, 54
"""First bytes of a file, and sizes (bytes) of the smallest header and of the smallest record before the points."""
MOST_PER_BYTE = 10
"""Largest plausible number of points for each byte of a compressed file; real surveys have about 0.2."""


def read_las(path: Path) -> Cloud:
    """Return the points and classes of a LAS or LAZ file.

    Raises
    ------
    TerrainError
        The library is missing, the file is damaged, or it has no points.
    """
    needed(path, "laspy")
    arrays = read_apart(path, "rpf3d_core.formats.mine.las:las_arrays")
    crs = str(arrays["crs"]) or None
    return Cloud(points=arrays["points"], classes=arrays["classes"], crs=crs)


def las_arrays(path: Path) -> Arrays:
    """Return the arrays of a LAS or LAZ file, read in this process: `points` (N, 3) m, `classes` (N,) and `crs`.

    `crs` is as in `las_header`.
    """
    laspy = needed(path, "laspy")
    _refuse_impossible_records(path)
    try:
        with laspy.open(path, read_evlrs=False) as reader:
            count = reader.header.point_count
            _refuse_impossible(path, reader.header)
            points, classes, begin = np.empty((count, 3)), np.empty(count, np.uint8), 0
            for chunk in reader.chunk_iterator(CHUNK):
                end = begin + len(chunk)
                for axis, values in enumerate((chunk.x, chunk.y, chunk.z)):
                    points[begin:end, axis] = values
                classes[begin:end] = chunk.classification
                begin = end
            if begin < count:
                raise TerrainError(f"{path}: announces {count:,} points, but has {begin:,}; it is truncated")
            return {"points": points, "classes": classes, "crs": _crs(reader.header)}
    except TerrainError:
        raise
    except BaseException as fault:  # a panic of lazrs is not an Exception
        raise TerrainError(f"{path}: cannot be read as a LAS or LAZ file ({fault})".replace("\n", " ")) from fault


def las_crs(path: Path) -> str | None:
    """Return the coordinate reference system that a LAS or LAZ file states; None if it states none, or is damaged."""
    try:
        arrays = read_apart(path, "rpf3d_core.formats.mine.las:las_header")
    except TerrainError:
        return None
    return str(arrays["crs"]) or None


def las_header(path: Path) -> Arrays:
    """Return the reference system of a LAS or LAZ file, read in this process, as array `crs`: EPSG code, WKT or ""."""
    laspy = needed(path, "laspy")
    _refuse_impossible_records(path)
    try:
        with laspy.open(path, read_evlrs=False) as reader:
            return {"crs": _crs(reader.header)}
    except Exception as fault:
        raise TerrainError(f"{path}: cannot be read as a LAS or LAZ file ({fault})") from fault


def _refuse_impossible_records(path: Path) -> None:
    """Raise a TerrainError if a file is too small for the records that its header announces before the points."""
    with path.open("rb") as file:
        head = file.read(LEAST_HEADER)
    if len(head) < LEAST_HEADER or not head.startswith(MAGIC):
        raise TerrainError(f"{path}: is not a LAS or LAZ file; one starts with {MAGIC.decode()}")
    begin, records = (int.from_bytes(head[at : at + 4], "little") for at in (96, 100))
    if max(begin, RECORD * records) > path.stat().st_size:
        raise TerrainError(f"{path}: its header announces {records:,} records, more than it can hold; it is damaged")


def _refuse_impossible(path: Path, header: Any) -> None:
    """Raise a TerrainError if the header of a file announces no points, or more points than the file can contain."""
    size, count = path.stat().st_size, header.point_count
    most = MOST_PER_BYTE * size if header.are_points_compressed else size // max(1, header.point_format.size)
    if count == 0:
        raise TerrainError(f"{path}: holds no points")
    if count > min(most, MOST_POINTS):
        raise TerrainError(
            f"{path}: announces {count:,} points, more than a file of {size:,} bytes can hold or memory can take; "
            "it is damaged, or must be cut"
        )


def _crs(header: Any) -> str:
    """Return the horizontal coordinate reference system of a header, as EPSG code or WKT.

    The EPSG code is preferred; the result is "" if the header states no system.
    """
    try:
        system = header.parse_crs()
    except Exception:
        return ""
    if system is None:
        return ""
    horizontal = system.sub_crs_list[0] if system.is_compound else system
    code = horizontal.to_epsg()
    return f"EPSG:{code}" if code else str(horizontal.to_wkt())
