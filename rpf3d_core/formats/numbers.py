"""Read numbers, such as measured sizes of rocks, from a text file with one on each line, or from a column of a CSV."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import NUMBER, Row, decimal_comma, rows_of, text_of
from rpf3d_core.formats.units import TableUnit, unit_of_column
from rpf3d_core.terrain.frame import FloatArray


class NumberColumn(NamedTuple):
    """A column of numbers in a file.

    values : (N,) in m, kg or m3 if the header states a unit of the wanted quantity, else in the file's own unit
    name : name of the column, None without a header; unit : unit that the name states, None if it states none
    """

    values: FloatArray
    name: str | None
    unit: TableUnit | None = None


def read_column(path: Path, column: str | None, quantity: str) -> NumberColumn:
    """Return a column of N >= 1 numbers of a file, with its name.

    Empty lines, and comments after `#`, are skipped; a first line without a number is a header. If the header states
    a unit of the wanted quantity, such as `length (mm)`, the numbers are converted to m, kg or m3.

    column : name of the column in the header; None if each line has one number
    quantity : the wanted quantity, a key of `units.SI`

    Raises
    ------
    InputError
        The file cannot be read or has no number, its header does not name the column exactly once, or a cell is not a
        plain, finite number. The message names a wrong line.
    """
    rows = list(rows_of(path, text_of(path)))
    header: list[str] = []
    if rows and not any(NUMBER.fullmatch(cell) for cell in rows[0].cells):
        header, rows = [cell.strip().strip('"') for cell in rows[0].cells], rows[1:]
    if not rows:
        raise InputError(f"{path}: holds no number; each line must have one")
    if column is None:
        return _in_si([_number(path, row, header) for row in rows], " ".join(header).strip() or None, quantity)
    place = _place(path, header, column)
    return _in_si([_cell(path, row, place, column) for row in rows], column, quantity)


def _in_si(numbers: list[float], name: str | None, quantity: str) -> NumberColumn:
    """Return a column with its numbers in m, kg or m3, if its name states a unit of the wanted quantity.

    Otherwise the numbers are unchanged.

    numbers : as in the file; name : name of the column, None without a header; quantity : a key of `units.SI`
    """
    unit = unit_of_column(name or "", quantity)
    factor = unit.factor if unit is not None and unit.quantity == quantity else 1.0
    return NumberColumn(np.array(numbers) * factor, name, unit)


def _place(path: Path, header: list[str], column: str) -> int:
    """Return the index of a column; raise an InputError if the header does not have the name exactly once."""
    if header.count(column) == 1:
        return header.index(column)
    known = f"its columns are {', '.join(header)}" if header else "its first line does not name columns"
    found = "twice" if column in header else "not"
    raise InputError(f"{path}: the column {column!r} is {found} in the file; {known}")


def _cell(path: Path, row: Row, place: int, column: str) -> float:
    """Return the number in one column of a line; raise an InputError if the cell is not a plain, finite number.

    place, column : index and name of the column
    """
    text = row.cells[place] if place < len(row.cells) else ""
    if not NUMBER.fullmatch(text) or not math.isfinite(float(text)):
        raise InputError(
            f"{path}, line {row.line}: the column {column!r} must be one plain, finite number, but is {text[:60]!r}"
            f"{decimal_comma(text)}"
        )
    return float(text)


def _number(path: Path, row: Row, header: list[str]) -> float:
    """Return the only number of a line; raise an InputError if the line has other content.

    header : names of the columns, for the advice in the message
    """
    cells = [cell for cell in row.cells if cell]
    if len(cells) != 1 or not NUMBER.fullmatch(cells[0]) or not math.isfinite(float(cells[0])):
        found = f"{len(cells)} cells ({', '.join(cells)})" if len(cells) != 1 else repr(cells[0])
        named = [name for name in header if name]
        several = len(named) > 1 and len(cells) != 1  # a header of one column may have blanks, such as `diameter [m]`
        advice = f"; name one of the columns {', '.join(named)} as `column`" if several else ""
        advice = advice or (decimal_comma(cells[0]) if len(cells) == 1 else "")
        raise InputError(f"{path}, line {row.line}: must be one plain, finite number, but is {found[:60]}{advice}")
    return float(cells[0])
