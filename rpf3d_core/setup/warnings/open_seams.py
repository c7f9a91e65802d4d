"""Warn of open seams of the terrain that are too wide to be closed, or that cannot be closed safely."""

from collections.abc import Iterator

import numpy as np

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.terrain.closed_seams import Seams
from rpf3d_core.terrain.facets import Terrain


def open_seams(terrain: Terrain, seams: Seams) -> Iterator[str]:
    """Yield a warning if seams of the terrain are still open.

    The warning has the number of vertices at open seams, the width of the widest open seam, and the place of this seam.
    """
    if not len(seams.vertex):
        return
    widest = int(np.argmax(seams.gap))
    where = ", ".join(f"{c:.3f}" for c in terrain.frame.points_to_input(terrain.vertices[seams.vertex[widest]]))
    count, least = np.unique(seams.vertex).size, "at least " if seams.sampled else ""
    yield (
        f"{least}{count:,} {'vertices lie' if count > 1 else 'vertex lies'} close to a side of another facet, but not "
        f"on it: up to {three_figures(1000.0 * float(seams.gap[widest]))} mm off, at ({where}). Rocks can fall through "
        "such an open seam unnoticed, or end there as unresolved_contact: export the surface so that neighbouring "
        "facets share their vertices, or close it in the program that made it"
    )
