"""hazard/*.tif: the hazard of the raster's cells as GeoTIFFs, one file a quantity.

Plan axes are those of the input, as in polygons of zones and areas: x and y, or x and z where y is up (the file's
second axis is z then, and says so in its tag AXES). The first row is that of the largest second coordinate.

Nodata: NaN in a statistic or a time means that no rock came, in a percentile that fewer than 20 did. Shares and counts
are 0 where no rock came; 0 is a value.
"""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import rasterio
from affine import Affine
from numpy.typing import NDArray
from rasterio.crs import CRS
from rasterio.errors import NotGeoreferencedWarning
from rasterio.windows import Window

from rpf3d_core.formats.reference_system import reference_system
from rpf3d_core.hazard.maps import HazardMaps, Raster
from rpf3d_core.hazard.passages import Passage, passage_per_metre
from rpf3d_core.hazard.quantities import (
    ENERGY,
    PER_METRE,
    STATISTICS,
    Quantity,
    counts_of,
    shares_of,
    spreads_of,
    statistics_of,
)
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

COUNT_NODATA = 2**32 - 1
"""Declared for counts, and never used: 0 is a value there."""

TILE, LARGE = 256, 1024
"""Files of at least LARGE cells along a side are written in tiles of TILE cells, for viewers read them in parts."""

SPREAD_OF = "of each rock's maximum in the cell, over the distinct rocks that came there"


def write_hazard_rasters(folder: Path, terrain: Terrain, maps: HazardMaps, crs: str | None = None) -> None:
    """Write a GeoTIFF for each quantity into an existing folder.

    `reach_probability`, `first_arrival_s`, `passages`, `impacts` and `deposits` have one band; `energy_j`, `speed_m_s`
    and `height_m` have max, mean, p50, p90, p95 and p99, in this order, by these names. `passage_per_metre`, where the
    maps have it, has value, low and high: the ends of its 95 % interval.

    Parameters
    ----------
    crs : as `terrain.crs` of the scene

    Raises
    ------
    InputError
        As `reference_system`.
    """
    system = reference_system(crs, terrain.frame.up)
    with warnings.catch_warnings():
        # Of cells of 1 m from a corner at (0, 0), which this driver does keep.
        warnings.simplefilter("ignore", NotGeoreferencedWarning)
        _write_all(folder, terrain, maps, system)


def _write_all(folder: Path, terrain: Terrain, maps: HazardMaps, system: CRS | None) -> None:
    for quantity, values in shares_of(maps, maps.cells):
        _write(folder, quantity, terrain.frame, maps, system, [values.astype(np.float32)])
    if maps.cells.has_ways:
        bands = [values.astype(np.float32) for values in passage_per_metre(maps)]
        _write(folder, PER_METRE, terrain.frame, maps, system, bands)
    for quantity, counts in counts_of(maps.cells):
        fits = counts.max(initial=0) < COUNT_NODATA
        _write(folder, quantity, terrain.frame, maps, system, [counts.astype(np.uint32 if fits else np.float64)])
    for quantity, spread in spreads_of(maps.cells):
        bands = [values.astype(np.float32) for values in statistics_of(spread)]
        _write(folder, quantity, terrain.frame, maps, system, bands)


def transform_of(raster: Raster, frame: Frame) -> Affine:
    """From column and row of `upright` values, counted from the corner of the first cell, to plan coordinates, m."""
    east, north, _ = frame.origin
    top = -(raster.y + north) if frame.up == "y" else raster.y + raster.ny * raster.cell + north
    return Affine(raster.cell, 0.0, raster.x + east, 0.0, -raster.cell, top)


def upright(values: NDArray[Any], raster: Raster, frame: Frame) -> NDArray[Any]:
    """Values (C,) as an image (ny, nx) whose first row has the largest y, or z where y is up: that is to the south."""
    image = values.reshape(raster.ny, raster.nx)
    return image if frame.up == "y" else image[::-1]


class RasterPart(NamedTuple):
    """A part of an image: which of the S cells that rocks came to lie in it, and in which of its rows and columns."""

    window: Window
    cells: NDArray[np.int64]
    row: NDArray[np.int64]
    column: NDArray[np.int64]


def _parts(maps: HazardMaps, frame: Frame, tiles: bool) -> list[RasterPart]:
    """The tiles of an image that rocks came to, or all of it as one part."""
    raster = maps.raster
    row, column = np.divmod(maps.cells.cell, raster.nx)
    row = row if frame.up == "y" else raster.ny - 1 - row
    if not tiles:
        return [RasterPart(Window(0, 0, raster.nx, raster.ny), np.arange(len(row)), row, column)]
    tile = row // TILE * raster.nx + column // TILE
    order = np.argsort(tile, kind="stable")
    parts = []
    for cells in np.split(order, np.flatnonzero(np.diff(tile[order])) + 1) if len(order) else ():
        top, left = row[cells[0]] // TILE * TILE, column[cells[0]] // TILE * TILE
        window = Window(left, top, min(TILE, raster.nx - left), min(TILE, raster.ny - top))
        parts.append(RasterPart(window, cells, row[cells] - top, column[cells] - left))
    return parts


def _write(
    folder: Path, quantity: Quantity, frame: Frame, maps: HazardMaps, crs: CRS | None, bands: Sequence[NDArray[Any]]
) -> None:
    """Write bands of values (S,). Tiles that no rock came to are nodata, which the library fills in by itself."""
    raster, kind = maps.raster, bands[0].dtype
    profile = {
        "driver": "GTiff", "width": raster.nx, "height": raster.ny, "count": len(bands), "dtype": kind, "crs": crs,
        "transform": transform_of(raster, frame), "nodata": COUNT_NODATA if kind == np.uint32 else np.nan,
        "interleave": "band", "compress": "deflate", "zlevel": 1,
    }  # fmt: skip
    tiled = max(raster.nx, raster.ny) >= LARGE
    if tiled:
        profile |= {"tiled": True, "blockxsize": TILE, "blockysize": TILE}
    parts = _parts(maps, frame, tiled and math.isnan(quantity.elsewhere))
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
    """The name of band `number`, from 1, of so many."""
    if bands == 1:
        return quantity.name
    return (Passage._fields if quantity is PER_METRE else STATISTICS)[number - 1]


def _tags(quantity: Quantity, frame: Frame, maps: HazardMaps, bands: int) -> dict[str, str]:
    """What a reader must know of the numbers, beside the bands' names."""
    meaning = f"{maps.energy_kind} kinetic energy" if quantity is ENERGY else quantity.meaning
    return {
        "QUANTITY": quantity.name,
        "UNITS": quantity.unit,
        "MEANING": f"{meaning}; {SPREAD_OF}" if bands == len(STATISTICS) else meaning,
        "ROCKS": str(maps.flown),
        "CELL_M": f"{maps.raster.cell:g}",
        "CELL_MATTERS": "no" if quantity is PER_METRE else "yes",
        "AXES": "x y" if frame.up == "z" else "x z",
        "SOFTWARE": "rpf3d",
    }
