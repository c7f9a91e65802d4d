"""The scene's effect `scarring`: soft ground, everywhere or in some zones."""

from collections.abc import Mapping
from typing import ClassVar

from pydantic import Field

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import Name, Number, StrictModel

LU = "Lu et al. 2019, fitted to Chant Sura"
BARTELT = "Bartelt et al. 2016, as used by Lu et al. 2019"


class SoftZoneSpec(StrictModel):
    """The values of one named zone or pattern that differ from the values outside `zones`."""

    stiffness: Number | None = Field(None, ge=1e3, description="a number of at least 1000 (Pa), or left out")
    form_drag: Number | None = Field(None, ge=0, description="a number >= 0, or left out")
    soil_drag: Number | None = Field(None, ge=0, description="a number >= 0, or left out")
    density: Number | None = Field(None, ge=0, description="a number >= 0 (kg/m3), or left out")
    mu_min: Number | None = Field(None, ge=0, description="a number >= 0, or left out")
    mu_max: Number | None = Field(None, ge=0, description="a number >= 0, or left out")
    kappa: Number | None = Field(None, ge=0, description="a number >= 0 (1/m), or left out")


class ScarringSpec(ModelSpec):
    """Soft ground that a rock penetrates: depth by Gerber's formula, drag in the scar, slip friction on the way out."""

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.scarring:Scarring"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.scarring:scarring"
    SOURCE: ClassVar[str] = "Lu et al. 2019; Gerber 2019; Leine et al. 2014"
    CONFIRMED: ClassVar[Confirmed] = "C"
    REPLACED_FOR_BODIES: ClassVar[Mapping[str, str]] = dict.fromkeys(
        ("mu_min", "mu_max", "kappa"), "`slip_friction` of the material"
    )

    stiffness: Number = parameter(
        15e6, "a number of at least 1000 (Pa), the stiffness M_E of the soil; rocks penetrate stiffer soil less", "Pa",
        LU, "C", ge=1e3,
    )  # fmt: skip
    form_drag: Number = parameter(1.0, "a number >= 0, C_f of the drag coefficient C_f + C_s", "-", LU, "C", ge=0)
    soil_drag: Number = parameter(1.5, "a number >= 0, C_s of the drag coefficient C_f + C_s", "-", LU, "C", ge=0)
    density: Number = parameter(1700.0, "a number >= 0 (kg/m3), the density of the soil", "kg/m3", LU, "C", ge=0)
    mu_min: Number = parameter(
        0.55, "a number >= 0, coefficient of friction of a rock that has not slipped", "-", BARTELT, "C", ge=0
    )
    mu_max: Number = parameter(
        2.0, "a number >= `mu_min`, coefficient of friction that a rock approaches while it slips", "-", BARTELT, "C",
        ge=0,
    )  # fmt: skip
    kappa: Number = parameter(
        3.0, "a number >= 0 (1/m), how fast friction grows with the slip", "1/m", BARTELT, "C", ge=0
    )
    zones: Mapping[Name, SoftZoneSpec] = parameter(
        {}, "a mapping of named zones or patterns to the keys whose values differ there; if `zones` is given, all "
        "other zones are hard ground", "-", "", "D",
    )  # fmt: skip
