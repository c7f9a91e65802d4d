"""The scene model: all settings of a run as frozen, validated values.

Coordinates and axes are as in the input files. Units are SI, except angles: a scene has degrees, all other code
radians. The description of each field states the valid values. Error messages about wrong values quote the description
(`scene.faults`).
"""

from collections.abc import Mapping
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from rpf3d_core.scene.draws import Coefficient, FrictionAngle, Share
from rpf3d_core.scene.hazard import HazardSpec
from rpf3d_core.scene.method import MethodSpec, method_values
from rpf3d_core.scene.models import (
    EffectsSpec,
    GroundSpec,
    ReboundSpec,
    SlidingSpec,
    chosen_model,
    named_effects,
)
from rpf3d_core.scene.rebounds import CoulombLimitedSpec
from rpf3d_core.scene.releases import RockSpec, SourceSpec
from rpf3d_core.scene.sphere import COULOMB_SPHERE, SPHERE_GROUND
from rpf3d_core.scene.terrain import TerrainSpec, ZoneSpec
from rpf3d_core.scene.values import (
    MOST_ROCKS,
    Count,
    InputFile,
    Name,
    Number,
    Rocks,
    RocksOrAuto,
    StrictModel,
    Vector,
    no_two_alike,
    refuse,
)
from rpf3d_core.values import STANDARD_GRAVITY

LARGEST_SEED = 2**63 - 1
"""Largest seed (-) of a scene.

A seed is the 64-bit key of the random streams and stays in the range of a signed integer.
"""


def _rising(sections: Mapping[str, tuple[float | None, float | None]]) -> Mapping[str, Any]:
    for name, (low, high) in sections.items():
        if low is not None and high is not None and low >= high:
            raise refuse(f"is [{low}, {high}], but must be [low, high] with low < high", name)
    return sections


def _pointing_somewhere(along: tuple[float, float, float]) -> tuple[float, float, float]:
    if along == (0.0, 0.0, 0.0):
        raise refuse("is [0, 0, 0], which is no direction")
    return along


def _names_only(value: Any, name: str) -> bool:
    return isinstance(value, Mapping) and set(value) == {name}


class Material(StrictModel):
    """The ground material of a zone: coefficients (-), friction angle in degrees, stop speed in m/s."""

    normal_restitution: Share = Field(description="a number from 0 to 1 (-), R_n, or a distribution")
    tangential_restitution: Share = Field(description="a number from 0 to 1 (-), R_t, or a distribution")
    friction_angle_deg: FrictionAngle = Field(
        30.0, description="a number from 0 to below 90 (degrees), or a distribution"
    )
    stop_speed: Number | None = Field(None, ge=0, description="a number >= 0 (m/s), or left out for the scene's own")
    rolling_friction: Coefficient | None = Field(
        None, description="a number >= 0 (-), mu_r = tan(beta), or a distribution; for ground models that roll, and "
        "for impacts of `coulomb_sphere`",
    )  # fmt: skip
    draw: Literal["per_rock", "per_impact"] = Field(
        "per_rock", description="per_rock or per_impact, when distributions are drawn again"
    )


class AreaSpec(StrictModel):
    """A named area of interest: the summary of a run counts the rocks in the area."""

    name: Name = Field(description="a name that no other area has")
    polygons: InputFile = Field(description="the path of a GeoJSON file with polygons")


class OutputSpec(StrictModel):
    """The extent of the output: the number of rocks whose paths are kept for display, and the optional files."""

    trajectories: Count = Field(200, ge=0, description="a whole number of at least 0, the rocks whose paths are kept")
    impacts: bool = Field(True, strict=True, description="true or false, whether impacts.parquet is written")
    pictures: bool = Field(True, strict=True, description="true or false, whether maps and profiles are drawn")
    recording: bool = Field(True, strict=True, description="true or false, whether run.rrd is written")


class TargetSpec(StrictModel):
    """The target of `rocks: auto`: the accuracy at which a run ends, in the areas of interest or else in the zones."""

    half_width: Number = Field(
        0.02, gt=0, lt=0.5, description="a number above 0 and below 0.5, the half-width of the 95 % intervals of shares"
    )
    p95_energy: Number = Field(
        0.05, gt=0, description="a number above 0, the largest relative change of p95 energies over two doublings"
    )
    most_rocks: Rocks = Field(10_000_000, description=f"a whole number from 1 to {MOST_ROCKS}, where to give up")


class ObservedSpec(StrictModel):
    """Observed stops of rocks for comparison with the simulated stops.

    Stops are counted in sections of distance (m) along a direction, which is given in the axes of the input.
    """

    points_file: InputFile = Field(description="the path of a file with x y z (m) first on each line")
    along: Annotated[Vector, AfterValidator(_pointing_somewhere)] = Field(
        (1.0, 0.0, 0.0), description="three numbers, the direction in which the sections are measured"
    )
    sections: Annotated[Mapping[str, tuple[Number | None, Number | None]], AfterValidator(_rising)] = Field(
        default_factory=dict, description="[low, high] (m) for each name, null for no limit"
    )


