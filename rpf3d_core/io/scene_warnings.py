"""What a scene says that is allowed and hardly meant."""

from collections.abc import Iterator

from rpf3d_core.io.scene_draws import distribution_of
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.io.scene_sphere import SPHERE_GROUND

LEAST_FRICTION = 1.0
"""Degrees; ice on ice has 2: below this an angle in radians, or its tangent, stands where degrees should."""
LEAST_STEM = 2.0
"""Centimetres; a stem this thin stops no rock: below this a diameter in metres stands where centimetres should."""
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
    forest = scene.effects.forest
    if forest is not None and forest.stems_per_ha and forest.dbh_mean_cm < LEAST_STEM:
        yield f"`effects.forest.dbh_mean_cm` is {forest.dbh_mean_cm:g} cm; is it in metres?"
    yield from _rolling(scene)
    if scene.rebound.name == "coulomb_limited" and scene.ground.name == "none":
        yield (
            "`rebound: coulomb_limited` leaves a rock its speed along the ground when its bounces die out, and "
            "`ground: none` carries no rock on: it ends as unresolved_contact if it is faster than stop_speed; name "
            "`ground: sliding`"
        )
    if "target" in scene.model_fields_set and scene.rocks != "auto":
        yield "`target` has no effect, for `rocks` is not auto"


def _rolling(scene: Scene) -> Iterator[str]:
    """Materials whose rolling friction is taken for 0 where a sphere rolls."""
    if scene.ground.name != SPHERE_GROUND:
        return
    for name, material in scene.materials.items():
        if material.rolling_friction is None:
            yield (
                f"`materials.{name}.rolling_friction` is not given and taken as 0: a sphere that rolls there never "
                "stops on level ground; give it, or write 0"
            )
