"""The last guard: a rock that is about to leave the terrain must not do so from below the ground.

Contact is found to rounding, and rounding has ways that no list is complete of. A rock that no facet took although it
lies under the ground has fallen through. It is not counted as one that left: it ends where it was last known to be on
the ground, as `unresolved_contact`, which the summary counts and alerts take for danger.
"""

from typing import Any

from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.compiling import kernel
from rpf3d_core.detection.contact import NOTHING_LEFT, first_contact
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec

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
def sets_out_below(locator: Any, facets: Facets, arc: Arc) -> bool:
    """Return whether a place on the arc has the backs of facets straight above it, and all around it.

    All around: next to an upright wall a rock in the open has the back of the wall's top above it on one side.
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
    """Return whether the facet straight above x (3,) m is met from its back."""
    up = (0.0, 0.0, max(facets.high[2] - x[2], 0.0) + path)
    above = first_contact(locator, facets, Arc(x, up, STRAIGHT), NOTHING_LEFT, 1.0)
    return above.t <= 1.0 and above.side < 0.0  # type: ignore[no-any-return]
