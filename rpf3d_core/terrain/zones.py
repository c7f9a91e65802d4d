"""Assign zones to facets by polygons in plan, such as the polygons of a scene file."""

from dataclasses import replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon

from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray, Frame

Flags = NDArray[np.bool_]


def in_plan(frame: Frame, points: FloatArray) -> FloatArray:
    """Return the plan coordinates (..., 2) m, in the input's coordinates, of points (..., 3) m in the local frame.

    Plan coordinates are x and y, or x and z if y points up in the input. Polygons of zones have these coordinates.
    """
    there = frame.points_to_input(points)
    return there[..., :2] if frame.up == "z" else there[..., ::2]


def covered(polygons: MultiPolygon, plan: FloatArray) -> Flags:
    """Return flags (N,): true for each point in plan (N, 2) m inside the polygons of a zone or on their outline."""
    shapely.prepare(polygons)
    return np.asarray(shapely.intersects_xy(polygons, plan[:, 0], plan[:, 1]), dtype=bool)


def centroids_in_plan(terrain: Terrain) -> FloatArray:
    """Return the plan coordinates (F, 2) m of the facets' centroids, in the input's coordinates, as in `in_plan`.

    A facet is in a zone if its centroid is in the zone's polygon.
    """
    return in_plan(terrain.frame, terrain.vertices[terrain.triangles].mean(axis=1))


def with_zone(terrain: Terrain, zone: str, facets: Flags) -> Terrain:
    """Return the terrain with some facets moved to a zone; a zone that the terrain does not have is added.

    facets : (F,) true for the facets to move
    """
    zones = terrain.zones if zone in terrain.zones else (*terrain.zones, zone)
    numbers: IntArray = np.where(facets, np.int32(zones.index(zone)), terrain.zone).astype(np.int32)
    return replace(terrain, zone=numbers, zones=zones)


def zones_with_facets(terrain: Terrain) -> tuple[str, ...]:
    """Return the names of the zones that have facets, in order; polygons may have taken all facets of a zone."""
    counts = np.bincount(terrain.zone, minlength=len(terrain.zones))
    return tuple(zone for zone, count in zip(terrain.zones, counts.tolist(), strict=True) if count)
