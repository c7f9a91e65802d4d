"""Models by name with default parameters, for tests that read no scene."""

from rpf3d_core.scene.models import GroundSpec, ReboundSpec
from rpf3d_core.simulation.engines import Models


def models_called(rebound: str, ground: str) -> Models:
    """Return models by name, with default parameters and no effects, for models that need no scene."""
    bouncing, resting = ReboundSpec.model_validate({rebound: {}}), GroundSpec.model_validate({ground: {}})
    return Models(bouncing.offer.made(), resting.offer.made())
