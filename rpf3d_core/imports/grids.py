"""The grids of an input folder: found by their names, read, and all on the cells of the elevation grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from affine import Affine
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.formats.grids import DEM_EXTENSIONS, read_grid
from rpf3d_core.results.cell_outlines import enclosed_cell
from rpf3d_core.terrain.frame import FloatArray

Cells = NDArray[np.bool_]

SAME_CORNER = 1e-3
"""Of a cell: corners that differ by less are written with fewer digits, not moved."""

DEM = "dem"


@dataclass(frozen=True, eq=False)
class Grids:
    """Grids on the same cells, H rows from the north and W columns.

    files : path of each grid, by its name in the program that it comes from
    values : numbers (H, W) of each in its own unit, NaN where there are none
    transform : from column and row, counted from the corner of the first cell, to x and y, m
    """

    files: Mapping[str, Path]
    values: Mapping[str, FloatArray]
    transform: Affine

    @property
    def cell(self) -> float:
        """Side of a cell, m."""
        return float(self.transform.a)

    @property
    def ground(self) -> Cells:
        """(H, W) whether a cell has a height."""
        return np.isfinite(self.values[DEM])

    def centres(self, cells: Cells) -> FloatArray:
        """Plan coordinates (N, 2) m of the centres of the flagged cells (H, W), row by row."""
        row, column = np.nonzero(cells)
        a = self.transform
        return np.stack([a.c + a.a * (column + 0.5), a.f + a.e * (row + 0.5)], axis=1)


def find_grids(folder: Path, names: Sequence[str]) -> dict[str, Path]:
    """Those files of a folder that have one of the names, in capitals or not, and the extension of a grid.

    Raises
    ------
    InputError
        It is no folder, or two files have the same name.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: is not a folder; give the one that holds {DEM}.asc and the other grids")
    found: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        name = _grid_name(path)
        if name not in names:
            continue
        if name in found:
            raise InputError(f"{folder}: {found[name].name} and {path.name} are both the grid {name}; keep one of them")
        found[name] = path
    return found


def _grid_name(path: Path) -> str:
    """The name of a grid file without its extension, in small letters; nothing for other files."""
    name = path.name.lower()
    extension = next((known for known in sorted(DEM_EXTENSIONS, key=len)[::-1] if name.endswith(known)), None)
    return name.removesuffix(extension) if extension else ""


def require(folder: Path, found: Mapping[str, Path], names: Sequence[str], program: str) -> None:
    """Refuse a folder that lacks grids.

    Raises
    ------
    InputError
        Names those that are missing and all that are needed.
    """
    if missing := [f"{name}.asc" for name in names if name not in found]:
        raise InputError(f"{folder}: has no {', '.join(missing)}; {program} needs {', '.join(names)}, each as .asc")


def read_grids(files: Mapping[str, Path]) -> Grids:
    """Read grids, the elevation grid `dem` among them, which lie on the same square cells.

    Raises
    ------
    InputError
        A file is damaged, does not lie on the cells of dem, or dem has no square cells, or a gap; names the file.
    """
    read = {name: read_grid(path, "elevation" if name == DEM else "value") for name, path in files.items()}
    heights, transform = read[DEM]
    _refuse_unusable_cells(files[DEM], heights, transform)
    for name, (numbers, its) in read.items():
        _refuse_other_cells(files[name], numbers, its, files[DEM], heights, transform)
    return Grids(dict(files), {name: numbers for name, (numbers, _) in read.items()}, transform)


def _refuse_unusable_cells(path: Path, heights: FloatArray, transform: Affine) -> None:
    """Refuse an elevation grid whose cells are not squares with north up, or that has a gap."""
    across, down = transform.a, -transform.e
    if transform.b or transform.d or not np.isclose(across, down, rtol=SAME_CORNER) or across <= 0.0:
        raise InputError(f"{path}: its cells are {across:g} by {down:g} m; they must be squares, with north up")
    if (gap := enclosed_cell(~np.isfinite(heights))) is not None:
        where = _place(*gap)
        raise InputError(f"{path}: has no height at {where}, amid cells that have one; fill the gap")


def _refuse_other_cells(
    path: Path, numbers: FloatArray, its: Affine, dem: Path, heights: FloatArray, transform: Affine
) -> None:
    """Refuse a grid that does not lie on the cells of the elevation grid."""
    cell, corner = transform.a, (transform.c, transform.f)
    if not np.allclose((its.a, -its.e), cell, rtol=SAME_CORNER / max(heights.shape), atol=0.0):
        raise InputError(f"{path}: its cells are {its.a:g} m, but those of {dem.name} {cell:g} m; resample it")
    if numbers.shape != heights.shape:
        has, must = ("{} rows of {}".format(*shape) for shape in (numbers.shape, heights.shape))
        raise InputError(f"{path}: has {has}, but {dem.name} has {must}; cut them alike")
    if not np.allclose((its.c, its.f), corner, rtol=0.0, atol=SAME_CORNER * cell):
        has, must = (f"({x:.10g}, {y:.10g})" for x, y in ((its.c, its.f), corner))
        raise InputError(f"{path}: its north-west corner is {has}, but that of {dem.name} is {must}; cut them alike")


def refuse_where(grids: Grids, name: str, wrong: Cells, what: str) -> None:
    """Refuse a grid that has wrong cells.

    Parameters
    ----------
    wrong : (H, W) flags ; what : what would be right: "must be ..."

    Raises
    ------
    InputError
        Names the file, the first such cell, its value and how many there are.
    """
    if not wrong.any():
        return
    row, column = (int(places[0]) for places in np.nonzero(wrong))
    value = grids.values[name][row, column]
    has = f"is {value:g}" if np.isfinite(value) else "has no value"
    count = int(wrong.sum())
    others = "" if count == 1 else f" (and {count - 1:,} more)"
    raise InputError(f"{grids.files[name]}: {has} at {_place(row, column)}{others}, but {what}")


def _place(row: int, column: int) -> str:
    """A cell as people count them."""
    return f"row {row + 1}, column {column + 1}"
