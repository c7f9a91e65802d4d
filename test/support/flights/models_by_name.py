"""Rebound and ground models by name, for tests that need no scene."""

from rpf3d_core.scene.models.keys import GroundSpec, ReboundSpec
from rpf3d_core.simulation.engines import Models


def models_called(rebound: str, ground: str) -> Models:
    """Return a rebound model and a ground model by their names, with default parameters and without effects."""
    bouncing, resting = ReboundSpec.model_validate({rebound: {}}), GroundSpec.model_validate({ground: {}})
    return Models(rebound=bouncing.model_spec.made(), ground=resting.model_spec.made(), effects=None)
