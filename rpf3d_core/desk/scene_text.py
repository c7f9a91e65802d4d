"""Edit the text of a scene file, and keep its comments, its order of keys and the way its values are written.

All functions take a text that `scene_of_text` accepts, and return a new text. The text is written again as a whole:
long lines are not broken, lists are indented by two blanks, and blanks that align comments may change.
"""

import io
from collections.abc import Mapping, Sequence
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_core.formats.extras import library_of

SOURCES, AREAS, MATERIALS = "sources", "areas_of_interest", "materials"
LONGEST_LINE = 100_000
"""Characters up to which a line stays one line."""


def with_item(text: str, key: str, item: Mapping[str, Any]) -> str:
    """Return the text with one more item at the end of a list of the scene, such as a source in SOURCES."""
    yaml, scene = _read(text)
    if scene.get(key) is None:
        scene[key] = []
    scene[key].append(_as_written(item))
    return _written(yaml, scene)


def without_item(text: str, key: str, name: str) -> str:
    """Return the text without the item of a name in a list of the scene; the whole key if the list is then empty.

    Raises
    ------
    InputError
        There is no such item, or it is the last source, which a scene needs.
    """
    yaml, scene = _read(text)
    names = [item.get("name") for item in scene.get(key) or ()]
    if name not in names:
        raise InputError(f"`{key}` has no {name!r}")
    if key == SOURCES and len(names) == 1:
        raise InputError(f"{name!r} is the only source; a scene needs one, so place another source first")
    if len(names) == 1:
        del scene[key]
    else:
        del scene[key][names.index(name)]
    return _written(yaml, scene)


def with_value(text: str, path: Sequence[str], value: Any) -> str:
    """Return the text with another value at a path of keys, such as ("materials", "rock", "friction_angle_deg").

    Mappings on the path that are missing are added.
    """
    yaml, scene = _read(text)
    part = scene
    for key in path[:-1]:
        if not isinstance(part.get(key), dict):
            part[key] = {}
        part = part[key]
    part[path[-1]] = _as_written(value)
    return _written(yaml, scene)


def without_value(text: str, path: Sequence[str]) -> str:
    """Return the text without a key, so that its default holds; unchanged if the key is not there."""
    yaml, scene = _read(text)
    part: Any = scene
    for key in path[:-1]:
        part = part.get(key) if isinstance(part, dict) else None
    if not isinstance(part, dict) or path[-1] not in part:
        return text
    del part[path[-1]]
    return _written(yaml, scene)


def free_name(taken: Sequence[str], stem: str) -> str:
    """Return the first of stem_1, stem_2, ... that is not taken."""
    return next(name for n in range(1, len(taken) + 2) if (name := f"{stem}_{n}") not in taken)


def _read(text: str) -> tuple[Any, Any]:
    """Return a reader that keeps comments, and the scene as it reads it."""
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
    """Return plain values with the style in which they are written: lists of numbers and small mappings on one line."""
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
