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

from rpf3d_core.scene.calibration import CalibrationSpec
from rpf3d_core.scene.hazard import HazardSpec
from rpf3d_core.scene.library import with_libraries
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.method import MethodSpec, method_values
from rpf3d_core.scene.models.keys import (
    EffectsSpec,
    GroundSpec,
    OneOf,
    ReboundSpec,
    SlidingSpec,
    chosen_model,
    named_effects,
)
from rpf3d_core.scene.models.rebounds import CoulombLimitedSpec
from rpf3d_core.scene.models.sphere import COULOMB_SPHERE, SPHERE_GROUND, CoulombSphereSpec
from rpf3d_core.scene.releases import RockSpec, SourceSpec, check_crests, with_heights
from rpf3d_core.scene.shapes import SPHERE, ContactSpec, RigidSpec, check_effects_on_bodies, names_sphere
from rpf3d_core.scene.terrain import TerrainSpec, ZoneSpec
from rpf3d_core.scene.unknowns import UnknownsSpec, with_priors_apart
from rpf3d_core.scene.values import (
    MOST_ROCKS,
    Count,
    InputFile,
    Name,
    Number,
    Outline,
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


def chosen_contact(value: Any) -> Any:
    """Return the fields of `ContactSpec` from the scene's value of `contact`; None if the value is None."""
    return None if value is None else chosen_model(ContactSpec)(value)


def chosen_rebound(value: Any) -> Any:
    """Return the fields of `ReboundSpec` from the scene's value of `rebound`.

    Raise a PydanticCustomError for `coulomb_sphere`, which is a contact model.
    """
    if value == COULOMB_SPHERE or (isinstance(value, Mapping) and COULOMB_SPHERE in value):
        raise refuse("names coulomb_sphere, but a sphere is a shape: give `rock: {shape: sphere}` instead, and "
                     "parameters in `contact: {coulomb_sphere: ...}`")  # fmt: skip
    return chosen_model(ReboundSpec)(value)


class AreaSpec(StrictModel):
    """A named area of interest: the summary of a run counts the rocks in the area."""

    name: Name = Field(description="a name that no other area has")
    polygons: Outline = Field(
        description="three or more corners [x, y] (m) in plan, or the path of a file with one or more polygons"
    )


class OutputSpec(StrictModel):
    """The extent of the output: the number of rocks whose paths are kept for display, and the optional files."""

    trajectories: Count = Field(
        200, ge=0, description="a whole number of at least 0, the number of rocks whose paths are kept"
    )
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
    most_rocks: Rocks = Field(
        10_000_000, description=f"a whole number from 1 to {MOST_ROCKS}, the largest number of rocks that fly; "
        "every source flies at least one rock",
    )


class ObservedSpec(StrictModel):
    """Observed stops of rocks for comparison with the simulated stops.

    Stops are counted in sections of distance (m) along a direction, which is given in the axes of the input.
    """

    points_file: InputFile = Field(description="the path of a file of points, as in sources, with or without heights")
    along: Annotated[Vector, AfterValidator(_pointing_somewhere)] = Field(
        (1.0, 0.0, 0.0), description="three numbers, the direction in which the distances of stops are measured"
    )
    sections: Annotated[Mapping[str, tuple[Number | None, Number | None]], AfterValidator(_rising)] = Field(
        default_factory=dict,
        description="mapping of names to [low, high] (m), ranges of the distance along "
        "`along` in which stops are counted; null: no limit",
    )


class Scene(StrictModel):
    """All settings of a run. Equal scenes with equal files give equal results with the same version of rpf3d."""

    path: Path = Field(description="the scene file")
    terrain: TerrainSpec = Field(description="a mapping with files, pit or benches")
    zones: tuple[ZoneSpec, ...] = Field(
        (), description="a list of {zone, polygons}; where polygons overlap, the later entry applies"
    )
    materials: Mapping[str, Material] = Field(
        min_length=1, description="a mapping of zone name, pattern or `default` to a material"
    )
    rock: RockSpec = Field(default_factory=RockSpec, description="a mapping with density and diameter, mass or volume")
    sources: Annotated[tuple[SourceSpec, ...], AfterValidator(no_two_alike)] = Field(
        min_length=1, description="a list of at least one source"
    )
    rocks: RocksOrAuto | None = Field(
        None, description=f"a whole number from 1 to {MOST_ROCKS}, or auto; shared among the sources in proportion to "
        "their own `rocks`; left out: each source has its own number",
    )  # fmt: skip
    target: TargetSpec = Field(
        default_factory=TargetSpec, description="a mapping with half_width, p95_energy and most_rocks"
    )
    rebound: Annotated[ReboundSpec, BeforeValidator(chosen_rebound)] = Field(
        default_factory=lambda: ReboundSpec(coulomb_limited=CoulombLimitedSpec()),
        description="the name of a rebound model, or a mapping of it to its parameters",
    )
    ground: Annotated[GroundSpec, BeforeValidator(chosen_model(GroundSpec))] = Field(
        default_factory=lambda: GroundSpec(sliding=SlidingSpec()),
        description="the name of a ground model, or a mapping of it to its parameters; left out with "
        "`rock.shape: sphere`: `sphere`",
    )
    contact: Annotated[ContactSpec | None, BeforeValidator(chosen_contact)] = Field(
        None, description="the name of the contact model of spheres or of rocks with a shape, or a mapping of it to "
        "its parameters; left out: the model that the shape needs",
    )  # fmt: skip
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
        default_factory=HazardSpec, description="a mapping such as {cell, reach_levels, matrix, memory_gb}"
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
    unknowns: UnknownsSpec | None = Field(None, description="a mapping with sets, priors, sample and misfit")
    calibration: CalibrationSpec | None = Field(
        None, description="a mapping with unknowns and data, for `rpf3d calibrate`; a run ignores it"
    )
    data_hint: Name | None = Field(None, description="a sentence that states what to do when a file is missing")

    @model_validator(mode="before")
    @classmethod
    def _ground_of_a_sphere(cls, values: Any) -> Any:
        """Add the ground model `sphere` if the rocks of a scene are spheres and the scene states no ground model."""
        if not isinstance(values, Mapping) or "ground" in values or not names_sphere(values.get("rock")):
            return values
        return {**values, "ground": SPHERE_GROUND}

    @model_validator(mode="before")
    @classmethod
    def _priors_apart(cls, values: Any) -> Any:
        """Replace library entries by their ranges, and each prior by a plain number; the priors move to `unknowns`."""
        return with_priors_apart(with_libraries(values)) if isinstance(values, Mapping) else values

    @model_validator(mode="before")
    @classmethod
    def _points_in_plan(cls, values: Any) -> Any:
        """Give points [x, y] of sources with `above_ground` a height of 0, which is not used."""
        return with_heights(values) if isinstance(values, Mapping) else values

    @property
    def has_unknowns(self) -> bool:
        """True if a run flies parameter sets, because values of the scene are unknown."""
        return self.unknowns is not None and self.unknowns.names_any

    @property
    def impact_model(self) -> OneOf:
        """The model of impacts: the rebound model of points, or the contact model of spheres and rocks with a shape."""
        if self.rock.is_sphere:
            return self.contact or ContactSpec(coulomb_sphere=CoulombSphereSpec())
        return self.contact or ContactSpec(rigid=RigidSpec()) if self.rock.is_body else self.rebound

    @property
    def ground_model(self) -> OneOf:
        """The model of motion on the ground; the contact model of rocks with a shape is also their ground model."""
        return self.impact_model if self.rock.is_body else self.ground

    @model_validator(mode="after")
    def _crests_of_benches(self) -> Self:
        check_crests(self.sources, self.terrain.benches)
        return self

    @model_validator(mode="after")
    def _keys_for_shapes(self) -> Self:
        """Refuse keys for points in a scene of rocks with a shape, and materials for bodies in any other scene.

        Also refuse a contact model for another shape, and effects that do not act on rocks with a shape.
        """
        bodies, shape = self.rock.is_body, SPHERE if self.rock.is_sphere else "point"
        self._check_contact()
        for name, material in self.materials.items():
            if material.is_of_a_body and not bodies:
                raise refuse(f"is for rocks with a shape, and `rock.shape` is {shape}", "materials", name, "friction")
            if bodies and not material.is_of_a_body:
                raise refuse("is missing; rocks with a shape need restitution and friction", "materials", name,
                             "friction")  # fmt: skip
        if not bodies:
            return self
        for key in ("rebound", "ground"):
            if key in self.model_fields_set:
                raise refuse("is for points; rocks with a shape have `contact: rigid`", key)
        check_effects_on_bodies(self.effects)
        return self

    def _check_contact(self) -> None:
        """Refuse a contact model for another shape, and a rebound model if the rocks are spheres."""
        if self.contact is not None and self.rock.shape is None:
            raise refuse("is for spheres and rocks with a shape, and `rock.shape` is point", "contact")
        ours = COULOMB_SPHERE if self.rock.is_sphere else "rigid"
        if self.contact is not None and self.contact.name != ours:
            raise refuse(f"is {self.contact.name}, but the shape of the rocks goes with {ours}", "contact")
        if self.rock.is_sphere and "rebound" in self.model_fields_set:
            raise refuse("is for points; spheres have `contact: coulomb_sphere`", "rebound")

    @model_validator(mode="after")
    def _materials_for_models(self) -> Self:
        if self.rock.is_body:
            return self
        named = (("rebound", self.impact_model), ("ground", self.ground))
        for (kind, spec), (name, material) in product(named, self.materials.items()):
            for key in spec.model_spec.MATERIAL_KEYS:
                if getattr(material, key) is None:
                    raise refuse(f"is not given, but `{kind}: {spec.name}` needs it", "materials", name, key)
        return self

    @model_validator(mode="after")
    def _models_that_go_together(self) -> Self:
        rebound, ground = self.impact_model, self.ground_model
        grounds, rebounds = rebound.model_spec.GROUNDS, ground.model_spec.REBOUNDS
        name = f"rebound: {rebound.name}" if self.rock.shape is None else "rock.shape: sphere"
        if grounds is not None and ground.name not in grounds:
            raise refuse(f"is {ground.name}, but `{name}` goes with {' or '.join(grounds)}", "ground")
        if rebounds is not None and rebound.name not in rebounds:
            raise refuse(f"is {ground.name}, which needs `rock.shape: sphere`", "ground")
        if self.method.stepping is not None and not rebound.model_spec.STEPS:
            raise refuse("finds contacts of points, but `rock.shape` has a size", "method", "stepping")
        return self
