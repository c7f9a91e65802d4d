"""Polygons in plan from GeoJSON (RFC 7946, but in the input's own plan coordinates, m)."""

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import MultiPolygon, shape

from rpf3d_core.errors import InputError


def read_polygons(path: Path) -> MultiPolygon:
    """All polygons of a GeoJSON file, holes respected; a point is in them if it is in any.

    Raises
    ------
    InputError
        If the file is not GeoJSON, holds anything but polygons, none at all, or one that crosses itself.
    """
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as fault:
        raise InputError(f"{path}: cannot be read as GeoJSON ({fault})") from fault
    polygons = [polygon for geometry in _geometries(path, content) for polygon in _polygons(path, geometry)]
    if not polygons:
        raise InputError(f"{path}: holds no polygon; it must be GeoJSON with at least one Polygon or MultiPolygon")
    return MultiPolygon(polygons)


def _geometries(path: Path, content: Any) -> Iterator[Any]:
    """The geometries of a FeatureCollection, a Feature, a GeometryCollection or a bare geometry."""
    kind = content.get("type") if isinstance(content, dict) else None
    parts = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
    if kind in parts and isinstance(content.get(parts[kind]), list):
        for part in content[parts[kind]]:
            yield from _geometries(path, part)
    elif kind == "Feature":
        yield from _geometries(path, content.get("geometry"))
    elif kind in ("Polygon", "MultiPolygon"):
        yield content
    else:
        raise InputError(f"{path}: must be GeoJSON that holds polygons only, but has {kind or str(content)[:40]!r}")


def _polygons(path: Path, geometry: Any) -> list[Any]:
    """The polygons of one Polygon or MultiPolygon."""
    try:
        read = shape(geometry)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, shapely.errors.ShapelyError) as fault:
        raise InputError(f"{path}: the coordinates of a {geometry['type']} are damaged ({fault})") from fault
    if not read.is_valid:
        raise InputError(f"{path}: a {geometry['type']} is not valid: {shapely.is_valid_reason(read)}")
    parts = list(read.geoms) if isinstance(read, MultiPolygon) else [read]
    return [part for part in parts if not part.is_empty]
