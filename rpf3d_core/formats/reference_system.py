"""The coordinate reference system of a scene or a file, for georeferenced output."""

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
    """Return the reference system of plan coordinates in the input's own axes; None if the scene names none.

    Return None with `up: y` as well: plan coordinates are then x and z, z runs south, and no reference system has such
    axes.

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
    """Return why a reference system cannot be used for a terrain in metres; None if it can."""
    try:
        system = _named(name)
    except CRSError:
        return f"is {name!r}, which is no known coordinate reference system; give one such as EPSG:31287"
    if system.is_geographic:
        return f"is {name!r}, which is in degrees; the terrain is in metres, and so must it be"
    return None


def are_same(name: str, other: str) -> bool:
    """True if two known names mean the same reference system."""
    return bool(_named(name) == _named(other))


def reference_system_of_file(path: Path) -> str | None:
    """Return the reference system of a GeoTIFF: its EPSG code or, without one, the whole definition (WKT).

    Return None for other files and if the file states no reference system; also if the system is in degrees or the file
    is damaged, because the reader of the file refuses both.
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
    """Return the reference system of a name; raise CRSError if the name is unknown."""
    with rasterio.Env():  # without Env, GDAL and PROJ print their errors to the terminal
        return CRS.from_user_input(name)
