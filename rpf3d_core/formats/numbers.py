"""Read a list of numbers from a text or CSV file with one number on each line, such as measured sizes of rocks."""

import math
from pathlib import Path

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import NUMBER, Row, rows_of, text_of
from rpf3d_core.terrain.frame import FloatArray


def read_numbers(path: Path) -> FloatArray:
    """Return the numbers (N,) of a file, N >= 1, in its own unit.

    Each line has one number. Empty lines, and comments after `#`, are skipped; a first line without a number is a
    header.

    Raises
    ------
    InputError
        The file cannot be read, has no number, or a line has anything else; names the line.
    """
    rows = list(rows_of(path, text_of(path)))
    if rows and not any(NUMBER.fullmatch(cell) for cell in rows[0].cells):
        rows = rows[1:]
    if not rows:
        raise InputError(f"{path}: holds no number; each line must have one")
    return np.array([_number(path, row) for row in rows])


def _number(path: Path, row: Row) -> float:
    """Return the only number of a line."""
    cells = [cell for cell in row.cells if cell]
    if len(cells) != 1 or not NUMBER.fullmatch(cells[0]) or not math.isfinite(float(cells[0])):
        found = f"{len(cells)} cells ({', '.join(cells)})" if len(cells) != 1 else repr(cells[0])
        raise InputError(f"{path}, line {row.line}: must be one plain, finite number, but is {found[:60]}")
    return float(cells[0])
