"""Transform geometries from one coordinate reference system to another with pyproj (PROJ)."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry import shape

from rpf3d_core.errors import InputError
from rpf3d_core.formats.mine.need import needed
from rpf3d_core.terrain.frame import FloatArray


def transformed(path: Path, geometries: Sequence[Any], begin: str, end: str) -> list[Any]:
    """Return shapely geometries transformed to another coordinate reference system; heights do not change.

    Coordinates have longitude or easting first in both systems, whatever the axis order of the system is.

    begin, end : names of the old and the new reference system, such as EPSG:4326

    Raises
    ------
    InputError
        The library is missing, a name is unknown, or a point has no coordinates in the other system.
    """
    moved = shapely.transform(
        np.array(geometries, dtype=object), lambda places: transformed_places(path, places, begin, end), include_z=True
    )
    # `include_z` adds the height NaN to geometries without heights.
    flat = ~shapely.has_z(np.array(geometries, dtype=object))
    moved[flat] = shapely.force_2d(moved[flat])
    return list(moved)


def feature_collection(
    path: Path, geometries: Sequence[dict[str, Any]], begin: str | None, end: str | None
) -> dict[str, Any]:
    """Return the content of a GeoJSON file with geometries, transformed if `begin` and `end` are given.

    path : file of the geometries, for messages
    geometries : GeoJSON geometries (type and coordinates)
    begin : name of the reference system of `geometries`; None if unknown: the coordinates then stay unchanged
    end : name of the reference system of the result; None to leave the coordinates unchanged

    Raises
    ------
    InputError
        As `transformed`, or the coordinates of a geometry are damaged.
    """
    try:
        found = [shape(each) for each in geometries]
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, shapely.errors.ShapelyError) as fault:
        raise InputError(f"{path}: the coordinates of a geometry are damaged ({fault})") from fault
    if end is not None and begin is not None:
        found = transformed(path, found, begin, end)
    content: dict[str, Any] = {"type": "FeatureCollection"}
    if system := end or begin:
        content["crs"] = {"type": "name", "properties": {"name": _urn(system)}}
    texts = shapely.to_geojson(np.array(found, dtype=object))
    geometry = [json.loads(text) for text in texts]
    return content | {"features": [{"type": "Feature", "properties": {}, "geometry": each} for each in geometry]}


def _urn(system: str) -> str:
    """Return the name of a reference system such as EPSG:4326 as a URN, which GDAL also writes to GeoJSON files."""
    authority, _, code = system.partition(":")
    return f"urn:ogc:def:crs:{authority}::{code}" if code.isdecimal() else system


def transformed_places(path: Path, places: FloatArray, begin: str, end: str) -> FloatArray:
    """Return the places (N, 2 or 3) of a file, transformed to another coordinate reference system.

    Heights do not change. Errors are as in `transformed`.

    begin, end : names of the old and the new reference system, such as EPSG:4326
    """
    pyproj = needed(path, "pyproj")
    try:
        change = pyproj.Transformer.from_crs(begin, end, always_xy=True)
    except pyproj.exceptions.ProjError as fault:
        raise InputError(f"{path}: no transformation from {begin!r} to {end!r} is known ({fault})") from fault
    x, y = change.transform(places[:, 0], places[:, 1])
    if not (np.isfinite(x).all() and np.isfinite(y).all()):
        raise InputError(f"{path}: has points outside of {end!r}; is it really in {begin!r}?")
    return np.column_stack([x, y, places[:, 2:]])
