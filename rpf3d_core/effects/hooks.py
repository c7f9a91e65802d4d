"""The hooks: functions of the simulation in which an effect may act on a rock, with one rule per effect.

The effects of a scene form a `Chain`: each link is one effect, and None ends the chain. An effect has a rule for each
hook in which it acts; in the other hooks it changes nothing. The effects act in the order of the fields of
`scene.models.keys.EffectsSpec`, whatever their order in the scene file. A scene without effects has None in place of a
chain, so no code of any effect is compiled.
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
    """The effects of a scene as a linked list: an effect (`head`), and the effects after it (`tail`, None if none)."""

    head: Any
    tail: Any


class Meeting(NamedTuple):
    """The first obstacle that a rock on an arc meets.

    t : s until the meeting, inf for none; number : of the obstacle in the scene, -1 for none
    """

    t: float
    number: int


class AfterObstacle(NamedTuple):
    """The result for a rock that meets an obstacle.

    motion : after the meeting; outcome : MOVING if the rock continues
    facet : facet on which the rock lies if it ends at the obstacle; -1 if it continues
    """

    motion: Motion
    outcome: int
    facet: int


NO_MEETING = Meeting(math.inf, -1)


def chain_of(effects: Sequence[Any]) -> Chain | None:
    """Return the effects of a scene as a chain, in the given order; None if there are no effects."""
    chain = None
    for effect in reversed(effects):
        chain = Chain(effect, chain)
    return chain


def links_of(chain: Chain | None) -> list[Any]:
    """Return the effects of a chain as a list, in order."""
    return [] if chain is None else [chain.head, *links_of(chain.tail)]


@model_function
def felt_normal(effect: object, n: Vec, motion: Motion, rock: RockContext) -> Vec:
    """Return the unit normal (3,) that a rebound uses instead of the ground's normal n: a hook for rough ground.

    The caller uses n in place of the result in two cases: if the velocity v does not point against the result
    (v . result >= 0), or if the rebound with the result would send the rock into the ground.

    n : (3,) unit normal, turned against the velocity v; motion : just before the impact
    """


@felt_normal.otherwise
def ground_normal(effect: object, n: Vec, motion: Motion, rock: RockContext) -> Vec:
    """Return the ground's normal n unchanged, because the effect does not tilt the normal."""
    return n


@felt_normal.rule(Chain)
def normal_of_all(chain: Chain, n: Vec, motion: Motion, rock: RockContext) -> Vec:
    """Return the unit normal (3,) that a rebound uses, after all effects of the chain have tilted it, in order."""
    return felt_normal(chain.tail, felt_normal(chain.head, n, motion, rock), motion, rock)  # type: ignore[no-any-return]


