"""The releases of a scene: the rocks, and the sources that state their places and velocities."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Self, cast

from pydantic import BeforeValidator, Field, ModelWrapValidatorHandler, model_validator

from rpf3d_core.formats.points import read_points
from rpf3d_core.scene.draws import Speed, distribution_of
from rpf3d_core.scene.measured import Size, check_sizes
from rpf3d_core.scene.shapes import ShapeSpec, shape_values
from rpf3d_core.scene.values import (
    MOST_ROCKS,
    Count,
    HalfWidths,
    InputFile,
    Name,
    Number,
    Outline,
    Rocks,
    StrictModel,
    Track,
    Vector,
    exactly_one,
    refuse,
)
from rpf3d_core.terrain.benches.parameters import Benches
from rpf3d_core.terrain.frame import FloatArray, Up

FASTEST = 10_000.0
"""Highest release speed (m/s) that a scene may have, so that the square of a speed stays finite.

No blast throws a rock so fast.
"""
SIZES = ("diameter", "mass", "volume")
"""Keys of a rock that give its size; at most one is given."""
OPTIONAL = ("crest", *SIZES)
"""Keys of a source that the digest of a scene includes only if they are given."""
PLACES = ("points", "points_file", "line", "crest", "polygon", "zone")
"""Keys of a source that give the places of its rocks; exactly one is given."""


def _no_line(value: Any) -> Any:
    """Return the value of `crest`; raise a PydanticCustomError for points or a file, which belong to the key `line`."""
    if isinstance(value, list | tuple | str):
        raise refuse("is a line, but must be the number of a face of `terrain.benches`; did you mean `line`?")
    return value


class RockSpec(StrictModel):
    """The rocks: density (kg/m3), and one of diameter (m) of the sphere of equal volume, mass (kg) and volume (m3)."""

    density: Number = Field(2700.0, gt=0, description="a number above 0 (kg/m3)")
    diameter: Size | None = Field(None, description="a number above 0 (m), or a distribution or measured list")
    mass: Size | None = Field(None, description="a number above 0 (kg), or a distribution or measured list")
    volume: Size | None = Field(None, description="a number above 0 (m3), or a distribution or measured list")
    shape: Annotated[ShapeSpec | None, BeforeValidator(shape_values)] = Field(
        None, description="point, sphere, or a mapping with one of box, family and files"
    )

    @model_validator(mode="wrap")
    @classmethod
    def _a_metre_unless_told(cls, values: Any, checked: ModelWrapValidatorHandler[Self]) -> Self:
        """Add the default diameter of 1 m if the scene gives no size; boxes and shapes from files keep their size."""
        if not isinstance(values, dict) or any(name in values for name in SIZES):
            return checked(values)
        shape = values.get("shape")
        if isinstance(shape, dict) and ("box" in shape or "files" in shape):
            return checked(values)
        spec = checked({**values, "diameter": 1.0})
        spec.model_fields_set.discard("diameter")
        return spec

    @model_validator(mode="after")
    def _one_size(self) -> Self:
        if not self.has_own_size:
            exactly_one(self, *SIZES)
        check_sizes(self, SIZES)
        return self

    @property
    def is_body(self) -> bool:
        """True if the rocks are bodies with a shape, neither points nor spheres."""
        return self.shape is not None and not self.is_sphere

    @property
    def is_sphere(self) -> bool:
        """True if the rocks are spheres that touch the ground with their surface."""
        return self.shape is not None and self.shape.sphere is True

    @property
    def has_own_size(self) -> bool:
        """True if the box or the files of the shape determine the size of the rocks, because no size key is given."""
        return self.is_body and all(getattr(self, name) is None for name in SIZES)


class SourceSpec(StrictModel):
    """A source of rocks: places and velocities of the released rocks; `rocks` is the number of rocks."""

    name: Name = Field(description="a name that no other source has")
    points: tuple[Vector, ...] | None = Field(None, min_length=1, description="a list of points [x, y, z] (m)")
    points_file: InputFile | None = Field(
        None, description="the path of a file of points: x y z (m) on each line, a CSV with a header, GeoJSON, "
        "GeoPackage, Shapefile, DXF or Surpac strings"
    )
    line: Track | None = Field(
        None, description="two or more points [x, y, z] (m), or the path of a file with lines, with `above_ground`"
    )
    crest: Annotated[Count | None, BeforeValidator(_no_line)] = Field(
        None, ge=1, description="the number of a face of `terrain.benches`, 1 for the uppermost; rocks fall from the "
        "upper edge of this face",
    )  # fmt: skip
    polygon: Outline | None = Field(
        None, description="three or more corners [x, y] (m) in plan, or the path of a file with polygons"
    )
    zone: Name | None = Field(None, description="the name, or a pattern, of zones that rocks fall from")
    steeper_than_deg: Number | None = Field(
        None, ge=0, lt=180, description="a number from 0 to below 180 (degrees), the least slope of a facet from which "
        "rocks fall; with `zone`",
    )  # fmt: skip
    rocks: Rocks = Field(
        1,
        description=f"a whole number from 1 to {MOST_ROCKS}; left out: one for each point of a source of points, "
        "otherwise one",
    )
    diameter: Size | None = Field(
        None, description="as in `rock`, but only for this source; or give `mass` or `volume` instead"
    )
    mass: Size | None = Field(None, description="as in `rock`, but only for this source")
    volume: Size | None = Field(None, description="as in `rock`, but only for this source")
    velocity: Vector = Field((0.0, 0.0, 0.0), description="three numbers [vx, vy, vz] (m/s)")
    speed: Speed | None = Field(None, description="a number >= 0 (m/s), or a distribution; instead of velocity")
    azimuth_deg: Number | None = Field(
        None, ge=-360, le=360, description="a number from -360 to 360 (degrees), clockwise from north; with `speed`"
    )
    elevation_deg: Number | None = Field(
        None, ge=-90, le=90, description="a number from -90 to 90 (degrees) above the horizontal; with `speed`"
    )
    spread_deg: Number | None = Field(
        None,
        ge=0,
        le=180,
        description="a number from 0 to 180 (degrees), half the opening angle of the cone of directions; with `speed`",
    )
    above_ground: Number | None = Field(
        None, ge=0, description="a height >= 0 (m) above the terrain, or left out to keep the heights of the points"
    )
    spread: HalfWidths = Field(
        (0.0, 0.0, 0.0),
        description="three numbers >= 0 (m), the largest distances of a rock from its place on the source, along x, y "
        "and z; uniformly distributed",
    )
    velocity_spread: HalfWidths = Field(
        (0.0, 0.0, 0.0),
        description="three numbers >= 0 (m/s), the largest differences of a rock's vx, vy and vz from those of the "
        "source; uniformly distributed",
    )

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        exactly_one(self, *PLACES)
        if isinstance(self.line, Path) and self.above_ground is None:
            raise refuse("is a file of lines in plan, so it needs `above_ground`, a height (m) over ground", "line")
        if self.steeper_than_deg is not None and self.zone is None:
            raise refuse("is for the facets of a `zone`, and there is none", "steeper_than_deg")
        if (self.zone or self.polygon) and any(self.spread):
            raise refuse("is for points and lines; a polygon or zone spreads its rocks evenly by itself", "spread")
        return self

    @model_validator(mode="after")
    def _one_size(self) -> Self:
        if self.size_key is not None:
            exactly_one(self, *SIZES)
        check_sizes(self, SIZES)
        return self

    @property
    def size_key(self) -> str | None:
        """The size key of this source: `diameter`, `mass` or `volume`; None if its rocks have the size in `rock`."""
        return next((name for name in SIZES if getattr(self, name) is not None), None)

    @property
    def fastest(self) -> float:
        """Upper bound of the release speed of the source (m/s), for the check against FASTEST."""
        speed = 0.0 if self.speed is None else distribution_of(self.speed).high
        return speed + math.hypot(*self.velocity) + math.hypot(*self.velocity_spread)

    @model_validator(mode="after")
    def _one_velocity(self) -> Self:
        if self.speed is not None and any(self.velocity):
            raise refuse("must have velocity or speed, but has both")
        if self.speed is not None and self.azimuth_deg is None:
            raise refuse("has a speed and no `azimuth_deg`; it must say where to, in degrees clockwise from north")
        if self.fastest > FASTEST:
            key = "velocity" if self.speed is None else "speed"
            raise refuse(f"lets a rock start at {self.fastest:g} m/s, but {FASTEST:g} m/s is the most", key)
        for name in ("azimuth_deg", "elevation_deg", "spread_deg"):
            if self.speed is None and getattr(self, name) is not None:
                raise refuse("is the direction of a `speed`, and there is none", name)
        return self


def check_crests(sources: Sequence[SourceSpec], benches: Benches | None) -> None:
    """Raise a PydanticCustomError if a source names a face (`crest`) that the terrain of the scene does not have."""
    for i, source in enumerate(sources):
        if source.crest is None:
            continue
        if benches is None:
            raise refuse("is the number of a face of `terrain.benches`, and the terrain has none; give a `line`",
                         "sources", i, "crest")  # fmt: skip
        if source.crest > benches.number:
            raise refuse(f"is {source.crest}, but the slope has {benches.number} faces", "sources", i, "crest")


def with_heights(values: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the values of a scene in which points [x, y] of sources with `above_ground` have a height of 0.

    The height is not used. With `up: y`, such a point is [x, z].
    """
    sources, terrain = values.get("sources"), values.get("terrain")
    if not isinstance(sources, list | tuple):
        return values
    height = 1 if isinstance(terrain, Mapping) and terrain.get("up") == "y" else 2
    return {**values, "sources": tuple(_with_heights(source, height) for source in sources)}


def _with_heights(source: Any, axis: int) -> Any:
    """Return the values of a source; each point in plan gets a height of 0 if the source states `above_ground`.

    axis : index of the height in a point
    """
    if not isinstance(source, Mapping) or source.get("above_ground") is None:
        return source
    points = {key: source[key] for key in ("points", "line") if isinstance(source.get(key), list | tuple)}
    return {**source, **{key: tuple(_with_height(point, axis) for point in written) for key, written in points.items()}}


def _with_height(point: Any, axis: int) -> Any:
    is_plan = isinstance(point, list | tuple) and len(point) == 2
    return (*point[:axis], 0.0, *point[axis:]) if is_plan else point


def source_points(spec: SourceSpec, up: Up) -> FloatArray:
    """Return the points (P, 3) m in the file of a source, from which its rocks start, in the axes of the input.

    Heights are optional in the file if the source states `above_ground`.

    Raises
    ------
    InputError
        The file cannot be read as points (see `read_points`).
    """
    return read_points(cast(Path, spec.points_file), up, heights=spec.above_ground is None)
