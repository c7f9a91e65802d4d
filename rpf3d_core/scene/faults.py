"""Describe the errors of a scene file as sentences: line, key, wrong value and valid values.

Pydantic finds the errors. In all functions, `root` is the pydantic model that checks the file; with None, the file is
a scene.
"""

import difflib
import json
import re
import types
from collections.abc import Iterator, Sequence
from dataclasses import is_dataclass
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel
from pydantic_core import ErrorDetails

from rpf3d_core.formats.yaml import Document, Fault, KeyPath, key_name
from rpf3d_core.scene.draws import MARKS
from rpf3d_core.scene.hazard import HazardSpec
from rpf3d_core.scene.material import Material
from rpf3d_core.scene.meanings import keys_meant
from rpf3d_core.scene.model import OutputSpec, Scene
from rpf3d_core.scene.models.own import OWN
from rpf3d_core.scene.releases import RockSpec, SourceSpec
from rpf3d_core.scene.terrain import TerrainSpec
from rpf3d_core.scene.values import ROCKS_MARKS

LONGEST_VALUE = 60
"""Largest number of characters of a wrong value that a message quotes."""

PYDANTIC_MARKS = ("[key]", "[file]", "[numbers]", "[corners]", OWN, *ROCKS_MARKS, *MARKS)
"""Marks that pydantic adds to a key path; they are removed before messages show the path.

They stand for the key of a mapping, or for the chosen type of a union.
"""

PLACES = {"[x, y, z]": "three numbers [x, y, z] (m)", "[x, y]": "two numbers [x, y] (m)"}
"""Words for one point of a list, by the form of a point, such as `[x, y]`, in the description of the list.

A message about a wrong point shows these words.
"""
ELSEWHERE = {"berm": "terrain.berms", "berms": "terrain.berms"}
"""Right key path in the scene, by wrong key, for keys that users write below `effects` by mistake."""

SECTIONS: dict[str, type[BaseModel]] = {
    "materials.ZONE": Material, "rock": RockSpec, "terrain": TerrainSpec, "sources[0]": SourceSpec,
    "hazard": HazardSpec, "outputs": OutputSpec,
}  # fmt: skip
"""Sections of a scene whose keys users write at the top level by mistake, by key path."""
MISSPELT = 0.85
"""Least similarity (-), from 0 to 1, of a wrong key to a known key from which the wrong key counts as a misspelling.

A misspelling is preferred to another known key with the same meaning as the wrong key.
"""

SHARE, DISTRIBUTION = "a number from 0 to 1 (", "or a distribution"
"""Parts of a description of valid values that show that a value is a share, or may be a distribution."""
RANGE = re.compile(r"([\d.]+)\s*(?:to|-|\.\.)\s*([\d.]+)")
PERCENT = re.compile(r"(\d+(?:\.\d+)?)\s*(%?)")
LEAST_PERCENT = 5.0
"""Smallest number without a percent sign that is probably a percentage where a share is needed; 1.5 is not."""
UNKNOWN_KEY = ("extra_forbidden", "unexpected_keyword_argument")
NOT_SCENE_KEYS = ("path",)
"""Fields of `Scene` that are not keys of the scene file."""

Root = type[BaseModel] | None
"""The pydantic model that checks the file; None for a scene."""


def faults_of(details: list[ErrorDetails], document: Document, root: Root = None) -> Iterator[Fault]:
    """Yield each error of a file as a line number and a sentence, without errors that another error causes.

    details : the errors as pydantic states them; document : the file, with the lines of its keys
    """
    paths = [_without_marks(detail["loc"]) for detail in details]
    misspelt = {
        (*path[:-1], _nearest(path, root))
        for path, detail in zip(paths, details, strict=True)
        if detail["type"] in UNKNOWN_KEY
    }
    for path, detail in zip(paths, details, strict=True):
        # Pydantic also reports a list as too short if some items of the list are refused.
        follows = detail["type"] == "too_short" and any(other[: len(path)] == path != other for other in paths)
        if not follows and not (detail["type"] == "missing" and path in misspelt):
            yield _fault(path, detail, document, root)


