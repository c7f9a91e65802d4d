"""Measure which share of an area of interest has no terrain below it: the part beyond the survey or over its holes."""

import numpy as np

from rpf3d_core.live.areas import AreaOutline, outlines_for_places
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.terrain.frame import FloatArray

PROBES = 400
"""Approximate number of evenly spread places in an area that are tested for terrain."""

MOST_PLACES = 40_000
"""Largest number of places that are spread over the box around an area; the places inside the area are tested."""


def uncovered_shares(standing: PreparedTerrain, areas: Outlines) -> dict[str, float]:
    """Return for each area, by name, the share (-) of the area in plan that has no terrain below it.

    The share of an outline is computed once for each terrain, and kept in `standing.uncovered`.

    areas : rings (P, 2) m, local frame
    """
    prepared = dict(zip(areas, outlines_for_places(areas), strict=True))
    shares = {}
    for name, rings in areas.items():
        key = b"".join(np.ascontiguousarray(ring).tobytes() for ring in rings)
        if key not in standing.uncovered:
            standing.uncovered[key] = _uncovered(standing, prepared[name])
        shares[name] = standing.uncovered[key]
    return shares


def _uncovered(standing: PreparedTerrain, area: AreaOutline) -> float:
    probes = _probes(area)
    return float(np.mean(~standing.has_ground(probes)))


def _probes(area: AreaOutline) -> FloatArray:
    """Return about PROBES places (N, 2) m, at least one: the middles of squares that are evenly spread over the area.

    If no middle is inside the area, the places are the corners of its convex hull.
    """
    low, high = area.hull.min(axis=0), area.hull.max(axis=0)
    step = max(np.sqrt(_surface(area) / PROBES), np.sqrt(np.prod(high - low) / MOST_PLACES), np.finfo(float).tiny)
    x, y = (np.arange(a + 0.5 * step, b, step) for a, b in zip(low, high, strict=True))
    places = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    inside = places[area.contains(places)] if len(places) else places
    return inside if len(inside) else area.hull


def _surface(area: AreaOutline) -> float:
    """Return an upper bound of the size of the area in plan, m^2; holes are added, not subtracted."""
    return float(sum(ring.area for ring in area.rings))
