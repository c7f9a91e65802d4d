"""Find the coordinate reference system of a scene or a file, which georeferenced output states."""

import logging
from pathlib import Path

import rasterio
from rasterio.crs import CRS
from rasterio.errors import CRSError, RasterioError

from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import Up

GEOTIFF = (".tif", ".tiff")

logging.getLogger("rasterio").addHandler(logging.NullHandler())


def reference_system(name: str | None, up: Up) -> CRS | None:
    """Return the coordinate reference system of the horizontal coordinates of the input; None if the scene names none.

    With `up: y` the result is also None: plan coordinates are then x and z, z points south, and no reference system has
    such axes.

    Raises
    ------
    InputError
        The name is unknown, or the reference system is in degrees.
    """
    if name is None:
        return None
    if why := why_unusable(name):
        raise InputError(f"terrain.crs {why}")
    return _named(name) if up == "z" else None


def why_unusable(name: str) -> str | None:
    """Return why a coordinate reference system cannot be used for a terrain in metres; None if it can be used."""
    try:
        system = _named(name)
    except CRSError:
        return f"is {name!r}, which is no known coordinate reference system; give one such as EPSG:31287"
    if system.is_geographic:
        return f"is {name!r}, which is in degrees; the terrain is in metres, and so must it be"
    return None


def are_same(name: str, other: str) -> bool:
    """True if two names, both known, mean the same coordinate reference system."""
    return bool(_named(name) == _named(other))


def reference_system_of_file(path: Path) -> str | None:
    """Return the coordinate reference system that a GeoTIFF states: its EPSG code or else its whole definition (WKT).

    Return None for any other file, and for a file without a reference system. Also return None if the system is in
    degrees or the file is damaged: the function that reads the file then reports the error.
    """
    if path.suffix.lower() not in GEOTIFF:
        return None
    try:
        with rasterio.open(path, driver="GTiff") as grid:
            system = grid.crs
    except (RasterioError, OSError):
        return None
    if system is None or system.is_geographic:
        return None
    code = system.to_epsg()
    return f"EPSG:{code}" if code else str(system.to_wkt())


def _named(name: str) -> CRS:
    """Return the coordinate reference system with a name; raise CRSError if the name is unknown."""
    with rasterio.Env():  # without Env, GDAL and PROJ print their errors to the terminal
        return CRS.from_user_input(name)
