"""The base class of all models and effects that a scene may name: their parameters, with bounds and sources.

The physics of a model or effect is in a separate file, which is imported only if a scene names the model or effect.
"""

from collections.abc import Mapping
from importlib import import_module
from typing import Any, ClassVar, Literal

from pydantic import Field

from rpf3d_core.scene.values import StrictModel

Confirmed = Literal["C", "CC", "S", "D", "UNCONFIRMED"]
"""Mark that states how well a number of a model is confirmed, from C (primary text) to UNCONFIRMED.

C: read in the primary text; CC: read in an independent public implementation; S: quoted by another text; D: derived in
this project; UNCONFIRMED: general knowledge, which the user must check.
"""


class ModelSpec(StrictModel):
    """The parameters of one model or effect. Without a BUILDER, the class of its physics has fields of the same names.

    PHYSICS : `module:class` of the physics; the engines find the rules of the model by this class
    MATERIAL_KEYS : keys that are optional in a material, but that this model requires
    GROUNDS, REBOUNDS : names of the ground and rebound models that may be combined with this model, None for any
    STEPS : True if contacts may be found in fixed time steps
    BUILDER : `module:function` that returns an object of the physics class from (parameters, scene, terrain); None if
        copying the parameters is enough
    OBSTACLES : `module:function` that returns names and places of the obstacles, from (name of the effect, parameters,
        object of the physics class); None for an effect without obstacles
    STOPPED : of a ground model, the sentence on stopped rocks; None for the usual sentence
    NOT_FOR_BODIES : of an effect, why it does not act on rocks with a shape; None if it does
    REPLACED_FOR_BODIES : parameters of an effect that rocks with a shape do not have, with the key to give instead
    SOURCE : where the model is published; CONFIRMED : how well the source is confirmed
    """

    PHYSICS: ClassVar[str]
    MATERIAL_KEYS: ClassVar[tuple[str, ...]] = ()
    GROUNDS: ClassVar[tuple[str, ...] | None] = None
    REBOUNDS: ClassVar[tuple[str, ...] | None] = None
    STEPS: ClassVar[bool] = True
    BUILDER: ClassVar[str | None] = None
    OBSTACLES: ClassVar[str | None] = None
    STOPPED: ClassVar[str | None] = None
    NOT_FOR_BODIES: ClassVar[str | None] = None
    REPLACED_FOR_BODIES: ClassVar[Mapping[str, str]] = {}
    SOURCE: ClassVar[str]
    CONFIRMED: ClassVar[Confirmed]

    @property
    def asks_friction(self) -> bool:
        """True if the model uses the friction angle of the materials, so that a missing angle is worth a warning."""
        return False

    @property
    def idle_keys(self) -> tuple[str, ...]:
        """The keys of a material's coefficients that this model ignores although other models use them; () for none."""
        return ()

    def physics(self) -> type:
        """Import and return the class with the physics of the model; the import registers its rules."""
        return loaded(self.PHYSICS)  # type: ignore[no-any-return]

    def made(self) -> Any:
        """Return the parameters of the model as an object of its physics class, which the flight loops read."""
        return self.physics()(**{name: getattr(self, name) for name in type(self).model_fields})


def loaded(path: str) -> Any:
    """Import a module and return one of its objects, such as a class; path : `module:name` of module and object."""
    module, name = path.split(":")
    return getattr(import_module(module), name)


def parameter(
    default: Any, description: str, unit: str, source: str, confirmed: Confirmed, **bounds: Any
) -> Any:  # fmt: skip
    """Return a field of a `ModelSpec`: a value with its unit, bounds, source, and how well the source is confirmed.

    default : `...` for a required parameter; description : valid values and meaning in words
    bounds : limits of a number by pydantic's names, such as gt and le
    """
    facts: dict[str, Any] = {"unit": unit, "source": source, "confirmed": confirmed}
    return Field(default, description=description, json_schema_extra=facts, **bounds)
