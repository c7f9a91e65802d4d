"""The friction of a body's contacts on ground with slip friction."""

from typing import Any

from rpf3d_core.body.contacts import FACET, MU
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.slippage import has_slip, slippage_friction
from rpf3d_core.terrain.facets import Facets


@kernel
def set_slip_friction(model: Any, facets: Facets, points: Any, count: int, slipped: Any) -> None:
    """Write the friction of all contacts of a body on ground with slip friction into `points`, from the body's slip.

    model : `SlipFriction`, or None if no ground has slip friction, so that nothing is written
    slipped : slip of the body (m), as in `Ride`
    points : (K, CONTACT_COLUMNS) contacts, of which the first `count` rows are used; column MU is changed
    """
    if model is None:
        return
    for i in range(count):
        zone = facets.zone[int(points[i, FACET])]
        if has_slip(model, zone):
            points[i, MU] = slippage_friction(model.mu_min[zone], model.mu_max[zone], model.kappa[zone], slipped)