def unknown_key(path: KeyPath, document: Document, root: Root = None) -> Fault:
    """Return the error for an unknown key of a file, with advice such as the nearest known key."""
    near = _nearest(path, root)
    file = "scene" if root is None else f"{document.kind} file"
    if path[:-1] == ("effects",) and (place := ELSEWHERE.get(str(path[-1]))):
        return Fault(_line(path, document), f"`{key_name(path)}` is not a key of a scene; it belongs in `{place}`")
    if not near and root is None and (place := _section_of(path)):
        sentence = f"`{key_name(path)}` is not a key of the top level; did you mean `{place}`?"
        return Fault(_line(path, document), sentence)
    if near == path[-1]:
        return Fault(_line(path, document), f"`{key_name(path)}` is not allowed with the other keys there; remove it")
    advice = f"did you mean `{near}`?" if near else f"the keys here are {', '.join(_known(path, root))}"
    return Fault(_line(path, document), f"`{key_name(path)}` is not a key of a {file}; {advice}")


def _fault(path: KeyPath, detail: ErrorDetails, document: Document, root: Root) -> Fault:
    kind, context = detail["type"], detail.get("ctx", {})
    if kind in UNKNOWN_KEY:
        return unknown_key(path, document, root)
    if kind == "missing" and not isinstance(path[-1], int):
        sentence = f"`{key_name(path)}` is missing; it must be {_requirement(path, root)}"
        return Fault(_line(path[:-1], document), sentence)
    if "sentence" in context:
        path = (*path, *context["at"])
        sentence = context["sentence"]
    elif kind == "value_error":
        told = _told_in(str(context["error"]), path, root)
        path = told if told in document.lines or not document.lines else path  # not a key that the file does not have
        sentence = f"is refused: {context['error']}"
    else:
        # A missing list item has no value to show: the list is too short.
        path = path[:-1] if kind == "missing" else _whole(path, root)
        sentence = _wrong_value(path, _written(path, document), root)
    return Fault(_line(path, document), f"`{key_name(path)}` {sentence}")


def _told_in(message: str, path: KeyPath, root: Root) -> KeyPath:
    """Return the path of the key that an error message is about.

    The result is the path of a key below `path` if the message names exactly one such key, else `path` itself.
    message : from the check of the section at `path`
    """
    words = re.findall(r"\w+", message)
    named = [key for key in _keys(_annotation(path, root)) if key in words]
    return (*path, named[0]) if len(named) == 1 else path


def _wrong_value(path: KeyPath, value: Any, root: Root) -> str:
    must = f"must be {_requirement(path, root)}"
    if isinstance(value, dict) and _bare(_annotation(path, root)) in (float, int):
        return f"is a mapping, but no distribution can stand here; it {must}"
    return f"is {_shown(value)}, but {must}{_meant(value, must)}"


def _meant(value: Any, must: str) -> str:
    """Return the end of a message on a wrong number: how to write a percentage or a range; "" for other values.

    must : what the value must be, as the message states it
    """
    text = str(value).strip()
    if DISTRIBUTION in must and (ends := RANGE.fullmatch(text)):
        return f"; a range is {{prior: {{min: {ends[1]}, max: {ends[2]}}}}}"
    percent = PERCENT.fullmatch(text)
    if SHARE not in must or not percent:
        return ""
    number = float(percent[1])
    is_meant = number <= 100.0 and (percent[2] or number >= LEAST_PERCENT)
    return f"; {number:g} % is {number / 100.0:g}" if is_meant else ""


def _whole(path: KeyPath, root: Root) -> KeyPath:
    """Return the path of a whole vector if `path` leads to one of its numbers, else `path`.

    Messages show the vector.
    """
    is_component = isinstance(path[-1], int) and _bare(_annotation(path, root)) is float
    return path[:-1] if is_component else path


def _written(path: KeyPath, document: Document) -> Any:
    value = document.values
    for step in path:
        value = value[step]
    return value


def _known(path: KeyPath, root: Root) -> list[str]:
    """Return the keys that would be valid as the last key of a path, for advice in a message."""
    keys = _keys(_annotation(path[:-1], root))
    return keys if path[:-1] else [key for key in keys if key not in NOT_SCENE_KEYS]


def _nearest(path: KeyPath, root: Root) -> str | None:
    """Return the known key that the last key of a path probably means; None if no known key is near."""
    return nearest_key(str(path[-1]), _known(path, root))


def nearest_key(word: str, known: Sequence[str]) -> str | None:
    """Return the known key that a wrong key probably means; None if no known key is near.

    The order of preference is: a key of nearly the same spelling, a key of the same meaning, a key of similar spelling.
    """
    misspelt = difflib.get_close_matches(word, known, n=1, cutoff=MISSPELT)
    similar = difflib.get_close_matches(word, known, n=1)
    found = [*misspelt, *keys_meant(word, known), *similar]
    return found[0] if found else None


