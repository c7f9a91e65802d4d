"""Contacts found in fixed time steps, as the thesis and most programs find them: a third way of finding contacts.

Not a second physics: rebound, materials, the end of bouncing and outcomes are those of every other run. The rock is
put at the exact parabola at each step, so what is wrong with the answer is wrong with finding contacts alone. It may
tunnel through the ground, bounce in the air above it, or off a neighbour: that is what it is here to show.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, position, time_over, velocity
from rpf3d_core.detection.closest import closest_facet
from rpf3d_core.detection.contact import NO_CONTACT, Contact, PreviousContact, first_contact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import REACH, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.vectors import dot

LOOK = 2.0
"""How far around a rock facets are looked for, over the size of a facet (m): beyond that, steps are taken unseen."""


class Stepped(NamedTuple):
    """A fixed-step method over an index that tells the closest facet.

    locator : the index; dt : s; threshold : m, the distance below which the rock is in contact
    look : m, the radius within which facets are looked for
    every_step : whether each step is looked at, as the thesis does, or only those that could be a contact: a rock
        further off than the threshold is still so while its path is shorter than the difference. The answer is the
        same to the last bit; only the time it takes is not.
    """

    locator: Any
    dt: float
    threshold: float
    look: float
    every_step: bool


def stepped(
    locator: Any, size: float, dt: float, threshold: float, squared: bool = False, every_step: bool = False
) -> Stepped:
    """The fixed-step method over an index.

    Parameters
    ----------
    size : of a facet (m)
    dt : s; threshold : m
    squared : the thesis' literal comparison of the *squared* distance with the threshold: 0.05 means 0.22 m
    """
    distance = math.sqrt(threshold) if squared else threshold
    return Stepped(locator, dt, distance, distance + LOOK * size, every_step)


@first_contact.rule(Stepped)
def first_contact_at_steps(method: Stepped, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Contact:
    """The first step at which the closest facet is nearer than the threshold and the rock moves into it.

    Moving into it is told by the normal towards its free side, wherever the rock is: one that has stepped through by
    less than the threshold is turned back.
    """
    step = 1.0
    while step * method.dt < end:
        t = step * method.dt
        closest = closest_facet(method.locator, facets, position(arc, t), method.look)
        step += 1.0
        if closest.distance < method.threshold:
            approach = -dot(stored_normal(facets, closest.facet), velocity(arc, t))
            if approach > 0.0:
                return Contact(t, closest.facet, 1.0, approach)
        elif not method.every_step:
            step = max(step, _next_possible(method, arc, t, closest.distance - REACH * facets.tolerance))
    return NO_CONTACT


@kernel
def _next_possible(method: Stepped, arc: Arc, t: float, distance: float) -> float:
    """The first step at which a rock `distance` (m) off all facets at time t could be within the threshold."""
    clear = distance - method.threshold
    return math.floor(time_over(arc, t, clear) / method.dt) if clear > 0.0 else 0.0
