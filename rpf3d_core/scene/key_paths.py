"""Give new values to keys of a scene, named by key paths such as `materials.gray.friction`; check the new scene.

A key path has the keys of the scene file with dots between them. `*` stands for all keys of a mapping, so
`materials.*.friction` is one value for all materials. An item of a list has its number, from 0, or its name. The key of
a user's own class is its import path, as in `effects.stones.Stones.tilt_deg`.
"""

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from pydantic import BaseModel, ValidationError

from rpf3d_core.errors import SceneError
from rpf3d_core.formats.yaml import Document
from rpf3d_core.scene.faults import NOT_SCENE_KEYS, faults_of, nearest_key
from rpf3d_core.scene.library import LIBRARY, keys_of_entry, models_of, ranges_of
from rpf3d_core.scene.material import POINT_KEYS, Material
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.keys import EffectsSpec, ReboundSpec
from rpf3d_core.scene.models.own import OWN
from rpf3d_core.scene.values import StrictModel

ALL = "*"
"""Key that stands for all keys of a mapping."""

Steps = tuple[str | int, ...]
"""The keys and list numbers that lead from a scene to one of its values."""


def with_values(scene: Scene, values: Mapping[str, Any]) -> Scene:
    """Return a scene with other values at some key paths, after all checks of a scene file.

    A replaced value loses its prior, because the value is now known. A material with a new library entry loses the
    coefficients and priors that it took from the old entry.

    values : new values by key path, in the scene's units. If two key paths lead to the same value, a key path without
        `*` overrides a key path with `*`; without values, the same scene is returned

    Raises
    ------
    SceneError
        A key path leads to no value of the scene, a value is refused, or `values` has both a section and a value in
        this section. The message names the path.
    """
    changes: dict[str, Any] = {}
    for path in sorted(values, key=lambda path: ALL not in path.split(".")):
        for steps in reversed(steps_to(scene, path)):
            if not _put(changes, steps, values[path]):
                raise SceneError(f"{scene.path}: the key path `{path}` and one above or below it both have a value; "
                                 "remove one")  # fmt: skip
    if not changes:
        return scene
    scene = _without_priors_of(_without_entries(scene, changes), changes)
    try:
        return Scene.model_validate(_merged(scene, changes), context={"folder": scene.path.parent})
    except ValidationError as error:
        document = Document(values=_plain(_merged(scene, changes)), lines={}, faults=[])
        sentences = {fault.sentence for fault in faults_of(error.errors(), document)}
        raise SceneError("\n".join(f"{scene.path}: {sentence}" for sentence in sorted(sentences))) from None


