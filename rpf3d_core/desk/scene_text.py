"""Edit the text of a scene file, and keep its comments, its order of keys and the form of its values.

The functions expect a text that `scene_of_text` accepts, and return a new text. The whole text is written again: long
lines are not broken, lists are indented by two blanks, and blanks that align comments may change.
An edit that would also change another value is refused, for example if the value has an anchor (&name) and an alias.
"""

import io
from collections.abc import Callable, Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_core.formats.extras import library_of
from rpf3d_core.formats.yaml import KeyPath, key_name, parse_yaml

SOURCES, AREAS, MATERIALS = "sources", "areas_of_interest", "materials"
MISSING = object()
"""Placeholder for a missing value in a comparison of two trees of values."""
LONGEST_LINE = 100_000
"""Largest length of a line (characters), so that no line is broken."""


def with_item(text: str, key: str, item: Mapping[str, Any]) -> str:
    """Return the text with one more item at the end of a list of the scene; key : of the list, such as SOURCES."""

    def edit(scene: Any) -> None:
        if scene.get(key) is None:
            scene[key] = []
        scene[key].append(_as_written(item))

    return _edited(text, edit)


def without_item(text: str, key: str, name: str) -> str:
    """Return the text without the named item of a list of the scene; a list that becomes empty is removed with its key.

    Raises
    ------
    InputError
        There is no such item, or it is the last source, which a scene needs.
    """

    def edit(scene: Any) -> None:
        names = [str(item.get("name")) for item in scene.get(key) or ()]
        if name not in names:
            raise InputError(f"`{key}` has no {name!r}")
        if key == SOURCES and len(names) == 1:
            raise InputError(f"{name!r} is the only source; a scene needs one, so place another source first")
        if len(names) == 1:
            del scene[key]
        else:
            del scene[key][names.index(name)]

    return _edited(text, edit)


def with_value(text: str, path: Sequence[str], value: Any) -> str:
    """Return the text with a new value at a path of keys, such as ("materials", "rock", "friction_angle_deg").

    A mapping that is missing on the path is added; a value on the path that is not a mapping is replaced by a mapping.
    """

    def edit(scene: Any) -> None:
        part = scene
        for key in path[:-1]:
            if not isinstance(part.get(key), dict):
                part[key] = {}
            part = part[key]
        part[path[-1]] = _as_written(value)

    return _edited(text, edit)


def without_value(text: str, path: Sequence[str]) -> str:
    """Return the text without a key, so that the default of the key is used; unchanged if the key is missing.

    path : the keys that lead to this key, with this key at the end
    """

    def parent(scene: Any) -> Any:
        for key in path[:-1]:
            scene = scene.get(key) if isinstance(scene, dict) else None
        return scene if isinstance(scene, dict) and path[-1] in scene else None

    if parent(_read(text)[1]) is None:
        return text
    return _edited(text, lambda scene: parent(scene).pop(path[-1]))


def free_name(taken: Sequence[str], stem: str) -> str:
    """Return the first of the names stem_1, stem_2, ... that is not in `taken`."""
    return next(name for n in range(1, len(taken) + 2) if (name := f"{stem}_{n}") not in taken)


def _edited(text: str, edit: Callable[[Any], object]) -> str:
    """Return the text of a scene after an edit.

    As a check, the edit is also made on a copy of the scene's plain values, and the new text must have equal values.

    edit : function that changes a tree of values

    Raises
    ------
    InputError
        The edit is refused, or it would also change other values.
    """
    yaml, scene = _read(text)
    wanted = _values_of(text)
    edit(wanted)
    edit(scene)
    changed = _written(yaml, scene)
    other = _first_difference(_values_of(changed), _plain(wanted), ())
    if other is not None:
        raise InputError(
            f"this edit would also change `{key_name(other)}`; the file may repeat a value with an anchor (&name), so "
            "write its values out in the file, and start the desk again"
        )
    return changed


def _values_of(text: str) -> Any:
    """Return the plain values of a scene's text; each alias becomes a copy of its value."""
    return _plain(parse_yaml(text, Path("scene.yaml")).values)


def _plain(value: Any) -> Any:
    """Return a tree of values as plain dicts and lists."""
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value


def _first_difference(one: Any, other: Any, path: KeyPath) -> KeyPath | None:
    """Return the key path of the first value that differs between two trees of values; None if the trees are equal.

    path : key path that leads to the two trees; () for whole scenes
    """
    if isinstance(one, dict) and isinstance(other, dict):
        items = [(key, one.get(key, MISSING), other.get(key, MISSING)) for key in {**one, **other}]
    elif isinstance(one, list) and isinstance(other, list):
        items = [(number, *pair) for number, pair in enumerate(zip_longest(one, other, fillvalue=MISSING))]
    else:
        return None if one == other and isinstance(one, bool) == isinstance(other, bool) else path
    found = (_first_difference(first, second, (*path, key)) for key, first, second in items)
    return next((each for each in found if each is not None), None)


def _read(text: str) -> tuple[Any, Any]:
    """Return a YAML reader that keeps comments, and the tree of values that it reads from a text."""
    yaml = library_of("desk", "ruamel.yaml", "the desk needs").YAML()
    yaml.preserve_quotes = True
    yaml.width = LONGEST_LINE
    yaml.indent(mapping=2, sequence=4, offset=2)
    return yaml, yaml.load(text)


def _written(yaml: Any, scene: Any) -> str:
    out = io.StringIO()
    yaml.dump(scene, out)
    return out.getvalue()


def _as_written(value: Any) -> Any:
    """Return a value as ruamel.yaml collections: lists of numbers, and mappings without lists, are written on one line.

    value : mappings, lists and scalars, nested; scalars are returned unchanged
    """
    comments = library_of("desk", "ruamel.yaml.comments", "the desk needs")
    if isinstance(value, Mapping):
        found = comments.CommentedMap((key, _as_written(item)) for key, item in value.items())
        if all(not isinstance(item, list | tuple) for item in value.values()):
            found.fa.set_flow_style()
        return found
    if isinstance(value, list | tuple):
        found = comments.CommentedSeq(_as_written(item) for item in value)
        if all(isinstance(item, int | float) for item in value):
            found.fa.set_flow_style()
        return found
    return value
