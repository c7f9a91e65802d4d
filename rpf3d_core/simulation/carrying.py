"""Find which facets carry a lumped mass on the ground: one facet, the two facets of a gully, or no facet."""

from typing import NamedTuple

from rpf3d_core.detection.contact import NOTHING_LEFT, Contact, PreviousContact
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.gully import WEAKEST, excursion, gully, kink, line_between, thrown_out
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.physics import Physics, ground_of
from rpf3d_core.simulation.state import State
from rpf3d_core.terrain.facet_geometry import (
    ALONG_GULLY,
    NEAR,
    PARALLEL,
    corner,
    leads_on,
    lies_below,
    stored_normal,
)
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import along, cross, dot, scale, subtract, without


class Hold(NamedTuple):
    """The facets that carry a rock on the ground, and the velocity v (3,) m/s that the rock keeps.

    left : the facet, or both facets of a gully; `left.facet` is -1 if no facet carries the rock
    """

    left: PreviousContact
    v: Vec


@kernel
def held_by(physics: Physics, state: State, contact: Contact, n: Vec, rock: RockContext) -> Hold:
    """Return which facets carry a rock that has slid onto a facet, or is released on it, and its new velocity.

    The first case that applies decides:

    - If the facet of the contact and the rock's last facet form a gully (`_held_line`), both carry the rock. If the
      gully ends at the rock, only the facet of the contact carries the rock, provided that gravity presses the rock
      onto this facet. If not, only the last facet carries the rock, provided that it faces up and the line of the gully
      goes on over it. Otherwise no facet carries the rock. A carried rock keeps its velocity along the gully.
    - If the contact is slight (a bounce would rise by less than smallest_bounce), the facet of the contact carries the
      rock, which keeps its velocity along the facet. Slight contacts are not impacts, because a rock would otherwise
      lose speed at every slight kink of a mesh.
    - In all other cases, no facet carries the rock: the contact is an impact.

    state : with the rock's last facet and velocity; n : (3,) normal of the contact's facet, turned towards the rock
    """
    facets, settings, v, last = physics.facets, physics.settings, state.motion.v, state.left.facet
    into, g_n = -dot(v, n), settings.gravity * n[2]
    slight = g_n > 0.0 and into * into < 2.0 * g_n * settings.smallest_bounce
    before = last if state.left.resting and state.tally.idle > 0 else -1
    alone = PreviousContact(facet=contact.facet, other=-1, side=contact.side, resting=True, before=before)
    line = _held_line(physics, state, contact, n, slight, rock)
    if line[0] != 0.0 or line[1] != 0.0 or line[2] != 0.0:
        x, kept = state.motion.x, scale(dot(v, line), line)
        on_last = leads_on(facets, last, x, line, ALONG_GULLY)
        if on_last and leads_on(facets, contact.facet, x, line, ALONG_GULLY):
            return Hold(
                PreviousContact(facet=contact.facet, other=last, side=contact.side, resting=True, before=before), kept
            )
        if g_n > 0.0:
            return Hold(alone, kept)
        if on_last and contact.side * stored_normal(facets, last)[2] > 0.0:  # an overhang ends, but its floor does not
            last_alone = PreviousContact(facet=last, other=-1, side=contact.side, resting=True, before=-1)
            return Hold(last_alone, kept)
        return Hold(NOTHING_LEFT, v)  # the line ends, and an overhang carries no rock
    return Hold(alone, along(v, n)) if slight else Hold(NOTHING_LEFT, v)


@kernel
def _held_line(physics: Physics, state: State, contact: Contact, n: Vec, slight: bool, rock: RockContext) -> Vec:
    """Return the unit direction (3,) of the gully between the contact's facet and the last facet; zero if no gully.

    Two facets form a gully if both push the rock and the rock stays at their common line. The rock leaves the line if
    it climbs a facet by smallest_bounce or more, at once or after bounces between both facets (`_is_thrown_out`). Two
    facets that are almost one plane form a gully only if the rock moves to and fro between them without progress, and
    gravity hardly pulls the rock across their line.

    n : (3,) normal of the contact's facet, turned towards the rock
    slight : True if a bounce off the contact's facet would rise by less than smallest_bounce
    """
    facets, settings = physics.facets, physics.settings
    last, x, v = state.left.facet, state.motion.x, state.motion.v
    if last < 0 or last == contact.facet or not state.left.resting or contact.side != state.left.side:
        return ZERO
    m = scale(state.left.side, stored_normal(facets, last))
    off_last = abs(dot(m, subtract(x, corner(facets, last, 0))))
    one_plane = kink(n, m) <= PARALLEL
    if off_last > NEAR * facets.tolerance or (one_plane and contact.facet != state.left.before):
        return ZERO
    line = line_between(facets, contact.facet, last, x, v)
    if one_plane:
        return line if _is_level_across(n, line) else ZERO
    if lies_below(facets, contact.facet, last, contact.side, NEAR * facets.tolerance):
        return ZERO  # the formula also gives two pushes at a ridge, but a ridge does not carry a rock
    held = gully(n, m, line, settings.gravity)
    weakest = -WEAKEST * settings.gravity
    if held.first < weakest or held.second < weakest:
        return ZERO
    onto, off = without(v, n), subtract(v, scale(2.0 * dot(v, n), n))
    climbs = excursion(n, m, onto, settings.gravity) >= settings.smallest_bounce
    bounces = not slight and excursion(m, n, off, settings.gravity) >= settings.smallest_bounce
    if climbs or bounces:
        return ZERO
    return ZERO if not slight and _is_thrown_out(physics, state, contact, n, m, rock) else line


@kernel
def _is_level_across(n: Vec, line: Vec) -> bool:
    """Return True if gravity hardly pulls a rock across a line on a plane: the smallest kink there holds the rock.

    n : (3,) unit normal of the plane; line : (3,) unit vector in the plane
    """
    return abs(cross(n, line)[2]) <= PARALLEL


@kernel
def _is_thrown_out(physics: Physics, state: State, contact: Contact, n: Vec, m: Vec, rock: RockContext) -> bool:
    """Return True if a rock that hits the contact's facet would bounce between both facets and climb out of the gully.

    Each bounce uses the R_n of the ground under the facet that the rock hits.

    n, m : (3,) normals of the contact's facet and of the last facet, turned towards the rock
    """
    R_n = ground_of(physics, contact.facet, rock, state).R_n, ground_of(physics, state.left.facet, rock, state).R_n
    rise = thrown_out(n, m, state.motion.v, R_n, physics.settings.gravity)
    return rise >= physics.settings.smallest_bounce
