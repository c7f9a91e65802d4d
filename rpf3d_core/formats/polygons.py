"""Read polygons in plan from files, in the plan coordinates (m) of the input."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, shape

from rpf3d_core.errors import InputError
from rpf3d_core.formats.features import features_of
from rpf3d_core.terrain.frame import FloatArray, Frame

KINDS = ("Polygon", "MultiPolygon")


def read_polygons(path: Path) -> MultiPolygon:
    """Return all polygons of a file as one area, with holes, such as an area of interest.

    A point is inside the area if it is inside any polygon.

    Raises
    ------
    InputError
        The file cannot be read, has other geometries than polygons, no polygon, or a polygon that crosses itself.
    """
    content = features_of(path, "polygon")
    polygons = [polygon for geometry in geometries(path, content, KINDS) for polygon in _polygons(path, geometry)]
    if not polygons:
        raise InputError(f"{path}: holds no polygon; it must have at least one")
    return MultiPolygon(polygons)


def polygon_of(corners: Sequence[tuple[float, float]]) -> MultiPolygon:
    """Return the area within three or more corners (N, 2) m in plan; the last corner is connected to the first.

    Raises
    ------
    InputError
        The polygon crosses itself or encloses no area.
    """
    polygon = shapely.Polygon(corners)
    if not polygon.is_valid or polygon.area == 0.0:
        # A polygon that crosses itself may also have area 0, but only corners on one line have a hull of area 0.
        on_a_line = polygon.convex_hull.area == 0.0
        why = "it encloses no area" if on_a_line else f"it crosses itself: {shapely.is_valid_reason(polygon)}"
        raise InputError(f"must be the corners of a polygon in their order around it, but is none ({why})")
    return MultiPolygon([polygon])


def plan_triangles(polygons: MultiPolygon) -> NDArray[np.float64]:
    """Return triangles (T, 3, 2) m that cover polygons exactly in plan, without overlap and without their holes."""
    whole = shapely.union_all(list(polygons.geoms))  # polygons may overlap
    triangles = shapely.constrained_delaunay_triangles(whole).geoms
    return np.array([shapely.get_coordinates(triangle)[:3] for triangle in triangles]).reshape(-1, 3, 2)


def local_plan(frame: Frame, plan: FloatArray) -> FloatArray:
    """Convert plan coordinates (..., 2) m from the input (x and y, or x and z if y is up) to the local frame."""
    level = np.zeros(plan.shape[:-1])
    columns = (plan[..., 0], plan[..., 1], level) if frame.up == "z" else (plan[..., 0], level, plan[..., 1])
    return frame.points_to_local(np.stack(columns, axis=-1))[..., :2]


def geometries(path: Path, content: Any, wanted: tuple[str, ...]) -> Iterator[Any]:
    """Yield all geometries of the wanted types in a FeatureCollection, Feature, GeometryCollection or single geometry.

    Raises
    ------
    InputError
        The content has other geometries, or is not GeoJSON.
    """
    kind = content.get("type") if isinstance(content, dict) else None
    parts = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
    if kind in parts and isinstance(content.get(parts[kind]), list):
        for part in content[parts[kind]]:
            yield from geometries(path, part, wanted)
    elif kind == "Feature":
        yield from geometries(path, content.get("geometry"), wanted)
    elif kind in wanted:
        yield content
    else:
        only = {"Polygon": "polygons", "LineString": "lines"}.get(wanted[0], "points")
        raise InputError(f"{path}: must be GeoJSON that holds {only} only, but has {kind or str(content)[:40]!r}")


def _polygons(path: Path, geometry: Any) -> list[Any]:
    """Return the polygons of one GeoJSON Polygon or MultiPolygon; raise an InputError if one is not valid."""
    try:
        read = shape(geometry)
    except (ValueError, TypeError, KeyError, IndexError, AttributeError, shapely.errors.ShapelyError) as fault:
        raise InputError(f"{path}: the coordinates of a {geometry['type']} are damaged ({fault})") from fault
    if not read.is_valid:
        raise InputError(f"{path}: a {geometry['type']} is not valid: {shapely.is_valid_reason(read)}")
    parts = list(read.geoms) if isinstance(read, MultiPolygon) else [read]
    return [part for part in parts if not part.is_empty]
