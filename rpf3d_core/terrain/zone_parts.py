"""Split a zone made of separate surfaces at different heights, such as a CAD layer with all berms of a wall."""

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
"""Share (-) of a zone's area from which a surface of the zone always counts as a part of its own.

The same share of the area is left out at both ends of a range of heights (`heights_of_zone`).
"""
LEAST_AREA = 100.0
"""Area (m^2) from which a surface below the share SMALLEST, too, counts as a part, if it lies at another height.

This is the area of 33 m of a berm 3 m wide. A zone can contain the pit's floor and rim, so that each berm has only a
small share of the zone's area.
"""


class Merged(NamedTuple):
    """The surfaces of a zone whose mean heights differ from the mean heights of their parts by more than LOWEST (3 m).

    surfaces : number of surfaces; area : m^2, of all of them; largest : m^2, of the largest; farthest : m, the largest
        difference from the mean height of the part
    """

    surfaces: int
    area: float
    largest: float
    farthest: float


class ZoneParts(NamedTuple):
    """The parts of a zone, numbered from the highest part down.

    zone : name of the zone
    part : (Z,) number of the part, from 0, of each facet of the zone, in the order of the terrain's facets
    heights : (P,) m, local frame, mean height of each part without the surfaces that only join the part
    merged : the surfaces at another height than their part; None if there are none
    """

    zone: str
    part: IntArray
    heights: FloatArray
    merged: Merged | None = None


LEVEL = 4.0
"""Largest slope (degrees) of level ground; haul ramps are steeper, mostly 8 to 10 %, which is 4.6 to 5.7 degrees."""
MOSTLY = 0.5
"""Smallest share (-) of level ground in a surface that consists of joined benches."""


class Joined(NamedTuple):
    """A zone with a surface that joins level ground at several heights, such as benches and the ramp between them.

    zone : name of the zone; heights : (N,) m, local frame, mean heights of the level ground, the highest first
    """

    zone: str
    heights: FloatArray


class _Surfaces(NamedTuple):
    """The S surfaces of a zone: areas (S,) m^2, and mean, low and high heights (S,) m; see `_surfaces`."""

    areas: FloatArray
    means: FloatArray
    low: FloatArray
    high: FloatArray


def parts_by_height(terrain: Terrain, edges: Edges) -> list[ZoneParts]:
    """Return the parts of each zone that consists of surfaces at different heights; other zones are left out.

    A surface is a set of facets of one zone that are connected by edges. The surfaces of a zone are sorted by mean
    height. Neighbours in this order that differ by less than LOWEST (3 m) are one part, because a berm interrupted by a
    ramp or a spill is one bench. A surface of less than the share SMALLEST of the zone's area joins the part that is
    nearest in height, if it is smaller than LEAST_AREA (m^2), or if its mean height is at most LOWEST outside the
    heights of a surface with a larger share. An example is a fragment of a face or a ramp.
    """
    one, other, _ = shared_by_two(edges)
    same = terrain.zone[one] == terrain.zone[other]
    surface = components(len(terrain.triangles), one[same], other[same])
    area = np.linalg.norm(area_vectors(terrain.vertices, terrain.triangles), axis=1)
    corners = terrain.vertices[terrain.triangles, 2]
    found = [_parts(name, surface[mine], area[mine], corners[mine])
             for number, name in enumerate(terrain.zones) if (mine := terrain.zone == number).any()]  # fmt: skip
    return [parts for parts in found if len(parts.heights) > 1]


def joined_benches(terrain: Terrain, edges: Edges) -> list[Joined]:
    """Return the zones with a surface that joins benches at several heights; `parts_by_height` does not separate them.

    Level ground is a set of facets of one surface that are connected by edges and less steep than LEVEL, and whose area
    is at least LEAST_AREA. A surface joins benches if the mean heights of its level grounds differ by LOWEST or more,
    and if these grounds are at least the share MOSTLY of its area. The result is empty for rough surveys, whose facets
    on benches are steeper than LEVEL. Of several such surfaces of a zone, the one with most heights is returned.
    """
    one, other, _ = shared_by_two(edges)
    same = terrain.zone[one] == terrain.zone[other]
    vectors = area_vectors(terrain.vertices, terrain.triangles)
    area = np.linalg.norm(vectors, axis=1)
    level = vectors[:, 2] > np.cos(np.radians(LEVEL)) * area
    both = same & level[one] & level[other]
    count = len(terrain.triangles)
    surface = np.unique(components(count, one[same], other[same]), return_inverse=True)[1]
    ground = np.unique(components(count, one[both], other[both]), return_inverse=True)[1]
    whole, areas = np.bincount(surface, area), np.bincount(ground, np.where(level, area, 0.0))
    sums = np.bincount(ground, area * terrain.vertices[terrain.triangles, 2].mean(axis=1))
    first = np.unique(ground, return_index=True)[1]
    large = np.flatnonzero(areas >= LEAST_AREA)
    found: dict[str, FloatArray] = {}
    for number in np.unique(surface[first[large]]):
        mine = large[surface[first[large]] == number]
        order = mine[np.argsort(-sums[mine] / areas[mine], kind="stable")]
        means = sums[order] / areas[order]
        bench = np.append(0, np.cumsum(-np.diff(means) >= LOWEST))
        heights = np.bincount(bench, sums[order]) / np.bincount(bench, areas[order])
        zone = terrain.zones[terrain.zone[first[mine[0]]]]
        if areas[mine].sum() >= MOSTLY * whole[number] and len(heights) > max(1, len(found.get(zone, ()))):
            found[zone] = heights
    return [Joined(zone, heights) for zone, heights in found.items()]


