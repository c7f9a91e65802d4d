"""The last guard: a rock that is about to leave the terrain must not do so from below the ground.

Contact is found to rounding, and rounding has ways that no list is complete of. A rock that no facet took although it
lies under the ground has fallen through. It is not counted as one that left: it ends where it was last known to be on
the ground, as `fell_through`, which the summary counts and alerts take for danger.
"""

import math
from typing import Any

from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.compiling import kernel
from rpf3d_core.detection.contact import NOTHING_LEFT, UPRIGHT, Contact, Left, first_contact
from rpf3d_core.terrain.facet_geometry import stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import add, scale

PROBES = 3
"""Places along a flight that are looked at."""
FIRST_PROBE = 64.0
"""Cracks of path to the first of them: 16 times as deep as a rock may lie below a facet that still takes it."""
FURTHER = 256.0
"""Path to a place over that to the place before."""
WIDTH = 1.0 / 16.0
"""How far around a place is looked, over the path to it."""
AROUND = ((1.0, 0.4), (-0.4, 1.0), (-1.0, -0.4), (0.4, -1.0))
"""Where is looked around a place, in plan: a rock that falls straight below a vertex lies within no facet."""
STRAIGHT = 1e-100
"""Gravity (m/s^2) of an arc that is a straight line; not 0, by which the reference engine's boxes would divide."""


@kernel
def sets_out_below(locator: Any, facets: Facets, arc: Arc, left: Left, end: float) -> bool:
    """Return whether a place on the arc before `end` (s) has the backs of facets straight above it, and all around it.

    All around: next to an upright wall a rock in the open has the back of the wall's top above it on one side. Under a
    sheet, a surface without thickness, even rocks in the open have backs above them: there this cannot be told.
    """
    path = FIRST_PROBE * facets.crack
    if _was_in_the_open(locator, facets, arc.x, left, path):
        return False
    for _ in range(PROBES):
        t = time_over(arc, 0.0, path)
        if t > end:
            return False
        x, free = position(arc, t), False
        for east, north in AROUND:
            apart = WIDTH * path
            free = free or not _is_under(locator, facets, (x[0] + apart * east, x[1] + apart * north, x[2]), path)
        if not free:
            return True
        path = FURTHER * path
    return False


@kernel
def _was_in_the_open(locator: Any, facets: Facets, x: Vec, left: Left, path: float) -> bool:
    """Return whether backs above x (3,) m say nothing, for they were there before the rock could fall.

    In mid-air it is in the open where it has ground below it; on the ground, where it has backs above it as well as
    `path` metres off the ground that it leaves.
    """
    if left.facet < 0:
        below = _straight(locator, facets, x, min(facets.low[2] - x[2], 0.0) - path)
        return below.t <= 1.0 and below.side > 0.0  # type: ignore[no-any-return]
    n = scale(left.side, stored_normal(facets, left.facet))
    if abs(n[2]) > UPRIGHT:
        n = (0.0, 0.0, math.copysign(1.0, n[2]))
    return _is_under(locator, facets, add(x, scale(path, n)), path)


@kernel
def _is_under(locator: Any, facets: Facets, x: Vec, path: float) -> bool:
    """Return whether the facet straight above x (3,) m is met from its back."""
    above = _straight(locator, facets, x, max(facets.high[2] - x[2], 0.0) + path)
    return above.t <= 1.0 and above.side < 0.0  # type: ignore[no-any-return]


@kernel
def _straight(locator: Any, facets: Facets, x: Vec, way: float) -> Contact:
    """The first contact of a straight line of `way` metres upwards (down where negative); its time is a share of it."""
    return first_contact(locator, facets, Arc(x, (0.0, 0.0, way), STRAIGHT), NOTHING_LEFT, 1.0)  # type: ignore[no-any-return]
