"""Find the coordinate reference system of a scene or a file, which georeferenced output states."""

import json
import logging
import math
import re
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.formats.units import LENGTHS
from rpf3d_core.terrain.frame import FloatArray, Up

if TYPE_CHECKING:  # rasterio takes a tenth of a second to import, and only a scene with a reference system needs it
    from rasterio.crs import CRS

GEOTIFF = (".tif", ".tiff")
RANGE_OF_DEGREES = (180.0, 90.0)
"""Largest absolute longitude and latitude (degrees)."""

SAME_UNIT = 1e-7
"""Largest relative difference (-) of two lengths of one unit: files round the US survey foot, which is 2e-6 longer than
the foot.
"""
NEARLY_A_METRE = 1e-4
"""Largest relative difference (-) from a metre of a unit that counts as a metre, such as the German legal metre."""
IN_METRES = "the same projection in metres, such as EPSG:26941 in place of EPSG:2225"
"""A reference system that the user can name in place of one in feet."""
_NAME_IN_WKT = re.compile(r'\w+\["([^"]+)"')

logging.getLogger("rasterio").addHandler(logging.NullHandler())


class SystemUnit(NamedTuple):
    """The unit of length of a coordinate reference system that is not in metres.

    name : such as "US survey feet"; key : key of `units.LENGTHS`, None if the unit has none
    """

    name: str
    key: str | None


def reference_system(name: str | None, up: Up) -> "CRS | None":
    """Return the coordinate reference system of the horizontal coordinates of the input; None if the scene names none.

    With `up: y` the result is also None: plan coordinates are then x and z, z points south, and no reference system has
    such axes.

    Raises
    ------
    InputError
        The name is unknown, or the reference system is not in metres.
    """
    if name is None:
        return None
    if why := why_unusable(name):
        raise InputError(f"terrain.crs {why}")
    return _named(name) if up == "z" else None


def why_unusable(name: str) -> str | None:
    """Return why a coordinate reference system cannot be used: it is unknown or not in metres; None if it can be used.

    The result completes a sentence that begins with the key.
    """
    if not is_known(name):
        advice = f"did you mean EPSG:{name.strip()}?" if name.strip().isdecimal() else "give one such as EPSG:31287"
        return f"is {name!r}, which is no known coordinate reference system; {advice}"
    if is_in_degrees(name):
        return f"is {name!r}, which is in degrees; the terrain is in metres, and so must it be"
    if unit := unit_unlike_metre(name):
        return f"is {name!r}, which is in {unit.name}; the terrain is in metres, and so must it be: {_remedy(unit)}"
    return None


def _remedy(unit: SystemUnit) -> str:
    """Return what a user can do who named a reference system in another unit than the metre."""
    if unit.key is None:
        return "reproject the terrain to a system in metres, or leave it out"
    return (
        f"give terrain files in {unit.name} `unit: {unit.key}` (`rpf3d new`: --unit {unit.key}) and name {IN_METRES}, "
        "or leave it out"
    )


def unit_unlike_metre(name: str) -> SystemUnit | None:
    """Return the unit of length of a reference system, such as EPSG:2225 in US survey feet; None if it is the metre.

    The result is also None for a system that is unknown, in degrees or not projected, such as the grid of a mine.
    """
    if not is_known(name) or not (system := _named(name)).is_projected:
        return None
    word, length = system.linear_units_factor
    if math.isclose(length, 1.0, rel_tol=NEARLY_A_METRE):
        return None
    keys = (key for key, (_, metres) in LENGTHS.items() if math.isclose(length, metres, rel_tol=SAME_UNIT))
    key = next(keys, None)
    return SystemUnit(name=f"the unit {word!r}" if key is None else LENGTHS[key][0], key=key)


def short_name(name: str) -> str:
    """Return the name of a coordinate reference system for messages: of a definition (WKT), only the name in it."""
    found = _NAME_IN_WKT.match(name)
    return found[1] if found else name


def is_known(name: str) -> bool:
    """Return True if a name means a coordinate reference system."""
    from rasterio.errors import CRSError

    try:
        _named(name)
    except CRSError:
        return False
    return True


def are_same(name: str, other: str) -> bool:
    """Return True if two names mean the same coordinate reference system; an unknown name only equals itself."""
    return name == other or (is_known(name) and is_known(other) and bool(_named(name) == _named(other)))


