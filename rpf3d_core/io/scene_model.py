"""The scene: what a run simulates, as frozen, validated values.

Everything is in the input's own axes and coordinates, SI units; angles in degrees at this edge only. The description
of each field says what a right value is, and is what the error message for a wrong one quotes (`io.scene`).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from difflib import get_close_matches
from fnmatch import fnmatchcase
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import pydantic.dataclasses
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from rpf3d_core.errors import SceneError
from rpf3d_core.io.reference_system import are_same, reference_system_of_file, why_unusable
from rpf3d_core.io.scene_berms import BermSpec
from rpf3d_core.io.scene_draws import Coefficient, FrictionAngle, Share, Size, Speed, distribution_of
from rpf3d_core.io.scene_hazard import HazardSpec
from rpf3d_core.io.scene_method import MethodSpec, method_values
from rpf3d_core.io.scene_models import (
    ConstantSpec,
    EffectsSpec,
    GroundSpec,
    NoGroundSpec,
    ReboundSpec,
    chosen_model,
    named_effects,
)
from rpf3d_core.io.scene_values import (
    MOST_ROCKS,
    Count,
    HalfWidths,
    InputFile,
    Name,
    Number,
    Outline,
    Part,
    Rocks,
    RocksOrAuto,
    Vector,
    exactly_one,
    no_two_alike,
    refuse,
)
from rpf3d_core.terrain.pit_parameters import Pit
from rpf3d_core.values import STANDARD_GRAVITY

LARGEST_SEED = 2**63 - 1
"""Seeds are the 64-bit key of the random streams; kept in the range of a signed integer."""
MOST_NAMED = 12
"""Zones that a message lists: a pit has dozens."""
FASTEST = 10_000.0
"""m/s at which a rock may start: no blast throws one so fast, and squares of speeds stay numbers."""


def _rising(sections: Mapping[str, tuple[float | None, float | None]]) -> Mapping[str, Any]:
    for name, (low, high) in sections.items():
        if low is not None and high is not None and low >= high:
            raise refuse(f"is [{low}, {high}], but must be [low, high] with low < high", name)
    return sections


def _pointing_somewhere(along: tuple[float, float, float]) -> tuple[float, float, float]:
    if along == (0.0, 0.0, 0.0):
        raise refuse("is [0, 0, 0], which is no direction")
    return along


def _pit_values(pit: Any) -> Any:
    return _as_mapping(pit) if isinstance(pit, Pit) else pit


def _plain_pit(checked: Pit) -> Pit:
    return Pit(**_as_mapping(checked))


def _as_mapping(pit: Pit) -> dict[str, Any]:
    return {field.name: getattr(pit, field.name) for field in fields(Pit)}


PLACES = ("points", "points_file", "line", "polygon", "zone")
"""Keys of a source that say where its rocks start; one of them is given."""

_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)

if TYPE_CHECKING:
    PitSpec = Pit
else:
    _CHECKED_PIT = pydantic.dataclasses.dataclass(Pit, frozen=True, config=_STRICT)
    PitSpec = Annotated[_CHECKED_PIT, BeforeValidator(_pit_values), AfterValidator(_plain_pit)]


class TerrainFile(Part):
    """One mesh or grid file, all of it one zone."""

    path: InputFile = Field(description="the path of a terrain file, relative to the scene file")
    zone: Name = Field("terrain", description="the name of the zone that the file's facets belong to")


class TerrainSpec(Part):
    """Where the terrain comes from: files, or a synthetic pit."""

    files: tuple[TerrainFile, ...] | None = Field(None, min_length=1, description="a list of {path, zone}")
    pit: PitSpec | None = Field(None, description="a mapping of the synthetic pit's parameters")
    berms: Annotated[tuple[BermSpec, ...], AfterValidator(no_two_alike)] = Field(
        (), description="a list of {name, along, height, width}, each raised on the ground as a zone of its own"
    )
    up: Literal["y", "z"] = Field("z", description="y or z, the input axis that points up")
    weld: Number = Field(1e-4, ge=0, description="a distance >= 0 (m), vertices nearer than this become one")
    crs: Name | None = Field(None, description="the name of a coordinate reference system, such as EPSG:31287, "
                             "or left out for that of GeoTIFF files")  # fmt: skip

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        exactly_one(self, "files", "pit")
        return self

    @model_validator(mode="after")
    def _one_reference_system(self) -> Self:
        if self.crs is not None and (why := why_unusable(self.crs)):
            raise refuse(why, "crs")
        found = self.crs_of_files()
        for i, crs in found.items():
            first, name = next(iter(found.items())), self.files[i].path.name if self.files else ""
            if self.crs is not None and not are_same(self.crs, crs):
                raise refuse(f"is {self.crs!r}, but {name} is in {crs!r}; name that, or leave crs out", "crs")
            if not are_same(first[1], crs):
                raise refuse(f"is in {crs!r}, but files[{first[0]}] in {first[1]!r}; reproject one", "files", i, "path")
        return self

    def crs_of_files(self) -> dict[int, str]:
        """The reference systems of those files that say in which they are, by their place in the list."""
        found = {i: reference_system_of_file(file.path) for i, file in enumerate(self.files or ())}
        return {i: crs for i, crs in found.items() if crs is not None}


class ZoneSpec(Part):
    """Facets whose centroid lies, in plan, in one of the polygons belong to the zone."""

    zone: Name = Field(description="the name of a zone")
    polygons: InputFile = Field(description="the path of a GeoJSON file with polygons")


class Material(Part):
    """How a zone returns a lumped mass: coefficients (-) of speed, friction angle in degrees, stop speed in m/s."""

    normal_restitution: Share = Field(description="a number from 0 to 1 (-), R_n, or a distribution")
    tangential_restitution: Share = Field(description="a number from 0 to 1 (-), R_t, or a distribution")
    friction_angle_deg: FrictionAngle = Field(
        30.0, description="a number from 0 to below 90 (degrees), or a distribution"
    )
    stop_speed: Number | None = Field(None, ge=0, description="a number >= 0 (m/s), or left out for the scene's own")
    rolling_friction: Coefficient | None = Field(
        None, description="a number >= 0 (-), mu_r = tan(beta), or a distribution; for ground models that roll"
    )
    draw: Literal["per_rock", "per_impact"] = Field(
        "per_rock", description="per_rock or per_impact, when distributions are drawn anew"
    )


class RockSpec(Part):
    """The rocks: density (kg/m3), and the diameter (m) of the sphere of the same volume, the mass or the volume."""

    density: Number = Field(2700.0, gt=0, description="a number above 0 (kg/m3)")
    diameter: Size | None = Field(None, description="a number above 0 (m), or a distribution")
    mass: Size | None = Field(None, description="a number above 0 (kg), or a distribution")
    volume: Size | None = Field(None, description="a number above 0 (m3), or a distribution")

    @model_validator(mode="before")
    @classmethod
    def _a_metre_unless_told(cls, values: Any) -> Any:
        told = not isinstance(values, dict) or any(name in values for name in ("diameter", "mass", "volume"))
        return values if told else {**values, "diameter": 1.0}

    @model_validator(mode="after")
    def _one_size(self) -> Self:
        exactly_one(self, "diameter", "mass", "volume")
        return self


class SourceSpec(Part):
    """Where rocks start and how fast; `rocks` is the source's total."""

    name: Name = Field(description="a name that no other source has")
    points: tuple[Vector, ...] | None = Field(None, min_length=1, description="a list of points [x, y, z] (m)")
    points_file: InputFile | None = Field(
        None, description="the path of a file of points: x y z (m) on each line, a CSV with a header, or GeoJSON"
    )
    line: tuple[Vector, ...] | None = Field(None, min_length=2, description="two or more points [x, y, z] (m)")
    polygon: Outline | None = Field(
        None, description="three or more corners [x, y] (m) in plan, or the path of a GeoJSON file with polygons"
    )
    zone: Name | None = Field(None, description="the name, or a pattern, of zones that rocks fall from")
    steeper_than_deg: Number | None = Field(
        None, ge=0, lt=180, description="a number from 0 to below 180 (degrees), a facet's least slope; with `zone`"
    )
    rocks: Rocks = Field(
        1, description=f"a whole number from 1 to {MOST_ROCKS}; left out, one for each point that is given, or one"
    )
    velocity: Vector = Field((0.0, 0.0, 0.0), description="three numbers [vx, vy, vz] (m/s)")
    speed: Speed | None = Field(None, description="a number >= 0 (m/s), or a distribution; instead of velocity")
    azimuth_deg: Number | None = Field(
        None, ge=-360, le=360, description="a number from -360 to 360 (degrees), clockwise from north; with `speed`"
    )
    elevation_deg: Number | None = Field(
        None, ge=-90, le=90, description="a number from -90 to 90 (degrees) above the horizontal; with `speed`"
    )
    spread_deg: Number | None = Field(
        None, ge=0, le=180, description="a number from 0 to 180 (degrees), half the cone of directions; with `speed`"
    )
    above_ground: Number | None = Field(
        None, ge=0, description="a height >= 0 (m) above the terrain, or left out to keep the heights of the points"
    )
    spread: HalfWidths = Field(
        (0.0, 0.0, 0.0), description="three numbers >= 0 (m), uniform half-widths of the position"
    )
    velocity_spread: HalfWidths = Field(
        (0.0, 0.0, 0.0), description="three numbers >= 0 (m/s), uniform half-widths of the velocity"
    )

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        exactly_one(self, *PLACES)
        if self.steeper_than_deg is not None and self.zone is None:
            raise refuse("is for the facets of a `zone`, and there is none", "steeper_than_deg")
        if (self.zone or self.polygon) and any(self.spread):
            raise refuse("is for points and lines; a polygon or zone spreads its rocks evenly by itself", "spread")
        return self

    @property
    def _fastest(self) -> float:
        """No rock of the source starts faster than this (m/s)."""
        speed = 0.0 if self.speed is None else distribution_of(self.speed).high
        return speed + math.hypot(*self.velocity) + math.hypot(*self.velocity_spread)

    @model_validator(mode="after")
    def _one_velocity(self) -> Self:
        if self.speed is not None and any(self.velocity):
            raise refuse("must have velocity or speed, but has both")
        if self.speed is not None and self.azimuth_deg is None:
            raise refuse("has a speed and no `azimuth_deg`; it must say where to, in degrees clockwise from north")
        if self._fastest > FASTEST:
            key = "velocity" if self.speed is None else "speed"
            raise refuse(f"lets a rock start at {self._fastest:g} m/s, but {FASTEST:g} m/s is the most", key)
        for name in ("azimuth_deg", "elevation_deg", "spread_deg"):
            if self.speed is None and getattr(self, name) is not None:
                raise refuse("is the direction of a `speed`, and there is none", name)
        return self


