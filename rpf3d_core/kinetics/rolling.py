"""Ground model of a sphere that rolls without slipping; its resistance is proportional to the normal force.

Down a slope of angle b, v^2(s) = v_0^2 + 2 A g cos(b) (tan(b) - mu_r) s, with v the speed of the sphere's centre, s the
distance and mu_r the material's rolling friction. A = m / (m + I / R^2), with m the mass, I the moment of inertia and R
the radius, is 5/7 for a solid sphere, because rotation takes part of the energy. As a vector along the ground,
dv/dt = A (g_t - mu_r g_n v / |v|), with g_t and g_n the gravity along the ground and normal to the ground.

v_0 is the whole speed of the rock when it begins to roll, although it has no spin then. So the model adds the energy of
rotation, (1 - A) / A = 2/5 of the translational energy, and uphill the rock may rise by 7/5 of v_0^2 / (2 g).

Source: Azzoni et al. 1995, Int. J. Rock Mech. Min. Sci. 32:709-724, as in the public program PlatRock.
"""

from typing import NamedTuple

from rpf3d_core.kinetics.ground import Law, law_in_gully, law_on_facet
from rpf3d_core.materials.library import Surface

ROLLING_SHARE = 5.0 / 7.0
"""Share A of gravity that accelerates a rolling solid sphere (-): I = 2/5 m R^2."""


class Rolling(NamedTuple):
    """The ground model of rolling, with the material's rolling friction.

    A rock that this friction can hold on the slope stops below stop_speed.
    """


@law_on_facet.rule(Rolling)
def rolling_on_facet(ground: Rolling, surface: Surface, n_z: float, gravity: float) -> Law:
    """Return the law of motion of a rolling rock on a facet: deceleration k = A mu_r g_n, with A = 5/7.

    mu_r is the material's rolling friction, g_n the gravity normal to the facet.
    n_z : vertical component of the facet's unit normal; gravity : g, m/s^2, above 0
    """
    return Law(
        share=ROLLING_SHARE,
        friction=ROLLING_SHARE * surface.mu_r * gravity * n_z,
        stop_speed=surface.stop_speed,
        anywhere=False,
    )


@law_in_gully.rule(Rolling)
def rolling_in_gully(
    ground: Rolling, first: Surface, second: Surface, pushes: tuple[float, float], gravity: float
) -> Law:
    """Return the law of motion of a rock that rolls in a gully.

    The deceleration k is A times the sum over both facets of rolling friction times normal force.
    The share A = 5/7 of gravity that accelerates the rock is the same as on a facet. This is a simplification: in a
    groove, A would be smaller.

    first, second, pushes, gravity : as in `ground.law_in_gully`
    """
    friction = ROLLING_SHARE * (first.mu_r * pushes[0] + second.mu_r * pushes[1])
    return Law(
        share=ROLLING_SHARE, friction=friction, stop_speed=max(first.stop_speed, second.stop_speed), anywhere=False
    )
