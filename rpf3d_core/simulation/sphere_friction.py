"""Friction under a rigid sphere on the ground: the surface, the slip, and when the slip ends.

The slip is the velocity of the sphere's surface at the contact.
"""

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.coulomb_sphere import kicked, slip_of
from rpf3d_core.kinetics.ground import shared
from rpf3d_core.kinetics.rolling_moment import STICKS
from rpf3d_core.kinetics.sphere_ground import CRAWL, STRAIGHT, TURN
from rpf3d_core.materials.library import Surface
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.physics import Physics, ground_of
from rpf3d_core.simulation.sphere_hold import Held
from rpf3d_core.simulation.state import State
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import cross, dot, norm, scale, without


@kernel
def surface_under(physics: Physics, held: Held, rock: RockContext, state: State) -> Surface:
    """Return the surface properties of the ground under a sphere.

    For two contacts, mu and mu_r are means weighted by the pushes, stop_speed is the larger value, and R_n and R_t are
    the values of the first contact.

    held : the contacts that carry the sphere
    """
    first = ground_of(physics, held.first.facet, rock, state)
    if held.contacts == 1:
        return first
    second, pushes = ground_of(physics, held.second.facet, rock, state), held.pushes
    return Surface(
        R_n=first.R_n,
        R_t=first.R_t,
        mu=shared(first.mu, second.mu, pushes),
        stop_speed=max(first.stop_speed, second.stop_speed),
        mu_r=shared(first.mu_r, second.mu_r, pushes),
    )


@kernel
def slip_under(held: Held, motion: Motion, n: Vec, radius: float) -> Vec:
    """Return the slip (3,) m/s of a sphere: the velocity of its surface at the contact, which friction opposes.

    n : (3,) unit direction of the push of the ground. For two contacts, the result is only the component along their
    common line.

    held : the contacts that carry the sphere
    radius : of the sphere, m
    """
    slip = slip_of(motion.v, motion.w, n, radius)
    if held.contacts == 1:
        return slip
    line = cross(held.first.n, held.second.n)
    line = scale(1.0 / norm(line), line)
    return scale(dot(slip, line), line)


@kernel
def sticks(slip: Vec, g_t: Vec, friction: float, brief: float) -> bool:
    """Return True if the small slip of a sphere must be set to zero at once.

    slip : (3,) m/s; g_t : (3,) m/s^2, gravity along the ground; friction : largest deceleration by friction (m/s^2)
    brief : shortest duration (s) of a segment that only turns the slip

    The result is True for a slip below CRAWL whose direction gravity turns, if friction is strong enough for rolling,
    or if the segment would be shorter than `brief`. As the slip decreases, its direction turns faster and faster, and
    the segments become ever shorter. Around an edge, where spin turns the slip back, they could do so without end.
    """
    slips = norm(slip)
    if slips > CRAWL or slips == 0.0:
        return False
    across = norm(without(g_t, scale(1.0 / slips, slip)))
    if across <= STRAIGHT * (norm(g_t) + friction):
        return False
    return STICKS * norm(g_t) <= friction or slips <= brief * max(across / TURN, 3.5 * friction)  # as in `_skids`


@kernel
def gripped(held: Held, motion: Motion, n: Vec, radius: float) -> tuple[Vec, Vec]:
    """Return velocity (3,) m/s and spin (3,) rad/s of a sphere at the end of skidding, without the slip that is left.

    The slip turns while the sphere skids, so a small component of the slip, across its first direction, is left at the
    end (`kinetics.sphere_ground`). A friction impulse removes this component.

    held : the contacts that carry the sphere; motion : just before
    n : (3,) unit direction of the push of the ground; radius : of the sphere, m
    """
    slip = slip_under(held, motion, n, radius)
    after = kicked(motion, n, radius, STICKS * norm(slip), slip)
    return after.v, after.w