class Scene(StrictModel):
    """All settings of a run. Equal scenes with equal files give equal results."""

    path: Path = Field(description="the scene file")
    terrain: TerrainSpec = Field(description="a mapping with files or pit")
    zones: tuple[ZoneSpec, ...] = Field((), description="a list of {zone, polygons}, later entries win")
    materials: Mapping[str, Material] = Field(
        min_length=1, description="a mapping of zone name, pattern or `default` to a material"
    )
    rock: RockSpec = Field(default_factory=RockSpec, description="a mapping with density and diameter, mass or volume")
    sources: Annotated[tuple[SourceSpec, ...], AfterValidator(no_two_alike)] = Field(
        min_length=1, description="a list of at least one source"
    )
    rocks: RocksOrAuto | None = Field(
        None, description=f"a whole number from 1 to {MOST_ROCKS}, or auto; dealt to the sources in proportion, left "
        "out for their own",
    )  # fmt: skip
    target: TargetSpec = Field(
        default_factory=TargetSpec, description="a mapping with half_width, p95_energy and most_rocks"
    )
    rebound: Annotated[ReboundSpec, BeforeValidator(chosen_model(ReboundSpec))] = Field(
        default_factory=lambda: ReboundSpec(coulomb_limited=CoulombLimitedSpec()),
        description="the name of a rebound model, or a mapping of it to its parameters",
    )
    ground: Annotated[GroundSpec, BeforeValidator(chosen_model(GroundSpec))] = Field(
        default_factory=lambda: GroundSpec(sliding=SlidingSpec()),
        description="the name of a ground model, or a mapping of it to its parameters; left out, `sphere` goes with "
        "`rebound: coulomb_sphere`",
    )
    stop_speed: Number = Field(0.5, ge=0, description="a number >= 0 (m/s)")
    gravity: Number = Field(STANDARD_GRAVITY, gt=0, description="a number above 0 (m/s2)")
    smallest_bounce: Number = Field(1e-3, gt=0, description="a height above 0 (m)")
    max_time: Number = Field(3600.0, gt=0, description="a number above 0 (s)")
    max_impacts: Count = Field(100_000, ge=1, description="a whole number of at least 1")
    effects: Annotated[EffectsSpec, BeforeValidator(named_effects)] = Field(
        default_factory=EffectsSpec, description="a mapping of effect name to its parameters"
    )
    areas_of_interest: Annotated[tuple[AreaSpec, ...], AfterValidator(no_two_alike)] = Field(
        (), description="a list of {name, polygons}"
    )
    hazard: HazardSpec = Field(
        default_factory=HazardSpec, description="a mapping with cell, reach_levels, matrix and memory_gb"
    )
    engine: Literal["auto", "reference", "compiled"] = Field("auto", description="auto, reference or compiled")
    method: Annotated[MethodSpec, BeforeValidator(method_values)] = Field(
        default_factory=MethodSpec, description="events, or a mapping with stepping"
    )
    seed: Count = Field(1, ge=0, le=LARGEST_SEED, description=f"a whole number from 0 to {LARGEST_SEED}")
    outputs: OutputSpec = Field(
        default_factory=OutputSpec, description="a mapping with trajectories, impacts, pictures and recording"
    )
    observed: ObservedSpec | None = Field(None, description="a mapping with points_file, along and sections")
    data_hint: Name | None = Field(None, description="a sentence that states what to do when a file is missing")

    @model_validator(mode="before")
    @classmethod
    def _ground_of_a_sphere(cls, values: Any) -> Any:
        """Add the ground model `sphere` if a scene has the rebound model `coulomb_sphere` but no ground model."""
        if not isinstance(values, Mapping) or "ground" in values:
            return values
        rebound = values.get("rebound")
        return (
            {**values, "ground": SPHERE_GROUND}
            if rebound == COULOMB_SPHERE or _names_only(rebound, COULOMB_SPHERE)
            else values
        )

    @model_validator(mode="after")
    def _materials_for_models(self) -> Self:
        named = (("rebound", self.rebound), ("ground", self.ground))
        for (kind, spec), (name, material) in product(named, self.materials.items()):
            for key in spec.model_spec.MATERIAL_KEYS:
                if getattr(material, key) is None:
                    raise refuse(f"is not given, but `{kind}: {spec.name}` needs it", "materials", name, key)
        return self

    @model_validator(mode="after")
    def _models_that_go_together(self) -> Self:
        rebound, ground = self.rebound, self.ground
        grounds, rebounds = rebound.model_spec.GROUNDS, ground.model_spec.REBOUNDS
        if grounds is not None and ground.name not in grounds:
            raise refuse(f"is {ground.name}, but `rebound: {rebound.name}` goes with {' or '.join(grounds)}", "ground")
        if rebounds is not None and rebound.name not in rebounds:
            raise refuse(f"is {ground.name}, which needs `rebound: {' or '.join(rebounds)}`", "ground")
        if self.method.stepping is not None and not rebound.model_spec.STEPS:
            raise refuse(f"finds contacts of points, but `rebound: {rebound.name}` has a size", "method", "stepping")
        return self
