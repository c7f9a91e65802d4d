"""What follows when the bouncing has died out: the scene's ground model."""

from typing import NamedTuple


class NoGround(NamedTuple):
    """The thesis: a rock slower than stop_speed has stopped; a faster one is left unresolved."""


class Sliding(NamedTuple):
    """Coulomb sliding with the friction angle of the material, from facet to facet."""


GROUND_MODELS = {"none": NoGround(), "sliding": Sliding()}
"""Ground models by the name that a scene gives them."""
