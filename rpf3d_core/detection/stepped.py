"""Find contacts in fixed time steps, as the thesis and most programs do; only for comparison with the exact method.

Only the search for contacts differs. The models of rebound, material and stopping are those of every run. At each step
the rock is on the exact parabola, so all errors of the result come from the search for contacts. The rock may pass
through the ground, bounce in the air above the ground, or bounce off a neighbouring facet: the method exists to show
these errors. A fall through the ground is not detected or repaired.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc, position, time_over, velocity
from rpf3d_core.detection.closest import closest_facet
from rpf3d_core.detection.contact import NO_CONTACT, Contact, PreviousContact, first_contact, plain_locator
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import REACH, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.vectors import dot

LOOK = 2.0
"""Distance beyond the contact threshold up to which facets are searched, divided by the size of a facet (-).

If no facet is within the search radius, the steps in which the rock cannot reach a facet are skipped.
"""


class Stepped(NamedTuple):
    """The fixed-step method and its settings, with a locator that finds the closest facet.

    locator : any locator that `closest_facet` has a rule for; dt : time step, s
    threshold : m, the distance to a facet below which the rock is in contact
    look : m, the radius within which facets are searched
    every_step : True to test each step, as the thesis does; False to test only steps that could be a contact: at a
        distance D from the closest facet, a rock must first move by D minus the threshold. Both settings find the
        same contacts, to the last bit; only the computing time differs.
    """

    locator: Any
    dt: float
    threshold: float
    look: float
    every_step: bool


def stepped(
    locator: Any, size: float, dt: float, threshold: float, squared: bool = False, every_step: bool = False
) -> Stepped:
    """Return the fixed-step method with its search radius, for a locator that finds the closest facet.

    Parameters
    ----------
    size : of a facet (m)
    dt : time step (s); threshold : distance to a facet below which the rock is in contact (m)
    squared : True to compare the *squared* distance with the threshold (m2), as the thesis does literally: a threshold
        of 0.05 m2 is a distance of 0.22 m
    every_step : as in `Stepped`
    """
    distance = math.sqrt(threshold) if squared else threshold
    return Stepped(locator=locator, dt=dt, threshold=distance, look=distance + LOOK * size, every_step=every_step)


@plain_locator.rule(Stepped)
def locator_of_heights(method: Stepped) -> Any:
    """Return the locator inside `method`, which uses no time steps, so that heights above the ground are exact."""
    return method.locator


@first_contact.rule(Stepped)
def first_contact_at_steps(method: Stepped, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Contact:
    """Return the contact at the first step where a facet is within the threshold and the rock moves into this facet.

    A rock moves into a facet if it moves against the normal of the facet, on whichever side of the facet the rock is.
    So a rock that has passed through the facet by less than the threshold bounces back to the free side.

    method : the settings; end : s, later steps are not tested; left : not used
    """
    step = 1.0
    while step * method.dt < end:
        t = step * method.dt
        closest = closest_facet(method.locator, facets, position(arc, t), method.look)
        step += 1.0
        if closest.distance < method.threshold:
            approach = -dot(stored_normal(facets, closest.facet), velocity(arc, t))
            if approach > 0.0:
                return Contact(t=t, facet=closest.facet, side=1.0, approach=approach)
        elif not method.every_step:
            step = max(step, _next_possible(method, arc, t, closest.distance - REACH * facets.tolerance))
    return NO_CONTACT


@kernel
def _next_possible(method: Stepped, arc: Arc, t: float, distance: float) -> float:
    """Return the number of the next step at which a rock may be within the contact threshold; 0 to skip no step.

    distance : m, lower bound of the distance from the rock to all facets at time t
    """
    clear = distance - method.threshold
    return math.floor(time_over(arc, t, clear) / method.dt) if clear > 0.0 else 0.0
