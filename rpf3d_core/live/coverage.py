"""Find which share of an area of interest has no terrain below it, and how low the ground in the area is.

A part of an area has no terrain below it if this part lies beyond the survey or over a hole of the survey.
"""

import math

import numpy as np

from rpf3d_core.live.areas import AreaGround, AreaOutline, outlines_for_places
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.terrain.frame import FloatArray

PROBES = 400
"""Approximate number of evenly spread places in an area that are tested for terrain."""

MOST_PLACES = 40_000
"""Largest number of places that are spread over the box around an area; the places inside the area are tested."""


def grounds_of(standing: PreparedTerrain, areas: Outlines) -> dict[str, AreaGround]:
    """Return the terrain below each area, by name.

    The result for an outline is computed once for each terrain, and kept in `standing.area_grounds`.

    areas : rings (P, 2) m, local frame
    """
    prepared = dict(zip(areas, outlines_for_places(areas), strict=True))
    grounds = {}
    for name, rings in areas.items():
        key = b"".join(np.ascontiguousarray(ring).tobytes() for ring in rings)
        if key not in standing.area_grounds:
            standing.area_grounds[key] = _ground_of(standing, prepared[name])
        grounds[name] = standing.area_grounds[key]
    return grounds


def _ground_of(standing: PreparedTerrain, area: AreaOutline) -> AreaGround:
    """Return the terrain below an area.

    The lowest ground is an estimate on the safe side: the lowest corner of all facets at the probes and at the corners
    of the area, minus the distance between neighbouring probes. So a slope of 45 degrees between two probes is
    included; a narrow and steep ditch may be missed. If a place has no ground, the lowest ground is unknown.
    """
    probes, step = _probes(area)
    uncovered = float(np.mean(~standing.has_ground(probes)))
    heights = standing.lowest_ground(np.concatenate([probes, area.corners]))
    lowest = float(heights.min()) - step if np.isfinite(heights).all() else -math.inf
    return AreaGround(uncovered=uncovered, lowest=lowest)


def _probes(area: AreaOutline) -> tuple[FloatArray, float]:
    """Return about PROBES places (N, 2) m in an area, at least one, and the distance (m) between neighbours.

    The places are the middles of squares that are evenly spread over the area. If no middle is inside the area, the
    places are the corners of its convex hull, and the distance is the diagonal of the box around the hull.
    """
    low, high = area.hull.min(axis=0), area.hull.max(axis=0)
    step = max(np.sqrt(_surface(area) / PROBES), np.sqrt(np.prod(high - low) / MOST_PLACES), np.finfo(float).tiny)
    x, y = (np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = places[area.contains(places)] if len(places) else places
    if len(inside):
        return inside, float(step)
    return area.hull, float(np.linalg.norm(high - low))


def _surface(area: AreaOutline) -> float:
    """Return an upper bound of the size of the area in plan, m^2; holes are added, not subtracted."""
    return float(sum(ring.area for ring in area.rings))