def _section_of(path: KeyPath) -> str | None:
    """Return the key path that an unknown key at the top level probably means, such as `rock.mass`; None if unknown.

    For a key that is not at the top level, the result is None.
    """
    word = str(path[-1])
    for section, model in SECTIONS.items():
        keys = list(model.model_fields)
        meant = [word] if word in keys else keys_meant(word, keys)
        if len(path) == 1 and meant and word not in NOT_SCENE_KEYS:
            return f"{section}.{meant[0]}"
    return None


def _shown(value: Any) -> str:
    if isinstance(value, str):
        text = repr(value)
    else:
        text = json.dumps(value, default=str).replace("NaN", "nan").replace("Infinity", "inf")
    return text if len(text) <= LONGEST_VALUE else text[: LONGEST_VALUE - 3] + "..."


def _line(path: KeyPath, document: Document) -> int:
    """Return the line of a key in the file, for a message.

    For a key that the file does not have, return the line of the innermost section on its path that the file has, or 1.
    """
    while path and path not in document.lines:
        path = path[:-1]
    return document.lines.get(path, 1)


def _without_marks(location: tuple[int | str, ...]) -> KeyPath:
    """Return the path of a key as in the scene file, without the names of types that pydantic adds to a path."""
    return tuple(step for step in location if step not in PYDANTIC_MARKS)


def _requirement(path: KeyPath, root: Root) -> str:
    """Return the valid values for a key as a phrase, such as "a number >= 0 (m)".

    The phrase is the description of the innermost described field on the path of the key, "left out" if no field there
    has a description. For a section, the phrase lists the keys of the section. For an item that is itself a list, the
    phrase is about this item: for a point such as "three numbers [x, y, z] (m)", else "a part of" and the description
    of the whole list.
    """
    inner = _bare(_annotation(path, root))
    if _is_record(inner):
        return f"a mapping with the keys {', '.join(_keys(inner))}"
    described = [text for text in _descriptions(path, root) if text]
    if not described:
        return "left out"
    if isinstance(path[-1], int) and get_origin(inner) is tuple:
        return next((words for shape, words in PLACES.items() if shape in described[-1]), f"a part of {described[-1]}")
    return described[-1]


def _descriptions(path: KeyPath, root: Root) -> Iterator[str | None]:
    for depth, step in enumerate(path):
        written = _bare(_annotation(path[:depth], root))
        for record in map(_bare, get_args(written)) if _is_union(written) else (written,):
            if isinstance(record, type) and issubclass(record, BaseModel) and step in record.model_fields:
                yield record.model_fields[str(step)].description
            elif is_dataclass(record):
                yield _kind_of_number(_annotation(path[: depth + 1], root))


def _annotation(path: KeyPath, root: Root) -> Any:
    """Return the type of the value at a key path, from the pydantic model of the file; None for an unknown key."""
    annotation: Any = root or Scene
    for step in path:
        annotation = _inside(_bare(annotation), step)
    return annotation


def _inside(annotation: Any, step: str | int) -> Any:
    if _is_union(annotation):
        return next((found for item in get_args(annotation) if (found := _inside(_bare(item), step))), None)
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        field = annotation.model_fields.get(str(step))
        return field.annotation if field else None
    if is_dataclass(annotation):
        return get_type_hints(annotation).get(str(step))
    values = [item for item in get_args(annotation) if item is not Ellipsis]
    return values[-1] if values else None


def _bare(annotation: Any) -> Any:
    """Return a type without `Annotated` and without `| None`; a union of several types stays a union."""
    if get_origin(annotation) is Annotated:
        return _bare(get_args(annotation)[0])
    if _is_union(annotation):
        items = [item for item in get_args(annotation) if item is not type(None)]
        return _bare(items[0]) if len(items) == 1 else annotation
    return annotation


def _is_union(annotation: Any) -> bool:
    return get_origin(annotation) in (Union, types.UnionType)


def _is_record(annotation: Any) -> bool:
    return is_dataclass(annotation) or (isinstance(annotation, type) and issubclass(annotation, BaseModel))


def _keys(annotation: Any) -> list[str]:
    record = _bare(annotation)
    if _is_union(record):
        return [key for item in get_args(record) for key in _keys(item)]
    if isinstance(record, type) and issubclass(record, BaseModel):
        return list(record.model_fields)
    return list(get_type_hints(record)) if is_dataclass(record) else []


def _kind_of_number(annotation: Any) -> str:
    bare = _bare(annotation)
    if get_origin(bare) is tuple:
        return f"a list of {len(get_args(bare))} numbers"
    return {float: "a number", int: "a whole number", bool: "true or false"}.get(bare, str(bare))
