"""The list of all models and effects that a scene may name, with parameters, sources and measured costs."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import resources
from types import NoneType
from typing import Any, get_args

from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from rpf3d_core.scene.models.keys import EffectsSpec, GroundSpec, ReboundSpec
from rpf3d_core.scene.models.own import OWN
from rpf3d_core.scene.models.spec import Confirmed, ModelSpec
from rpf3d_core.scene.shapes import ContactSpec

KINDS = {"rebound": ReboundSpec, "ground": GroundSpec, "contact": ContactSpec, "effects": EffectsSpec}
COSTS = "measured_costs.json"
"""File with the measured cost of each model and effect; `make effects` writes it.

The cost was measured on the wall of a synthetic pit.
"""
WORDS = {"gt": "above {:g}", "ge": "at least {:g}", "lt": "below {:g}", "le": "at most {:g}"}
"""Words for each kind of bound of a number, by pydantic's name of the bound, to describe parameters."""


@dataclass(frozen=True)
class Parameter:
    """A parameter of a model or effect, as `rpf3d effects` and the reference describe it.

    meaning : valid values and meaning in words
    default : None if the parameter is required or has no default (see `required`)
    bounds : in words, "" for none; unit : "" if the parameter is not a number
    """

    name: str
    meaning: str
    unit: str
    default: Any
    required: bool
    bounds: str
    source: str
    confirmed: Confirmed


@dataclass(frozen=True)
class CatalogueEntry:
    """A model or effect that a scene may name, as `rpf3d effects` and the reference describe it.

    kind : the scene's key; summary : description of the model or effect
    cost : two numbers, measured on the wall of a synthetic pit; None if not measured. "time" is the time per rock
        divided by the time per rock with default settings. "runout" is the relative change of the mean runout.
    """

    kind: str
    name: str
    summary: str
    source: str
    confirmed: Confirmed
    parameters: tuple[Parameter, ...]
    cost: dict[str, float] | None


def entries() -> list[CatalogueEntry]:
    """Return all models and effects that a scene may name, by key of the scene, without import of the physics."""
    costs = _costs()
    return [
        _entry(kind, name, model_spec, costs.get(f"{kind}.{name}"))
        for kind, spec in KINDS.items()
        for name, model_spec in _specs_of(spec)
    ]


def _specs_of(spec: type) -> Iterator[tuple[str, type[ModelSpec]]]:
    """Yield name and class of each model or effect under a key of the scene, except classes of users."""
    for name, field in spec.model_fields.items():  # type: ignore[attr-defined]
        if field.alias != OWN:
            yield name, next(kind for kind in get_args(field.annotation) if kind is not NoneType)


def _entry(kind: str, name: str, model_spec: type[ModelSpec], cost: dict[str, float] | None) -> CatalogueEntry:
    parameters = tuple(_parameter(key, field, model_spec) for key, field in model_spec.model_fields.items())
    summary = " ".join((model_spec.__doc__ or "").split())
    return CatalogueEntry(
        kind=kind,
        name=name,
        summary=summary,
        source=model_spec.SOURCE,
        confirmed=model_spec.CONFIRMED,
        parameters=parameters,
        cost=cost,
    )


def _parameter(name: str, field: FieldInfo, model_spec: type[ModelSpec]) -> Parameter:
    """Return the description of a parameter from its field in a model; a missing source is taken from the model."""
    facts: Any = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    default = field.get_default(call_default_factory=True)
    return Parameter(
        name=name,
        meaning=field.description or "",
        unit=facts.get("unit", ""),
        default=None if default is PydanticUndefined else default,
        required=field.is_required(),
        bounds=", ".join(_bounds(field)),
        source=facts.get("source") or model_spec.SOURCE,
        confirmed=facts.get("confirmed", model_spec.CONFIRMED),
    )


def _bounds(field: FieldInfo) -> Iterator[str]:
    for each in field.metadata:
        for kind, words in WORDS.items():
            if getattr(each, kind, None) is not None:
                yield words.format(getattr(each, kind))


def _costs() -> dict[str, dict[str, float]]:
    """Return the measured costs of models and effects, by `<key>.<name>` such as `effects.drag`; {} without the file.

    A cost is as in `CatalogueEntry.cost`. The file is part of the package.
    """
    file = resources.files("rpf3d_core").joinpath(COSTS)
    return json.loads(file.read_text()) if file.is_file() else {}
