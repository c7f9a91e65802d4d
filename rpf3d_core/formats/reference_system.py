"""The coordinate reference system that a scene or a file names, as georeferenced files need it."""

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
    """The reference system of plan coordinates in the input's own axes; None where the scene names none.

    None with `up: y` as well: plan coordinates are x and z there, z runs south, and no reference system has such axes.

    Raises
    ------
    InputError
        The name is not known, or is one of degrees.
    """
    if name is None:
        return None
    if why := why_unusable(name):
        raise InputError(f"terrain.crs {why}")
    return _named(name) if up == "z" else None


def why_unusable(name: str) -> str | None:
    """Why a reference system cannot be that of a terrain in metres, None if it can."""
    try:
        system = _named(name)
    except CRSError:
        return f"is {name!r}, which is no known coordinate reference system; give one such as EPSG:31287"
    if system.is_geographic:
        return f"is {name!r}, which is in degrees; the terrain is in metres, and so must it be"
    return None


def are_same(name: str, other: str) -> bool:
    """Whether two names that are known mean one reference system."""
    return bool(_named(name) == _named(other))


def reference_system_of_file(path: Path) -> str | None:
    """What a GeoTIFF says it is in: its EPSG code or, where it has none, the whole definition (WKT).

    None for other files and where it says nothing; also where it is in degrees or damaged, which its reader refuses.
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
    """A reference system by its name; `CRSError` if there is none."""
    with rasterio.Env():  # without it, what GDAL and PROJ find wrong goes to the terminal as it is
        return CRS.from_user_input(name)
