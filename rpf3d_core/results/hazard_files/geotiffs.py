"""Write the hazard maps as GeoTIFFs (hazard/*.tif), one file for each quantity, for GIS programs.

The plan axes are the axes of the input, as in polygons of zones and areas: x and y, or x and z if y is up. The tag AXES
names the two axes. The first row has the largest second coordinate.

Nodata: in a percentile, NaN means that fewer than 20 rocks reached the cell; in another statistic or a time, NaN means
that no rock reached the cell. Shares and counts are 0 in cells that no rock reached. NaN in `reach_probability_low` and
`reach_probability_high` means that the predictive interval is unknown, because too few parameter sets have flown.
"""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from affine import Affine
from numpy.typing import NDArray

from rpf3d_core.formats.reference_system import reference_system
from rpf3d_core.hazard.maps import CountArray, HazardMaps, Raster
from rpf3d_core.hazard.passages import Passage, passage_per_metre
from rpf3d_core.hazard.quantities import (
    ENERGY,
    ENERGY_WORST,
    PER_METRE,
    REACH_HIGH,
    REACH_LOW,
    REACH_WORST,
    STATISTICS,
    Quantity,
    counts_of,
    shares_of,
    spreads_of,
    statistics_of,
)
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

if TYPE_CHECKING:  # rasterio takes 0.1 s to import, so it is imported late, while the second process draws
    from rasterio.crs import CRS
    from rasterio.windows import Window

COUNT_NODATA = 2**32 - 1
"""Value that marks a missing count in a file; no cell has this value, because a cell without rocks has the count 0."""

TILE, LARGE = 256, 1024
"""Side of a tile (cells); and number of rows or columns from which a file has tiles, which viewers read separately."""

SPREAD_OF = "of each rock's maximum in the cell, over the different rocks that reached it"


def write_hazard_rasters(folder: Path, terrain: Terrain, maps: HazardMaps, crs: str | None = None) -> None:
    """Write the hazard maps as GeoTIFFs into an existing folder, one file for each quantity.

    `reach_probability`, `first_arrival_s`, `passages`, `impacts` and `deposits` have one band. `energy_j`, `speed_m_s`
    and `height_m` have the bands max, mean, p50, p90, p95 and p99, in this order. `passage_per_metre`, if the maps
    have it, has the bands value, low and high; low and high are the ends of the 95 % interval. A run over parameter
    sets also has `reach_probability_low` and `reach_probability_high`, the ends of the predictive interval. A scene
    with several sources also has `reach_probability_worst_source` and `energy_j_worst_source`, with the bands `value`
    and `source`, unless their counts needed too much memory.

    Parameters
    ----------
    crs : `terrain.crs` of the scene; None if the scene has none

    Raises
    ------
    InputError
        `crs` is unknown, or is in degrees.
    """
    from rasterio.errors import NotGeoreferencedWarning

    system = reference_system(crs, terrain.frame.up)
    with warnings.catch_warnings():
        # rasterio warns of cells of 1 m with a corner at (0, 0), but the file is correct.
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        _write_all(folder, terrain, maps, system)


def _write_all(folder: Path, terrain: Terrain, maps: HazardMaps, system: "CRS | None") -> None:
    for quantity, values in shares_of(maps, maps.cells):
        _write(folder, quantity, terrain.frame, maps, system, [values.astype(np.float32)])
    if maps.reach_band is not None:
        band = maps.reach_band
        for quantity, values in ((REACH_LOW, band.low), (REACH_HIGH, band.high)):
            _write(folder, quantity, terrain.frame, maps, system, [values.astype(np.float32)], band.cell)
    if (worst := maps.worst_cells) is not None:
        for quantity, values, source in (
            (REACH_WORST, worst.reach, worst.reach_source), (ENERGY_WORST, worst.energy, worst.energy_source)
        ):  # fmt: skip
            _write(folder, quantity, terrain.frame, maps, system, [values.astype(np.float32), _numbers(values, source)])
    if maps.cells.has_ways:
        bands = [values.astype(np.float32) for values in passage_per_metre(maps)]
        _write(folder, PER_METRE, terrain.frame, maps, system, bands)
    for quantity, counts in counts_of(maps.cells):
        fits = counts.max(initial=0) < COUNT_NODATA
        _write(folder, quantity, terrain.frame, maps, system, [counts.astype(np.uint32 if fits else np.float64)])
    for quantity, spread in spreads_of(maps.cells):
        bands = [values.astype(np.float32) for values in statistics_of(spread)]
        _write(folder, quantity, terrain.frame, maps, system, bands)


