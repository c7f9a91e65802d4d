"""Read clouds of points from text: x y z on each line, or a CSV with named columns, as `formats.points` describes.

A column named class or classification holds the LAS class of each point. A remark names other columns.
"""

import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.formats.mine.cloud import Cloud
from rpf3d_core.formats.points import AxisColumn, columns_of, further_columns_of, read_points, rows_of, text_of
from rpf3d_core.terrain.frame import FloatArray

HEAD = 2**16
"""Number of characters at the beginning of a file, from which the separator and the columns are found."""
CLASS_NAMES = ("class", "classification")
"""Names, in any case, of the column with the LAS class of each point."""
MOST_CLASS = 255
"""Largest class of a point (ASPRS LAS 1.4, table 17)."""


class _Layout(NamedTuple):
    """The layout of a text or CSV file.

    separator : of cells, None for blanks; skipped : number of lines up to the header, 0 without a header
    columns : of x, y and z; further : place, from 0, and name of each other column
    """

    separator: str | None
    skipped: int
    columns: tuple[AxisColumn, ...]
    further: dict[int, str]

    @property
    def class_column(self) -> int | None:
        """Place of the column of classes, from 0; None if no column, or more than one, has one of CLASS_NAMES."""
        found = [place for place, name in self.further.items() if name.lower() in CLASS_NAMES]
        return found[0] if len(found) == 1 else None


def read_xyz(path: Path) -> Cloud:
    """Return the points of a text or CSV file, and their classes if a header names one column of classes.

    All lines are converted in one step. If this fails, `read_points` reads the lines one by one and names a wrong line.

    Raises
    ------
    TerrainError
        The file is not text, has no point, or a line has no plain numbers; the message names the line.
    """
    try:
        head = _head(path)
        layout = _Layout(*columns_of(path, head), further_columns_of(path, head))
        points, numbers = _points_and_classes(path, layout, quoted='"' in head)
    except InputError as fault:
        raise TerrainError(str(fault)) from fault
    classes = None if numbers is None else _classes(numbers)
    return Cloud(points, classes=classes, remarks=tuple(_not_read(path, layout, classes is not None)))


def _head(path: Path) -> str:
    """Return the first whole lines of a file, of up to HEAD characters."""
    try:
        with path.open(encoding="utf-8-sig") as file:
            head = file.read(HEAD)
    except UnicodeDecodeError as fault:
        raise TerrainError(f"{path}: cannot be read as text ({fault})") from fault
    return head.rpartition("\n")[0] or head


def _points_and_classes(path: Path, layout: _Layout, quoted: bool) -> tuple[FloatArray, FloatArray | None]:
    """Return the points (N, 3) m of a file, and the numbers (N,) in its column of classes.

    The second result is None if the file has no such column, or if a cell of the column is not a number.

    quoted : True if cells are between quotes, so that the lines must be read one by one
    """
    places = [column.place for column in layout.columns]
    units = [column.unit for column in layout.columns]
    choices = [places] if layout.class_column is None else [[*places, layout.class_column], places]
    for chosen in [] if quoted else choices:
        table = _all_at_once(path, layout, chosen)
        if table is not None and np.isfinite(table[:, :3]).all():
            table[:, :3] *= units
            return table[:, :3], table[:, 3] if len(chosen) > 3 else None
    return read_points(path), _class_cells(path, layout)


def _all_at_once(path: Path, layout: _Layout, places: list[int]) -> FloatArray | None:
    """Return some columns of a file as numbers (N, len(places)), N >= 1; None if they cannot be read in one step.

    places : of the columns, from 0
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # the warning about a file without numbers
            table = np.loadtxt(
                path, delimiter=layout.separator, usecols=places, skiprows=layout.skipped, ndmin=2, encoding="utf-8-sig"
            )
    except (ValueError, IndexError, UnicodeDecodeError, UserWarning):
        return None
    return table if len(table) else None


def _class_cells(path: Path, layout: _Layout) -> FloatArray | None:
    """Return the numbers (N,) in the column of classes, read line by line.

    The result is None if the file has no such column, or if a cell of the column is not a number.
    """
    if layout.class_column is None:
        return None
    rows = list(rows_of(path, text_of(path)))[1:]
    try:
        return np.array([float(row.cells[layout.class_column]) for row in rows])
    except (ValueError, IndexError):
        return None


def _classes(numbers: FloatArray) -> NDArray[np.uint8] | None:
    """Return numbers (N,) as LAS classes; None if one of them is not a whole number from 0 to MOST_CLASS."""
    is_class = (numbers >= 0) & (numbers <= MOST_CLASS) & (numbers == np.floor(numbers))
    return numbers.astype(np.uint8) if is_class.all() else None


def _not_read(path: Path, layout: _Layout, has_classes: bool) -> list[str]:
    """Return a list with a sentence on the columns that are not read; [] if there are none.

    has_classes : True if the column of classes is read
    """
    place = layout.class_column
    left = [name for at, name in layout.further.items() if not (has_classes and at == place)]
    if not left:
        return []
    kind = "column" if len(left) == 1 else "columns"
    why = "" if has_classes or place is None else (
        f"; {layout.further[place]!r} gives classes of points only if each cell is a whole number from 0 to "
        f"{MOST_CLASS}"
    )  # fmt: skip
    return [f"{path.name}: not read: {kind} {', '.join(left)}{why}"]