def is_in_degrees(name: str) -> bool:
    """Return True if a coordinate reference system is known and in degrees, such as WGS84 (EPSG:4326)."""
    return is_known(name) and bool(_named(name).is_geographic)


def system_in_metres(path: Path, stated: str | None, points: FloatArray) -> tuple[str | None, tuple[str, ...]]:
    """Return the coordinate reference system to use for a terrain file, and remarks (sentences) for the user.

    A stated system in degrees is ignored with a remark if the coordinates are outside the range of degrees: the first
    result is then None. Any other stated system, also an unknown system, is returned unchanged.

    path : the file, for messages; stated : name of the system that the file states, None if it states none
    points : (N, 3) with longitude or easting first, N >= 1

    Raises
    ------
    TerrainError
        The file states a system in degrees, and its coordinates can be degrees.
    """
    if stated is None or not is_in_degrees(stated):
        return stated, ()
    if (np.abs(points[:, :2]) <= RANGE_OF_DEGREES).all():
        raise TerrainError(f"{path}: is in degrees ({stated}); reproject it to a reference system in metres")
    return None, (
        f"{path.name}: states {stated}, which is in degrees, but its coordinates are outside the range of degrees; the "
        "statement is ignored, so name the right system as `terrain: {crs: ...}`",
    )


def reference_system_of_file(path: Path) -> str | None:
    """Return the coordinate reference system that a file of terrain states: its EPSG code or else its definition (WKT).

    Return None for a file without a reference system. Also return None if the system is unknown or not in metres, or
    the file is damaged. The function that reads the file then reports damage, degrees and feet; an unknown system is
    ignored.
    """
    stated = stated_reference_system(path)
    return None if stated is None or why_unusable(stated) else stated


def stated_reference_system(path: Path, family: str = "polygon") -> str | None:
    """Return the coordinate reference system that an input file states, even one in degrees; None if it states none.

    The result is also None if the file cannot be read.
    GeoTIFF, LandXML, LAS, GeoPackage, Shapefile and GeoJSON with the member `crs` can state one.

    family : kind of geometry, "polygon", "line" or "point", whose layer counts in a GeoPackage or Shapefile; the layers
        of a GeoPackage may have different systems
    """
    if path.suffix.lower() in (".gpkg", ".shp"):
        from rpf3d_core.formats.mine.vector_files import vector_crs

        return vector_crs(path, family)
    try:
        state = path.stat()
    except OSError:
        return None
    return _stated(path, state.st_mtime_ns, state.st_size)


@lru_cache(maxsize=64)
def _stated(path: Path, changed: int, size: int) -> str | None:
    extension = path.suffix.lower()
    if extension in GEOTIFF:
        return _of_geotiff(path)
    if extension in (".geojson", ".json"):
        return _of_geojson(path)
    if extension in (".xml", ".landxml"):
        from rpf3d_core.formats.mine.landxml import landxml_crs

        return landxml_crs(path)
    if extension in (".las", ".laz"):
        from rpf3d_core.formats.mine.las import las_crs

        return las_crs(path)
    return None


def _of_geotiff(path: Path) -> str | None:
    import rasterio
    from rasterio.errors import RasterioError

    try:
        with rasterio.open(path, driver="GTiff") as grid:
            system = grid.crs
    except (RasterioError, OSError):
        return None
    if system is None:
        return None
    code = system.to_epsg()
    return f"EPSG:{code}" if code else str(system.to_wkt())


def _of_geojson(path: Path) -> str | None:
    """Return the reference system in the member `crs` of a GeoJSON file, such as urn:ogc:def:crs:EPSG::32719."""
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"))
        name = str(content["crs"]["properties"]["name"])
    except (OSError, ValueError, KeyError, TypeError, RecursionError):
        return None
    words = name.rpartition("def:crs:")[2].split(":")
    if words[0] == "OGC":
        return "OGC:CRS84"
    return f"EPSG:{words[-1]}" if words[0] == "EPSG" and words[-1].isdecimal() else None


def _named(name: str) -> "CRS":
    """Return the coordinate reference system that a name such as EPSG:31287 means; raise CRSError if it is unknown."""
    import rasterio
    from rasterio.crs import CRS

    with rasterio.Env():  # without Env, GDAL and PROJ print their errors to the terminal
        return CRS.from_user_input(name)
