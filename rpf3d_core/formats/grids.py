"""Read elevation grids as terrain: ESRI ASCII and GeoTIFF through rasterio.

Each elevation of the grid belongs to the centre of a cell. Therefore the vertices of the mesh are the cell centres, and
the mesh ends half a cell inside the outline of the grid. (`xllcorner` is the lower left corner of the outline,
`xllcenter` is the centre of the lower left cell; both keys give the same mesh for the same grid.) Four neighbouring
centres form a square of two triangles.
All squares are cut along the same diagonal, from the first row and column to the next row and column (north-west to
south-east in a north-up grid). A square with a corner without data becomes a hole.
"""

import gzip
import logging
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from affine import Affine

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.surface import MOST_TRIANGLES, FileMesh
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.grid_triangles import grid_triangles

DEM_EXTENSIONS = (".asc", ".asc.gz", ".tif", ".tiff")

HEADER_KEYS = b"ncols nrows xllcorner yllcorner xllcenter yllcenter cellsize dx dy nodata_value".split()

ESRI_NODATA = -9999.0
"""The elevation that marks missing data if an ESRI ASCII grid names no such value (ESRI, ASCII raster format)."""

logging.getLogger("rasterio").addHandler(logging.NullHandler())


def read_dem(path: Path) -> FileMesh:
    """Return the terrain mesh of an elevation grid.

    All facets face up, and are ordered square by square along the rows.

    Parameters
    ----------
    path : Path
        .asc, .asc.gz, .tif or .tiff; the first band has the elevations. Coordinates and elevations are in the unit of
        the file. The reference system, if stated, must be projected.

    Raises
    ------
    TerrainError
        The file is not a raster, is truncated, is in degrees, has too many cells, or has a word in place of a number.
    """
    return _surface(*read_grid(path))


def read_grid(path: Path, kind: str = "elevation") -> tuple[FloatArray, Affine]:
    """Return the numbers (H, W) of a grid in the file's unit, and the transform from its columns and rows to x and y.

    Missing numbers are NaN. The transform counts columns and rows from the outer corner of the first cell.

    kind : the word for a number in messages, such as "elevation"

    Raises
    ------
    TerrainError
        As `read_dem`.
    """
    from rasterio.errors import NotGeoreferencedWarning, RasterioError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", NotGeoreferencedWarning)
            return _read_numbers(path, kind)
    except (RasterioError, OSError, EOFError, zlib.error, MemoryError) as fault:
        article = "an" if kind[0] in "aeiou" else "a"
        raise TerrainError(f"{path}: cannot be read as {article} {kind} grid ({fault})") from fault


def _read_numbers(path: Path, kind: str) -> tuple[FloatArray, Affine]:
    """Return the numbers and the transform of a grid, as `read_grid` does; errors of libraries are not converted."""
    import rasterio  # takes a tenth of a second, and only grids need it

    is_text = path.name.lower().endswith((".asc", ".asc.gz"))
    name = f"/vsigzip/{path.absolute()}" if path.suffix.lower() == ".gz" else str(path)
    options: dict[str, Any] = {"driver": "AAIGrid", "DATATYPE": "Float64"} if is_text else {"driver": "GTiff"}
    with rasterio.open(name, **options) as grid:
        _refuse_unusable(path, grid)
        heights = _text_numbers(path, kind, grid.height, grid.width) if is_text else grid.read(1).astype(float)
        nodata = ESRI_NODATA if is_text and grid.nodata is None else grid.nodata
        missing = ~np.isfinite(heights) | (heights == nodata)
        if not is_text:
            missing |= grid.read_masks(1) == 0
        heights = heights * grid.scales[0] + grid.offsets[0]
        heights[missing] = np.nan
        return heights, grid.transform


def _refuse_unusable(path: Path, grid: Any) -> None:
    if grid.crs is not None and grid.crs.is_geographic:
        raise TerrainError(f"{path}: is in degrees ({grid.crs}); reproject it to a reference system in metres")
    if 2 * grid.width * grid.height > MOST_TRIANGLES:
        raise TerrainError(f"{path}: {grid.width:,} x {grid.height:,} cells are more than can be numbered; cut it")


def _text_numbers(path: Path, kind: str, rows: int, columns: int) -> FloatArray:
    """Return the numbers (rows, columns) below the header of an ESRI ASCII grid; refuse a truncated file.

    GDAL is not used for the numbers, because it would read a word as 0, and fill up a truncated file with zeros.
    """
    data = gzip.decompress(path.read_bytes()) if path.suffix.lower() == ".gz" else path.read_bytes()
    words = data.split()
    begin = next((n for n in range(0, len(words), 2) if words[n].lower() not in HEADER_KEYS), len(words))
    found = len(words) - begin
    if found != rows * columns:
        raise TerrainError(
            f"{path}: has {found:,} {kind}s, but its header announces {rows} rows of {columns}, "
            f"{rows * columns:,} in all; it is truncated or damaged"
        )
    try:
        return np.array(words[begin:], dtype=float).reshape(rows, columns)
    except ValueError as fault:
        raise TerrainError(f"{path}: every {kind} must be a number ({fault})") from fault


def _surface(heights: FloatArray, transform: Affine) -> FileMesh:
    """Return the mesh of a grid: vertices at the centres of cells with data, two triangles for each complete square."""
    row, column = np.nonzero(np.isfinite(heights))
    x = transform.a * (column + 0.5) + transform.b * (row + 0.5) + transform.c
    y = transform.d * (column + 0.5) + transform.e * (row + 0.5) + transform.f
    # In a north-up grid, rows run south: the determinant is negative.
    triangles = grid_triangles(np.isfinite(heights), rows_run_south=transform.determinant < 0)
    return FileMesh(np.stack([x, y, heights[row, column]], axis=1), triangles)
