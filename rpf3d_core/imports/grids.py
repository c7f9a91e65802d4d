"""Find and read the grids of an input folder, and check that all have the same cells as the elevation grid."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from affine import Affine
from numpy.typing import NDArray

from rpf3d_core.errors import InputError
from rpf3d_core.formats.cell_outlines import enclosed_cell
from rpf3d_core.formats.grids import DEM_EXTENSIONS, read_grid
from rpf3d_core.terrain.frame import FloatArray

Cells = NDArray[np.bool_]

SAME_CORNER = 1e-3
"""Tolerance, as a share (-) of a cell, within which corners and cell sides are equal: files have rounded numbers."""

DEM = "dem"


@dataclass(frozen=True, eq=False)
class Grids:
    """The input grids of an import, all on the same cells: H rows from north to south and W columns.

    files : path of each grid, by the name that the grid has in Rockyfor3D or STONE, such as dem
    values : numbers (H, W) of each grid, by the same name, in the unit of the grid; NaN for missing values
    transform : from column and row, counted from the outer corner of the first cell, to x and y (m)
    """

    files: Mapping[str, Path]
    values: Mapping[str, FloatArray]
    transform: Affine

    @property
    def cell(self) -> float:
        """Side of a cell (m)."""
        return float(self.transform.a)

    @property
    def ground(self) -> Cells:
        """Flags (H, W): True for cells with ground, that is with a height in the elevation grid."""
        return np.isfinite(self.values[DEM])

    def centres(self, cells: Cells) -> FloatArray:
        """Return the plan coordinates (N, 2) m of the centres of the flagged cells (H, W), row by row."""
        row, column = np.nonzero(cells)
        a = self.transform
        return np.stack([a.c + a.a * (column + 0.5), a.f + a.e * (row + 0.5)], axis=1)


def find_grids(folder: Path, names: Sequence[str]) -> dict[str, Path]:
    """Return the paths of the input grids in a folder, by grid name in lower case; other files are ignored.

    File names may have upper-case or lower-case letters.

    Raises
    ------
    InputError
        The path is not a folder, or two files have the name of the same grid.
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
    """Return the name of a grid file in lower case, without its extension; "" without one of DEM_EXTENSIONS."""
    name = path.name.lower()
    extension = next((known for known in sorted(DEM_EXTENSIONS, key=len)[::-1] if name.endswith(known)), None)
    return name.removesuffix(extension) if extension else ""


def require(folder: Path, found: Mapping[str, Path], names: Sequence[str], program: str) -> None:
    """Raise an error if a folder lacks a grid that the import needs.

    found : grids in the folder; names : needed grids; program : name of the other program, for the message

    Raises
    ------
    InputError
        A needed grid is missing; the message names the missing and all needed grids.
    """
    if missing := [f"{name}.asc" for name in names if name not in found]:
        raise InputError(f"{folder}: has no {', '.join(missing)}; {program} needs {', '.join(names)}, each as .asc")


def read_grids(files: Mapping[str, Path]) -> Grids:
    """Read the input grids of an import, and check that all have the cells of the elevation grid `dem`.

    files : path of each grid, by name; `dem` is required

    Raises
    ------
    InputError
        A file is damaged or has other cells than dem; or the cells of dem are not squares with north up; or dem has an
        enclosed gap. The message names the file.
    """
    read = {name: read_grid(path, "elevation" if name == DEM else "value") for name, path in files.items()}
    heights, transform = read[DEM]
    _refuse_unusable_cells(files[DEM], heights, transform)
    for name, (numbers, its) in read.items():
        _refuse_other_cells(files[name], numbers, its, files[DEM], heights, transform)
    return Grids(files=dict(files), values={name: numbers for name, (numbers, _) in read.items()}, transform=transform)


def _refuse_unusable_cells(path: Path, heights: FloatArray, transform: Affine) -> None:
    """Refuse an elevation grid with a gap amid cells with heights, or with cells that are not squares with north up."""
    across, down = transform.a, -transform.e
    if transform.b or transform.d or not np.isclose(across, down, rtol=SAME_CORNER) or across <= 0.0:
        raise InputError(f"{path}: its cells are {across:g} by {down:g} m; they must be squares, with north up")
    if (gap := enclosed_cell(~np.isfinite(heights))) is not None:
        where = _place(*gap)
        raise InputError(f"{path}: has no height at {where}, amid cells that have one; fill the gap")


def _refuse_other_cells(
    path: Path, numbers: FloatArray, its: Affine, dem: Path, heights: FloatArray, transform: Affine
) -> None:
    """Refuse a grid whose cells differ from the cells of the elevation grid.

    numbers, its : numbers (H, W) and transform of the grid
    heights, transform : numbers (H, W) and transform of the elevation grid, which is in the file `dem`
    """
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
    """Refuse a grid with wrong values, with a message that names the first wrong cell.

    Parameters
    ----------
    wrong : (H, W) True for wrong cells; what : the right values, as a phrase "must be ..."

    Raises
    ------
    InputError
        A cell is wrong; the message names the file, the first wrong cell, its value and the number of wrong cells.
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
    """Return row and column of a cell as text for messages, counted from 1."""
    return f"row {row + 1}, column {column + 1}"
