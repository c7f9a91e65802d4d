"""What a scene may name: models and effects, each with its parameters, their bounds and where they come from.

The physics stands in a file of its own, which is imported once a scene names it, and not before.
"""

from importlib import import_module
from typing import Any, ClassVar, Literal

from pydantic import Field

from rpf3d_core.scene.values import StrictModel

Confirmed = Literal["C", "CC", "S", "D", "UNCONFIRMED"]
"""How far a figure is confirmed: C read in the primary text, CC in an independent public implementation, S quoted by
another text, D derived here; UNCONFIRMED general knowledge, to be checked by who uses it."""


class Offer(StrictModel):
    """Parameters of one model or effect, under names that the class of its physics has as well.

    PHYSICS : module and class of the parameters that its rules are registered for
    MATERIAL_KEYS : optional keys of a material that the model cannot do without
    GROUNDS, REBOUNDS : ground and rebound models that it goes with, None for any
    STEPS : whether contacts may be found in fixed steps
    BUILDER : module and function that makes that class from the scene where there is more to it than copying numbers
    OBSTACLES : module and function that tells what its obstacles are called, from (name, offer, its parameters)
    STOPPED : of a ground model, the sentence on rocks that stopped where it is not that of all others
    SOURCE : where it is published; CONFIRMED : how far that is confirmed
    """

    PHYSICS: ClassVar[str]
    MATERIAL_KEYS: ClassVar[tuple[str, ...]] = ()
    GROUNDS: ClassVar[tuple[str, ...] | None] = None
    REBOUNDS: ClassVar[tuple[str, ...] | None] = None
    STEPS: ClassVar[bool] = True
    BUILDER: ClassVar[str | None] = None
    OBSTACLES: ClassVar[str | None] = None
    STOPPED: ClassVar[str | None] = None
    SOURCE: ClassVar[str]
    CONFIRMED: ClassVar[Confirmed]

    @property
    def asks_friction(self) -> bool:
        """Whether the result depends on the friction angle of the materials."""
        return False

    def physics(self) -> type:
        """The class of the parameters, imported with its rules."""
        return loaded(self.PHYSICS)  # type: ignore[no-any-return]

    def made(self) -> Any:
        """The parameters as a value of that class, which has fields of the same names."""
        return self.physics()(**{name: getattr(self, name) for name in type(self).model_fields})


def loaded(path: str) -> Any:
    """What stands at `module:name`."""
    module, name = path.split(":")
    return getattr(import_module(module), name)


def parameter(
    default: Any, description: str, unit: str, source: str, confirmed: Confirmed, **bounds: Any
) -> Any:  # fmt: skip
    """A field of an `Offer`: a number with its unit, bounds, source, and how far that is confirmed.

    default : `...` where there is none
    """
    facts: dict[str, Any] = {"unit": unit, "source": source, "confirmed": confirmed}
    return Field(default, description=description, json_schema_extra=facts, **bounds)
