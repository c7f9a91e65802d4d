"""List the fields of a scene for programs that offer them in another form, such as ROS parameters."""

import types
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Tag
from pydantic.fields import FieldInfo

from rpf3d_core.scene.draws import NUMBER
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import EffectsSpec, OneOf
from rpf3d_core.scene.models.own import OWN
from rpf3d_core.scene.models.spec import ModelSpec

SCALARS: tuple[type, ...] = (bool, int, float, str)
BOUNDS = ("ge", "gt", "le", "lt")
ANY_ZONE = "default"
"""Key of a mapping of zones for all zones that the mapping does not name."""


@dataclass(frozen=True)
class SceneField:
    """One field of a scene, described for a program that offers the field in another form, such as a ROS parameter.

    key : key in the scene file, with dots; in a mapping with names of the user, such as zones, the key below `default`
    kind : bool, int, float or str; None if the field, or a required parameter of the effect that it names, takes a
        list, a file or a mapping with names of the user
    default : default value; None if the field is required or the default is not a bool, int, float or str
    description : valid values and meaning in words
    choices : valid values of a str or an int, () if all values are valid
    bounds : bounds of a number, by pydantic's names ge, gt, le, lt
    within : key of the model, effect or optional section that contains the field; "" if the section always exists
    names : True if the field names a model (str) or an effect (bool), whose parameters are the fields below its key
    """

    key: str
    kind: type | None
    default: Any
    description: str
    choices: tuple[Any, ...] = ()
    bounds: Mapping[str, float] | None = None
    within: str = ""
    names: bool = False


def scene_fields() -> Iterator[SceneField]:
    """Yield every field of a scene that takes a value or names a model or effect, in the order of the scene model."""
    yield from _fields(Scene, "", "")


def _fields(model: type[BaseModel], above: str, within: str) -> Iterator[SceneField]:
    for name, field in model.model_fields.items():
        key = f"{above}{field.alias if field.alias == OWN else name}"
        part = _part(field.annotation)
        if part is None:
            yield _leaf(key, field, within)
        elif issubclass(part, OneOf):
            yield _choice(key, field, part)
            yield from _fields(part, f"{key}.", within)
        elif issubclass(part, ModelSpec):
            if model is EffectsSpec:
                yield _effect(key, field, part)
            yield from _fields(part, f"{key}.", key)
        else:
            each = f"{key}.{ANY_ZONE}." if _is_mapping(field.annotation) else f"{key}."
            yield from _fields(part, each, within or (key if _may_be_left_out(field) else ""))


def _leaf(key: str, field: FieldInfo, within: str) -> SceneField:
    """Return the description of a field that takes a value: a field that neither contains a section nor names a model.

    key : key of the field in the scene file, with dots; field : its pydantic field
    within : key of the model, effect or optional section that contains the field; "" if the section always exists
    """
    kind, choices, bounds = _scalar(field.annotation, field.metadata)
    default = field.get_default(call_default_factory=False) if not field.is_required() else None
    known = default if isinstance(default, SCALARS) else None
    return SceneField(
        key=key,
        kind=kind,
        default=known,
        description=field.description or "",
        choices=choices,
        bounds=bounds,
        within=within,
    )


def _choice(key: str, field: FieldInfo, part: type[OneOf]) -> SceneField:
    """Return the description of a field that names one of several models.

    key : key of the field in the scene file, with dots; field : its pydantic field; part : class of the choice
    """
    default = field.get_default(call_default_factory=True)
    names = tuple(name for name, each in part.model_fields.items() if each.alias != OWN and _is_nameable(each))
    return SceneField(
        key=key,
        kind=str,
        default=default and default.name,
        description=f"one of {', '.join(names)}",
        choices=names,
        names=True,
    )


def _effect(key: str, field: FieldInfo, model_spec: type[ModelSpec]) -> SceneField:
    """Return the description of the field of an effect: true names the effect, with all its defaults.

    key : key of the field in the scene file, with dots; field : its pydantic field; model_spec : class of the effect
    """
    kind = bool if _is_nameable(field) else None
    summary = " ".join((model_spec.__doc__ or "").split())
    return SceneField(
        key=key, kind=kind, default=None, description=f"true names the effect: {summary}", within=key, names=True
    )


def _is_nameable(field: FieldInfo) -> bool:
    """Return True if a name and single values can state a model or effect: no required parameter is a list or file."""
    model_spec = _part(field.annotation)
    assert model_spec is not None
    required = [each for each in model_spec.model_fields.values() if each.is_required()]
    return all(_scalar(each.annotation, each.metadata)[0] is not None for each in required)


def _part(annotation: Any) -> type[BaseModel] | None:
    """Return the pydantic model of a field that contains a section; None if the field contains a value.

    The section may be required or optional. For a mapping with one section for each zone, return the pydantic model of
    these sections.
    """
    several = [get_args(annotation)[1]] if _is_mapping(annotation) else _alternatives(annotation)
    found, _ = _unwrapped(several[0]) if len(several) == 1 else (None, [])
    return found if isinstance(found, type) and issubclass(found, BaseModel) else None


def _is_mapping(annotation: Any) -> bool:
    return get_origin(annotation) is Mapping


def _may_be_left_out(field: FieldInfo) -> bool:
    return not field.is_required() and field.get_default(call_default_factory=True) is None


def _alternatives(annotation: Any) -> list[Any]:
    """Return the types that a union allows, without None; for any other type, a list of this type only."""
    bare, _ = _unwrapped(annotation)
    if get_origin(bare) in (Union, types.UnionType):
        return [item for item in get_args(bare) if item is not types.NoneType]
    return [annotation]


def _scalar(annotation: Any, metadata: list[Any]) -> tuple[type | None, tuple[Any, ...], dict[str, float]]:
    """Return type, choices and bounds of a field that takes one number, text or truth value.

    If the field also takes a distribution, the result describes the number. If the field takes no single value, the
    result is None, (), {}.

    annotation, metadata : type of the field, and its annotations, in which pydantic keeps the bounds
    """
    several = _alternatives(annotation)
    if len(several) == 1 and len(_alternatives(several[0])) > 1:
        several = _alternatives(several[0])
    if len(several) > 1:  # the field takes a number or a distribution
        several = [item for item in several if Tag(NUMBER) in getattr(item, "__metadata__", ())]
    if len(several) != 1:
        return None, (), {}
    bare, further = _unwrapped(several[0])
    if get_origin(bare) is Literal:
        choices = get_args(bare)
        return type(choices[0]), choices, {}
    if bare not in SCALARS:
        return None, (), {}
    return bare, (), _bounds([*metadata, *further])


def _unwrapped(annotation: Any) -> tuple[Any, list[Any]]:
    """Return a type without its annotations, and the annotations in a list."""
    if get_origin(annotation) is not Annotated:
        return annotation, []
    inner, *own = get_args(annotation)
    bare, further = _unwrapped(inner)
    return bare, [*further, *own]


def _bounds(metadata: list[Any]) -> dict[str, float]:
    found: dict[str, float] = {}
    for each in metadata:
        for fact in each.metadata if isinstance(each, FieldInfo) else [each]:
            found.update({name: getattr(fact, name) for name in BOUNDS if getattr(fact, name, None) is not None})
    return found
