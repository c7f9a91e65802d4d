"""The scene's key `effects.forest`: single trees, from a file or drawn from the density and the size of stems."""

from typing import Annotated, ClassVar, Self

from pydantic import AfterValidator, Field, model_validator

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import InputFile, Number, StrictModel, refuse

DORREN_BERGER = "Dorren and Berger 2006"
THICKEST = 500.0
"""Largest stem diameter (cm) that a scene may have; the thickest trees of the Alps are half as thick."""
DENSEST = 20_000.0
"""Largest number of stems per hectare that a scene may have; thickets have fewer stems that stop a rock."""

Chance = Annotated[Number, Field(ge=0, le=1)]
Chances = tuple[Chance, Chance, Chance]


def _all_there(chances: tuple[float, float, float]) -> tuple[float, float, float]:
    if abs(sum(chances) - 1.0) > 1e-9:
        raise refuse(f"is {list(chances)}, which add up to {sum(chances):g}, but must add up to 1")
    return chances


Classes = Annotated[Chances, AfterValidator(_all_there)]
ASIDE = "Rockyfor3D's fall directions"
CLASSES = (0.72, 0.24, 0.04)


class EnergyFactors(StrictModel):
    """The energy factor FE (-) of each kind of tree: a tree takes at most the energy FE 38.7 d^2.31 (J) from a rock.

    d is the stem diameter (cm) at breast height.
    """

    conifer: Number = parameter(
        0.93, "a number above 0 (-), energy factor FE of conifers; unconfirmed", "-", DORREN_BERGER, "UNCONFIRMED",
        gt=0,
    )  # fmt: skip
    broadleaved: Number = parameter(
        1.59, "a number above 0 (-), energy factor FE of broadleaved trees; unconfirmed", "-", DORREN_BERGER,
        "UNCONFIRMED", gt=0,
    )  # fmt: skip
    silver_fir: Number = parameter(
        1.0, "a number above 0 (-), energy factor FE of silver firs; unconfirmed", "-", DORREN_BERGER, "UNCONFIRMED",
        gt=0,
    )  # fmt: skip


class DeflectionSpec(StrictModel):
    """The angle by which a tree turns the path of a rock away from the stem, in plan, drawn from three ranges.

    The three deflections are 0-22.5, 22.5-67.5 and 67.5-76 degrees. Their probabilities depend on the kind of blow. The
    offset of a blow (0 head on, 1 grazing) determines its kind: frontal, lateral or scratching.
    """

    frontal_within: Number = parameter(
        0.35, "a number from 0 to 1 (-), offset up to which a blow is frontal; unconfirmed", "-", "none", "UNCONFIRMED",
        ge=0, le=1,
    )  # fmt: skip
    lateral_within: Number = parameter(
        0.75, "a number from 0 to 1 (-), offset up to which a blow is lateral; a larger offset is a scratching blow; "
        "unconfirmed", "-", "none", "UNCONFIRMED", ge=0, le=1,
    )  # fmt: skip
    frontal: Classes = parameter(
        CLASSES, "the probabilities [a, b, c] (-) of the three deflections of a frontal blow; they add up to 1; "
        "unconfirmed", "-", ASIDE, "UNCONFIRMED",
    )  # fmt: skip
    lateral: Classes = parameter(
        CLASSES, "the probabilities [a, b, c] (-) of the three deflections of a lateral blow; they add up to 1; "
        "unconfirmed", "-", ASIDE, "UNCONFIRMED",
    )  # fmt: skip
    scratch: Classes = parameter(
        CLASSES, "the probabilities [a, b, c] (-) of the three deflections of a scratching blow; they add up to 1; "
        "unconfirmed", "-", ASIDE, "UNCONFIRMED",
    )  # fmt: skip

    @model_validator(mode="after")
    def _frontal_first(self) -> Self:
        if self.lateral_within < self.frontal_within:
            raise refuse(f"is {self.lateral_within:g}, but must not be below frontal_within", "lateral_within")
        return self


class ForestSpec(ModelSpec):
    """Single trees that take energy from rocks and deflect rocks; the amounts are unconfirmed."""

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.forest:Forest"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.forest:forest_of"
    OBSTACLES: ClassVar[str | None] = "rpf3d_core.setup.builders.forest:forest_as_obstacles"
    SOURCE: ClassVar[str] = "Dorren and Berger 2006"
    CONFIRMED: ClassVar[Confirmed] = "UNCONFIRMED"

    file: InputFile | None = Field(
        None, description="the path of a file of trees: x, y, dbh_cm, height (m) and kind on each line"
    )
    stems_per_ha: Number | None = parameter(
        None, f"a number from 0 to {DENSEST:g} (1/ha), how many trees per hectare are placed at random; only without "
        "`file`", "1/ha", "", "C", ge=0, le=DENSEST,
    )  # fmt: skip
    within: InputFile | None = Field(
        None, description="the path of a file with polygons in which trees are placed at random; left out: on "
        "the whole terrain",
    )  # fmt: skip
    dbh_mean_cm: Number = parameter(
        30.0, f"a number above 0 up to {THICKEST:g} (cm), mean stem diameter of randomly placed trees", "cm",
        "Rockyfor3D", "C", gt=0, le=THICKEST,
    )  # fmt: skip
    dbh_sd_cm: Number = parameter(
        10.0, f"a number from 0 to {THICKEST:g} (cm), standard deviation of the stem diameter of randomly placed "
        "trees (gamma distribution; unconfirmed)", "cm", "Rockyfor3D", "UNCONFIRMED", ge=0, le=THICKEST,
    )  # fmt: skip
    height: Number = parameter(
        25.0, "a number above 0 up to 150 (m), the height of randomly placed trees, and of trees from a file without "
        "heights; unconfirmed", "m", "none", "UNCONFIRMED", gt=0, le=150,
    )  # fmt: skip
    conifer_share: Number = parameter(
        1.0, "a number from 0 to 1 (-), share of conifers among randomly placed trees; the others are broadleaved", "-",
        "Rockyfor3D", "C", ge=0, le=1,
    )  # fmt: skip
    energy_factors: EnergyFactors = Field(
        default_factory=EnergyFactors, description="a mapping with conifer, broadleaved and silver_fir"
    )
    deflection: DeflectionSpec = Field(
        default_factory=DeflectionSpec,
        description="a mapping with frontal_within, lateral_within, frontal, lateral and scratch",
    )

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        if (self.file is None) == (self.stems_per_ha is None):
            has = "none of them" if self.file is None else "both"
            raise refuse(f"must have exactly one of file, stems_per_ha, but has {has}")
        if self.file is not None and self.within is not None:
            raise refuse("is for trees that are drawn, and they come from a file", "within")
        return self
