"""The shape of rocks in a scene, and the contact model of rocks with a shape."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from rpf3d_core.scene.models.keys import EffectsSpec, OneOf
from rpf3d_core.scene.models.spec import Confirmed, ModelSpec, parameter
from rpf3d_core.scene.models.sphere import CoulombSphereSpec
from rpf3d_core.scene.values import Count, InputFile, Number, StrictModel, exactly_one, refuse

POINT, SPHERE = "point", "sphere"
KINDS = (SPHERE, "box", "family", "files")
"""Keys of a shape, of which a scene gives exactly one."""
FEWEST_CORNERS, MOST_CORNERS = 4, 200
FLATTEST = 20.0
"""Largest ratio (-) of the longest to the shortest side of a box."""

BARTELT = "Bartelt et al. 2016, as used by Lu et al. 2019; law: Leine et al. 2014, equations 46 and 47"

Length = Annotated[Number, Field(gt=0)]


def _not_too_flat(sides: tuple[float, float, float]) -> tuple[float, float, float]:
    if max(sides) > FLATTEST * min(sides):
        raise refuse(f"is {list(sides)}, but the longest side may be at most {FLATTEST:g} times the shortest")
    return sides


class ShapeSpec(StrictModel):
    """The shape of the rocks: a sphere, or a convex body: a box, an ideal body of a family, or blocks from files."""

    sphere: Literal[True] | None = Field(None, description="true, for spheres of the rocks' size; the same as "
                                         "`shape: sphere`")  # fmt: skip
    box: Annotated[tuple[Length, Length, Length], AfterValidator(_not_too_flat)] | None = Field(
        None, description="three lengths above 0 (m), the sides of a box"
    )
    family: Literal["equant", "plate", "column", "eota111", "eota221"] | None = Field(
        None, description="equant, plate, column, eota111 or eota221"
    )
    files: Annotated[tuple[InputFile, ...], Field(min_length=1)] | None = Field(
        None, description="a list of at least one mesh file, such as STL, OBJ or DXF; each has one block, in metres"
    )
    corners: Count = Field(
        40, ge=FEWEST_CORNERS, le=MOST_CORNERS, description=f"a whole number from {FEWEST_CORNERS} to {MOST_CORNERS}, "
        "with `files`: the number of directions; the outermost point of a block in each direction becomes a corner",
    )  # fmt: skip
    weights: tuple[Annotated[Number, Field(ge=0)], ...] | None = Field(
        None, description="a number >= 0 for each file, how often its block is drawn; left out: all equally often"
    )

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        exactly_one(self, *KINDS)
        for key in ("corners", "weights"):
            if key in self.model_fields_set and self.files is None:
                raise refuse("is for `files`, and there are none", key)
        if self.weights is not None and self.files is not None:
            if len(self.weights) != len(self.files):
                raise refuse(f"has {len(self.weights)} numbers, but there are {len(self.files)} files", "weights")
            if not any(self.weights):
                raise refuse("is all 0, so no block could be drawn", "weights")
        return self


def is_point(shape: Any) -> bool:
    """Return True if a scene file's value of `rock.shape` stands for points; None for a scene without this key."""
    return shape in (None, POINT, {SPHERE: False})


def names_sphere(rock: Any) -> bool:
    """Return True if a scene file's value of `rock` names the shape `sphere`."""
    return isinstance(rock, Mapping) and rock.get("shape") in (SPHERE, {SPHERE: True})


def shape_values(value: Any) -> Any:
    """Return the fields of a `ShapeSpec` from the scene's value of `rock.shape`; None for a point.

    Raise a PydanticCustomError if the value is neither a mapping nor one of the words `point` and `sphere`.
    """
    if is_point(value):
        return None
    if value == SPHERE:
        return {SPHERE: True}
    if not isinstance(value, Mapping):
        raise refuse(f"is {value!r}, but must be point, sphere, or a mapping with one of {', '.join(KINDS[1:])}")
    return value


