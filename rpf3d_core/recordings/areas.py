"""Write the outlines of the areas of interest to a recording."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rpf3d_core.recordings.hazard import LIFT
from rpf3d_core.terrain.draped_outlines import draped_outlines
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray

AREA_COLOUR = (0, 89, 191)
AREA_PIXELS = 1.5
"""Half the width of the outlines in the viewer (pixels); rerun interprets a negative radius as pixels on the screen."""
ABOVE_MAPS = 3.0
"""Height of the outlines above the terrain as a multiple of LIFT: above the two hazard maps."""


def log_areas(recording: Any, terrain: Terrain, areas: Mapping[str, Sequence[FloatArray]]) -> None:
    """Write the outlines of the areas of interest to a recording, as named lines just above the ground, `world/areas`.

    areas : outline rings (N, 2) m of each area, local frame
    """
    import rerun as rr

    diagonal = float(np.linalg.norm(np.ptp(terrain.vertices, axis=0)))
    found = [(name, draped_outlines(terrain, rings, ABOVE_MAPS * LIFT * diagonal)) for name, rings in areas.items()]
    named = [(name, line) for name, lines in found for line in lines]
    if named:
        names, lines = zip(*named, strict=True)
        strips = rr.LineStrips3D(lines, colors=[AREA_COLOUR], radii=[-AREA_PIXELS], labels=names)
        recording.log("world/areas", strips, static=True)
