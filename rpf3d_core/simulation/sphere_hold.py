"""Find the contacts (up to three) that carry a sphere on the ground, and the motion that these contacts allow.

A velocity or an acceleration is projected onto the cone of directions that no contact blocks. One contact allows the
component along its plane, two contacts allow the component along their common line, three contacts allow no motion. The
centre of the sphere moves on an offset surface of the terrain: facets raised by the radius R, cylinders of radius R
around edges, balls of radius R around corners.
"""

from typing import Any, NamedTuple

from rpf3d_core.detection.sphere_course import NO_TOUCH, Touch
from rpf3d_core.detection.touching import Against, scan
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import NEAR, PARALLEL
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import ZERO, Vec
from rpf3d_core.vectors import add, cross, dot, norm, scale, without

TRIES = 8
"""Largest number of contacts that are tried one after another; on a mesh without faults three are enough."""
LEADING = 5e-10
"""Share of a vector that counts as rounding error (-), in the search for the contacts that carry a sphere.

The share is half of GRAZING. So this search finds all contacts that the search along the sphere's path finds at time 0.
"""


class Held(NamedTuple):
    """The contacts that block the motion of a sphere along a vector, and the component that they allow.

    The vector is the sphere's velocity (m/s) or the gravity (m/s^2).

    contacts : number of contacts, 0 to 3; first, second : the first two contacts
    pushes : push of the first and of the second contact, in the unit of the vector; 0 for three contacts
    way : (3,) component of the vector that the contacts allow
    """

    contacts: int
    first: Touch
    second: Touch
    pushes: tuple[float, float]
    way: Vec


@kernel
def most_against(locator: Any, facets: Facets, against: Against) -> Touch:
    """Return the contact that most blocks the motion of a sphere along a vector; facet -1 if no contact blocks it.

    against : the search, with the sphere and the vector
    """
    x, reach = against.x, against.radius + NEAR * facets.tolerance
    wide = (reach, reach, reach)
    low, high = (x[0] - wide[0], x[1] - wide[1], x[2] - wide[2]), add(x, wide)
    return scan(locator, facets, low, high, against, NO_TOUCH)  # type: ignore[no-any-return]


@kernel
def held_against(locator: Any, facets: Facets, x: Vec, radius: float, way: Vec, v: Vec, down: Vec) -> Held:
    """Return the contacts that block a sphere along the vector `way` (3,), and the component of `way` that they allow.

    x : (3,) m, centre; radius : of the sphere, m
    way : gravity (m/s^2), to find the contacts that carry the sphere, or the velocity (m/s) of the sphere
    v, down : (3,) velocity (m/s) and acceleration (m/s^2) of the sphere

    Contacts from which the sphere moves away do not count.
    """
    noise = LEADING * norm(way)
    held = Held(contacts=0, first=NO_TOUCH, second=NO_TOUCH, pushes=(0.0, 0.0), way=way)
    for _ in range(TRIES):
        against = Against(x=x, way=held.way, v=v, down=down, radius=radius, noise=noise)
        found = most_against(locator, facets, against)
        if found.facet < 0 or held.contacts == 3:
            break
        if held.contacts == 0:
            held = by_one(found, way)
        elif held.contacts == 1:
            held = _by_two(held.first, found, way)
        else:
            held = _by_three(held, found, way, noise)
    return held


@kernel
def by_one(touch: Touch, way: Vec) -> Held:
    """Return `Held` for one contact, which allows the component of the vector `way` along the plane of the contact.

    touch : the contact; way : (3,) velocity (m/s) or gravity (m/s^2)
    """
    return Held(contacts=1, first=touch, second=NO_TOUCH, pushes=(-dot(way, touch.n), 0.0), way=without(way, touch.n))


@kernel
def _by_two(first: Touch, second: Touch, way: Vec) -> Held:
    """Return `Held` for two contacts, which allow the component of the vector `way` along their common line.

    If only one of both contacts pushes, return `Held` for this contact alone. Two contacts with opposite normals allow
    no motion.

    way : (3,) velocity (m/s) or gravity (m/s^2)
    """
    line = cross(first.n, second.n)
    sine = norm(line)
    if sine <= PARALLEL:
        return by_one(second, way) if dot(first.n, second.n) > 0.0 else _nothing_left(first, second)
    c, one, other = dot(first.n, second.n), -dot(way, first.n), -dot(way, second.n)
    push, against = (one - c * other) / (sine * sine), (other - c * one) / (sine * sine)
    if push <= 0.0:
        return by_one(second, way)
    if against <= 0.0:
        return by_one(first, way)
    line = scale(1.0 / sine, line)
    return Held(contacts=2, first=first, second=second, pushes=(push, against), way=scale(dot(way, line), line))


@kernel
def _by_three(held: Held, third: Touch, way: Vec, noise: float) -> Held:
    """Return `Held` after a third contact is found: one, two or all three contacts block the sphere.

    - If the first two contacts allow the motion along the third contact's plane, the third contact alone blocks the
      sphere.
    - If not, one of the first two contacts blocks the sphere together with the third contact, if the remaining contact
      allows the motion along the common line of this pair.
    - Otherwise the three contacts allow no motion.

    held : the first two contacts
    third : the third contact; way : the vector that the contacts block, as in `held_against`
    noise : component of a vector that counts as zero, in the unit of `way`
    """
    alone = by_one(third, way)
    if dot(alone.way, held.first.n) >= -noise and dot(alone.way, held.second.n) >= -noise:
        return alone
    one = _by_two(held.first, third, way)
    if one.contacts == 2 and dot(one.way, held.second.n) >= -noise:
        return one
    other = _by_two(held.second, third, way)
    if other.contacts == 2 and dot(other.way, held.first.n) >= -noise:
        return other
    return _nothing_left(held.first, held.second)


@kernel
def _nothing_left(first: Touch, second: Touch) -> Held:
    """Return `Held` for contacts that allow a sphere no motion at all, with 3 as the number of contacts.

    first, second : two of the contacts
    """
    return Held(contacts=3, first=first, second=second, pushes=(0.0, 0.0), way=ZERO)


@kernel
def resultant(held: Held) -> tuple[Vec, float]:
    """Return the unit direction (3,) in which one or two contacts push the sphere, and the sum of their pushes.

    The sum has the unit of `held.pushes`.
    """
    both = add(scale(held.pushes[0], held.first.n), scale(held.pushes[1], held.second.n))
    return scale(1.0 / norm(both), both), held.pushes[0] + held.pushes[1]
