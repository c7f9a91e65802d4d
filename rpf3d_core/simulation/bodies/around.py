"""The effects of a scene on bodies with a shape: obstacles, air and soft ground, as the flight loop asks them.

The rules of the effects are those of points. A body differs in three ways:

- The path that meets an obstacle is that of the centre of mass.
- The energy that an obstacle compares and takes is that of translation and rotation. A rule sees the velocity of a rock
  that has the same energy without spin, and the change of this velocity applies to velocity and spin alike.
- Soft ground and air act on the centre of mass; they change no spin.

A scene without effects has None in place of a chain, so nothing of this file is compiled.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.detection.contact import plain_locator
from rpf3d_core.effects.hooks import Meeting, at_obstacle, in_air, in_ground
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.library import surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.bodies.motion import Body, BodyMotion, rotational_energy
from rpf3d_core.simulation.bodies.notes import motion_of, note_blow
from rpf3d_core.simulation.parabola import height_for_effects
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.record import FIRST_OBSTACLE, Record, against
from rpf3d_core.simulation.state import RockTally, past, with_meeting
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import dot, norm, scale


class Met(NamedTuple):
    """The result of a meeting with an obstacle: the body's motion, its totals, its outcome, and `Ride.passed`."""

    motion: BodyMotion
    tally: RockTally
    outcome: int
    passed: int


@kernel
def with_velocity_of(motion: BodyMotion, v: Vec, share: float) -> BodyMotion:
    """Return a motion with the velocity v (m/s) and a share (-) of its spin."""
    return BodyMotion(t=motion.t, x=motion.x, v=v, q=motion.q, w=scale(share, motion.w))


@kernel
def as_fast(body: Body, motion: BodyMotion) -> float:
    """Return the speed (-) of a rock with the body's energy and no spin, over the speed of the body's centre.

    1 for a body whose centre does not move.
    """
    v2 = dot(motion.v, motion.v)
    return math.sqrt(1.0 + 2.0 * rotational_energy(body, motion) / v2) if v2 > 0.0 else 1.0


@kernel
def meet_obstacle(
    effects: Any, body: Body, motion: BodyMotion, tally: RockTally, meeting: Meeting, rock: RockContext, record: Record
) -> Met:
    """Return the result for a body that meets an obstacle, and write the meeting into the record."""
    whole, seen = as_fast(body, motion), motion_of(motion)
    given = Motion(t=seen.t, x=seen.x, v=scale(whole, seen.v), w=seen.w)
    met = at_obstacle(effects, given, meeting.number, tally.meetings, rock)
    speed = norm(given.v)
    kept = norm(met.motion.v) / speed if speed > 0.0 else 0.0
    after = with_velocity_of(motion, scale(1.0 / whole, met.motion.v), kept)
    contact = (FIRST_OBSTACLE - meeting.number, 0, against(motion.v))
    note_blow(record, tally, body, motion, after, contact)
    return Met(
        motion=after,
        tally=with_meeting(tally, met.facet),
        outcome=met.outcome,
        passed=past(met.motion, meeting.number),
    )


@kernel
def entering_ground(physics: Physics, motion: BodyMotion, facet: int, n: Vec, rock: RockContext) -> BodyMotion:
    """Return the motion of a body that has entered soft ground, before its impact on a facet of normal n (3,)."""
    if physics.effects is None:
        return motion
    zone = physics.facets.zone[facet]
    surface = surface_of(physics.materials, zone, rock)
    soft = in_ground(physics.effects, zone, surface, motion_of(motion), n, rock)
    return with_velocity_of(motion, soft.v, 1.0)


@kernel
def height_of(physics: Physics, locator: Any, motion: BodyMotion) -> float:
    """Return the height (m) of the body's centre above the ground, if an effect asks for it; else 0.0."""
    return height_for_effects(physics.effects, plain_locator(locator), physics.facets, motion.x)


@kernel
def braked(effects: Any, motion: BodyMotion, height: float, t: float, rock: RockContext) -> BodyMotion:
    """Return the motion of a body after the air alone has acted on its centre for t seconds; height : as `in_air`.

    An infinite t means that no effect acts in the air.
    """
    if effects is None or t == math.inf:
        return motion
    after = in_air(effects, motion_of(motion), height, t, rock)
    return with_velocity_of(motion, after.v, 1.0)
