"""The scene's keys `rebound`, `ground` and `effects`: one of several models, or any number of effects, by name.

A name alone takes the model with its defaults; a mapping of the name gives its parameters.
"""

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from rpf3d_core.io.scene_grounds import RollingSpec, RollingStoneSpec
from rpf3d_core.io.scene_offers import Confirmed, Offer
from rpf3d_core.io.scene_sphere import CoulombSphereSpec, SphereGroundSpec
from rpf3d_core.io.scene_values import Part, exactly_one, refuse

REBOUNDS = "rpf3d_core.kinetics.rebound"


class ConstantSpec(Offer):
    """R_n and R_t of the material, whatever the speed and the angle."""

    PHYSICS: ClassVar[str] = f"{REBOUNDS}:ConstantRestitution"
    SOURCE: ClassVar[str] = "thesis, equations 3-1 to 3-3"
    CONFIRMED: ClassVar[Confirmed] = "C"


class ThesisLiteralSpec(Offer):
    """The thesis' equations 2-3 to 2-8 as printed, for reproduction only: they may lose or gain energy."""

    PHYSICS: ClassVar[str] = f"{REBOUNDS}:ThesisLiteral"
    SOURCE: ClassVar[str] = "thesis, equations 2-3 to 2-8"
    CONFIRMED: ClassVar[Confirmed] = "C"


class NoGroundSpec(Offer):
    """A rock slower than stop_speed when its bounces have died out has stopped; a faster one is left unresolved."""

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.ground:NoGround"
    SOURCE: ClassVar[str] = "thesis, section 3.5"
    CONFIRMED: ClassVar[Confirmed] = "C"


class SlidingSpec(Offer):
    """Coulomb sliding with the friction angle of the material, from facet to facet."""

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.ground:Sliding"
    SOURCE: ClassVar[str] = "Coulomb friction"
    CONFIRMED: ClassVar[Confirmed] = "D"


class OneOf(Part):
    """A choice among models, each a field; exactly one is given."""

    @model_validator(mode="after")
    def _one(self) -> Self:
        exactly_one(self, *type(self).model_fields)
        return self

    @property
    def name(self) -> str:
        """The name of the model that is given."""
        return next(name for name in type(self).model_fields if getattr(self, name) is not None)

    @property
    def offer(self) -> Offer:
        """Its parameters."""
        return getattr(self, self.name)  # type: ignore[no-any-return]


class ReboundSpec(OneOf):
    """What an impact does to a rock."""

    constant: ConstantSpec | None = Field(None, description="a mapping without keys")
    thesis_literal: ThesisLiteralSpec | None = Field(None, description="a mapping without keys")
    coulomb_sphere: CoulombSphereSpec | None = Field(None, description="a mapping of its parameters")


class GroundSpec(OneOf):
    """What follows when the bouncing has died out."""

    none: NoGroundSpec | None = Field(None, description="a mapping without keys")
    sliding: SlidingSpec | None = Field(None, description="a mapping without keys")
    rolling: RollingSpec | None = Field(None, description="a mapping without keys")
    rolling_stone: RollingStoneSpec | None = Field(None, description="a mapping with stop_speed")
    sphere: SphereGroundSpec | None = Field(None, description="a mapping without keys")


class EffectsSpec(Part):
    """What else acts on rocks; nothing that is not named here is simulated."""

    @property
    def named(self) -> dict[str, Offer]:
        """The effects that are given, in the order in which they act, whatever their order in the file."""
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return {name: offer for name, offer in given.items() if offer is not None}


def chosen_model(spec: type[OneOf]) -> Any:
    """What a scene may write for a choice among models: a name, or a mapping of one name to parameters."""

    def values(value: Any) -> Any:
        names = list(spec.model_fields)
        if isinstance(value, str):
            if value not in names:
                raise refuse(f"is {value!r}, but must be {', '.join(names[:-1])} or {names[-1]}")
            return {value: {}}
        return _with_defaults(value)

    return values


def named_effects(value: Any) -> Any:
    """What a scene may write for its effects: a mapping of names to parameters, or to nothing for all defaults."""
    return _with_defaults(value)


def _with_defaults(value: Any) -> Any:
    """A mapping in which a name without parameters takes all defaults."""
    return {key: {} if item is None else item for key, item in value.items()} if isinstance(value, dict) else value
