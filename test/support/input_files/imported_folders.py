"""Write small input folders of Rockyfor3D and STONE, in the formats of these programs."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROWS, COLUMNS, CELL = 14, 12, 5.0
CORNER = (601000.0, 201000.0)
"""x and y (m) of the grids' south-western corner."""
NODATA = -9999.0

Grid = NDArray[np.float64]


def write_grid(path: Path, values: Grid, cell: float = CELL, corner: tuple[float, float] = CORNER) -> Path:
    """Write values (rows, columns), northernmost row first, as an ESRI ASCII grid; NaN is written as NODATA.

    cell : size of a cell (m); corner : south-western corner (m)
    """
    rows, columns = values.shape
    header = f"ncols {columns}\nnrows {rows}\nxllcorner {corner[0]!r}\nyllcorner {corner[1]!r}\ncellsize {cell!r}\n"
    shown = np.where(np.isnan(values), NODATA, values)
    lines = [" ".join(repr(value) for value in row) for row in shown.tolist()]
    path.write_text(f"{header}NODATA_value {NODATA:g}\n" + "\n".join(lines) + "\n")
    return path


def slope(rows: int = ROWS, columns: int = COLUMNS) -> Grid:
    """Return the heights (m) of an uneven slope that falls to the south at about 40 degrees, to a level floor."""
    row, column = np.mgrid[0:rows, 0:columns].astype(float)
    fall = np.maximum(0.0, 0.7 * rows - row) * CELL * 0.84
    return np.asarray(400.0 + fall + 0.4 * np.sin(1.3 * column) + 0.3 * np.cos(row))


def full(value: float, rows: int = ROWS, columns: int = COLUMNS) -> Grid:
    """Return a grid (rows, columns) with the same value in all cells."""
    return np.full((rows, columns), value)


def rockyfor3d_grids() -> dict[str, Grid]:
    """Return the grids of a Rockyfor3D project, by file name: a slope with three soils, a river and source cells.

    Six source cells have rocks of two sizes. The import omits a seventh, because it is too near the edge of the grid.
    """
    soil, rough = full(4.0), {"rg70": full(0.05), "rg20": full(0.1), "rg10": full(0.3)}
    soil[9:11] = 3.0
    soil[11, 3:9] = 0.0
    soil[12:] = 1.0
    rough["rg70"][:, 7:], rough["rg20"][:, 7:], rough["rg10"][:, 7:] = 0.2, 0.4, 0.9
    density = full(0.0)
    density[2:4, 3:6] = 2650.0
    density[1, 3] = 2650.0
    axes = {name: full(0.0) for name in ("d1", "d2", "d3")}
    for name, length in zip(axes, (1.2, 1.0, 0.8), strict=True):
        axes[name][density > 0.0] = length
    axes["d1"][3, 3:6] = 0.6
    shape = np.where(density > 0.0, 2.0, 0.0)
    shape[3, 3:6] = 1.0
    return {"dem": slope(), "rockdensity": density, **axes, "blshape": shape, **rough, "soiltype": soil}


def stone_grids() -> dict[str, Grid]:
    """Return the grids of a STONE project, by file name: a slope with two lithologies and sources, above a lake.

    Source cells have 10 or 4 rocks; the values -1 and NaN mean that a cell has no source.
    """
    sources = full(np.nan)
    sources[2, 3:6], sources[3, 8] = 10.0, 4.0
    sources[12:, 2:10] = -1.0
    normal, tangential, friction = full(65.0), full(75.0), full(0.3)
    normal[6:], tangential[6:], friction[6:] = 35.0, 55.0, 0.65
    return {"dem": slope(), "sources": sources, "nrest": normal, "trest": tangential, "friction": friction}


def write_folder(folder: Path, grids: dict[str, Grid]) -> Path:
    """Create a folder, write each grid to it as NAME.asc, and return the folder."""
    folder.mkdir()
    for name, values in grids.items():
        write_grid(folder / f"{name}.asc", values)
    return folder
