"""The scene's keys `rebound` and `ground` (one model each) and `effects` (any number of effects), chosen by name.

A name alone selects the model with its default parameters. A mapping from the name to parameters sets the parameters.
"""

from typing import Any, ClassVar, Self

from pydantic import Field, model_validator

from rpf3d_core.scene.models.air import DragLayerSpec, DragSpec
from rpf3d_core.scene.models.barriers import BarriersSpec
from rpf3d_core.scene.models.forest import ForestSpec
from rpf3d_core.scene.models.fragmentation import FragmentationSpec
from rpf3d_core.scene.models.grounds import RollingSpec, RollingStoneSpec
from rpf3d_core.scene.models.own import OWN, OwnSpec, is_own
from rpf3d_core.scene.models.rebounds import (
    AngleTableSpec,
    CoulombLimitedSpec,
    MassScaledSpec,
    PfeifferBowenSpec,
    StochasticMatrixSpec,
    ThesisLiteralSpec,
    VelocityScaledSpec,
    VHalfSpec,
)
from rpf3d_core.scene.models.roughness import RoughnessSpec
from rpf3d_core.scene.models.scarring import ScarringSpec
from rpf3d_core.scene.models.spec import Confirmed, ModelSpec
from rpf3d_core.scene.models.sphere import SphereGroundSpec
from rpf3d_core.scene.values import StrictModel, exactly_one, refuse


class ConstantSpec(ModelSpec):
    """The normal restitution R_n and the tangential restitution R_t of the material, at any speed and angle."""

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.rebound:ConstantRestitution"
    SOURCE: ClassVar[str] = "thesis, equations 3-1 to 3-3"
    CONFIRMED: ClassVar[Confirmed] = "C"


class NoGroundSpec(ModelSpec):
    """Ground model `none`: no motion along the ground.

    When its bounces have died out, a rock slower than `stop_speed` stops; a faster rock ends with outcome
    `unresolved_contact`. Friction is ignored, so a rock may stop on any slope.
    """

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.ground:NoGround"
    STOPPED: ClassVar[str | None] = (
        "was slower than stop_speed when its bounces had died out; `ground: none` does not ask whether friction holds "
        "it there, so it may rest on any slope (`ground: sliding` asks)"
    )
    SOURCE: ClassVar[str] = "thesis, section 3.5"
    CONFIRMED: ClassVar[Confirmed] = "C"


class SlidingSpec(ModelSpec):
    """Coulomb sliding with the friction angle of the material, from facet to facet."""

    PHYSICS: ClassVar[str] = "rpf3d_core.kinetics.ground:Sliding"
    SOURCE: ClassVar[str] = "Coulomb friction"
    CONFIRMED: ClassVar[Confirmed] = "D"

    @property
    def asks_friction(self) -> bool:
        """True: sliding depends on the friction angle of the materials."""
        return True


class OneOf(StrictModel):
    """A choice of one model: each possible model is a field, and exactly one field is set."""

    @model_validator(mode="after")
    def _one(self) -> Self:
        exactly_one(self, *type(self).model_fields)
        return self

    @property
    def name(self) -> str:
        """The name of the chosen model, as in the scene."""
        return next(name for name in type(self).model_fields if getattr(self, name) is not None)

    @property
    def model_spec(self) -> ModelSpec:
        """The parameters of the chosen model."""
        return getattr(self, self.name)  # type: ignore[no-any-return]


class ReboundSpec(OneOf):
    """The rebound model: the change of a rock's velocity at an impact."""

    constant: ConstantSpec | None = Field(None, description="a mapping without keys")
    coulomb_limited: CoulombLimitedSpec | None = Field(None, description="a mapping without keys")
    thesis_literal: ThesisLiteralSpec | None = Field(None, description="a mapping without keys")
    pfeiffer_bowen: PfeifferBowenSpec | None = Field(None, description="a mapping with K, A and B")
    velocity_scaled: VelocityScaledSpec | None = Field(None, description="a mapping with K")
    mass_scaled: MassScaledSpec | None = Field(None, description="a mapping with C and K")
    v_half: VHalfSpec | None = Field(None, description="a mapping with speed")
    angle_table: AngleTableSpec | None = Field(None, description="a mapping with rows or law")
    stochastic_matrix: StochasticMatrixSpec | None = Field(None, description="a mapping with mean and covariance")
    own: OwnSpec | None = Field(None, alias=OWN, description="the import path module.Class of a model of your own")


