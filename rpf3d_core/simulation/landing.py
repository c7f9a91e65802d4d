"""The contact of a moving rock with the ground: the rock slides on or rebounds.

A rock that was on the ground slides on if a gully holds the rock, or if the contact is slight: if a bounce off the
facet would rise by less than smallest_bounce. A flying rock rebounds, except for a sphere that only grazes the ground.
"""

from rpf3d_core.detection.contact import Contact, PreviousContact
from rpf3d_core.effects.hooks import breaks, felt_normal, in_ground, still_at
from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.kinetics.rebound import rebound
from rpf3d_core.materials.library import Surface, surface_of
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.carrying import held_by
from rpf3d_core.simulation.physics import Physics, rock_at
from rpf3d_core.simulation.record import Record, note_impact
from rpf3d_core.simulation.settling import settle, stand
from rpf3d_core.simulation.state import State, ended, with_impact
from rpf3d_core.terrain.facet_geometry import NEAR, corner, on_plane, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Motion, Outcome, Vec
from rpf3d_core.vectors import dot, scale, subtract

FRAGMENTED = int(Outcome.FRAGMENTED)


@model_function
def land(contact: object, physics: Physics, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a rock after a contact with the ground.

    There is one rule for each class of contacts: `Contact` of lumped masses and `Touch` of spheres.

    state : of the rock at the contact; record : receives an impact
    """


@land.rule(Contact)
def land_point(contact: Contact, physics: Physics, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a lumped mass after a contact with the ground: sliding, or after a rebound.

    A rock that was sliding, or is released on the ground, slides if the facet or a gully carries it (`held_by`). Any
    other rock rebounds, and then flies or stays on the facet (`settle`). A rebound is recorded as an impact. If an
    effect breaks the rock, the outcome of the state is FRAGMENTED.
    """
    facets = physics.facets
    n = scale(contact.side, stored_normal(facets, contact.facet))
    released_on_ground = state.left.facet < 0 and contact.t == 0.0
    if state.left.resting or released_on_ground:
        held = held_by(physics, state, contact, n, rock)
        if held.left.facet >= 0:
            return stand(facets, state, held.left, held.v)
    rock_now, before = rock_at(rock, state), _raised(facets, contact.facet, n, state.motion)
    after = rebounded(physics, before, contact.facet, n, rock_now)
    note_impact(record, state.tally, before, after, contact.facet, n)
    is_bounce = state.left.facet >= 0 and not state.left.resting
    tally = with_impact(state.tally, contact.facet, after, is_bounce)
    between = state.left.facet >= 0 and state.left.side != contact.side
    left = PreviousContact(
        facet=contact.facet,
        other=-1,
        side=contact.side,
        resting=False,
        before=state.left.facet if between else -1,
    )
    passed = still_at(physics.effects, after, state.passed, rock_now)
    bounced = State(motion=after, left=left, stands=False, tally=tally, outcome=MOVING, passed=passed)
    if breaks(physics.effects, before, after, n, rock_now):
        return ended(bounced, FRAGMENTED)
    return settle(physics, bounced, n, rock, record)


@kernel
def _raised(facets: Facets, f: int, n: Vec, motion: Motion) -> Motion:
    """Return the motion of a rock that touches facet f, moved up onto the facet if the rock is slightly below it.

    n : (3,) normal of the facet, turned towards the rock

    After a crack, a rock may be below the facet that it touches next (`detection.search`). These depths would add up
    from facet to facet, until the rock touches no facet. A rock whose contact is found in fixed time steps is far
    deeper, and is not moved.
    """
    depth = -dot(n, subtract(motion.x, corner(facets, f, 0)))
    if not NEAR * facets.tolerance < depth <= NEAR * facets.crack:
        return motion
    return Motion(t=motion.t, x=on_plane(facets, f, motion.x), v=motion.v, w=motion.w)


@kernel
def rebounded(physics: Physics, motion: Motion, facet: int, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock after an impact on a facet, by the rebound model and the effects.

    n : (3,) normal of the facet, turned towards the rock

    An effect may replace the facet's normal by another normal, the felt normal. The facet's normal is used in two
    cases: if the rock moves away from a surface with the felt normal, or if the rebound with the felt normal would send
    the rock into the ground. If the rock still moves into the ground after the rebound, its speed into the ground is
    set to zero. A rock that already moves off the facet keeps its motion.
    """
    if dot(motion.v, n) > 0.0:
        return motion
    zone = physics.facets.zone[facet]
    surface = surface_of(physics.materials, zone, rock)
    felt = felt_normal(physics.effects, n, motion, rock)
    if dot(motion.v, felt) >= 0.0:
        felt = n
    after = _struck(physics, zone, surface, motion, felt, rock)
    if physics.effects is not None and dot(after.v, n) < 0.0:
        after = _struck(physics, zone, surface, motion, n, rock)
    into = dot(after.v, n)
    if into >= 0.0:
        return after
    return Motion(t=after.t, x=after.x, v=subtract(after.v, scale(into, n)), w=after.w)


@kernel
def _struck(physics: Physics, zone: int, surface: Surface, motion: Motion, n: Vec, rock: RockContext) -> Motion:
    """Return the motion of a rock after its rebound from a surface of normal n, without the checks of `rebounded`.

    Before the rebound, an effect may let the rock enter soft ground.

    zone, surface : zone of the facet, and surface properties of the ground there
    """
    entering = in_ground(physics.effects, zone, surface, motion, n, rock)
    return rebound(physics.rebound, surface, entering, n, rock)  # type: ignore[no-any-return]
