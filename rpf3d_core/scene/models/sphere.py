"""Rocks that are rigid spheres: their contact model and their ground model, which belong together."""

from typing import Any, ClassVar

from pydantic import model_validator

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import refuse

COULOMB_SPHERE = "coulomb_sphere"
SPHERE_GROUND = "sphere"


class CoulombSphereSpec(ModelSpec):
    """A spinning rigid sphere of the rock's size: it touches facets, edges and corners, and sticks or slips there.

    An impact of normal impulse P changes the spin by an angular impulse of at most mu_r R P, where mu_r is the
    material's `rolling_friction`.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.coulomb_sphere:CoulombSphere"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.coulomb_sphere:sphere_of"
    SOURCE: ClassVar[str] = "rigid-body mechanics; Leine et al. 2014, Multibody Syst. Dyn. 32:241, for e_t = 0"
    CONFIRMED: ClassVar[Confirmed] = "D"
    GROUNDS: ClassVar[tuple[str, ...] | None] = ("none", SPHERE_GROUND)
    STEPS: ClassVar[bool] = False

    impact_friction: float | None = parameter(
        None, "a number >= 0 (-), mu of impacts; left out: the tangent of the material's friction angle", "-",
        "Coulomb friction", "D", ge=0, strict=True, allow_inf_nan=False,
    )  # fmt: skip
    tangential_restitution: float = parameter(
        0.0, "a number from 0 to 1 (-), the share of the slip that an impact reverses", "-",
        "0 for rock: Leine et al. 2014", "C", ge=0, le=1, strict=True, allow_inf_nan=False,
    )  # fmt: skip

    @model_validator(mode="before")
    @classmethod
    def _no_loss_per_impact(cls, values: Any) -> Any:
        if isinstance(values, dict) and "damping" in values:
            raise refuse(
                "is not a parameter: a loss per impact depends on `smallest_bounce`, which decides how many impacts "
                "there are. Give `rolling_friction` in `materials` instead, a loss that follows the impulse",
                "damping",
            )
        return values

    @property
    def idle_keys(self) -> tuple[str, ...]:
        """The material keys that this model ignores: the model has its own `tangential_restitution`."""
        return ("tangential_restitution",)

    @property
    def asks_friction(self) -> bool:
        """True unless the scene states `impact_friction`, which replaces the friction angle at impacts."""
        return self.impact_friction is None


class SphereGroundSpec(ModelSpec):
    """A sphere that skids with the material's friction angle until it rolls; only with `rock.shape: sphere`.

    The material's `rolling_friction` slows a rolling sphere. Without `rolling_friction`, nothing slows a rolling
    sphere, so it may roll across the whole pit.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.sphere_ground:SphereGround"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.coulomb_sphere:sphere_ground_of"
    SOURCE: ClassVar[str] = "rigid-body mechanics; rolling friction as in Azzoni et al. 1995"
    CONFIRMED: ClassVar[Confirmed] = "D"
    REBOUNDS: ClassVar[tuple[str, ...] | None] = (COULOMB_SPHERE,)

    @property
    def asks_friction(self) -> bool:
        """True: skidding depends on the friction angle of the materials."""
        return True