def _without_entries(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """Return the scene without the coefficients of old library entries, if the changes name a new entry.

    In a material with a new entry, the numbers of the old entry count as not given, and the priors of the old entry are
    removed. A prior stays if the new entry has a range for the same coefficient; the new range replaces the prior
    later. The priors then have the same order as in a scene file with the new entry.

    changes : new values, in nested dictionaries with the keys of the scene and a `_Value` at each end
    """
    of_materials = changes.get("materials", {})
    if isinstance(of_materials, _Value):
        return scene
    materials, models = dict(scene.materials), models_of(scene)
    priors = {} if scene.unknowns is None else dict(scene.unknowns.priors)
    for name, inner in of_materials.items():
        if isinstance(inner, _Value) or LIBRARY not in inner or materials[name].library is None:
            continue
        keys = keys_of_entry(materials[name], name, priors, models)
        materials[name] = materials[name].model_copy()
        materials[name].model_fields_set.difference_update(keys)
        for key in keys.difference(ranges_of(inner[LIBRARY].value, models)):
            priors.pop(f"materials.{name}.{key}", None)
    unknowns = scene.unknowns and scene.unknowns.model_copy(update={"priors": priors})
    return scene.model_copy(update={"materials": materials, "unknowns": unknowns})


def _without_priors_of(scene: Scene, changes: Mapping[str, Any]) -> Scene:
    """Return the scene without the priors of values that the changes replace, because the new values are known.

    A prior stays if it also belongs to values that are not replaced.

    changes : new values, in nested dictionaries with the keys of the scene and a `_Value` at each end
    """
    if scene.unknowns is None or not scene.unknowns.priors:
        return scene
    left = {
        path: prior
        for path, prior in scene.unknowns.priors.items()
        if not all(_is_changed(changes, steps) for steps in steps_to(scene, path))
    }
    return scene.model_copy(update={"unknowns": scene.unknowns.model_copy(update={"priors": left})})


def _is_changed(changes: Any, steps: Steps) -> bool:
    """Return True if a tree of changes replaces the value of a scene at some steps, or a section that contains it.

    changes : new values, in nested dictionaries with the keys of the scene and a `_Value` at each end
    steps : the keys and indices that lead to the value
    """
    for step in steps:
        if isinstance(changes, _Value) or step not in changes:
            break
        changes = changes[step]
    return isinstance(changes, _Value)


def steps_to(scene: Scene, path: str) -> list[Steps]:
    """Return the places in a scene that a key path stands for: one, or several if the path has `*`.

    Raises
    ------
    SceneError
        The key path leads to no value of the scene. The message names the missing key, and the existing keys if there
        are any.
    """
    found = list(_walk(scene, scene, path, path, ()))
    if not found:
        raise SceneError(f"{scene.path}: the key path `{path}` stands for no value of this scene")
    return found


def _walk(scene: Scene, part: Any, rest: str, path: str, before: Steps) -> Iterator[Steps]:
    """Yield the places in a scene that a key path stands for, each as steps: the keys and indices that lead there.

    part : the part of the scene at the steps `before`; rest : the rest of the key path, below this part
    path : the whole key path, for messages

    Raises
    ------
    SceneError
        The key path leads to no value of the scene.
    """
    if not rest:
        yield before
        return
    keys = _keys(part)
    first, _, others = rest.partition(".")
    if first == ALL and isinstance(part, Mapping):
        for key in part:
            yield from _walk(scene, part[key], others, path, (*before, key))
        return
    fitting = [key for key in keys if rest == key or rest.startswith(f"{key}.")]
    if not fitting:
        advice = _whole_path(scene, path) or _on_terrain(scene, path)
        raise SceneError(f"{scene.path}: {_refusal(part, first, path, keys)}{advice}")
    key = max(fitting, key=len)  # names of zones may have dots
    steps, inner = keys[key]
    yield from _walk(scene, inner, rest[len(key) + 1 :], path, (*before, *steps))


def _keys(part: Any) -> dict[str, tuple[Steps, Any]]:
    """Return, for each key below a part of a scene, the steps that lead to its value, and the value.

    The result is {} for a single value.
    """
    if isinstance(part, BaseModel):
        listed = type(part).model_fields.items()
        names = [name for name, field in listed if name not in NOT_SCENE_KEYS and field.alias != OWN]
        return {name: ((name,), getattr(part, name)) for name in names} | _keys_of_own_classes(part)
    if is_dataclass(part) and not isinstance(part, type):
        return {field.name: ((field.name,), getattr(part, field.name)) for field in fields(part)}
    if isinstance(part, Mapping):
        return {str(key): ((key,), value) for key, value in part.items()}
    if isinstance(part, tuple):
        numbers: dict[str, tuple[Steps, Any]] = {str(i): ((i,), item) for i, item in enumerate(part)}
        return numbers | {item.name: ((i,), item) for i, item in enumerate(part) if hasattr(item, "name")}
    return {}


def _keys_of_own_classes(part: BaseModel) -> dict[str, tuple[Steps, Any]]:
    """Return, for the import path of each class of a user, the steps that lead to its parameters, and the parameters.

    Parameters that the scene does not state are left out. The result is {} for sections other than `rebound` and
    `effects`.
    """
    if isinstance(part, EffectsSpec):
        return {own.path: (("own", i, "values"), own.values) for i, own in enumerate(part.own)}
    if isinstance(part, ReboundSpec) and part.own is not None:
        return {part.own.path: (("own", "values"), part.own.values)}
    return {}


def _refusal(part: Any, key: str, path: str, keys: Mapping[str, Any]) -> str:
    """Return why a key path leads nowhere, as a sentence.

    part : the last part of the scene that the path reaches; key : the key that is missing there
    path : the whole key path; keys : the existing keys
    """
    if not keys:
        what = "nothing is given there" if part is None else f"there is {part!r}"
        return f"the key path `{path}` leads to no value: above `{key}` {what}"
    near = nearest_key(key, list(keys))
    advice = f"; did you mean `{near}`?" if near else ""
    return f"the key path `{path}` leads to no value: `{key}` is not one of {', '.join(keys)}{advice}"


def _whole_path(scene: Scene, path: str) -> str:
    """Return the end of a message that suggests the full key path for a single key, such as `terrain.benches.berm`.

    The result is "" if several key paths of the scene, or none, end with this key, or if the path is not a single key.

    path : the key path as the user wrote it, such as `berm`
    """
    meant = [key for key in _paths_below(scene) if key.rpartition(".")[2] == path]
    return f"; did you mean `{meant[0]}`?" if "." not in path and len(meant) == 1 else ""


def _paths_below(part: Any, above: str = "") -> Iterator[str]:
    """Yield all key paths below a part of a scene, except those in lists and mappings.

    above : the key path of the part, with a dot at its end; "" for the whole scene
    """
    if isinstance(part, BaseModel) or is_dataclass(part):
        for key, (_, inner) in _keys(part).items():
            yield f"{above}{key}"
            yield from _paths_below(inner, f"{above}{key}.")


def _on_terrain(scene: Scene, path: str) -> str:
    """Return the end of a message on a key of a synthetic terrain if the terrain is from files; "" for other keys."""
    section = ".".join(path.split(".")[:2])
    if scene.terrain.files is None or section not in ("terrain.benches", "terrain.pit"):
        return ""
    return f"; the terrain is read from files, and this key needs `{section}`"


def _put(changes: Any, steps: Steps, value: Any) -> bool:
    """Add a new value of a scene to a tree of changes; return False if the value cannot be added.

    The value cannot be added if the tree already has a new value for a section that contains this value, or for a part
    of this value.

    A tree of changes is nested dictionaries with the keys and indices of the scene, and with a `_Value` at each end.
    steps : the keys and indices that lead to the value
    """
    for step in steps[:-1]:
        if isinstance(changes, _Value):
            return False
        changes = changes.setdefault(step, {})
    if isinstance(changes, _Value) or not isinstance(changes.get(steps[-1], _Value(None)), _Value):
        return False
    changes[steps[-1]] = _Value(value)
    return True


class _Value:
    """A new value of a scene, at an end of a tree of changes."""

    def __init__(self, value: Any) -> None:
        self.value = value


def _merged(part: Any, changes: Any) -> Any:
    """Return a part of a scene with the new values of a tree of changes, as nested values that `Scene` can validate.

    Sections without a change stay objects.

    changes : new values of this part, in nested dictionaries with the keys of the scene and a `_Value` at each end
    """
    if isinstance(changes, _Value):
        return changes.value
    if isinstance(part, BaseModel):
        given = {_alias(part, name): getattr(part, name) for name in _given(part)}
        return given | {_alias(part, key): _merged(getattr(part, key), inner) for key, inner in changes.items()}
    if is_dataclass(part) and not isinstance(part, type):
        given = {field.name: getattr(part, field.name) for field in fields(part)}
        return given | {key: _merged(given[key], inner) for key, inner in changes.items()}
    if isinstance(part, Mapping):
        return {key: _merged(value, changes[key]) if key in changes else value for key, value in part.items()}
    return tuple(_merged(item, changes[i]) if i in changes else item for i, item in enumerate(part))


def _given(part: BaseModel) -> list[str]:
    """Return the fields of a section that the scene file states; all other fields have their defaults.

    For a material of bodies, the coefficients of points are left out, because the check of a material fills them in.
    """
    names = [name for name in type(part).model_fields if name in part.model_fields_set]
    if isinstance(part, Material) and part.is_of_a_body:
        return [name for name in names if name not in POINT_KEYS]
    return names


def _alias(part: BaseModel, name: str) -> str:
    """Return the key under which pydantic reads a field: the field's alias, or its name if it has no alias."""
    return type(part).model_fields[name].alias or name


def _plain(value: Any) -> Any:
    """Return a part of a scene as nested mappings and tuples without objects, so that messages can quote its values."""
    if isinstance(value, StrictModel):
        return value.model_dump(by_alias=True)
    if isinstance(value, Mapping):
        return {key: _plain(item) for key, item in value.items()}
    return tuple(_plain(item) for item in value) if isinstance(value, tuple) else value


def given_keys(section: BaseModel, above: Steps = ()) -> Iterator[str]:
    """Yield the key paths of the sections and values that a scene file states, for the whole scene or one section.

    Keys that the file does not state are left out. The parameters of a synthetic terrain are not listed one by one.

    section : the scene or the section; above : the keys that lead to the section; an item of a list has its number,
        from 0
    """
    for name in _given(section):
        if not above and name in NOT_SCENE_KEYS:
            continue
        yield ".".join(map(str, (*above, name)))
        yield from _given_below(getattr(section, name), (*above, name))


def _given_below(value: Any, above: Steps) -> Iterator[str]:
    """Yield the key paths of the stated values below a value of a scene; above : the keys that lead to the value."""
    if isinstance(value, BaseModel):
        yield from given_keys(value, above)
    elif isinstance(value, Mapping | list | tuple):
        for key, item in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _given_below(item, (*above, key))