class RigidSpec(ModelSpec):
    """Rigid bodies with hard contact, friction and rolling resistance; all contacts of an impact are solved at once.

    Flight is exact, and so is the time of contact. While contact lasts, a body moves in short steps whose length
    follows from `accuracy`. Rolling resistance is a moment of at most `rolling_resistance` times the normal force
    times the radius of the sphere of equal volume.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.rigid_body:RigidBody"
    BUILDER: ClassVar[str | None] = "rpf3d_core.setup.builders.rigid_body:rigid_body_of"
    STOPPED: ClassVar[str | None] = (
        "stood still, or stayed where it was to within `accuracy` for 2 s, or was slower than stop_speed for 5 s, "
        "spin included; `stopped_because` in deposits.csv says which"
    )
    SOURCE: ClassVar[str] = "hard contact as in Leine et al. 2014, Multibody Syst. Dyn. 32:241; Moreau's restitution"
    CONFIRMED: ClassVar[Confirmed] = "C"
    STEPS: ClassVar[bool] = False

    accuracy: float = parameter(
        0.002, "a number above 0 (m), the distance from the ground at which contact begins", "m",
        "measured on the slope Authume P1: from 4 mm to 1 mm, the mean stopping place changes by less than its random "
        "scatter", "D",
        gt=0, le=0.1, strict=True, allow_inf_nan=False,
    )  # fmt: skip


def check_effects_on_bodies(effects: EffectsSpec) -> None:
    """Raise a PydanticCustomError for an effect, or a parameter of an effect, that rocks with a shape cannot have."""
    for name, spec in effects.named.items():
        if spec.NOT_FOR_BODIES is not None:
            raise refuse(f"does not act on rocks with a shape: {spec.NOT_FOR_BODIES}; remove it, or `rock.shape`",
                         "effects", name)  # fmt: skip
        for key, instead in spec.REPLACED_FOR_BODIES.items():
            if key in _given(spec):
                raise refuse(f"is for points and spheres; rocks with a shape have {instead}", "effects", name, key)


def _given(spec: ModelSpec) -> set[str]:
    """Return the names of the parameters that a scene states for an effect, for all zones or for single zones."""
    zones = getattr(spec, "zones", None) or {}
    return spec.model_fields_set.union(*(zone.model_fields_set for zone in zones.values()))


class SlipFrictionSpec(StrictModel):
    """Coefficient of friction mu of a rock with a shape, which grows with the slip s (m) of the rock.

    mu = mu_min + (2 / pi) (mu_max - mu_min) atan(kappa s). The slip grows with the path of the centre of mass while
    the rock presses on the ground, and decays with exp(-beta t) in the air.
    """

    mu_min: Number = parameter(
        ..., "a number >= 0 (-), mu of a rock that has not slipped; 0.55 on hard ground", "-", BARTELT, "C", ge=0
    )
    mu_max: Number = parameter(
        ..., "a number >= mu_min (-), mu that a rock approaches while it slips; 2 on hard ground", "-", BARTELT, "C",
        ge=0,
    )  # fmt: skip
    kappa: Number = parameter(
        ..., "a number >= 0 (1/m), how fast friction grows with the slip; 3 on hard ground", "1/m", BARTELT, "C", ge=0
    )
    beta: Number = parameter(
        ..., "a number >= 0 (1/s), how fast the slip (a length) decays in the air; 185 on hard ground", "1/s", BARTELT,
        "C", ge=0,
    )  # fmt: skip

    @model_validator(mode="after")
    def _grows(self) -> Self:
        if self.mu_max < self.mu_min:
            raise refuse(f"is {self.mu_max:g}, but must be at least mu_min, {self.mu_min:g}", "mu_max")
        return self


class ContactSpec(OneOf):
    """The contact model of spheres and of rocks with a shape."""

    coulomb_sphere: CoulombSphereSpec | None = Field(
        None, description="a mapping with impact_friction and tangential_restitution, for `rock.shape: sphere`"
    )
    rigid: RigidSpec | None = Field(None, description="a mapping with accuracy, for rocks with a shape")
