"""The scene's key `calibration`: which values `rpf3d calibrate` determines, and observations other than end points."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Self

from pydantic import AfterValidator, Discriminator, Field, Tag, model_validator

from rpf3d_core.scene.unknowns import PriorSpec
from rpf3d_core.scene.values import Count, Name, Number, StrictModel, no_two_alike, refuse

MOST_UNKNOWNS = 12
"""Largest number of unknowns in `calibration.unknowns`: the data of one slope determines far fewer values.

Unknowns in the rest of the scene do not count.
"""
VALUES = ("speeds", "heights", "energies")
"""Keys of a gate whose value is a list with one number for each rock observed at the gate."""

if TYPE_CHECKING:
    Column = int | str
else:
    Column = Annotated[
        Annotated[Count, Field(ge=1), Tag("[numbers]")] | Annotated[Name, Tag("[key]")],
        Discriminator(lambda value: "[key]" if isinstance(value, str) else "[numbers]"),
    ]
"""A column of a file: its number, counted from 1, or its name."""
Measured = tuple[Annotated[Number, Field(ge=0)], ...]


class GateSpec(StrictModel):
    """Observations at a gate, a line across the slope: speeds, heights and energies of the rocks that passed it."""

    name: Name = Field(description="a name that no other gate has")
    at: Number = Field(
        description="a number (m), the place of the gate: its distance from the origin of the coordinates, measured "
        "along `observed.along`"
    )
    speeds: Measured = Field((), description="a list of numbers >= 0 (m/s), speeds of rocks at the gate")
    heights: Measured = Field((), description="a list of numbers >= 0 (m), heights of centres above the ground")
    energies: Measured = Field((), description="a list of numbers >= 0 (kJ), translational energies at the gate")
    speed_error: Number = Field(0.0, ge=0, description="a number >= 0 (m/s), the standard deviation of an observation")
    height_error: Number = Field(0.0, ge=0, description="a number >= 0 (m), the standard deviation of an observation")
    energy_error: Number = Field(0.0, ge=0, description="a number >= 0 (kJ), the standard deviation of an observation")
    passed: Count | None = Field(
        None, ge=0, description="a whole number >= 0, the number of observed rocks that passed"
    )
    of: Count | None = Field(
        None, ge=1, description="a whole number >= 1, the number of observed rocks; goes with passed"
    )

    @model_validator(mode="after")
    def _some_data(self) -> Self:
        if not any(getattr(self, key) for key in VALUES) and self.passed is None:
            raise refuse(f"has no data; give {', '.join(VALUES)} or passed")
        _part_of(self.passed, self.of, "passed")
        return self


class ShareSpec(StrictModel):
    """An observed count at one place, an area or a section: the rocks that stopped there, or that reached the place."""

    place: Name = Field(description="the name of an area of interest, or of a section of `observed`")
    stopped: Count | None = Field(
        None, ge=0, description="a whole number >= 0, the number of observed rocks that stopped in the place"
    )
    reached: Count | None = Field(
        None, ge=0, description="a whole number >= 0, the number of observed rocks that reached the place"
    )
    of: Count = Field(ge=1, description="a whole number >= 1, the number of observed rocks")

    @model_validator(mode="after")
    def _one_count(self) -> Self:
        if (self.stopped is None) == (self.reached is None):
            raise refuse("must have one of stopped and reached")
        _part_of(self.stopped, self.of, "stopped")
        _part_of(self.reached, self.of, "reached")
        return self


def _part_of(count: int | None, whole: int | None, key: str) -> None:
    """Raise a PydanticCustomError if a count is above the number of observed rocks, or if this number is missing.

    count : the count; None if not given, which is always allowed
    whole : the number of observed rocks (key `of`); None if not given
    key : the key of the count in the scene, for the message
    """
    if count is not None and (whole is None or count > whole):
        raise refuse(f"is {count}, but must be at most `of`, the number of observed rocks", key)


def _few_enough(unknowns: Mapping[str, PriorSpec]) -> Mapping[str, PriorSpec]:
    """Return the unknowns unchanged; raise a PydanticCustomError if there are more than MOST_UNKNOWNS."""
    if len(unknowns) > MOST_UNKNOWNS:
        raise refuse(f"has {len(unknowns)} unknowns; at most {MOST_UNKNOWNS} can be sampled")
    return unknowns


class CalibrationSpec(StrictModel):
    """The settings of a calibration: the unknowns to determine, and the observations. A run ignores these settings."""

    unknowns: Annotated[Mapping[str, PriorSpec], AfterValidator(_few_enough)] = Field(
        default_factory=dict, description="a mapping of key paths such as materials.*.friction to {min, max} or "
        "{mean, sd, min, max}",
    )  # fmt: skip
    book: Mapping[str, Number] = Field(
        default_factory=dict, description="a mapping of key paths to book values, whose score is also given",
    )  # fmt: skip
    measuring_error: Number = Field(
        0.5, ge=0, description="a number >= 0 (m), the standard deviation of an observed end point, along and across"
    )
    mass_column: Column | None = Field(
        None, description="a name or a whole number >= 1, the column of observed.points_file with the mass of each "
        "block (kg): a name in the header, a property of GeoJSON points, or the number of the column from 1",
    )  # fmt: skip
    shape_column: Column | None = Field(
        None, description="a name or a whole number >= 1, the column with the number of each block's shape: its place "
        "in rock.shape.files, from 1",
    )  # fmt: skip
    gates: Annotated[tuple[GateSpec, ...], AfterValidator(no_two_alike)] = Field(
        (), description="a list of gates, with speeds, heights and energies of the rocks that passed"
    )
    shares: tuple[ShareSpec, ...] = Field(
        (), description="a list of {place, stopped or reached, of}, counts of observed rocks in areas or sections"
    )
    rocks: Count | None = Field(
        None,
        ge=64,
        description="a whole number >= 64, the number of rocks of each parameter set, at least one for each observed "
        "block with a mass or shape; left out: rpf3d chooses it",
    )
