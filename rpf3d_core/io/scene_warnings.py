"""What a scene says that is allowed and hardly meant."""

from collections.abc import Iterator

from rpf3d_core.io.scene_draws import distribution_of
from rpf3d_core.io.scene_model import Scene

LEAST_FRICTION = 1.0
"""Degrees; ice on ice has 2: below this an angle in radians, or its tangent, stands where degrees should."""
LEAST_DENSITY = 100.0
"""kg/m^3; pumice has 250: below this a density in t/m^3 stands where kg/m^3 should."""


def warnings_of(scene: Scene) -> Iterator[str]:
    """A sentence for each thing that is likely to be a slip: a unit, or a key without effect."""
    if scene.rock.density < LEAST_DENSITY:
        yield f"`rock.density` is {scene.rock.density:g} kg/m3; is it in t/m3?"
    for name, material in scene.materials.items():
        friction = distribution_of(material.friction_angle_deg).high
        if scene.ground.name != "none" and friction < LEAST_FRICTION:
            yield f"`materials.{name}.friction_angle_deg` is {friction:g} degrees; is it in radians, or a tangent?"
    if "target" in scene.model_fields_set and scene.rocks != "auto":
        yield "`target` has no effect, for `rocks` is not auto"
