"""The scene's key `effects.barriers`: nets and fences along lines."""

from typing import Annotated, ClassVar, Literal

from pydantic import AfterValidator, Field

from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.values import Along, Name, Number, StrictModel, no_two_alike

HIGHEST = 100.0
"""Largest height (m) of a barrier that a scene may have; the highest nets are 10 m high."""
STRONGEST = 1e6
"""Largest energy (kJ) that a barrier of a scene may have; the strongest nets are tested with 10,000 kJ."""
BALANCE = "energy balance"


class BarrierSpec(StrictModel):
    """One net or fence: vertical panels on the ground below a line. Every rock meets an undamaged barrier."""

    name: Name = Field(description="a name that no other barrier has")
    along: Along = Field(description="two or more points [x, y] (m) in plan, or the path of a file with lines")
    height: Number = parameter(
        ...,
        f"a number from 0 to {HIGHEST:g} (m), the vertical height of the barrier above the ground below its line",
        "m", BALANCE, "C", ge=0, le=HIGHEST,
    )  # fmt: skip
    capacity_kj: Number = parameter(
        ...,
        f"a number from 0 to {STRONGEST:g} (kJ), the largest energy of a rock that the barrier catches; with 0, the "
        "barrier only counts rocks",
        "kJ", BALANCE, "C", ge=0, le=STRONGEST,
    )  # fmt: skip
    residual_height: Number = parameter(
        1.0, "a number from 0 to 1 (-), share of `height` that still stands, such as after a hit; unconfirmed",
        "-", "ETAG 027 has categories of residual height", "UNCONFIRMED", ge=0, le=1,
    )  # fmt: skip
    taken_by_break: Number = parameter(
        1.0, "a number from 0 to 1 (-), the energy that a rock loses by breaking through, as a share of the barrier's "
        "capacity", "-", BALANCE, "D", ge=0, le=1,
    )  # fmt: skip
    measured_at: Literal["centre", "top"] = parameter(
        "centre", "centre or top, the point of the rock whose height is compared with the height of the barrier", "",
        BALANCE, "C",
    )  # fmt: skip


class BarriersSpec(ModelSpec):
    """Nets and fences: rocks are caught, break through or fly over, and all three cases are counted."""

    PHYSICS: ClassVar[str] = "rpf3d_core.effects.barriers:Barriers"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.barriers:barriers_of"
    OBSTACLES: ClassVar[str | None] = "rpf3d_core.setup.builders.barriers:barriers_as_obstacles"
    SOURCE: ClassVar[str] = "the rule of RocFall, Rockyfor3D and RockGIS"
    CONFIRMED: ClassVar[Confirmed] = "CC"

    panels: Annotated[tuple[BarrierSpec, ...], AfterValidator(no_two_alike)] = Field(
        min_length=1, description="a list of {name, along, height, capacity_kj}"
    )
