"""Guard against falls: a rock that leaves the terrain must not start its last flight below the ground.

Contacts are found to rounding, and no list of what rounding can do is complete. If no facet stops a rock although the
rock is below the ground, the rock has fallen through. The simulation does not count it as a rock that left the terrain:
the rock ends where it was last known to be on the ground, as `unresolved_contact`. The summary counts this outcome, and
alerts treat it as danger.
"""

from typing import Any

from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.detection.contact import NOTHING_LEFT, first_contact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec

PROBES = 3
"""Number of positions along a flight that are checked."""
FIRST_PROBE = 64.0
"""Path to the first position (crack widths): 16 times the depth at which a facet may still stop a rock."""
FURTHER = 256.0
"""Ratio of the path to a position and the path to the position before."""
WIDTH = 1.0 / 16.0
"""Distance of the points around a position, as a share of the path to the position."""
AROUND = ((1.0, 0.4), (-0.4, 1.0), (-1.0, -0.4), (0.4, -1.0))
"""Directions of these points in plan: a rock that falls straight below a vertex is strictly inside no facet."""
STRAIGHT = 1e-100
"""Gravity (m/s^2) of an arc that stands for a straight line; not 0, because the reference engine divides by it."""


@kernel
def sets_out_below(locator: Any, facets: Facets, arc: Arc) -> bool:
    """True if, at one of the first positions of an arc, all points around it have the back of a facet above them.

    All points must agree: next to an upright wall, a point on the wall's side has the back of the wall's top above it.
    """
    path = FIRST_PROBE * facets.crack
    for _ in range(PROBES):
        x, free = position(arc, time_over(arc, 0.0, path)), False
        for east, north in AROUND:
            apart = WIDTH * path
            free = free or not _is_under(locator, facets, (x[0] + apart * east, x[1] + apart * north, x[2]), path)
        if not free:
            return True
        path = FURTHER * path
    return False


@kernel
def _is_under(locator: Any, facets: Facets, x: Vec, path: float) -> bool:
    """True if the first facet straight above x (3,) m is met from its back."""
    up = (0.0, 0.0, max(facets.high[2] - x[2], 0.0) + path)
    above = first_contact(locator, facets, Arc(x, up, STRAIGHT), NOTHING_LEFT, 1.0)
    return above.t <= 1.0 and above.side < 0.0  # type: ignore[no-any-return]