def heights_of_zone(terrain: Terrain, number: int) -> tuple[float, float]:
    """Return the lowest and the highest height (m, local frame) of a zone, without extreme facets.

    The lowest and the highest facets are left out, up to the share SMALLEST of the zone's area each.

    number : index of the zone in `terrain.zones`; the zone must have facets
    """
    triangles = terrain.triangles[terrain.zone == number]
    area = np.linalg.norm(area_vectors(terrain.vertices, triangles), axis=1)
    one = _surfaces(np.zeros(len(triangles), np.int32), area, terrain.vertices[triangles, 2])
    return float(one.low[0]), float(one.high[0])


def _parts(zone: str, surface: NDArray[np.int32], area: FloatArray, corners: FloatArray) -> ZoneParts:
    """Return the parts of a zone, from surface number (Z,), area (Z,) m^2 and corner heights (Z, 3) m of its facets."""
    _, number = np.unique(surface, return_inverse=True)
    found = _surfaces(number.astype(np.int32), area, corners)
    areas, means = found.areas, found.means
    apart = np.flatnonzero(_are_parts(found))
    if len(apart) < 2:
        return ZoneParts(zone=zone, part=np.zeros(len(number), np.int32), heights=np.array([float(means[0])]))
    order = apart[np.argsort(-means[apart], kind="stable")]
    level = np.append(0, np.cumsum(-np.diff(means[order]) >= LOWEST))
    part = level[np.abs(means[:, None] - means[order]).argmin(axis=1)]
    heights = np.bincount(level, areas[order] * means[order]) / np.bincount(level, areas[order])
    return ZoneParts(
        zone=zone, part=part[number].astype(np.int32), heights=heights,
        merged=_merged(areas, np.abs(means - heights[part])),
    )  # fmt: skip


def _surfaces(number: IntArray, area: FloatArray, corners: FloatArray) -> _Surfaces:
    """Return the surfaces of a zone, from surface number (Z,), area (Z,) m^2 and corner heights (Z, 3) m of its facets.

    `low` and `high` are heights of corners. They leave out the lowest and the highest facets, up to the share SMALLEST
    of the surface's area each.

    number : each of the numbers 0 to S - 1 is in use
    """
    areas = np.bincount(number, area).astype(float)
    means = np.bincount(number, area * corners.mean(axis=1)) / np.where(areas > 0.0, areas, 1.0)
    return _Surfaces(
        areas=areas, means=means, low=_lowest(number, area, corners.min(axis=1)),
        high=-_lowest(number, area, -corners.max(axis=1)),
    )  # fmt: skip


def _lowest(number: IntArray, area: FloatArray, height: FloatArray) -> FloatArray:
    """Return for each surface (S,) its lowest height (m) after the share SMALLEST of its area is left out.

    number, area, height : (Z,) surface number, area (m^2) and height (m) of each facet
    """
    order = np.lexsort((height, number))
    number, area, height = number[order], area[order], height[order]
    count = np.bincount(number)
    begin = np.cumsum(count) - count
    sums = np.cumsum(area)
    below = sums - (sums - area)[begin][number] < SMALLEST * np.bincount(number, area)[number]
    left_out = np.bincount(number, below).astype(np.int64)
    return np.asarray(height[begin + np.minimum(left_out, count - 1)])


def _are_parts(found: _Surfaces) -> NDArray[np.bool_]:
    """Return flags (S,): true for the surfaces that form parts; each other surface joins the part nearest in height."""
    large = found.areas >= max(SMALLEST * float(found.areas.sum()), np.finfo(float).tiny)
    small = ~large & (found.areas >= LEAST_AREA)
    for low, high in zip(found.low[large].tolist(), found.high[large].tolist(), strict=True):
        small &= (found.means < low - LOWEST) | (found.means > high + LOWEST)
    return np.asarray(large | small)


def _merged(areas: FloatArray, differences: FloatArray) -> Merged | None:
    """Return the surfaces at other heights than their part; None if there are none.

    areas : (S,) m^2; differences : (S,) m, between the mean heights of a surface and of its part
    """
    far = (differences > LOWEST) & (areas > 0.0)
    if not far.any():
        return None
    return Merged(
        surfaces=int(far.sum()), area=float(areas[far].sum()), largest=float(areas[far].max()),
        farthest=float(differences[far].max()),
    )  # fmt: skip


def names_of_parts(parts: ZoneParts) -> list[str]:
    """Return the names of the parts of a zone, the highest first: `NAME_1`, `NAME_2` and so on."""
    return [f"{parts.zone}_{number}" for number in range(1, len(parts.heights) + 1)]


def with_parts(terrain: Terrain, parts: ZoneParts) -> Terrain:
    """Return the terrain with a zone replaced by its parts, at the zone's position in the order of zones.

    No other zone may have the name of a part; this is not checked.
    """
    place, more = terrain.zones.index(parts.zone), len(parts.heights) - 1
    zone = np.where(terrain.zone > place, terrain.zone + more, terrain.zone).astype(terrain.zone.dtype)
    zone[terrain.zone == place] = place + parts.part
    zones = (*terrain.zones[:place], *names_of_parts(parts), *terrain.zones[place + 1 :])
    return replace(terrain, zone=zone, zones=zones)
