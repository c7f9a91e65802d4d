"""The terrain of a scene: files, a synthetic pit or a slope of benches; berms on it, and its zones."""

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

import pydantic.dataclasses
from pydantic import AfterValidator, BeforeValidator, ConfigDict, Field, model_validator

from rpf3d_core.formats.meshes import LAYERED
from rpf3d_core.formats.reference_system import (
    are_same,
    reference_system_of_file,
    stated_reference_system,
    unit_unlike_metre,
    why_unusable,
)
from rpf3d_core.formats.units import LENGTHS
from rpf3d_core.scene.values import Along, InputFile, Name, Number, StrictModel, exactly_one, no_two_alike, refuse
from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.pit.parameters import Pit

HIGHEST, WIDEST = 50.0, 200.0
"""Largest height and width (m) of a berm that a scene may have.

Berms of haul roads are 2 m high, waste dumps some tens of metres.
"""


_STRICT = ConfigDict(extra="forbid", allow_inf_nan=False)


def _checked(parameters: type[Any]) -> Any:
    """Return the type of a scene field for a synthetic terrain: a mapping, or an object of the dataclass `parameters`.

    The checked value is an object of this dataclass.
    """

    def as_mapping(value: Any) -> dict[str, Any]:
        return {field.name: getattr(value, field.name) for field in fields(parameters)}

    def values_of(value: Any) -> Any:
        return as_mapping(value) if isinstance(value, parameters) else value

    def plain(checked: Any) -> Any:
        return parameters(**as_mapping(checked))

    strict = pydantic.dataclasses.dataclass(parameters, frozen=True, config=_STRICT)
    return Annotated[strict, BeforeValidator(values_of), AfterValidator(plain)]


if TYPE_CHECKING:
    PitSpec = Pit
    BenchesSpec = Benches
else:
    PitSpec = _checked(Pit)
    BenchesSpec = _checked(Benches)


Unit = Literal["mm", "cm", "dm", "m", "km", "in", "ft", "yd", "us_ft", "mi"]


class BermSpec(StrictModel):
    """One berm along lines. Its facets are the zone `berm_<name>`, which materials and tables may name."""

    name: Name = Field(description="a name that no other berm has")
    along: Along = Field(description="two or more points [x, y] (m) in plan, or the path of a file with lines")
    height: Number = Field(
        gt=0,
        le=HIGHEST,
        description=f"a number above 0 up to {HIGHEST:g} (m), the height of the crest above the ground below",
    )
    width: Number = Field(
        gt=0, le=WIDEST, description=f"a number above 0 up to {WIDEST:g} (m), the width of the berm at its foot"
    )
    crest: Number = Field(0.0, ge=0, description="a number from 0 to below width (m), the width of the berm at its top")

    @model_validator(mode="after")
    def _narrower_at_the_top(self) -> Self:
        if self.crest >= self.width:
            raise refuse(f"is {self.crest:g}, but must be below the width at the foot, {self.width:g}", "crest")
        return self


class TerrainFile(StrictModel):
    """One file of terrain. Its layers or surfaces are zones, unless `zone` names one zone for all its facets."""

    path: InputFile = Field(description="the path of a terrain file, relative to the scene file")
    zone: Name = Field(
        "terrain", description="the name of the zone of all facets of the file; left out: each layer or surface of the "
        "file is a zone with its own name, and a file without layers is the zone `terrain`",
    )  # fmt: skip
    unit: Unit | None = Field(
        None, description=f"{', '.join(LENGTHS)}, the unit of the file's coordinates; left out: metres"
    )

    @property
    def has_layers_as_zones(self) -> bool:
        """True if the layers or surfaces of the file are zones: its format has them, and the scene names no zone."""
        return self.path.suffix.lower() in LAYERED and "zone" not in self.model_fields_set


class TerrainSpec(StrictModel):
    """The terrain of a scene: files, a synthetic pit or a slope of benches."""

    files: tuple[TerrainFile, ...] | None = Field(None, min_length=1, description="a list of {path, zone}")
    pit: PitSpec | None = Field(None, description="a mapping of the synthetic pit's parameters")
    benches: BenchesSpec | None = Field(None, description="a mapping of the parameters of a slope of benches")
    berms: Annotated[tuple[BermSpec, ...], AfterValidator(no_two_alike)] = Field(
        (), description="a list of {name, along, height, width}, ridges of loose rock; each is a separate zone"
    )
    up: Literal["y", "z"] = Field("z", description="y or z, the input axis that points up")
    split: tuple[Name, ...] | None = Field(
        None, min_length=1, description="a list of names of zones with several surfaces at different heights, such as "
        "all berms of a wall in one layer; each surface becomes a zone, `NAME_1` the highest; left out: no split",
    )  # fmt: skip
    weld: Number = Field(1e-4, ge=0, description="a distance >= 0 (m), vertices nearer than this become one")
    crs: Name | None = Field(None, description="the name of a coordinate reference system in metres, such as "
                             "EPSG:31287; left out: the system that the terrain files state")  # fmt: skip

    @model_validator(mode="after")
    def _one_origin(self) -> Self:
        exactly_one(self, "files", "pit", "benches")
        return self

    @model_validator(mode="after")
    def _as_benches_are(self) -> Self:
        """Refuse keys that conflict with `benches`: `up: y`, or a berm with the same zone name as a berm of `benches`.

        The zone of a berm is `berm_<name>`.
        """
        if self.benches is None:
            return self
        if self.up != "z":
            raise refuse("is y, but the slope of `benches` has z up", "up")
        for i, berm in enumerate(self.berms):
            if berm.name in map(str, range(1, self.benches.number)):
                raise refuse(f"is {berm.name!r}, which is also the number of a berm of `benches`", "berms", i, "name")
        return self

    @model_validator(mode="after")
    def _one_reference_system(self) -> Self:
        if self.crs is not None and (why := why_unusable(self.crs)):
            raise refuse(why, "crs")
        found = self.crs_of_files()
        for i, crs in found.items():
            if self.crs is not None and not are_same(self.crs, crs):
                name = self.files[i].path.name if self.files else ""
                raise refuse(f"is {self.crs!r}, but {name} is in {crs!r}; name that, or leave crs out", "crs")
        _refuse_different(found)
        _refuse_different(self._unused_crs_of_files())
        return self

    def crs_of_files(self) -> dict[int, str]:
        """Return the coordinate reference system of each terrain file that states one, by index of the file."""
        found = {i: reference_system_of_file(file.path) for i, file in enumerate(self.files or ())}
        return {i: crs for i, crs in found.items() if crs is not None}

    def _unused_crs_of_files(self) -> dict[int, str]:
        """Return the stated reference systems that are not in metres but, for example, in feet, by index of the file.

        The terrain does not have such a system, because the coordinates of the file are read in metres or converted.
        """
        found = {i: stated_reference_system(file.path) for i, file in enumerate(self.files or ())}
        return {i: crs for i, crs in found.items() if crs is not None and unit_unlike_metre(crs)}


def _refuse_different(found: dict[int, str]) -> None:
    """Raise a PydanticCustomError if two files state different systems; found : stated system, by index of the file."""
    first, expected = next(iter(found.items()), (0, ""))
    for i, crs in found.items():
        if not are_same(expected, crs):
            raise refuse(f"is in {crs!r}, but files[{first}] in {expected!r}; reproject one", "files", i, "path")


class ZoneSpec(StrictModel):
    """A zone drawn in plan: facets belong to the zone if their centroid lies in one of the polygons."""

    zone: Name = Field(description="the name of a zone")
    polygons: InputFile = Field(description="the path of a file with polygons")
