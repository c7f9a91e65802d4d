"""Where an effect may act on a rock: one function per place, one rule per effect, and none for a scene without effects.

A scene's effects are a `Chain`, each link one effect, or None. An effect has a rule in those functions where it acts;
the others leave everything as it is for it. `chain_of` puts them in the order of the registry, whatever the order in
the scene. None at the end of every chain is what a scene without effects consists of: nothing of an effect is compiled.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.values import MOVING, Motion, Vec


class Chain(NamedTuple):
    """One effect, and those that follow; None after the last."""

    head: Any
    tail: Any


class Meeting(NamedTuple):
    """An obstacle after t seconds of an arc (inf: none): a number that it has among all obstacles of a scene."""

    t: float
    number: int


class AfterObstacle(NamedTuple):
    """What an obstacle has made of a rock: its motion, and its outcome if it ends there, else MOVING.

    facet : that the obstacle stands on, which a rock that ends there is told to lie on; -1 if the rock goes on
    """

    motion: Motion
    outcome: int
    facet: int


NO_MEETING = Meeting(math.inf, -1)


def chain_of(effects: Sequence[Any]) -> Chain | None:
    """Effects as a chain, the first at its head; None of none."""
    chain = None
    for effect in reversed(effects):
        chain = Chain(effect, chain)
    return chain


def links_of(chain: Chain | None) -> list[Any]:
    """The effects of a chain, in order."""
    return [] if chain is None else [chain.head, *links_of(chain.tail)]


@model_function
def felt_normal(effect: object, n: Vec, motion: Motion, falling: RockContext) -> Vec:
    """The unit normal that an impact feels, of a ground whose normal is n (3,), turned against the velocity.

    Where v . result >= 0, or the rebound from it would lead into the ground, the ground's own normal is taken.
    """


@felt_normal.otherwise
def ground_normal(effect: object, n: Vec, motion: Motion, falling: RockContext) -> Vec:
    """The ground's own."""
    return n


@felt_normal.rule(Chain)
def normal_of_all(chain: Chain, n: Vec, motion: Motion, falling: RockContext) -> Vec:
    """One after another."""
    return felt_normal(chain.tail, felt_normal(chain.head, n, motion, falling), motion, falling)  # type: ignore[no-any-return]


@model_function
def in_ground(effect: object, zone: int, surface: Surface, motion: Motion, n: Vec, falling: RockContext) -> Motion:
    """What the ground makes of the motion of a rock that enters it, before it rebounds; n is the normal that it feels.

    zone : of the facet that was hit. It may change v and w; position and time are those of the impact.
    """


@in_ground.otherwise
def hard_ground(effect: object, zone: int, surface: Surface, motion: Motion, n: Vec, falling: RockContext) -> Motion:
    """Nothing."""
    return motion


@in_ground.rule(Chain)
def ground_of_all(chain: Chain, zone: int, surface: Surface, motion: Motion, n: Vec, falling: RockContext) -> Motion:
    """One after another."""
    after = in_ground(chain.head, zone, surface, motion, n, falling)
    return in_ground(chain.tail, zone, surface, after, n, falling)  # type: ignore[no-any-return]


@model_function
def breaks(effect: object, before: Motion, after: Motion, n: Vec, falling: RockContext) -> bool:
    """Whether an impact that turned the motion `before` into `after` breaks the rock."""


@breaks.otherwise
def stays_whole(effect: object, before: Motion, after: Motion, n: Vec, falling: RockContext) -> bool:
    """Never."""
    return False


@breaks.rule(Chain)
def breaks_by_any(chain: Chain, before: Motion, after: Motion, n: Vec, falling: RockContext) -> bool:
    """If any of them breaks it."""
    return bool(breaks(chain.head, before, after, n, falling) or breaks(chain.tail, before, after, n, falling))


@model_function
def longest_flight(effect: object, motion: Motion, falling: RockContext) -> float:
    """Seconds for which the effect lets a parabola stand for a flight, at the accuracy that it was asked for (inf)."""


@longest_flight.otherwise
def as_long_as_it_takes(effect: object, motion: Motion, falling: RockContext) -> float:
    """For ever."""
    return math.inf


