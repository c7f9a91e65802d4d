"""What follows when the bouncing has died out: the scene's ground model.

A rock that stays on the ground moves by dv/dt = A g_t - k v / |v|, with g_t the gravity along the ground. What A is,
what the deceleration k comes from, and when the rock has stopped, is the ground model's (`Law`); the rest is one.
"""

from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel, model_function
from rpf3d_core.materials.library import Surface


class NoGround(NamedTuple):
    """The thesis: a rock slower than stop_speed has stopped; a faster one is left unresolved."""


class Sliding(NamedTuple):
    """Coulomb sliding with the friction angle of the material, from facet to facet."""


class Law(NamedTuple):
    """How a rock moves along the ground where it is.

    share : A, of gravity along the ground that speeds the rock up (-); friction : k (m/s^2)
    stop_speed : m/s below which it has stopped; anywhere : also where friction does not hold it
    """

    share: float
    friction: float
    stop_speed: float
    anywhere: bool


@model_function
def law_on_facet(ground: object, surface: Surface, n_z: float, gravity: float) -> Law:
    """The law on a facet whose unit normal has the vertical part n_z > 0."""


@model_function
def law_in_gully(ground: object, first: Surface, second: Surface, pushes: tuple[float, float], gravity: float) -> Law:
    """The law between two facets that each push the rock (m/s^2, at least 0)."""


@law_on_facet.rule(Sliding)
def coulomb_on_facet(ground: Sliding, surface: Surface, n_z: float, gravity: float) -> Law:
    """Coulomb friction: k = mu g_n."""
    return Law(1.0, surface.mu * gravity * n_z, surface.stop_speed, False)


@law_in_gully.rule(Sliding)
def coulomb_in_gully(
    ground: Sliding, first: Surface, second: Surface, pushes: tuple[float, float], gravity: float
) -> Law:
    """Coulomb friction on either facet, by its own push."""
    friction = first.mu * pushes[0] + second.mu * pushes[1]
    return Law(1.0, friction, max(first.stop_speed, second.stop_speed), False)


@kernel
def shared(first: float, second: float, pushes: tuple[float, float]) -> float:
    """The mean of a coefficient of two facets, weighted with how they push."""
    both = pushes[0] + pushes[1]
    return (first * pushes[0] + second * pushes[1]) / both if both > 0.0 else max(first, second)


GROUND_MODELS = {"none": NoGround(), "sliding": Sliding()}
"""Ground models by the name that a scene gives them."""
