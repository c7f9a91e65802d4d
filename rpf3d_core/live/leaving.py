"""Find which rocks left the terrain while an area of interest was still ahead of them: such rocks may have reached it.

A rock that leaves over the boundary of the survey, or into a hole, moves on over unknown ground. The area counts as
ahead of the rock, unless the rock left inside the area, or the whole area lies behind the rock. To decide what is
behind, a line in plan is drawn through the place where the rock left, perpendicular to the direction from the release
to this place: everything on the side of the release is behind.
"""

from collections.abc import Sequence

import numpy as np

from rpf3d_core.alerts.evidence import LEFT
from rpf3d_core.ensemble.flights import Deposits, IntArray
from rpf3d_core.live.areas import AreaOutline

CODES = [int(outcome) for outcome in LEFT]


def left_ahead_of(deposits: Deposits, areas: Sequence[AreaOutline]) -> IntArray:
    """Return for each area (A,) how many rocks left the terrain with the area still ahead of them.

    deposits : where and how the rocks ended
    """
    left = np.isin(deposits.outcome, CODES)
    if not left.any():
        return np.zeros(len(areas), dtype=np.int64)
    places, ways = deposits.x[left, :2], (deposits.x - deposits.release)[left, :2]
    return np.array([(each.is_ahead(places, ways) & ~each.contains(places)).sum() for each in areas], dtype=np.int64)
