"""Find seams of the terrain that are open: a vertex lies close to a side of another facet, but not on it.

Such vertices come from rounding a T-junction, for example to the millimetres of an export. A rock can fall through the
gap unnoticed, because the rim next to the gap looks like the rim of the terrain.
"""

from collections.abc import Iterator

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.setup.hanging_rims import rim_sides
from rpf3d_core.terrain.facets import CRACK, Terrain, tolerance_of
from rpf3d_core.terrain.mesh.edges import Edges

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

WIDEST = 0.05
"""Largest width (m) of an open seam; a wider gap is a hole or a step of the terrain."""
RELATIVE = 0.01
"""Largest width of an open seam, as a share of the length of the side; a fine mesh has none across its facets."""
MOST_SIDES = 200_000
"""Largest number of sides of the rim that are searched; of a longer rim, evenly spread sides are searched."""


def open_seams(terrain: Terrain, edges: Edges) -> Iterator[str]:
    """Yield a warning if the terrain has open seams, with their number, the widest and its place.

    edges : of the terrain's facets
    """
    vertex, gap, sampled = seams_of(terrain, edges)
    if not len(vertex):
        return
    widest = int(np.argmax(gap))
    where = ", ".join(f"{c:.3f}" for c in terrain.frame.points_to_input(terrain.vertices[vertex[widest]]))
    count, least = np.unique(vertex).size, "at least " if sampled else ""
    yield (
        f"{least}{count:,} {'vertices lie' if count > 1 else 'vertex lies'} close to a side of another facet, but not "
        f"on it: up to {three_figures(1000.0 * float(gap[widest]))} mm off, at ({where}). Rocks can fall through such "
        "an open seam unnoticed, or end there as unresolved_contact: export the surface so that neighbouring "
        "facets share their vertices, or close it in the program that made it"
    )


def seams_of(terrain: Terrain, edges: Edges) -> tuple[IntArray, FloatArray, bool]:
    """Return the vertex (N,) and the width (N,) m of each open seam, and whether only a sample of the rim was searched.

    A seam is a pair of a vertex and a side that both lie on the rim. The width is their distance. It is larger than a
    crack, which no rock falls through, and at most WIDEST (m) and RELATIVE times the length of the side. The nearest
    point of the side is not one of its ends. The third corner of the facet of the side is no seam.

    edges : of the terrain's facets
    """
    low, high, third = rim_sides(terrain.triangles, edges)
    sampled = len(low) > MOST_SIDES
    on_rim = np.unique(np.concatenate([low, high]))
    if sampled:
        some = np.linspace(0, len(low) - 1, MOST_SIDES).astype(int)
        low, high, third = low[some], high[some], third[some]
    ends = terrain.vertices[np.stack([low, high], axis=1)]
    lines = shapely.linestrings(ends[:, :, :2])
    points = shapely.points(terrain.vertices[on_rim, :2])
    near, side = shapely.STRtree(lines).query(points, predicate="dwithin", distance=WIDEST)
    vertex = on_rim[near]
    other = (vertex != low[side]) & (vertex != high[side]) & (vertex != third[side])
    vertex, side = vertex[other], side[other]
    gap, inside, length = _distances(terrain.vertices[vertex], ends[side])
    found = inside & (gap <= np.minimum(WIDEST, RELATIVE * length))
    if found.any():
        found &= gap > CRACK * tolerance_of(terrain)
    return vertex[found], gap[found], sampled


def _distances(points: FloatArray, ends: FloatArray) -> tuple[FloatArray, NDArray[np.bool_], FloatArray]:
    """Return distances (N,) m of points from sides, whether the nearest point is between the ends, and side lengths.

    points : (N, 3) m; ends : (N, 2, 3) m, both ends of each side; the lengths are (N,) m
    """
    along, offset = ends[:, 1] - ends[:, 0], points - ends[:, 0]
    squared = (along * along).sum(axis=1)
    share = (along * offset).sum(axis=1) / np.where(squared > 0.0, squared, 1.0)
    gap = np.linalg.norm(offset - share[:, None] * along, axis=1)
    return gap, (share > 0.0) & (share < 1.0), np.sqrt(squared)
