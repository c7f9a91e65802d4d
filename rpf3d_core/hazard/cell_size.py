"""How large the cells of a map must be that the rocks of a scene fill them: a percentile needs 20 rocks in a cell.

N rocks that come down over a front of W metres pass N cell / W to a cell. So cells of at least 20 W / N give the cells
that most rocks come to their percentiles. What is known before the first rock flies is where rocks start, how many, and
how deep they may fall: a front is as wide as the source, and wider by how far rocks go aside.
"""

import math
from collections.abc import Sequence

import numpy as np

from rpf3d_core.ensemble.releases import Source
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec

ASIDE = 0.2
"""Width that rocks from one place spread over, over the length of the slope (-): 0.1 to 0.2 in field tests (Azzoni & de
Freitas 1995, Rock Mech. Rock Eng. 28:111-124). The depth of the terrain below the source stands for the length."""

LEAST_CELLS = 20
"""Along the longer side of a map, however few the rocks: coarser cells show nothing of the ground."""


def filled_cell(sources: Sequence[Source], rocks: int, low: Vec, high: Vec) -> float:
    """Return the cell (m) in which a front of rocks has as many as a percentile needs; 0 where no rock is released.

    Depends on the sources, the number of rocks and the terrain alone, so each part of an ensemble has the same.

    Parameters
    ----------
    sources : with the places of rocks, local frame
    rocks : that all sources together release
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
    """Return the largest cell (m) that a map over a box may have where its scene does not give one."""
    return max(high[0] - low[0], high[1] - low[1]) / LEAST_CELLS


def _front(source: Source, lowest: float, highest: float) -> float:
    """The width (m) of the front of a source's rocks: that of its places, or of so many single places."""
    aside, wide = _aside(source, lowest, highest), _wide(_places(source))
    if source.line or source.patches is not None:
        return wide + aside
    return min(wide + aside, len(source.points) * aside)


def _aside(source: Source, lowest: float, highest: float) -> float:
    """The width (m) of the front of rocks from one place of a source."""
    on_ground = source.above_ground is not None or source.patches is not None
    top = highest if on_ground else float(source.points[:, 2].max())
    return ASIDE * max(top - lowest, 0.0) + 2.0 * math.hypot(*source.spread[:2])


def _places(source: Source) -> FloatArray:
    """Places (P, 3) m between which a source's rocks start."""
    return source.points if source.patches is None else source.patches.corners.reshape(-1, 3)


def _wide(places: FloatArray) -> float:
    """How far places (P, 3) m reach in plan (m)."""
    return float(np.linalg.norm(np.ptp(places[:, :2], axis=0)))