@model_function
def in_ground(effect: object, zone: int, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock that has entered soft ground, before it rebounds: a hook for soft ground.

    A rule may change the velocity v and the spin w, but not position and time.

    zone : number of the zone of the facet that the rock hits; surface : properties of the ground there
    motion : just before the impact
    n : (3,) normal that the rebound uses: from `felt_normal`, or of the facet if the rebound cannot use a tilted normal
    """


@in_ground.otherwise
def hard_ground(effect: object, zone: int, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion unchanged: for this effect the ground is hard."""
    return motion


@in_ground.rule(Chain)
def ground_of_all(chain: Chain, zone: int, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock that has entered soft ground, after all effects of the chain, applied in order."""
    after = in_ground(chain.head, zone, surface, motion, n, rock)
    return in_ground(chain.tail, zone, surface, after, n, rock)  # type: ignore[no-any-return]


@model_function
def breaks(effect: object, before: Motion, after: Motion, n: Vec, rock: RockContext) -> bool:
    """Return True if an impact breaks the rock: a hook for the effect `fragmentation` alone.

    Fragments are made with the parameters of this effect.

    before, after : motion just before and just after the impact; n : (3,) normal of the ground
    """


@breaks.otherwise
def stays_whole(effect: object, before: Motion, after: Motion, n: Vec, rock: RockContext) -> bool:
    """Return False: the effect breaks no rock."""
    return False


@breaks.rule(Chain)
def breaks_by_any(chain: Chain, before: Motion, after: Motion, n: Vec, rock: RockContext) -> bool:
    """Return True if at least one effect of the chain breaks the rock."""
    return bool(breaks(chain.head, before, after, n, rock) or breaks(chain.tail, before, after, n, rock))


@model_function
def longest_flight(effect: object, motion: Motion, rock: RockContext) -> float:
    """Return the longest time step (s) of a flight with which this effect stays accurate; inf for no limit.

    This is a hook for effects of the air: with them, a flight consists of one parabola per time step.
    """


@longest_flight.otherwise
def as_long_as_it_takes(effect: object, motion: Motion, rock: RockContext) -> float:
    """Return inf: the effect does not act in the air and needs no time steps."""
    return math.inf


@longest_flight.rule(Chain)
def shortest_of_all(chain: Chain, motion: Motion, rock: RockContext) -> float:
    """Return the longest time step (s) with which all effects of the chain stay accurate; inf for no limit."""
    one, others = longest_flight(chain.head, motion, rock), longest_flight(chain.tail, motion, rock)
    return min(one, others)  # type: ignore[no-any-return]


@model_function
def asks_height(effect: object) -> bool:
    """Return True if the effect needs the height of a flying rock above the ground, which requires a search."""


@asks_height.otherwise
def asks_nothing(effect: object) -> bool:
    """Return False: the effect does not need the height of the rock."""
    return False


@asks_height.rule(Chain)
def any_asks_height(chain: Chain) -> bool:
    """Return True if at least one effect of the chain needs the height of the rock."""
    return bool(asks_height(chain.head) or asks_height(chain.tail))


@model_function
def in_air(effect: object, motion: Motion, height: float, t: float, rock: RockContext) -> Motion:
    """Return the motion of a rock after the air alone, without gravity, has acted on it for t >= 0 s: a hook for drag.

    A rule may change the velocity, but not the position, and must not increase the speed.
    height : m above the ground straight below the rock; inf over a hole; 0.0 if no effect needs the height
    """


@in_air.otherwise
def in_nothing(effect: object, motion: Motion, height: float, t: float, rock: RockContext) -> Motion:
    """Return the motion unchanged: the effect does not act in the air."""
    return motion


@in_air.rule(Chain)
def air_of_all(chain: Chain, motion: Motion, height: float, t: float, rock: RockContext) -> Motion:
    """Return the motion of a rock after all effects of the chain have acted on it in the air for t seconds.

    The first effect acts for half of the time before the other effects, and for half after them, so that the result
    is accurate to second order in t (Strang).

    height : as in `in_air`
    """
    before = in_air(chain.head, motion, height, 0.5 * t, rock)
    between = in_air(chain.tail, before, height, t, rock)
    return in_air(chain.head, between, height, 0.5 * t, rock)  # type: ignore[no-any-return]


@model_function
def first_obstacle(effect: object, arc: Arc, passed: int, until: float, rock: RockContext) -> Meeting:
    """Return the first obstacle that a rock on an arc meets up to the time `until` (s), or NO_MEETING.

    This is a hook for barriers and trees. For a straight line, such as the chord of a ground segment, the arc has no
    gravity, its velocity is the vector from start to end, and a time is a share of the line (-).

    passed : number of the obstacle that the rock has just met, and does not meet again on this arc; below 0 for none
    """


@first_obstacle.otherwise
def no_obstacle(effect: object, arc: Arc, passed: int, until: float, rock: RockContext) -> Meeting:
    """Return NO_MEETING: the effect has no obstacles."""
    return NO_MEETING


@first_obstacle.rule(Chain)
def first_of_all(chain: Chain, arc: Arc, passed: int, until: float, rock: RockContext) -> Meeting:
    """Return the first obstacle of all effects of the chain that a rock on an arc meets up to the time `until` (s).

    If a rock meets two obstacles at the same time, the obstacle of the earlier effect in the chain counts. The result
    is NO_MEETING if the rock meets no obstacle.

    passed : as in `first_obstacle`
    """
    one = first_obstacle(chain.head, arc, passed, until, rock)
    other = first_obstacle(chain.tail, arc, passed, until, rock)
    return _sooner(one, other)


@kernel
def _sooner(one: Meeting, other: Meeting) -> Meeting:
    """Return the earlier of two meetings with obstacles; `one` if both are at the same time."""
    return other if other.t < one.t else one


@kernel
def still_at(effects: Any, motion: Motion, passed: int, rock: RockContext) -> int:
    """Return the number of the obstacle that a rock must ignore on its next path segment, after touching the ground.

    The result is `passed` if the rock is still in contact with an obstacle. Otherwise the result is below 0, because
    the rock may then meet every obstacle, including the obstacle `passed`.

    effects : the chain of effects, None without effects
    motion : just after an impact, after the last small bounces, or at the end of a ground segment
    passed : number of the obstacle that the rock has passed and still ignores; below 0 for none
    """
    if passed < 0:
        return passed
    here = first_obstacle(effects, Arc(x=motion.x, v=motion.v, gravity=0.0), -1, 0.0, rock)
    return passed if here.t == 0.0 else -1


@model_function
def at_obstacle(effect: object, motion: Motion, number: int, met: int, rock: RockContext) -> AfterObstacle:
    """Return the result for a rock that meets obstacle `number`: a hook for barriers and trees.

    A rule changes nothing if the obstacle belongs to another effect.

    motion : at the meeting; number : of the obstacle in the scene
    met : number of meetings of the rock with obstacles so far, which selects random numbers
    """


@at_obstacle.otherwise
def past_it(effect: object, motion: Motion, number: int, met: int, rock: RockContext) -> AfterObstacle:
    """Return the motion unchanged and the outcome MOVING: the effect has no obstacles (default of `at_obstacle`)."""
    return AfterObstacle(motion=motion, outcome=MOVING, facet=-1)


@at_obstacle.rule(Chain)
def by_its_effect(chain: Chain, motion: Motion, number: int, met: int, rock: RockContext) -> AfterObstacle:
    """Return the result for a rock that meets an obstacle, from the effect to which this obstacle belongs.

    chain : the effects; motion, number, met : as in `at_obstacle`
    """
    one = at_obstacle(chain.head, motion, number, met, rock)
    if one.outcome != MOVING:
        return one  # type: ignore[no-any-return]
    return at_obstacle(chain.tail, one.motion, number, met, rock)  # type: ignore[no-any-return]


HOOKS = (felt_normal, in_ground, breaks, longest_flight, in_air, first_obstacle)
"""The main hooks: an effect must have a rule for at least one of them. The other hooks only support these hooks."""
FOR_POINTS = (felt_normal, breaks)
"""The hooks that act on points and spheres only, not on bodies with a shape."""
