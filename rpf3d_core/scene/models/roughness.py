"""The scene's effect `roughness`: a random normal at each impact."""

from typing import Annotated, ClassVar, Self

from pydantic import Field, model_validator

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import Number, exactly_one, refuse

CRSP = "CRSP, as in PlatRock"
ROCFALL = "RocFall's lumped mass, as in a public implementation"

Flag = Annotated[bool, Field(strict=True)]


class RoughnessSpec(ModelSpec):
    """Each impact has a random normal; a scene uses one of two laws.

    With `amplitude`, the normal is tilted against the motion, and roughness has more effect on smaller rocks. With
    `angle_sd_deg`, the normal is tilted along or against the motion, independent of the size of the rock. Rocks on a
    plane then do not spread sideways; `lateral_sd_deg` adds this spread. A tilt that would send the rock into the
    ground is ignored.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.roughness:CrspRoughness"
    BUILDER: ClassVar[str] = "rpf3d_core.setup.builders.roughness:roughness"
    SOURCE: ClassVar[str] = f"`amplitude`: {CRSP}; `angle_sd_deg`: {ROCFALL}"
    CONFIRMED: ClassVar[Confirmed] = "CC"
    NOT_FOR_BODIES: ClassVar[str | None] = (
        "it imitates the irregular rebounds of real rocks, which the corners of a body already cause"
    )

    amplitude: Number | None = parameter(
        None, "a number >= 0 (m), the height S of irregularities on a length of one rock radius; the normal is tilted "
        "against the motion by at most atan(S / radius)", "m", CRSP, "CC", ge=0,
    )  # fmt: skip
    deviates: Flag = parameter(
        False, "true or false, whether part of the tilt is to a side; only with `amplitude`", "", "PlatRock", "CC"
    )
    angle_sd_deg: Number | None = parameter(
        None, "a number from 0 to 30 (degrees), the standard deviation of the tilt along the motion, instead of "
        "`amplitude`", "degrees", ROCFALL, "CC", ge=0, le=30,
    )  # fmt: skip
    lateral_sd_deg: Number | None = parameter(
        None, "a number from 0 to 30 (degrees), the standard deviation of a further tilt to the side, with "
        "`angle_sd_deg`; not part of RocFall's law", "degrees", "rpf3d's own, unpublished", "D", ge=0, le=30,
    )  # fmt: skip

    @model_validator(mode="after")
    def _one_law(self) -> Self:
        exactly_one(self, "amplitude", "angle_sd_deg")
        if self.deviates and self.amplitude is None:
            raise refuse("is part of the law of `amplitude`, and there is none", "deviates")
        if self.lateral_sd_deg is not None and self.angle_sd_deg is None:
            raise refuse("goes with `angle_sd_deg`, and there is none; `amplitude` has `deviates`", "lateral_sd_deg")
        return self
