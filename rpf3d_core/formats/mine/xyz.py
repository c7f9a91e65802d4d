"""Read clouds of points from text: x y z on each line, or a CSV with named columns, as `formats.points` describes."""

import warnings
from pathlib import Path

import numpy as np

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.formats.mine.cloud import Cloud
from rpf3d_core.formats.points import columns_of, read_points
from rpf3d_core.terrain.frame import FloatArray

HEAD = 2**16
"""Number of characters at the beginning of a file, from which the separator and the columns are found."""


def read_xyz(path: Path) -> Cloud:
    """Return the points of a text or CSV file.

    All lines are converted in one step. If this fails, `read_points` reads the lines one by one and names a wrong line.

    Raises
    ------
    TerrainError
        The file is not text, has no point, or a line has no plain numbers; the message names the line.
    """
    try:
        fast = _all_at_once(path)
        return Cloud(read_points(path) if fast is None else fast)
    except InputError as fault:
        raise TerrainError(str(fault)) from fault


def _all_at_once(path: Path) -> FloatArray | None:
    """Return the points (N, 3) m of a file, converted in one step; None if this fails.

    The caller then reads the file line by line.
    """
    try:
        with path.open(encoding="utf-8-sig") as file:
            head = file.read(HEAD)
        separator, named, columns = columns_of(path, head.rpartition("\n")[0] or head)
    except UnicodeDecodeError as fault:
        raise TerrainError(f"{path}: cannot be read as text ({fault})") from fault
    if '"' in head:
        return None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # the warning about a file without numbers
            points = np.loadtxt(
                path, delimiter=separator, usecols=[column.place for column in columns], skiprows=named, ndmin=2,
                encoding="utf-8-sig",
            )  # fmt: skip
    except (ValueError, IndexError, UnicodeDecodeError, UserWarning):
        return None
    points *= [column.unit for column in columns]
    return points if len(points) and np.isfinite(points).all() else None