class AreaSpec(Part):
    """A named area that the summary counts rocks in."""

    name: Name = Field(description="a name that no other area has")
    polygons: InputFile = Field(description="the path of a GeoJSON file with polygons")


class OutputSpec(Part):
    """How much is written: the number of rocks whose paths are kept for display, and what may be left out."""

    trajectories: Count = Field(200, ge=0, description="a whole number of at least 0, the rocks whose paths are kept")
    impacts: bool = Field(True, strict=True, description="true or false, whether impacts.parquet is written")
    pictures: bool = Field(True, strict=True, description="true or false, whether maps and profiles are drawn")
    recording: bool = Field(True, strict=True, description="true or false, whether run.rrd is written")


class TargetSpec(Part):
    """When `rocks: auto` has flown enough, judged by the areas of interest or, without any, by the zones."""

    half_width: Number = Field(
        0.02, gt=0, lt=0.5, description="a number above 0 and below 0.5, the half-width of the 95 % intervals of shares"
    )
    p95_energy: Number = Field(
        0.05, gt=0, description="a number above 0, the largest relative change of p95 energies over two doublings"
    )
    most_rocks: Rocks = Field(10_000_000, description=f"a whole number from 1 to {MOST_ROCKS}, where to give up")


class ObservedSpec(Part):
    """Stops seen in the field, to compare with: points, and sections of the distance along an input axis."""

    points_file: InputFile = Field(description="the path of a file with x y z (m) first on each line")
    along: Annotated[Vector, AfterValidator(_pointing_somewhere)] = Field(
        (1.0, 0.0, 0.0), description="three numbers, the direction in which the sections are measured"
    )
    sections: Annotated[Mapping[str, tuple[Number | None, Number | None]], AfterValidator(_rising)] = Field(
        default_factory=dict, description="[low, high] (m) for each name, null for no limit"
    )