@longest_flight.rule(Chain)
def shortest_of_all(chain: Chain, motion: Motion, falling: RockContext) -> float:
    """What the most particular of them asks for."""
    one, others = longest_flight(chain.head, motion, falling), longest_flight(chain.tail, motion, falling)
    return min(one, others)  # type: ignore[no-any-return]


@model_function
def asks_height(effect: object) -> bool:
    """Whether the effect wants to know how high above the ground a rock flies."""


@asks_height.otherwise
def asks_nothing(effect: object) -> bool:
    """No."""
    return False


@asks_height.rule(Chain)
def any_asks_height(chain: Chain) -> bool:
    """If any of them does."""
    return bool(asks_height(chain.head) or asks_height(chain.tail))


@model_function
def in_air(effect: object, motion: Motion, height: float, t: float, falling: RockContext) -> Motion:
    """The velocity after the air alone has acted on a rock for t >= 0 seconds, where it is; it may not be faster.

    height : m above the ground below, inf over a hole, 0.0 where no effect asks for it
    """


@in_air.otherwise
def in_nothing(effect: object, motion: Motion, height: float, t: float, falling: RockContext) -> Motion:
    """The same."""
    return motion


@in_air.rule(Chain)
def air_of_all(chain: Chain, motion: Motion, height: float, t: float, falling: RockContext) -> Motion:
    """The first for half of the time before the others, and for half of it after them: of second order (Strang)."""
    before = in_air(chain.head, motion, height, 0.5 * t, falling)
    between = in_air(chain.tail, before, height, t, falling)
    return in_air(chain.head, between, height, 0.5 * t, falling)  # type: ignore[no-any-return]


@model_function
def first_obstacle(effect: object, arc: Arc, passed: int, until: float, falling: RockContext) -> Meeting:
    """The first obstacle on an arc before `until` (s), or NO_MEETING.

    passed : number of the one that the rock has just met, which is not met again
    """


@first_obstacle.otherwise
def no_obstacle(effect: object, arc: Arc, passed: int, until: float, falling: RockContext) -> Meeting:
    """None."""
    return NO_MEETING


@first_obstacle.rule(Chain)
def first_of_all(chain: Chain, arc: Arc, passed: int, until: float, falling: RockContext) -> Meeting:
    """The first of any; of two at the same instant that of the effect that comes first."""
    one = first_obstacle(chain.head, arc, passed, until, falling)
    other = first_obstacle(chain.tail, arc, passed, until, falling)
    return _sooner(one, other)


@kernel
def _sooner(one: Meeting, other: Meeting) -> Meeting:
    """The sooner of two meetings, the first of two at the same instant."""
    return other if other.t < one.t else one


@kernel
def still_at(effects: Any, motion: Motion, passed: int, falling: RockContext) -> int:
    """`passed` if a rock is still at an obstacle, as after an impact just where it met one; else -1 for none."""
    if passed < 0:
        return passed
    here = first_obstacle(effects, Arc(motion.x, motion.v, 0.0), -1, 0.0, falling)
    return passed if here.t == 0.0 else -1


@model_function
def at_obstacle(effect: object, motion: Motion, number: int, met: int, falling: RockContext) -> AfterObstacle:
    """What the obstacle of a number makes of a rock, unless it is another effect's.

    met : obstacles that the rock has met before, for draws
    """


@at_obstacle.otherwise
def past_it(effect: object, motion: Motion, number: int, met: int, falling: RockContext) -> AfterObstacle:
    """Nothing: it is not one of this effect's."""
    return AfterObstacle(motion, MOVING, -1)


@at_obstacle.rule(Chain)
def by_its_effect(chain: Chain, motion: Motion, number: int, met: int, falling: RockContext) -> AfterObstacle:
    """What that effect makes of it which the obstacle belongs to: each knows the numbers of its own."""
    one = at_obstacle(chain.head, motion, number, met, falling)
    if one.outcome != MOVING:
        return one  # type: ignore[no-any-return]
    return at_obstacle(chain.tail, one.motion, number, met, falling)  # type: ignore[no-any-return]


HOOKS = (felt_normal, in_ground, breaks, longest_flight, in_air, first_obstacle)
"""Where an effect acts by itself; the others follow from these."""
