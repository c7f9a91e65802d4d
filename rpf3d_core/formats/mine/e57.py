"""Read clouds of points from E57 files (ASTM E2807) with pye57, in a separate process."""

from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.apart import Arrays, read_apart
from rpf3d_core.formats.mine.cloud import MOST_POINTS, Cloud
from rpf3d_core.formats.mine.need import needed

MAGIC = b"ASTM-E57"
PAGE, CHECK = 1024, 4
"""Size (bytes) of a page, and of the checksum at the end of each page."""
POINTS_PER_BYTE = 8
"""Largest plausible number of points for each byte of a file, if a point takes one bit."""
FORBIDDEN = (b"<!DOCTYPE", b"<!ENTITY")


def read_e57(path: Path) -> Cloud:
    """Return the points of all scans of an E57 file, in the coordinates that all scans of the file share.

    Raises
    ------
    TerrainError
        The library is missing, the file is damaged, or it has no points.
    """
    needed(path, "pye57")
    arrays = read_apart(path, "rpf3d_core.formats.mine.e57:e57_arrays")
    return Cloud(points=arrays["points"], single=bool(arrays["single"]))


def e57_arrays(path: Path) -> Arrays:
    """Return the arrays of an E57 file, read in this process: `points` (N, 3) m, and `single`, as in `Cloud`."""
    pye57 = needed(path, "pye57")
    _refuse_entities(path)
    try:
        file = pye57.E57(str(path))
        counts = [file.get_header(scan).point_count for scan in range(file.scan_count)]
        _refuse_impossible(path, sum(counts))
        scans = [_scan(file, scan) for scan in range(file.scan_count)]
        single = all(_is_single(pye57, file.get_header(scan)) for scan in range(file.scan_count))
        file.close()
    except (TerrainError, MemoryError):
        raise
    except Exception as fault:
        raise TerrainError(f"{path}: cannot be read as an E57 file: {_reason(fault)}; export it again") from fault
    return {"points": np.concatenate(scans), "single": np.array(single)}


def _reason(fault: Exception) -> str:
    """Return why the library cannot read a file, without its list of C++ functions and the name of the error code."""
    first = str(fault).strip().partition("\n")[0]
    return first.partition(" (Error")[0] or type(fault).__name__


def _scan(file: Any, scan: int) -> Any:
    """Return the valid points (N, 3) m of one scan, after its pose is applied."""
    data = file.read_scan(scan, ignore_missing_fields=True, transform=True)
    return np.stack([data["cartesianX"], data["cartesianY"], data["cartesianZ"]], axis=1).astype(float)


def _is_single(pye57: Any, header: Any) -> bool:
    """Return True if a scan stores its coordinates in single precision, and its pose has no translation."""
    if "cartesianX" not in header.point_fields:
        return False
    node = pye57.libe57.StructureNode(header.points.prototype())["cartesianX"]
    single = isinstance(node, pye57.libe57.FloatNode) and node.precision() == pye57.libe57.FloatPrecision.E57_SINGLE
    return bool(single and not (header.has_pose() and np.any(header.translation)))


def _refuse_impossible(path: Path, count: int) -> None:
    if count == 0:
        raise TerrainError(f"{path}: holds no points")
    if count > min(MOST_POINTS, POINTS_PER_BYTE * path.stat().st_size):
        raise TerrainError(f"{path}: announces {count:,} points, more than it can hold or memory can take; cut it")


def _refuse_entities(path: Path) -> None:
    """Raise a TerrainError if the file is not an E57, or its XML has a document type or entities."""
    data = path.read_bytes()
    if not data.startswith(MAGIC):
        raise TerrainError(f"{path}: is not an E57 file; one starts with {MAGIC.decode()}")
    whole = len(data) // PAGE * PAGE
    content = np.frombuffer(data[:whole], np.uint8).reshape(-1, PAGE)[:, : PAGE - CHECK].tobytes()
    if any(word in content for word in FORBIDDEN):
        raise TerrainError(f"{path}: its XML has a document type (DOCTYPE), which is refused")
