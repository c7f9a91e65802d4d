"""Gullies between two facets that a rock touches at once: their line, the normal forces, and how far a rock climbs."""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facet_geometry import (
    ALONG_GULLY,
    NEAR,
    PARALLEL,
    corner,
    edge_distance,
    leads_on,
    stored_normal,
)
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import cross, dot, norm, scale, subtract

WEAKEST = 1e-9
"""Smallest share of gravity (-) that counts as a pull on a rock, along a facet and across the gully.

Below this share, the facet counts as level in this direction: gravity pulls the rock neither back to the line of the
gully nor away from it.
"""

MOST_BOUNCES = 32
"""Number of bounces between two facets after which a rock counts as staying between them.

Only in a gully sharper than 6 degrees could a rock bounce more often and then climb out.
"""


class Gully(NamedTuple):
    """A gully: two facets that carry a rock between them.

    direction : (3,) unit vector along both facets; pull : gravity along this direction (m/s^2)
    first, second : normal force of each facet, per mass of the rock (m/s^2)
    The friction of a facet is proportional to its normal force.
    """

    direction: Vec
    pull: float
    first: float
    second: float


@kernel
def gully(n_first: Vec, n_second: Vec, direction: Vec, gravity: float) -> Gully:
    """Return the gully of two facets, with the normal force of each facet on a rock in it.

    n_first, n_second : (3,) unit normals of the facets, turned towards the rock
    direction : (3,) unit vector along the line between the facets; gravity : m/s^2

    The normal forces per mass, N_1 and N_2, balance g_perp, the gravity perpendicular to the line:
    N_1 n_1 + N_2 n_2 + g_perp = 0, with n_1 and n_2 the normals. For two facets that are almost one plane, each facet
    carries half of the gravity normal to the facet. This changes only the friction, by at most the difference between
    the friction coefficients of the facets.
    """
    c, sine = dot(n_first, n_second), kink(n_first, n_second)
    g_first, g_second = gravity * n_first[2], gravity * n_second[2]
    if sine <= PARALLEL:
        return Gully(direction=direction, pull=-gravity * direction[2], first=0.5 * g_first, second=0.5 * g_second)
    first, second = (g_first - c * g_second) / (sine * sine), (g_second - c * g_first) / (sine * sine)
    return Gully(direction=direction, pull=-gravity * direction[2], first=first, second=second)


@kernel
def line_between(facets: Facets, first: int, second: int, x: Vec, v: Vec) -> Vec:
    """Return the unit direction (3,) in which a rock at x (m) with velocity v (m/s) moves along a gully of two facets.

    The gully is parallel to the cross product of the normals. If the two facets lie almost in one plane, an edge of the
    first facet near x takes the place of the gully. The rock must be able to move on along this edge over both facets;
    if there is no such edge, the result is (0, 0, 0). The direction points along v, or downwards if v has no component
    along the gully.

    first, second : numbers of the facets
    """
    n, m = stored_normal(facets, first), stored_normal(facets, second)
    if kink(n, m) > PARALLEL:
        line = cross(n, m)
        return _in_sense(scale(1.0 / norm(line), line), v)
    for k in range(3):
        squared, distance = edge_distance(facets, first, k, x)
        if distance * distance <= NEAR * NEAR * facets.tolerance * facets.tolerance * squared:
            edge = subtract(corner(facets, first, (k + 1) % 3), corner(facets, first, k))
            direction = _in_sense(scale(1.0 / math.sqrt(squared), edge), v)
            if leads_on(facets, first, x, direction, ALONG_GULLY) and leads_on(
                facets, second, x, direction, ALONG_GULLY
            ):
                return direction
    return 0.0, 0.0, 0.0


@kernel
def _in_sense(direction: Vec, v: Vec) -> Vec:
    """Return the direction in which a rock with velocity v slides along a gully: `direction` or its reverse.

    The result points along v, or downwards if v is perpendicular to the gully.
    """
    along = dot(v, direction)
    reverse = along < 0.0 or (along == 0.0 and direction[2] > 0.0)
    return scale(-1.0, direction) if reverse else direction


@kernel
def kink(n_first: Vec, n_second: Vec) -> float:
    """Return the sine of the angle between two facets (-).

    n_first, n_second : (3,) unit normals of the facets
    """
    return norm(cross(n_first, n_second))


@kernel
def excursion(n_over: Vec, n_from: Vec, v: Vec, gravity: float) -> float:
    """Return how far (m) a rock with velocity v climbs one facet of a gully before gravity brings it back to the line.

    The distance is measured on the facet, across the line. The result is inf if gravity pulls the rock away from the
    line. On a level facet, gravity pulls neither way: an acceleration of less than WEAKEST (1e-9) times gravity, in
    either direction, counts as WEAKEST times gravity back to the line.

    n_over : (3,) normal of the facet that the rock climbs; n_from : (3,) normal of the other facet
    v : (3,) m/s; gravity : m/s^2
    """
    across = cross(cross(n_over, n_from), n_over)
    if dot(across, n_from) < 0.0:
        across = scale(-1.0, across)
    across = scale(1.0 / norm(across), across)
    speed = max(dot(v, across), 0.0)
    pull = gravity * across[2]
    if pull < -WEAKEST * gravity:
        return math.inf
    return speed * speed / (2.0 * max(pull, WEAKEST * gravity))


@kernel
def thrown_out(n_first: Vec, n_second: Vec, v: Vec, restitution: tuple[float, float], gravity: float) -> float:
    """Return how far (m) a rock climbs one facet of a gully after several bounces in the gully; 0 if the rock stays.

    If the rock could climb either facet, the result is the larger distance.

    If a gully is sharper than 45 degrees, the first bounce sends the rock deeper into it, and only later bounces may
    send the rock out. The result is 0 for a rock that climbs after its first bounce: `excursion` covers this case. The
    loss of speed along the facets is neglected, so the result is an upper bound.

    n_first, n_second : (3,) normals of the facet that the rock hits first, with velocity v, and of the other facet
    restitution : R_n (-) of the first and of the second facet; gravity : m/s^2
    """
    n, m, out = n_first, n_second, v
    for k in range(MOST_BOUNCES):
        out = subtract(out, scale((1.0 + restitution[k % 2]) * min(dot(n, out), 0.0), n))
        if dot(m, out) >= 0.0:
            return max(excursion(n, m, out, gravity), excursion(m, n, out, gravity)) if k > 0 else 0.0
        n, m = m, n
    return 0.0
