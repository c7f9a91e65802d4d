"""Find the share of an area of interest that has no terrain below it, and the lowest ground in the area.

A part of an area has no terrain below it if this part lies beyond the survey or over a hole of the survey. If a single
outline of the area has a larger share without terrain than the whole area, and this larger share is above one half, the
larger share counts for the area.
"""

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.live.areas import AreaGround, AreaOutline, Indices, outlines_for_places
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.terrain.frame import FloatArray

Objects = NDArray[np.object_]

PROBES = 400
"""Approximate number of evenly spread places in an area that are tested for terrain."""

MOST_PLACES = 40_000
"""Largest number of places that are spread over the box around an area; the places inside the area are tested."""

MOSTLY = 0.5
"""Share (-) without terrain of a single outline above which this share counts for the whole area."""

LATTICE_PLACES = 4_000
"""Approximate number of places that are spread over the boxes around all outlines of an area."""

FEWEST_ROWS, MOST_ROWS = 5, 20
"""Bounds of the number of rows and columns of places that are spread over the box around one outline."""


def grounds_of(standing: PreparedTerrain, areas: Outlines) -> dict[str, AreaGround]:
    """Return the terrain below each area, by name.

    The result for an area is computed once for each terrain, and kept in `standing.area_grounds`.

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
    """Return the terrain below an area: the share without terrain, and the lowest ground.

    The lowest ground is an estimate on the safe side: the lowest corner of all facets at the probes and at the corners
    of the area, minus the distance between neighbouring probes. So ground that falls at 45 degrees between two probes
    is allowed for; a narrow and steep ditch may be missed. If one of these places has no ground, the lowest ground is
    unknown (-infinite).
    """
    probes, step = _probes(area)
    uncovered = float(np.mean(~standing.has_ground(probes)))
    heights = standing.lowest_ground(np.concatenate([probes, area.corners]))
    lowest = float(heights.min()) - step if np.isfinite(heights).all() else -math.inf
    return AreaGround(uncovered=max(uncovered, _worst_outline(standing, area)), lowest=lowest)


def _worst_outline(standing: PreparedTerrain, area: AreaOutline) -> float:
    """Return the largest share (-) without terrain of a single outline of an area; 0 if no share exceeds MOSTLY (0.5).

    This finds one machine or road segment with wrong coordinates, even if it is a small part of a large area. The
    result is also 0 for an area with only one outline.
    """
    outlines = _outlines(area)
    if len(outlines) < 2:
        return 0.0
    places, number = _spread(outlines)
    bare = np.bincount(number, ~standing.has_ground(places), len(outlines)) / np.bincount(number)
    worst = float(bare.max())
    return worst if worst > MOSTLY else 0.0


def _outlines(area: AreaOutline) -> Objects:
    """Return each outline of an area as a polygon without its holes; a hole is a ring within an odd number of rings."""
    rings = shapely.make_valid(np.array(area.rings, dtype=object))
    inner, outer = shapely.STRtree(rings).query(rings, predicate="within")
    inner, outer = inner[inner != outer], outer[inner != outer]
    for ring in np.unique(outer):
        inside = [area.rings[other] for other in inner[outer == ring]]
        rings[ring] = shapely.difference(rings[ring], shapely.union_all(shapely.make_valid(inside)))
    is_outline = np.bincount(inner, minlength=len(rings)) % 2 == 0
    outlines: Objects = rings[is_outline & ~shapely.is_empty(rings)]
    return outlines


def _spread(outlines: Objects) -> tuple[FloatArray, Indices]:
    """Return places (N, 2) m that are evenly spread over each outline, and the number (N,) of each place's outline.

    The box around an outline is divided into cells. The places of the outline are the middles of the cells that lie
    inside the outline, and one further place inside; so each outline has at least one place.
    """
    rows = int(np.clip(math.sqrt(LATTICE_PLACES / len(outlines)), FEWEST_ROWS, MOST_ROWS))
    low, high = np.split(shapely.bounds(outlines), 2, axis=1)
    cells = (np.stack(np.meshgrid(*[np.arange(rows)] * 2), axis=-1).reshape(-1, 2) + 0.5) / rows
    lattice = low[:, None] + cells * (high - low)[:, None]
    shapely.prepare(outlines)
    inside = shapely.contains_xy(outlines[:, None], lattice[..., 0], lattice[..., 1])
    within = shapely.get_coordinates(shapely.point_on_surface(outlines))
    return np.concatenate([lattice[inside], within]), np.append(np.nonzero(inside)[0], np.arange(len(outlines)))


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
    """Return the sum (m^2) of the areas of all rings in plan, an upper bound of the size: holes are added."""
    return float(sum(ring.area for ring in area.rings))
