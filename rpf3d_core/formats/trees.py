"""Read trees from a file: a CSV with a header, or lines of x, y, dbh_cm, height and kind."""

import math
import re
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.formats.points import COLUMN_NAMES, NUMBER, Row, rows_of, text_of
from rpf3d_core.formats.words import either
from rpf3d_core.terrain.frame import Up

UNIT = re.compile(r"(_m|\s*\(m\)|\s*\[m\])$")
"""Pattern of the unit at the end of a column's name; coordinates and heights of trees are in m."""
KINDS = ("conifer", "broadleaved", "silver_fir")
NAMES = {
    "dbh": ("dbh_cm", "dbh", "diameter_cm"),
    "height": ("height", "tree_height"),
    "kind": ("kind", "type", "species"),
    "foot": ("z", "foot"),
}
"""Names that the columns of a tree file may have, by property; `_columns` adds the horizontal coordinates."""
WITHOUT_A_HEADER = ("east", "north", "dbh", "height", "kind")
MUST = ("east", "north", "dbh")
THICKEST, HIGHEST = 500.0, 150.0
"""Largest DBH (cm, diameter at breast height) and largest height (m) that are accepted."""


class Tree(NamedTuple):
    """One tree of a tree file: its position, diameter, height and kind, for the forest effect.

    line : line in the file, from 1; east, north : plan coordinates of the input (m)
    dbh : diameter at breast height (cm); kind : one of KINDS, "conifer" if the file does not state the kind
    height : m; foot : altitude of the ground (m); both None if the file does not state them
    """

    line: int
    east: float
    north: float
    dbh: float
    height: float | None
    kind: str
    foot: float | None


def read_trees(path: Path, up: Up) -> list[Tree]:
    """Return the trees of a file, at least one; up : the input axis that points up.

    Raises
    ------
    InputError
        The file cannot be read, has no tree, or has a wrong value; the message names the line and the value.
    """
    rows = list(rows_of(path, text_of(path)))
    if rows and not any(NUMBER.fullmatch(cell) for cell in rows[0].cells):
        columns, rows = _columns(path, rows[0], up), rows[1:]
    else:
        columns = {name: place for place, name in enumerate(WITHOUT_A_HEADER)}
    if not rows:
        raise InputError(f"{path}: holds no tree; each line must begin with x y dbh_cm")
    return [_tree(path, row, columns) for row in rows]


def _columns(path: Path, header: Row, up: Up) -> dict[str, int]:
    """Return the index of the column of each property of a tree, found by the names in a header.

    An optional property without a column is left out. Raise an InputError if a required property has no column, or any
    property has several.
    """
    names = [UNIT.sub("", cell.lower()) for cell in header.cells]
    plan = ("x", "y") if up == "z" else ("x", "z")
    known = {
        "east": (plan[0], *(COLUMN_NAMES["x"] if up == "z" else ())),
        "north": (plan[1], *(COLUMN_NAMES["y"] if up == "z" else ())),
        **NAMES, "foot": ("z", "foot") if up == "z" else ("y", "foot"),
    }  # fmt: skip
    columns = {}
    for what, words in known.items():
        found = [place for place, name in enumerate(names) if name in words]
        if len(found) > 1 or (not found and what in MUST):
            raise InputError(
                f"{path}, line {header.line}: a header must name {', '.join(words)} once, but is "
                f"{', '.join(header.cells)!r}"
            )
        if found:
            columns[what] = found[0]
    return columns


def _tree(path: Path, row: Row, columns: dict[str, int]) -> Tree:
    numbers = {what: _number(path, row, columns, what) for what in ("east", "north", "dbh", "height", "foot")}
    dbh, height = numbers["dbh"] or 0.0, numbers["height"]
    _check(path, row, "dbh_cm", dbh, THICKEST, "cm")
    if height is not None:
        _check(path, row, "height", height, HIGHEST, "m")
    place = columns.get("kind", len(row.cells))
    kind = (row.cells[place] if place < len(row.cells) else "") or KINDS[0]
    if kind.lower() not in KINDS:
        raise InputError(f"{path}, line {row.line}: kind is {kind!r}, but must be {either(KINDS)}")
    return Tree(
        line=row.line,
        east=numbers["east"] or 0.0,
        north=numbers["north"] or 0.0,
        dbh=dbh,
        height=height,
        kind=kind.lower(),
        foot=numbers["foot"],
    )


def _number(path: Path, row: Row, columns: dict[str, int], what: str) -> float | None:
    """Return the number in one cell of a tree file; None if the cell is optional and empty.

    columns : index of the column of each property; what : the wanted property, such as "dbh"

    Raises
    ------
    InputError
        The cell is missing, or not a plain, finite number.
    """
    place = columns.get(what, len(row.cells))
    cell = row.cells[place] if place < len(row.cells) else ""
    if not cell and what not in MUST:
        return None
    if not NUMBER.fullmatch(cell) or not math.isfinite(float(cell)):
        found = f"is {cell!r}" if cell else "is missing"
        raise InputError(f"{path}, line {row.line}: {what} must be a plain, finite number, but {found}")
    return float(cell)


def _check(path: Path, row: Row, what: str, value: float, most: float, unit: str) -> None:
    if not 0.0 < value <= most:
        must = f"above 0 and up to {most:g} ({unit})"
        raise InputError(f"{path}, line {row.line}: {what} is {value:g}, but must be {must}")
