"""Impacts of a rigid sphere; `Motion.x` is the sphere's centre."""

from rpf3d_core.detection.contact import GRAZING, PreviousContact
from rpf3d_core.detection.sphere_course import Touch
from rpf3d_core.effects.hooks import breaks, still_at
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.landing import FRAGMENTED, land, rebounded
from rpf3d_core.simulation.physics import Physics, ground_of, rock_at
from rpf3d_core.simulation.record import Record, note_impact
from rpf3d_core.simulation.state import State, ended, with_ground, with_impact
from rpf3d_core.simulation.sustained import STOPPED, UNRESOLVED, WEDGED
from rpf3d_core.terrain.facet_geometry import NEAR, corner
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import MOVING, Motion, Vec
from rpf3d_core.vectors import add, along, dot, norm, scale, subtract


@kernel
def is_slight(physics: Physics, n: Vec, speed: float, least: float) -> bool:
    """Return True if a sphere with `speed` (m/s) off the ground, along the normal n, rises less than smallest_bounce.

    The result is False if `least` is 0 and gravity does not press the sphere on the contact.

    least : smallest share of gravity (-) that is assumed to press the sphere on the contact; the true share is n_z
    """
    return _rises_less(physics.settings.gravity * max(n[2], least), speed, physics.settings.smallest_bounce)


@kernel
def _rises_less(pressed: float, speed: float, height: float) -> bool:
    """Return True if a sphere with `speed` (m/s) off the ground rises less than `height` (m) before it returns.

    pressed : acceleration of the sphere towards the ground (m/s^2); if it is not above 0, the result is False
    """
    return pressed > 0.0 and speed * speed < 2.0 * pressed * height


@land.rule(Touch)
def land_sphere(contact: Touch, physics: Physics, state: State, rock: RockContext, record: Record) -> State:
    """Return the state of a sphere after a contact in flight: on the ground if the contact is slight, else rebounded.

    A contact is slight if the sphere only grazes the ground. For a sphere that was on the ground before, a contact is
    also slight if a bounce at the speed into the ground would rise by less than smallest_bounce. The path of a sphere
    without progress over WEDGED path segments ends here (`wedged`). A rebound is recorded as an impact.
    """
    motion, n = state.motion, contact.n
    into = -dot(motion.v, n)
    grazes = into <= GRAZING * norm(motion.v)
    if state.tally.idle >= WEDGED:
        return ended(state, wedged(physics, motion))
    if grazes or (state.left.resting and n[2] > 0.0 and is_slight(physics, n, into, 0.0)):
        radius = rock_at(rock, state).rock.radius  # type: ignore[union-attr]  # the model asks for the rock
        x = _lowered(physics.facets, contact, motion.x, radius)
        return lie(state, contact.facet, Motion(t=motion.t, x=x, v=along(motion.v, n), w=motion.w))
    return strike(physics, state, contact, rock, record)


@kernel
def _lowered(facets: Facets, contact: Touch, x: Vec, radius: float) -> Vec:
    """Return the centre (m) of a sphere that begins to lie on a facet, lowered onto the facet if it is just above.

    The centre is lowered by at most NEAR crack widths, which is 256 contact tolerances.

    The second search for a contact, with wider facets (`detection.search`), also finds a facet that is below the sphere
    by more than the contact tolerance. On the ground such a facet would not carry the sphere: the sphere would take off
    at once, and land again at once, until it counts as wedged.

    x : (3,) m, centre of the sphere; radius : of the sphere (m)
    """
    gap = dot(contact.n, subtract(x, corner(facets, contact.facet, 0))) - radius
    if not contact.face or not NEAR * facets.tolerance < gap <= NEAR * facets.crack:
        return x
    return add(x, scale(-gap, contact.n))


@kernel
def strike(physics: Physics, state: State, contact: Touch, rock: RockContext, record: Record) -> State:
    """Return the state of a sphere after an impact: in flight, or on the ground if the next bounce would be small.

    The next bounce is small if it would rise by less than smallest_bounce. If R_n is 1, bounces never become smaller,
    so they go on. But a bounce of less than NEAR contact tolerances always ends, because rounding alone may cause it: a
    sphere falls onto an edge by RIM tolerances more than onto a facet.

    If an effect breaks the sphere, the outcome of the state is FRAGMENTED. The impact is recorded.

    contact : the contact with the ground
    """
    n, rock_now = contact.n, rock_at(rock, state)
    after = rebounded(physics, state.motion, contact.facet, n, rock_now)
    note_impact(record, state.tally, state.motion, after, contact.facet, n)
    tally = with_impact(state.tally, contact.facet, after, False)
    passed = still_at(physics.effects, after, state.passed, rock_now)
    bounced = State(
        motion=after,
        left=PreviousContact(facet=contact.facet, other=-1, side=1.0, resting=False, before=-1),
        stands=False,
        tally=tally,
        outcome=MOVING,
        passed=passed,
    )
    if breaks(physics.effects, state.motion, after, n, rock_now):
        return ended(bounced, FRAGMENTED)
    surface = ground_of(physics, contact.facet, rock, bounced)
    height = NEAR * physics.facets.tolerance
    if surface.R_n < 1.0:
        height = max(height, physics.settings.smallest_bounce)
    if _rises_less(physics.settings.gravity * n[2], dot(after.v, n), height):
        return lie(bounced, contact.facet, Motion(t=after.t, x=after.x, v=along(after.v, n), w=after.w))
    return bounced


@kernel
def lie(state: State, facet: int, motion: Motion) -> State:
    """Return the state of a sphere that begins to slide or roll on a facet; motion : along the facet."""
    tally = with_ground(state.tally, facet, norm(motion.v))
    return State(
        motion=motion,
        left=PreviousContact(facet=facet, other=-1, side=1.0, resting=True, before=-1),
        stands=True,
        tally=tally,
        outcome=state.outcome,
        passed=state.passed,
    )


@kernel
def wedged(physics: Physics, motion: Motion) -> int:
    """Return the outcome of a sphere that makes no progress: STOPPED if it is too slow to rise by smallest_bounce.

    Otherwise the outcome is `unresolved contact`.
    """
    slow = dot(motion.v, motion.v) <= 2.0 * physics.settings.gravity * physics.settings.smallest_bounce
    return STOPPED if slow else UNRESOLVED
