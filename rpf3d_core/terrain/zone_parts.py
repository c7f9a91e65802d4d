"""Split a zone that consists of separate surfaces at different heights, such as a layer with all berms of a wall."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.faces import LOWEST
from rpf3d_core.terrain.facets import IntArray, Terrain, area_vectors
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.mesh.edges import Edges, shared_by_two

SMALLEST = 0.02
"""Least area of a surface, as a share (-) of its zone's area, for the surface to count as a part of its own.

A smaller surface joins the part that is nearest in height.
"""


class ZoneParts(NamedTuple):
    """The parts of a zone, numbered from the highest part down.

    zone : name of the zone
    part : (Z,) number of the part, from 0, of each facet of the zone, in the order of the terrain's facets
    heights : (P,) m, local frame, mean height of each part without its surfaces that are smaller than SMALLEST
    """

    zone: str
    part: IntArray
    heights: FloatArray


def parts_by_height(terrain: Terrain, edges: Edges) -> list[ZoneParts]:
    """Return the parts of each zone that consists of surfaces at different heights; other zones are left out.

    A surface is a set of facets of one zone that are connected by edges. The surfaces of a zone are sorted by mean
    height. Neighbours in this order that differ by less than LOWEST (m) are one part, because a berm interrupted by a
    ramp or a spill is one bench. A surface of less than the share SMALLEST of the zone's area belongs to the part that
    is nearest in height.
    """
    one, other, _ = shared_by_two(edges)
    same = terrain.zone[one] == terrain.zone[other]
    surface = components(len(terrain.triangles), one[same], other[same])
    area = np.linalg.norm(area_vectors(terrain.vertices, terrain.triangles), axis=1)
    height = terrain.vertices[terrain.triangles, 2].mean(axis=1)
    found = [_parts(name, surface[mine], area[mine], height[mine])
             for number, name in enumerate(terrain.zones) if (mine := terrain.zone == number).any()]  # fmt: skip
    return [parts for parts in found if len(parts.heights) > 1]


def _parts(zone: str, surface: NDArray[np.int32], area: FloatArray, height: FloatArray) -> ZoneParts:
    """Return the parts of a zone, from surface number (Z,), area (Z,) m^2 and height (Z,) m of each of its facets."""
    _, number = np.unique(surface, return_inverse=True)
    areas = np.bincount(number, area)
    means = np.bincount(number, area * height) / np.where(areas > 0.0, areas, 1.0)
    large = np.flatnonzero(areas >= max(SMALLEST * float(areas.sum()), np.finfo(float).tiny))
    if len(large) < 2:
        return ZoneParts(zone=zone, part=np.zeros(len(number), np.int32), heights=np.array([float(means[0])]))
    order = large[np.argsort(-means[large], kind="stable")]
    level = np.append(0, np.cumsum(-np.diff(means[order]) >= LOWEST))
    nearest = np.abs(means[:, None] - means[order]).argmin(axis=1)
    heights = np.bincount(level, areas[order] * means[order]) / np.bincount(level, areas[order])
    return ZoneParts(zone=zone, part=level[nearest][number].astype(np.int32), heights=heights)


def names_of_parts(parts: ZoneParts) -> list[str]:
    """Return the names of the parts of a zone, the highest first: `NAME_1`, `NAME_2` and so on."""
    return [f"{parts.zone}_{number}" for number in range(1, len(parts.heights) + 1)]


def with_parts(terrain: Terrain, parts: ZoneParts) -> Terrain:
    """Return the terrain with a zone replaced by its parts, at the zone's position in the order of zones.

    No other zone may have the name of a part.
    """
    place, more = terrain.zones.index(parts.zone), len(parts.heights) - 1
    zone = np.where(terrain.zone > place, terrain.zone + more, terrain.zone).astype(terrain.zone.dtype)
    zone[terrain.zone == place] = place + parts.part
    zones = (*terrain.zones[:place], *names_of_parts(parts), *terrain.zones[place + 1 :])
    return replace(terrain, zone=zone, zones=zones)
