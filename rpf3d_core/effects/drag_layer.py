"""Forest as a layer that brakes: F = -c v while a rock is lower than z_height above the ground, in parts or all over.

Source: Leine et al. 2014, equations 10 and 11 (physics reference 3.3, C). RAMMS' classes, c = 250, 500 and 750 kg/s for
open, medium and dense forest, and its height of 30 m are unconfirmed. As in the source c is that of any rock, so light
ones are braked more, and sink at m g / c in the end: `rpf3d check` and `rpf3d run` warn where that is below 1 m/s for
the lightest rock (`io.scene_warnings`). A rock meets no single tree (`forest` has them). It brakes flights alone: rocks
that slide or roll, or whose bounces are summed up, go on unbraked, so with a ground model their runout in a
forest is too long.

A rock is in the layer or not at the beginning and at the end of each stretch of its flight: where it comes in or goes
out the layer's border is known to within a stretch.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.effects.air import FLIGHT, stretch_for
from rpf3d_core.effects.hooks import asks_height, in_air, longest_flight
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import norm, scale

MOST_BRAKED = 0.5
"""Share of its speed, about, that a stretch may cost a rock: the series that errors are told from wants it small."""


class DragLayer(NamedTuple):
    """A layer above the ground that brakes rocks.

    coefficient : c, kg/s; height : of its top above the ground, m
    accuracy : m, of a flight of `air.FLIGHT` seconds that stays in it or out of it; gravity : m/s2, for that only
    edges : (E, 4) x, y, x, y m, of the outlines within which it stands, holes among them; none: it stands everywhere
    """

    coefficient: float
    height: float
    accuracy: float
    gravity: float
    edges: Any

    @property
    def asks_rock(self) -> bool:
        """Its rules ask for the mass."""
        return True


def terminal_speed(coefficient: float, mass: float, gravity: float) -> float:
    """Return the speed (m/s) at which a rock sinks in the layer in the end: m g / c, where F = -c v bears its weight.

    coefficient : c > 0, kg/s; mass : m, kg; gravity : g, m/s2
    """
    return mass * gravity / coefficient


@asks_height.rule(DragLayer)
def always(layer: DragLayer) -> bool:
    """Where it ends is told by the height."""
    return True


@in_air.rule(DragLayer)
def braked_by_the_layer(layer: DragLayer, motion: Motion, height: float, t: float, falling: RockContext) -> Motion:
    """The exact solution of m dv/dt = -c v over t seconds: v exp(-c t / m)."""
    if height >= layer.height or not stands_at(layer.edges, motion.x):
        return motion
    mass = falling.rock.mass  # type: ignore[union-attr]  # there is a rock: it asks for it
    return Motion(motion.t, motion.x, scale(math.exp(-layer.coefficient * t / mass), motion.v), motion.w)


@kernel
def stands_at(edges: Any, x: Vec) -> bool:
    """Whether the layer stands at x in plan: a line eastwards from it crosses the outlines an odd number of times."""
    inside = len(edges) == 0
    for e in range(len(edges)):
        if (edges[e, 1] > x[1]) == (edges[e, 3] > x[1]):
            continue
        share = (x[1] - edges[e, 1]) / (edges[e, 3] - edges[e, 1])
        if edges[e, 0] + share * (edges[e, 2] - edges[e, 0]) > x[0]:
            inside = not inside
    return inside


@longest_flight.rule(DragLayer)
def while_the_layer_brakes_little(layer: DragLayer, motion: Motion, falling: RockContext) -> float:
    """The stretch that keeps to the accuracy at the speed that the rock may have at its end; inf where nothing brakes.

    For d = -q v with q = c / m: d' = -q and d'' = 0, so that `air` has |dx| <= h^3 q (q v / 24 + g / 6) and
    |dv| <= h^3 q^2 g / 24. The layer brakes what a speed is off by, too: it moves the rock by no more than 1 / q times
    as much, whatever time is left, so that all of them together count 2 / (q T) of what `air` says at most.
    """
    q = layer.coefficient / falling.rock.mass  # type: ignore[union-attr]
    if q <= 0.0:
        return math.inf
    v = norm(motion.v)
    return _stretch(layer, q, v + layer.gravity * _stretch(layer, q, v))


@kernel
def _stretch(layer: DragLayer, q: float, v: float) -> float:
    """The stretch (s) at a speed v (m/s)."""
    g = layer.gravity
    forgotten = min(1.0, 2.0 / (q * FLIGHT))
    h = stretch_for(layer.accuracy, q * (q * v / 24.0 + g / 6.0), forgotten * q * q * g / 24.0, q * v)
    return min(h, MOST_BRAKED / q)
