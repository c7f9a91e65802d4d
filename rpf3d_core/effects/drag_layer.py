"""Forest as a layer above the ground that brakes flying rocks with the force F = -c v.

The layer reaches from the ground up to a height that the scene gives (`height`, m above the ground). It covers the area
inside given outlines, or the whole terrain.

Source: Leine et al. 2014 (Multibody Syst. Dyn. 32:241), equations 10 and 11. RAMMS' classes, c = 250, 500 and 750 kg/s
for open, medium and dense forest, and RAMMS' height of 30 m are unconfirmed. As in the source, c is the same for all
rocks, so the layer brakes light rocks more: their terminal velocity is m g / c. `rpf3d check` and `rpf3d run` warn if
this speed is below 1 m/s for the lightest rock or fragment (`setup/warnings/suspicious_settings.py`). The layer
contains no single trees (for trees see `forest`). The layer brakes flights only, not sliding or rolling rocks, and not
bounces that are summed up. With a ground model, the runout in a forest is therefore too long.

Whether a rock is inside the layer is decided at the beginning and at the end of each time step of a flight. The place
where a rock enters or leaves the layer is therefore exact only to one time step.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.effects.air_step import FLIGHT, stretch_for
from rpf3d_core.effects.hooks import asks_height, in_air, longest_flight
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import norm, scale

MOST_BRAKED = 0.5
"""Approximate largest share (-) of a rock's speed that the layer may take in one time step.

The error bound comes from a series that is valid only for a small share.
"""


class DragLayer(NamedTuple):
    """A layer above the ground that brakes flying rocks, such as a forest.

    coefficient : c, kg/s, of the braking force c v; height : m, top of the layer above the ground
    accuracy : m, largest position error after a flight of `air_step.FLIGHT` seconds wholly inside or outside the layer
    gravity : m/s^2, used only for the accuracy
    edges : (E, 4) x, y, x, y m, edges of the layer's outlines, holes included; with E = 0 the layer is everywhere
    """

    coefficient: float
    height: float
    accuracy: float
    gravity: float
    edges: Any

    @property
    def asks_rock(self) -> bool:
        """True: the rules for the layer need the mass of the rock."""
        return True


def terminal_speed(coefficient: float, mass: float, gravity: float) -> float:
    """Return the terminal velocity (m/s) of a rock in the layer, m g / c, at which the drag balances the weight.

    `rpf3d check` and `rpf3d run` warn if this speed is too low.

    coefficient : c > 0, kg/s; mass : m, kg; gravity : g, m/s^2
    """
    return mass * gravity / coefficient


@asks_height.rule(DragLayer)
def always(layer: DragLayer) -> bool:
    """Return True (hook `asks_height`): only the height above the ground shows if a rock is inside the layer."""
    return True


@in_air.rule(DragLayer)
def braked_by_the_layer(layer: DragLayer, motion: Motion, height: float, t: float, rock: RockContext) -> Motion:
    """Return the motion of a rock that the layer alone has braked for t seconds: the exact solution v exp(-c t / m).

    Outside the layer, the motion is returned unchanged.

    height : of the rock above the ground (m), as in `in_air`
    """
    if height >= layer.height or not stands_at(layer.edges, motion.x):
        return motion
    mass = rock.rock.mass  # type: ignore[union-attr]  # asks_rock: the rock is never None
    return Motion(t=motion.t, x=motion.x, v=scale(math.exp(-layer.coefficient * t / mass), motion.v), w=motion.w)


@kernel
def stands_at(edges: Any, x: Vec) -> bool:
    """Return True if the layer covers the point x in plan; edges : as in `DragLayer`.

    Without edges, the layer covers every point. Otherwise the layer covers x if a ray from x to the east crosses an odd
    number of edges.
    """
    inside = len(edges) == 0
    for e in range(len(edges)):
        if (edges[e, 1] > x[1]) == (edges[e, 3] > x[1]):
            continue
        share = (x[1] - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
        if edges[e, 0] + share * (edges[e, 2] - edges[e, 0]) > x[0]:
            inside = not inside
    return inside


@longest_flight.rule(DragLayer)
def while_the_layer_brakes_little(layer: DragLayer, motion: Motion, rock: RockContext) -> float:
    """Return the longest time step (s) of a flight for which the position error stays within `layer.accuracy` (m).

    The bound of the error uses the speed that gravity may give the rock by the end of the step. The result is inf if c
    is zero.

    For d = -q v with q = c / m: d' = -q and d'' = 0. The errors in `air_step` are then at most
    |dx| <= h^3 q (q v / 24 + g / 6) and |dv| <= h^3 q^2 g / 24. The layer also brakes an error in velocity: however
    long the flight is, such an error moves the rock by at most 1 / q times the error. The velocity term of the bound in
    `air_step`, T^2 / 2 |dv| / h^3, is therefore multiplied by 2 / (q T) if this factor is below 1.
    """
    q = layer.coefficient / rock.rock.mass  # type: ignore[union-attr]
    if q <= 0.0:
        return math.inf
    v = norm(motion.v)
    return _stretch(layer, q, v + layer.gravity * _stretch(layer, q, v))


@kernel
def _stretch(layer: DragLayer, q: float, v: float) -> float:
    """Return the longest time step (s) of a flight at the speed v (m/s) with a position error within `layer.accuracy`.

    q : c / m (1/s)
    """
    g = layer.gravity
    forgotten = min(1.0, 2.0 / (q * FLIGHT))
    h = stretch_for(layer.accuracy, q * (q * v / 24.0 + g / 6.0), forgotten * q * q * g / 24.0, q * v)
    return min(h, MOST_BRAKED / q)
