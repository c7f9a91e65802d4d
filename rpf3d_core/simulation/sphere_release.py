"""Release of a rigid sphere: a sphere that overlaps the ground is lifted off it; `Motion.x` is the sphere's centre."""

import math
from typing import Any

from rpf3d_core.arc import Arc
from rpf3d_core.detection.contact import LINE_OF_SIGHT, first_contact, plain_locator
from rpf3d_core.detection.fallen import STRAIGHT as STRAIGHT_LINE
from rpf3d_core.detection.sphere_course import NO_TOUCH, Touch
from rpf3d_core.detection.swept import Swept
from rpf3d_core.detection.touching import Nearest, scan
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.kinetics.coulomb_sphere import CoulombSphere
from rpf3d_core.materials.rock_context import RockContext
from rpf3d_core.simulation.march import has_room, locator_for, set_down
from rpf3d_core.terrain.facet_geometry import stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Motion, Vec
from rpf3d_core.vectors import add, dot, norm, scale

SURE = 2.0
"""Distance of a sphere's centre from the ground, in crack widths, beyond which the direction to the ground is known.

If the release lies on the ground, the centre may be a rounding error, or a crack width, below the ground.
"""
LIFTS = 64
"""Largest number of steps in which a sphere that overlaps the ground at its release is moved."""
STEEP = 0.05
"""Vertical component of the contact's normal (-) below which a sphere is moved off the ground, not lifted: 87 degrees.

Along a wall, a sphere that is lifted straight up would be released far above its place, or would never be free.
"""
STRAIGHT = 1.0 - 2.0**-20
"""Least cosine (-) of the angle between a facet's normal and the direction from the facet to a sphere's centre.

With a smaller cosine, the centre is nearest to an edge or a corner of the facet, not to its interior.
"""


@locator_for.rule(CoulombSphere)
def locator_of_sphere(model: CoulombSphere, locator: Any, rock: RockContext) -> Swept:
    """Return the locator that finds the contacts of a sphere with the rock's radius."""
    return Swept(locator, rock.rock.radius)  # type: ignore[union-attr]  # the model asks for the rock


@set_down.rule(CoulombSphere)
def set_down_sphere(model: CoulombSphere, locator: Swept, facets: Facets, motion: Motion) -> Motion:
    """Return the motion of a sphere at its release, lifted straight up until it no longer overlaps the ground.

    Each step lifts the sphere until it just touches the ground point that was nearest before the step. A step never
    lifts the sphere too far, so the steps approach the right position from below. A sphere at a wall, or under an
    overhang, is moved away from the nearest ground point instead. In a narrow place there may be no position without
    overlap; the sphere is then released where the last step ends, and `sphere_has_room` is False there. If a step leads
    through the ground, as in a slot narrower than the sphere, the sphere stays where it overlaps the ground.
    """
    x, radius = motion.x, locator.radius
    touch = nearest_to(locator.locator, facets, x, radius)
    behind = _is_behind(facets, touch)
    for _ in range(LIFTS):
        if not touch.t < radius - facets.tolerance:
            break
        if touch.n[2] < STEEP and touch.t > SURE * facets.crack:
            way = scale(radius - touch.t, touch.n)
        else:
            way = (0.0, 0.0, _lift_off(touch, radius))
        if not behind and _meets_ground(locator, facets, x, way):
            x = motion.x
            break
        x = add(x, way)
        touch = nearest_to(locator.locator, facets, x, radius)
    return Motion(t=motion.t, x=x, v=motion.v, w=motion.w)


@kernel
def _meets_ground(locator: Swept, facets: Facets, x: Vec, way: Vec) -> bool:
    """Return True if the straight line from x (3,) m to x + way (3,) m passes through the ground.

    The first 2 SURE crack widths do not count, because x may lie on the ground, or just below it by rounding.
    """
    length = norm(way)
    begin = 2.0 * SURE * facets.crack
    if length <= begin:
        return False
    share = begin / length
    line = Arc(x=add(x, scale(share, way)), v=scale(1.0 - share, way), gravity=STRAIGHT_LINE)
    return bool(first_contact(plain_locator(locator), facets, line, LINE_OF_SIGHT, 1.0).t <= 1.0)


@kernel
def _is_behind(facets: Facets, touch: Touch) -> bool:
    """Return True if a sphere's centre lies behind its nearest facet, farther than SURE crack widths.

    At an edge or corner of a facet, the side of one facet does not show where the ground is; then the result is False.
    """
    if touch.facet < 0 or touch.t <= SURE * facets.crack:
        return False
    return bool(dot(touch.n, stored_normal(facets, touch.facet)) < -STRAIGHT)


@has_room.rule(CoulombSphere)
def sphere_has_room(model: CoulombSphere, locator: Swept, facets: Facets, motion: Motion) -> bool:
    """Return True if a sphere does not overlap the ground where it is set down, except by a rounding error.

    In a slot that is narrower than the sphere, the sphere would otherwise stay inside the ground and count as stopped.
    """
    touch = nearest_to(locator.locator, facets, motion.x, locator.radius)
    return not touch.t < locator.radius - SURE * facets.crack


@kernel
def _lift_off(touch: Touch, radius: float) -> float:
    """Return how far (m) to lift a sphere straight up so that it just touches the ground point in `touch`, below it.

    radius : of the sphere, m
    """
    up = touch.t * touch.n[2]
    return math.sqrt(radius * radius - (touch.t - up) * (touch.t + up)) - up


@kernel
def nearest_to(locator: Any, facets: Facets, x: Vec, reach: float) -> Touch:
    """Return the facet interior, edge or corner nearest to point x (m); `Touch.t` is its distance (m).

    The result is NO_TOUCH, with `Touch.t` inf, if no facet reaches into the box that is searched. `Touch.n` points from
    the nearest place to x.

    reach : half the side of the box around x that is searched (m)
    """
    wide = (reach, reach, reach)
    low = x[0] - reach, x[1] - reach, x[2] - reach
    return scan(locator, facets, low, add(x, wide), Nearest(x), NO_TOUCH)  # type: ignore[no-any-return]
