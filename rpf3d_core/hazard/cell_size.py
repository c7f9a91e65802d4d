"""Choose a map cell so large that most cells on the rocks' paths get the 20 rocks that a percentile needs.

The front is the width over which the rocks fall. If N rocks fall on a front of W metres, about N c / W rocks pass a
cell of side c. So with cells of at least 20 W / N, most cells on the rocks' paths have percentiles. Before the first
rock flies, only the starting places, the number of rocks and the depth of fall are known. So the front is taken to be
as wide as the source, plus the width over which rocks spread sideways.
"""

import math
from collections.abc import Sequence

import numpy as np

from rpf3d_core.ensemble.releases import Source
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec

ASIDE = 0.2
"""Width over which rocks from one place spread sideways, as a share (-) of the slope's length.

Field tests gave 0.1 to 0.2 (Azzoni & de Freitas 1995, Rock Mech. Rock Eng. 28:111-124). The height of the source above
the lowest terrain is taken as the length.
"""

LEAST_CELLS = 20
"""Smallest number of cells along the longer side of a map; coarser cells do not show the shape of the ground."""


def filled_cell(sources: Sequence[Source], rocks: int, low: Vec, high: Vec) -> float:
    """Return the cell size (m) at which most cells on the rocks' paths have enough rocks for a percentile.

    The result is 0 if there are no rocks. It depends only on the sources, the number of rocks and the terrain, so it is
    the same for all parts of an ensemble.

    Parameters
    ----------
    sources : sources with the release places of rocks, local frame
    rocks : number of rocks that all sources release together
    low, high : corners of the terrain's box, m, local frame
    """
    flying = [source for source in sources if source.rocks > 0]
    if not flying or rocks < 1:
        return 0.0
    fronts = sum(_front(source, low[2], high[2]) for source in flying)
    together = _wide(np.concatenate([_places(source) for source in flying]))
    aside = max(_aside(source, low[2], high[2]) for source in flying)
    return FEWEST_ROCKS * min(fronts, together + aside) / rocks


def coarsest_cell(low: Vec, high: Vec) -> float:
    """Return the largest cell size (m) for a map over a box, if the scene does not state a cell size.

    low, high : corners of the box (m)
    """
    return max(high[0] - low[0], high[1] - low[1]) / LEAST_CELLS


def _front(source: Source, lowest: float, highest: float) -> float:
    """Return the width (m) over which the rocks of a source fall: its front.

    For a source of points, the front is at most the sum of the fronts of the single points.

    lowest, highest : heights of the lowest and the highest point of the terrain (m)
    """
    aside, wide = _aside(source, lowest, highest), _wide(_places(source))
    if source.line or source.triangles is not None:
        return wide + aside
    return min(wide + aside, len(source.points) * aside)


def _aside(source: Source, lowest: float, highest: float) -> float:
    """Return the width (m) over which rocks from one place of a source spread sideways.

    lowest, highest : heights of the lowest and the highest point of the terrain (m)
    """
    on_ground = source.above_ground is not None or source.triangles is not None
    top = highest if on_ground else float(source.points[:, 2].max())
    return ASIDE * max(top - lowest, 0.0) + 2.0 * math.hypot(*source.spread[:2])


def _places(source: Source) -> FloatArray:
    """Return places (P, 3) m that enclose all start points of a source."""
    return source.points if source.triangles is None else source.triangles.corners.reshape(-1, 3)


def _wide(places: FloatArray) -> float:
    """Return the diagonal (m) of the box in plan around places (P, 3) m."""
    return float(np.linalg.norm(np.ptp(places[:, :2], axis=0)))
