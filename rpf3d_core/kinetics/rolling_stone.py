"""Ground model of rolling by STONE's rule: a constant deceleration, and a stop by speed alone.

dv/dt = g_t - k v / |v|, with k = g sin(atan(mu_r)) on every slope; g_t is gravity along the ground. Coulomb's rule has
k = mu g cos(b) on a slope of angle b. Azzoni's rule (`rolling.py`) has 5/7 g_t, and k = 5/7 mu_r g cos(b).

Source: Guzzetti et al. 2002, Comput. Geosci. 28:1079-1093, as implemented in r.stone.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.ground import Law, law_in_gully, law_on_facet, shared
from rpf3d_core.materials.library import Surface


class RollingStone(NamedTuple):
    """The ground model of STONE's rule, with the material's rolling friction.

    stop_speed : m/s below which a rock on the ground has stopped, on any slope
    """

    stop_speed: float


@law_on_facet.rule(RollingStone)
def stone_on_facet(ground: RollingStone, surface: Surface, n_z: float, gravity: float) -> Law:
    """Return STONE's law of motion on a facet: k = g sin(atan(mu_r)), the same on any slope.

    n_z : not used by this law; gravity : g, m/s^2, above 0
    """
    return Law(share=1.0, friction=_deceleration(surface.mu_r, gravity), stop_speed=ground.stop_speed, anywhere=True)


@law_in_gully.rule(RollingStone)
def stone_in_gully(
    ground: RollingStone, first: Surface, second: Surface, pushes: tuple[float, float], gravity: float
) -> Law:
    """Return STONE's law of motion in a gully, with the mean friction of two facets, weighted by their normal forces.

    STONE itself has no gullies.

    first, second, pushes : as in `ground.law_in_gully`; gravity : g, m/s^2, above 0
    """
    return Law(
        share=1.0,
        friction=_deceleration(shared(first.mu_r, second.mu_r, pushes), gravity),
        stop_speed=ground.stop_speed,
        anywhere=True,
    )


@kernel
def _deceleration(mu: float, gravity: float) -> float:
    """Return the deceleration of STONE's rule, g sin(atan(mu)), m/s^2.

    mu : rolling friction (-); gravity : g, m/s^2
    """
    return gravity * mu / math.sqrt(1.0 + mu * mu)
