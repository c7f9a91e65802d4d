"""Quadratic air drag on flying rocks: F = 1/2 rho C_d A v^2 against the motion.

A = pi R^2, with R the radius of the sphere of equal volume. rho = 1.2 kg/m3 is the air density in the user guide of the
program stnParabel; the user sets C_d (docs/reference/effects.md, `drag`). Spin and lift are neglected. Drag is also
neglected while a rock slides and while bounces below `smallest_bounce` are summed up.
"""

import math
from typing import NamedTuple

from rpf3d_core.effects.air_step import stretch_for
from rpf3d_core.effects.hooks import in_air, longest_flight
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Rock
from rpf3d_core.vectors import norm, scale

MOST_BRAKED = 0.5
"""Approximate largest share (-) of a rock's speed that the air may take in one time step.

The error bound comes from a series that is valid only for a small share.
"""


class Drag(NamedTuple):
    """The parameters of quadratic air drag on flying rocks.

    coefficient : C_d (-); density : kg/m3, of the air
    accuracy : m, largest position error after a flight of `air_step.FLIGHT` seconds
    gravity : m/s^2, used only for the accuracy
    """

    coefficient: float
    density: float
    accuracy: float
    gravity: float

    @property
    def asks_rock(self) -> bool:
        """True: the rules for drag need mass and radius of the rock."""
        return True


@kernel
def drag_per_metre(drag: Drag, rock: Rock) -> float:
    """Return the drag of a rock per metre of its path, k = rho C_d pi R^2 / (2 m) (1/m), where dv/dt = -k |v| v."""
    return 0.5 * drag.density * drag.coefficient * math.pi * rock.radius * rock.radius / rock.mass


@in_air.rule(Drag)
def braked_by_air(drag: Drag, motion: Motion, height: float, t: float, rock: RockContext) -> Motion:
    """Return the motion of a rock that drag alone has braked for t seconds: the exact solution v / (1 + k |v| t).

    k is the drag per metre (`drag_per_metre`).

    height : not used by this effect
    """
    k = drag_per_metre(drag, rock.rock)  # type: ignore[arg-type]  # asks_rock: the rock is never None
    return Motion(t=motion.t, x=motion.x, v=scale(1.0 / (1.0 + k * norm(motion.v) * t), motion.v), w=motion.w)


@longest_flight.rule(Drag)
def while_drag_is_small(drag: Drag, motion: Motion, rock: RockContext) -> float:
    """Return the longest time step (s) of a flight for which the position error stays within `drag.accuracy` (m).

    The bound of the error uses the speed that gravity may give the rock by the end of the step. The result is inf
    without drag.

    For d = -k |v| v: |d'| <= 2 k v, |d''(g, g)| <= 2 k g^2 and |d''(d, g)| <= 2 k |d| g. The errors in `air_step` are
    then at most |dx| <= h^3 k v (k v^2 / 12 + g / 3) and |dv| <= h^3 k g (k v^2 / 4 + g / 6).
    """
    k = drag_per_metre(drag, rock.rock)  # type: ignore[arg-type]
    if k <= 0.0:
        return math.inf
    v = norm(motion.v)
    return _stretch(drag, k, v + drag.gravity * _stretch(drag, k, v))


@kernel
def _stretch(drag: Drag, k: float, v: float) -> float:
    """Return the longest time step (s) of a flight at the speed v (m/s) with a position error within `drag.accuracy`.

    k : drag per metre (1/m)
    """
    g, slowing = drag.gravity, k * v * v
    place = k * v * (slowing / 12.0 + g / 3.0)
    speed = k * g * (slowing / 4.0 + g / 6.0)
    h = stretch_for(drag.accuracy, place, speed, slowing)
    return min(h, MOST_BRAKED / (k * v)) if v > 0.0 else h