class Scene(Part):
    """Everything a run needs to know; equal scenes with equal files give equal answers."""

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
        default_factory=lambda: ReboundSpec(constant=ConstantSpec()),
        description="the name of a rebound model, or a mapping of it to its parameters",
    )
    ground: Annotated[GroundSpec, BeforeValidator(chosen_model(GroundSpec))] = Field(
        default_factory=lambda: GroundSpec(none=NoGroundSpec()),
        description="the name of a ground model, or a mapping of it to its parameters",
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
    data_hint: Name | None = Field(None, description="a sentence that tells what to do when a file is missing")

    @model_validator(mode="after")
    def _materials_for_models(self) -> Self:
        named = (("rebound", self.rebound), ("ground", self.ground))
        for (kind, spec), (name, material) in product(named, self.materials.items()):
            for key in spec.offer.MATERIAL_KEYS:
                if getattr(material, key) is None:
                    raise refuse(f"is not given, but `{kind}: {spec.name}` needs it", "materials", name, key)
        return self

    @model_validator(mode="after")
    def _models_that_go_together(self) -> Self:
        rebound, ground = self.rebound, self.ground
        grounds, rebounds = rebound.offer.GROUNDS, ground.offer.REBOUNDS
        if grounds is not None and ground.name not in grounds:
            raise refuse(f"is {ground.name}, but `rebound: {rebound.name}` goes with {' or '.join(grounds)}", "ground")
        if rebounds is not None and rebound.name not in rebounds:
            raise refuse(f"is {ground.name}, which needs `rebound: {' or '.join(rebounds)}`", "ground")
        if self.method.stepping is not None and not rebound.offer.STEPS:
            raise refuse(f"finds contacts of points, but `rebound: {rebound.name}` has a size", "method", "stepping")
        return self


def material_of(scene: Scene, zone: str) -> Material:
    """The material of a zone: its exact name, else the first pattern in file order, else `default`.

    Raises
    ------
    SceneError
        If nothing in the scene's materials fits the zone.
    """
    if zone in scene.materials:
        return scene.materials[zone]
    for pattern, material in scene.materials.items():
        if fnmatchcase(zone, pattern):
            return material
    if "default" in scene.materials:
        return scene.materials["default"]
    known = ", ".join(scene.materials)
    raise SceneError(
        f"{scene.path}: no material for the zone {zone!r}; materials has {known}: add {zone!r} or `default`"
    )


def check_materials(scene: Scene, zones: Sequence[str]) -> None:
    """Refuse a material that no zone of the terrain takes: its name is misspelt, or what it is for is not there.

    Raises
    ------
    SceneError
        Names it and the nearest zone, or the zones that there are.
    """
    for name in scene.materials:
        if name == "default" or any(zone == name or fnmatchcase(zone, name) for zone in zones):
            continue
        near = get_close_matches(name, zones, n=1)
        shown = ", ".join(zones[:MOST_NAMED]) + (", ..." if len(zones) > MOST_NAMED else "")
        advice = f"did you mean {near[0]!r}?" if near else f"the zones are {shown}; correct it, or remove it"
        raise SceneError(f"{scene.path}: `materials.{name}` fits no zone of the terrain; {advice}")
