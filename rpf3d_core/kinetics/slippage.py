"""Friction mu that grows with the slip s (m) of a rock, as in RAMMS::ROCKFALL.

Slip grows with the path of the rock's centre while the rock presses on the ground, and decays in the air:

    mu(s) = mu_min + 2 / pi (mu_max - mu_min) atan(kappa s)
    ds/dt = |v| while a contact presses, v the velocity of the centre of mass;    ds/dt = -beta s otherwise

Source: Leine et al. 2014 (Multibody Syst. Dyn. 32:241), equations 46 and 47.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.jit.dispatch import kernel


class SlipFriction(NamedTuple):
    """The slip friction of each of Z zones; every array is (Z,).

    mu_min, mu_max : friction (-) without slip, and its limit for a large slip; mu_min is NaN for a zone without slip
        friction
    kappa : 1/m, how fast friction grows with slip; beta : 1/s, how fast slip decays without contact
    """

    mu_min: Any
    mu_max: Any
    kappa: Any
    beta: Any


@kernel
def slippage_friction(mu_min: float, mu_max: float, kappa: float, slipped: float) -> float:
    """Return the friction mu (-) of a rock with a given slip (Leine et al. 2014, equation 46).

    mu(s) = mu_min + 2 / pi (mu_max - mu_min) atan(kappa s); slipped : the slip s, m
    """
    return mu_min + 2.0 / math.pi * (mu_max - mu_min) * math.atan(kappa * slipped)


@kernel
def has_slip(model: SlipFriction, zone: int) -> bool:
    """Return True if zone number `zone` has slip friction."""
    return bool(model.mu_min[zone] >= 0.0)


@kernel
def slip_at_release(model: Any) -> Any:
    """Return the slip (m) of a rock at its release: 0, or None if no ground of the scene has slip friction.

    model : `SlipFriction`, or None if no ground has slip friction
    """
    if model is None:
        return None
    return 0.0


@kernel
def slip_on_ground(model: Any, slipped: Any, zone: int, way: float) -> Any:
    """Return the slip (m) of a rock after its centre has moved a distance `way` (m) while it presses on a zone.

    model : as in `slip_at_release`; slipped : slip before (m); zone : number of the zone
    The result is 0 on ground without slip friction, and None if no ground of the scene has slip friction. Slip is the
    length on which slip friction depends.
    """
    if model is None:
        return None
    return slipped + way if has_slip(model, zone) else 0.0


@kernel
def slip_in_air(model: Any, slipped: Any, zone: int, t: float) -> Any:
    """Return the slip (m) of a rock after t seconds without pressure on the ground.

    The result is 0 after a contact with ground without slip friction, and None if no ground of the scene has slip
    friction.

    model : as in `slip_at_release`; slipped : slip before (m)
    zone : number of the zone of the last contact, or any zone before the first contact, when slip is 0
    """
    if model is None:
        return None
    if not slipped > 0.0:
        return slipped
    return slipped * math.exp(-model.beta[zone] * t) if has_slip(model, zone) else 0.0
