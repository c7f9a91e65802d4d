"""A rigid sphere on the ground that other ground blocks: in a groove, at a wall, or at the border of a facet."""

from rpf3d_core.detection.contact import GRAZING
from rpf3d_core.detection.swept import Swept
from rpf3d_core.detection.touching import Against
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.coulomb_sphere import kicked, slip_of
from rpf3d_core.kinetics.rolling_moment import STICKS
from rpf3d_core.simulation.physics import Physics
from rpf3d_core.simulation.sphere_hold import held_against, most_against
from rpf3d_core.simulation.sphere_impacts import is_slight
from rpf3d_core.terrain.facet_geometry import PARALLEL
from rpf3d_core.values import ZERO, Motion, Vec
from rpf3d_core.vectors import along, cross, dot, norm, scale, subtract, without

UNSURE = 1e-6
"""Ratio (-) of slip to speed below which rounding may turn the direction of the slip by GRAZING or more."""
WALL = 0.01
"""Least share of gravity (-) that is assumed to press the sphere on a contact, in the test for a slight impact.

A sphere that rolls against a wall at less than 14 mm/s then stays there (at a smallest bounce of 1 mm). Gravity does
not press the sphere onto the wall, so without this share the bounces between wall and floor would never end.
"""


@kernel
def along_groove(physics: Physics, locator: Swept, x: Vec, v: Vec) -> Vec:
    """Return the velocity (3,) m/s of a sphere after a slight impact; in a groove, along the groove.

    A sphere lies in a groove if two contacts would carry it at rest. A slight impact on one contact lifts the sphere
    off the other contact by micrometres. Without this function such hops would follow each other without end, and
    friction on one contact at a time would turn the spin.

    The result is v if the sphere lies in no groove, if other ground blocks the groove, or if the sphere moves across
    the groove faster than a sphere that stays at a wall (`WALL`).

    x : (3,) m, centre of the sphere; v : (3,) m/s, velocity that no contact blocks
    """
    gravity = (0.0, 0.0, -physics.settings.gravity)
    rest = held_against(locator.locator, physics.facets, x, locator.radius, gravity, ZERO, gravity)
    if rest.contacts != 2:
        return v
    line = cross(rest.first.n, rest.second.n)
    way = scale(dot(v, line) / dot(line, line), line)
    if not is_slight(physics, ZERO, norm(subtract(v, way)), WALL):
        return v
    onward = Against(x=x, way=way, v=ZERO, down=gravity, radius=locator.radius, noise=0.5 * GRAZING * norm(way))
    return v if most_against(locator.locator, physics.facets, onward).facet >= 0 else way


@kernel
def when_blocked(physics: Physics, motion: Motion, n: Vec, m: Vec, radius: float) -> tuple[Vec, Vec]:
    """Return velocity (3,) m/s and spin (3,) rad/s of a sphere that other ground blocks at the start of a segment.

    - If the sphere moves into the other ground, the search for contacts at rest has missed this ground: the sphere
      rolls over a border with a kink of less than about 1e-5 rad. If an impact there would be slight (`is_slight`), the
      velocity loses its component into the other ground. Otherwise the velocity is unchanged. The spin is unchanged.
    - Otherwise friction presses the sphere against the other ground. The part of the spin about the line along both
      contacts drives the sphere there. The sphere would rub until this part is lost; here it is lost at once, and the
      sphere keeps the spin of rolling along the line. The velocity is along the line, except for a part that is too
      small to count as an approach (GRAZING). This part is lost, too, and so is a slip that is almost zero (UNSURE):
      both would turn friction into the other ground again, and the sphere would stay here without end.

    motion : just before; radius : of the sphere, m
    n, m : (3,) unit normals of the ground under the sphere and of the other ground; if they are parallel, a sphere that
        friction presses keeps its velocity, and its spin becomes zero
    """
    v, w = motion.v, motion.w
    into = -dot(v, m)
    if into > GRAZING * norm(v):
        return (along(v, m) if is_slight(physics, m, into, WALL) else v), w
    line = cross(n, m)
    sine = norm(line)
    if sine <= PARALLEL:
        return v, ZERO
    line = scale(1.0 / sine, line)
    freed = Motion(t=motion.t, x=motion.x, v=scale(dot(v, line), line), w=without(w, line))
    slip = slip_of(freed.v, freed.w, n, radius)
    if norm(slip) <= UNSURE * norm(freed.v):
        freed = kicked(freed, n, radius, STICKS * norm(slip), slip)
    return freed.v, freed.w