def _numbers(values: NDArray[Any], source: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the band of the sources (S,) of values: numbers from 1, 0 for all rocks together; NaN without a value."""
    return np.where(np.isnan(values), np.nan, source + 1).astype(np.float32)


def transform_of(raster: Raster, frame: Frame) -> Affine:
    """Return the transformation from columns and rows of a GeoTIFF to plan coordinates (m).

    The order of the rows is as in `upright`. Columns and rows count from the outer corner of the first cell.
    """
    east, north, _ = frame.origin
    top = -(raster.y + north) if frame.up == "y" else raster.y + raster.ny * raster.cell + north
    return Affine(raster.cell, 0.0, raster.x + east, 0.0, -raster.cell, top)


def upright(values: NDArray[Any], raster: Raster, frame: Frame) -> NDArray[Any]:
    """Return the values (C,) of all map cells as the image (ny, nx) of a GeoTIFF.

    The first row has the largest second plan coordinate of the input: the largest y, or the largest z if y is up.
    """
    image = values.reshape(raster.ny, raster.nx)
    return image if frame.up == "y" else image[::-1]


class RasterPart(NamedTuple):
    """A part of a GeoTIFF that is written in one call, and the N cells with values in it.

    window : position and size of the part in the image
    cells : (N,) index among the S cells with values; row, column : (N,) position of each cell in the window
    """

    window: "Window"
    cells: NDArray[np.int64]
    row: NDArray[np.int64]
    column: NDArray[np.int64]


def _parts(cells: CountArray, raster: Raster, frame: Frame, tiles: bool) -> list[RasterPart]:
    """Return the parts of a GeoTIFF to write: the tiles that contain given cells (S,), or the whole image as one part.

    cells : (S,) raster indices of the cells with values; tiles : True to write tiles
    """
    from rasterio.windows import Window

    row, column = np.divmod(cells, raster.nx)
    row = row if frame.up == "y" else raster.ny - 1 - row
    if not tiles:
        return [
            RasterPart(window=Window(0, 0, raster.nx, raster.ny), cells=np.arange(len(row)), row=row, column=column)
        ]
    tile = row // TILE * raster.nx + column // TILE
    order = np.argsort(tile, kind="stable")
    parts = []
    for some in np.split(order, np.flatnonzero(np.diff(tile[order])) + 1) if len(order) else ():
        top, left = row[some[0]] // TILE * TILE, column[some[0]] // TILE * TILE
        window = Window(left, top, min(TILE, raster.nx - left), min(TILE, raster.ny - top))
        parts.append(RasterPart(window=window, cells=some, row=row[some] - top, column=column[some] - left))
    return parts


def _write(
    folder: Path, quantity: Quantity, frame: Frame, maps: HazardMaps, crs: "CRS | None", bands: Sequence[NDArray[Any]],
    cells: CountArray | None = None,
) -> None:  # fmt: skip
    """Write one GeoTIFF from the values of S cells.

    In a tiled file of a quantity that is NaN in cells without rocks, only tiles with values are written. rasterio fills
    the other tiles with NaN.

    bands : for each band, the values (S,) of the cells
    cells : (S,) raster indices of the cells; None for the cells that rocks reached
    """
    import rasterio

    raster, kind = maps.raster, bands[0].dtype
    profile = {
        "driver": "GTiff", "width": raster.nx, "height": raster.ny, "count": len(bands), "dtype": kind, "crs": crs,
        "transform": transform_of(raster, frame), "nodata": COUNT_NODATA if kind == np.uint32 else np.nan,
        "interleave": "band", "compress": "deflate", "zlevel": 1,
    }  # fmt: skip
    tiled = max(raster.nx, raster.ny) >= LARGE
    if tiled:
        profile |= {"tiled": True, "blockxsize": TILE, "blockysize": TILE}
    given = maps.cells.cell if cells is None else cells
    parts = _parts(given, raster, frame, tiled and math.isnan(quantity.elsewhere))
    with rasterio.open(folder / f"{quantity.name}.tif", "w", **profile) as file:
        file.update_tags(**_tags(quantity, frame, maps, len(bands)))
        for number, values in enumerate(bands, start=1):
            for part in parts:
                image = np.full((part.window.height, part.window.width), quantity.elsewhere, kind)
                image[part.row, part.column] = values[part.cells]
                file.write(image, number, window=part.window)
            file.set_band_description(number, _band_name(quantity, number, len(bands)))
            file.set_band_unit(number, quantity.unit)


def _band_name(quantity: Quantity, number: int, bands: int) -> str:
    """Return the name of a band of a GeoTIFF, such as p95; number : from 1; bands : number of bands of the file."""
    if bands == 1:
        return quantity.name
    if quantity in (REACH_WORST, ENERGY_WORST):
        return ("value", "source")[number - 1]
    return (Passage._fields if quantity is PER_METRE else STATISTICS)[number - 1]


def _tags(quantity: Quantity, frame: Frame, maps: HazardMaps, bands: int) -> dict[str, str]:
    """Return the metadata tags of a GeoTIFF: quantity, unit, meaning, number of rocks, cell size (m) and axes.

    bands : number of bands of the file
    """
    meaning = f"{maps.energy_kind} kinetic energy" if quantity is ENERGY else quantity.meaning
    worst = quantity in (REACH_WORST, ENERGY_WORST)
    names = {"SOURCES": "; ".join(f"{i} {name}" for i, name in enumerate(maps.sources.names, 1))} if worst else {}
    return {
        **names,
        "QUANTITY": quantity.name,
        "UNITS": quantity.unit,
        "MEANING": f"{meaning}; {SPREAD_OF}" if bands == len(STATISTICS) else meaning,
        "ROCKS": str(maps.flown),
        "CELL_M": f"{maps.raster.cell:g}",
        "CELL_MATTERS": "no" if quantity is PER_METRE else "yes",
        "AXES": "x y" if frame.up == "z" else "x z",
        "SOFTWARE": "rpf3d",
    }