class GroundSpec(OneOf):
    """The ground model: the motion of a rock after its bounces have died out."""

    none: NoGroundSpec | None = Field(None, description="a mapping without keys")
    sliding: SlidingSpec | None = Field(None, description="a mapping without keys")
    rolling: RollingSpec | None = Field(None, description="a mapping without keys")
    rolling_stone: RollingStoneSpec | None = Field(None, description="a mapping with stop_speed")
    sphere: SphereGroundSpec | None = Field(None, description="a mapping without keys")


class EffectsSpec(StrictModel):
    """The effects on rocks beyond rebound and ground model. Only named effects are simulated."""

    roughness: RoughnessSpec | None = Field(None, description="a mapping with amplitude or angle_sd_deg")
    scarring: ScarringSpec | None = Field(None, description="a mapping with the ground's stiffness, drag and friction")
    drag: DragSpec | None = Field(None, description="a mapping with coefficient, density and accuracy")
    drag_layer: DragLayerSpec | None = Field(None, description="a mapping with coefficient, height and polygons")
    forest: ForestSpec | None = Field(None, description="a mapping with file, or stems and dbh_mean_cm")
    barriers: BarriersSpec | None = Field(None, description="a mapping with panels")
    fragmentation: FragmentationSpec | None = Field(None, description="a mapping of when a rock breaks, and what of")
    own: tuple[OwnSpec, ...] = Field((), alias=OWN, description="import paths module.Class of effects of your own")

    @property
    def named(self) -> dict[str, ModelSpec]:
        """The effects of a scene by name, in the order in which they act; classes of users come last, in file order."""
        given = {name: getattr(self, name) for name in type(self).model_fields if name != "own"}
        ours = {name: model_spec for name, model_spec in given.items() if model_spec is not None}
        return ours | {model_spec.path: model_spec for model_spec in self.own}


def chosen_model(spec: type[OneOf]) -> Any:
    """Return a validator that converts a scene's choice of a model to the fields of its class.

    The choice is a name, or a mapping of one name to parameters. The validator raises a PydanticCustomError for a name
    that is neither a model of the class nor the import path of a user's class, if the class allows one.

    spec : the class, such as `GroundSpec`
    """

    def values(value: Any) -> Any:
        if isinstance(value, str):
            names = [name for name in spec.model_fields if name != "own"]
            if value not in names and not ("own" in spec.model_fields and is_own(value)):
                raise refuse(f"is {value!r}, but must be {' or '.join(', '.join(names).rsplit(', ', 1))}")
            value = {value: {}}
        own, ours = _told_apart(value)
        return ours | {OWN: own[0]} if len(own) == 1 else ours

    return values


def named_effects(value: Any) -> Any:
    """Return the fields of `EffectsSpec` from the scene's mapping of effect names to parameters.

    An effect with None in place of parameters has its default parameters.
    """
    own, ours = _told_apart(value)
    return ours | {OWN: own} if own else ours


def _told_apart(value: Any) -> tuple[list[dict[str, Any]], Any]:
    """Split a mapping of names to parameters into a list of users' classes and a mapping of rpf3d's own names.

    Parameters that are None become {}. A value that is not a mapping is returned unchanged, after an empty list.
    """
    if not isinstance(value, dict):
        return [], value
    given = {key: {} if item is None else item for key, item in value.items()}
    own = [{"path": key, "values": item} for key, item in given.items() if is_own(key)]
    return own, {key: item for key, item in given.items() if not is_own(key)}
