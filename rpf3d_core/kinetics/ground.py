"""Ground models: the motion of a rock along the ground after its bouncing has died out.

A rock that stays on the ground moves by dv/dt = A g_t - k v / |v|, with g_t the gravity along the ground. The ground
model sets A, the deceleration k and the condition for a stop (`Law`). Everything else is the same for all ground
models.
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.materials.library import Surface


class NoGround(NamedTuple):
    """No motion along the ground, as in the thesis: a rock ends where its bounces have died out.

    The rock has stopped if it is not faster than the stop_speed of the ground there. A faster rock ends with the
    outcome `unresolved contact`.
    """


class Sliding(NamedTuple):
    """The ground model of Coulomb sliding from facet to facet, with the friction angle of the material."""


class Law(NamedTuple):
    """The coefficients of the law of motion along the ground, dv/dt = A g_t - k v / |v|, at the rock's position.

    share : A, share of the gravity along the ground that accelerates the rock (-); friction : k (m/s^2)
    stop_speed : m/s, speed at which the rock stops, if friction can hold it on the slope
    anywhere : True if the rock stops at stop_speed even on a slope where friction cannot hold it
    """

    share: float
    friction: float
    stop_speed: float
    anywhere: bool


@model_function
def law_on_facet(ground: object, surface: Surface, n_z: float, gravity: float) -> Law:
    """Return the law of motion of a ground model on a facet whose unit normal has the vertical component n_z > 0.

    There is one rule for each ground model.

    ground : parameters of the ground model; surface : surface properties of the facet; gravity : m/s^2, above 0
    """


@model_function
def law_in_gully(ground: object, first: Surface, second: Surface, pushes: tuple[float, float], gravity: float) -> Law:
    """Return the law of motion of a ground model in a gully: along the line between two facets that carry the rock.

    There is one rule for each ground model.

    ground : parameters of the ground model
    first, second : surface properties of both facets
    pushes : normal force of each facet on the rock, per mass of the rock (m/s^2, at least 0)
    gravity : m/s^2, above 0
    """


@law_on_facet.rule(Sliding)
def coulomb_on_facet(ground: Sliding, surface: Surface, n_z: float, gravity: float) -> Law:
    """Return the law of motion of a rock that slides on a facet: k = mu g_n, g_n the gravity normal to the facet.

    mu is the friction coefficient of `surface`.

    n_z : vertical component of the facet's unit normal; gravity : m/s^2, above 0
    """
    return Law(share=1.0, friction=surface.mu * gravity * n_z, stop_speed=surface.stop_speed, anywhere=False)


@law_in_gully.rule(Sliding)
def coulomb_in_gully(
    ground: Sliding, first: Surface, second: Surface, pushes: tuple[float, float], gravity: float
) -> Law:
    """Return the law of motion of a rock that slides in a gully.

    The deceleration k is the sum over both facets of friction coefficient times normal force.

    first, second, pushes, gravity : as in `law_in_gully`
    """
    friction = first.mu * pushes[0] + second.mu * pushes[1]
    return Law(share=1.0, friction=friction, stop_speed=max(first.stop_speed, second.stop_speed), anywhere=False)


@kernel
def shared(first: float, second: float, pushes: tuple[float, float]) -> float:
    """Return the mean friction coefficient of two facets that carry a rock, weighted by their normal forces.

    The result is the larger coefficient if both forces are 0.

    first, second : coefficients of the facets (-); pushes : normal forces of the facets, in any unit
    """
    both = pushes[0] + pushes[1]
    return (first * pushes[0] + second * pushes[1]) / both if both > 0.0 else max(first, second)
