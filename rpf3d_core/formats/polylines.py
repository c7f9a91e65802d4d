"""Read lines in plan: from corners, or from files in the plan coordinates (m) of the input."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.features import features_of
from rpf3d_core.formats.polygons import geometries
from rpf3d_core.terrain.frame import FloatArray

LINES = ("LineString", "MultiLineString")

Along = Path | tuple[tuple[float, float], ...]
"""A line as written in a scene file: the path of a file, or the corners of one line."""


def lines_along(along: Along) -> list[FloatArray]:
    """Return the lines of a scene entry such as a road, each with its points (P, 2) m in plan.

    A point that equals the previous point of its line is removed.

    along : path of a file with lines, or the corners (x, y) of one line (m)

    Raises
    ------
    InputError
        The file is refused (`read_lines`), or all points of a line are the same.
    """
    written = [np.array(along, dtype=float)] if isinstance(along, tuple) else read_lines(along)
    lines = [without_repeats(line) for line in written]
    if any(len(line) < 2 for line in lines):
        raise InputError("must be a line of two or more different points, but all its points are the same")
    return lines


def without_repeats(line: FloatArray) -> FloatArray:
    """Return a line (P, D) m without each point that equals the previous point; the result has at most P points."""
    return np.asarray(line[np.append(True, (np.diff(line, axis=0) != 0.0).any(axis=1))])


def read_lines(path: Path) -> list[FloatArray]:
    """Return the lines of a file, at least one, each with its points (P, 2) m in plan.

    Raises
    ------
    InputError
        The file cannot be read, has other geometries than lines, no line, or a line with fewer than two points.
    """
    content = features_of(path, "line")
    lines = []
    for geometry in geometries(path, content, LINES):
        written = geometry.get("coordinates")
        for line in [written] if geometry["type"] == LINES[0] else written or []:
            lines.append(_line(path, line))
    if not lines:
        raise InputError(f"{path}: holds no line; it must have at least one")
    return lines


def read_lines_with_heights(path: Path) -> list[FloatArray]:
    """Return the lines of a file, each with its points (P, 3) m; a height that the file lacks is NaN.

    The result is [] for a file without lines.

    Raises
    ------
    InputError
        The file cannot be read, has other geometries than lines, or a line with fewer than two points.
    """
    lines = []
    for geometry in geometries(path, features_of(path, "line", heights=True), LINES):
        written = geometry.get("coordinates")
        for line in [written] if geometry["type"] == LINES[0] else written or []:
            plan = _line(path, line)
            lines.append(np.column_stack([plan, [_height(position) for position in line]]))
    return lines


def _height(position: list[Any]) -> float:
    """Return the third coordinate (m) of a position in a file; NaN if it is missing or not a number."""
    third = position[2] if len(position) > 2 else None
    return float(third) if isinstance(third, int | float) else np.nan


def layers_of_lines(path: Path) -> dict[str, int]:
    """Return the number of lines on each layer of a DXF file, by the layer's name; {} for other files.

    Raises
    ------
    InputError
        The file cannot be read, or has curves or lines that `read_dxf_lines` refuses.
    """
    if path.suffix.lower() != ".dxf":
        return {}
    from rpf3d_core.formats.mine.dxf_lines import read_dxf_lines

    return dict(Counter(line.layer for line in read_dxf_lines(path)))


def _line(path: Path, written: Any) -> FloatArray:
    try:
        line: FloatArray = np.array([position[:2] for position in written], dtype=np.float64)
    except (TypeError, ValueError) as fault:
        raise InputError(f"{path}: the coordinates of a line are damaged ({fault})") from fault
    if line.ndim != 2 or line.shape[1:] != (2,) or len(line) < 2 or not np.isfinite(line).all():
        raise InputError(f"{path}: a line must be two or more points [x, y], but is {str(written)[:60]}")
    return line
