"""The effects of a scene on bodies with a shape: obstacles, air and soft ground, for the flight loop of bodies.

Bodies use the same rules of effects as points, with three differences:

- A body meets an obstacle where the path of its centre of mass meets the obstacle.
- At an obstacle, the energy of rotation counts as well. The rule receives the velocity that a rock with the same total
  energy, but without spin, would have. The factor by which the rule changes this speed then applies to both the speed
  and the spin of the body.
- Soft ground and air act on the centre of mass only; they do not change the spin.

A scene without effects has None in place of its `Chain` of effects, so no rule of an effect is compiled for it.
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
    """The result of a body's meeting with an obstacle.

    motion, tally : motion and running totals after the meeting; outcome : MOVING if the body continues
    passed : number of the obstacle, which the next flight ignores; NONE_PASSED if the body has no speed left
    """

    motion: BodyMotion
    tally: RockTally
    outcome: int
    passed: int


@kernel
def with_velocity_of(motion: BodyMotion, v: Vec, share: float) -> BodyMotion:
    """Return the motion of a body with the new velocity v (3,) m/s of its centre, and its spin times `share` (-)."""
    return BodyMotion(t=motion.t, x=motion.x, v=v, q=motion.q, w=scale(share, motion.w))


@kernel
def as_fast(body: Body, motion: BodyMotion) -> float:
    """Return the speed of a rock with the body's kinetic energy but no spin, divided by the speed of the body's centre.

    The result (-) is 1 if the centre does not move.
    """
    v2 = dot(motion.v, motion.v)
    return math.sqrt(1.0 + 2.0 * rotational_energy(body, motion) / v2) if v2 > 0.0 else 1.0


@kernel
def meet_obstacle(
    effects: Any, body: Body, motion: BodyMotion, tally: RockTally, meeting: Meeting, rock: RockContext, record: Record
) -> Met:
    """Return the result for a body that meets an obstacle at its current position; write the meeting into the record.

    motion, tally : motion and running totals of the body before the meeting
    effects : parameters of all effects of the scene; meeting : the obstacle; record : receives the meeting
    """
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
    """Return the motion of a body just before an impact, after soft ground has changed the velocity of its centre.

    The motion is unchanged if no effect acts in the ground of the facet.

    facet : number of the facet that the body hits; n : (3,) unit normal of the contact, in the terrain's axes
    """
    if physics.effects is None:
        return motion
    zone = physics.facets.zone[facet]
    surface = surface_of(physics.materials, zone, rock)
    soft = in_ground(physics.effects, zone, surface, motion_of(motion), n, rock)
    return with_velocity_of(motion, soft.v, 1.0)


@kernel
def height_of(physics: Physics, locator: Any, motion: BodyMotion) -> float:
    """Return the height (m) of a body's centre above the ground, inf over a hole; 0.0 if no effect needs the height."""
    return height_for_effects(physics.effects, plain_locator(locator), physics.facets, motion.x)


@kernel
def braked(effects: Any, motion: BodyMotion, height: float, t: float, rock: RockContext) -> BodyMotion:
    """Return the motion of a body after the air alone, without gravity, has acted on its centre for t seconds.

    The motion is unchanged if t is inf, which means that no effect acts in the air.

    height : of the centre above the ground, as in `in_air` (m)
    effects : parameters of all effects of the scene; None if there are none
    """
    if effects is None or t == math.inf:
        return motion
    after = in_air(effects, motion_of(motion), height, t, rock)
    return with_velocity_of(motion, after.v, 1.0)
