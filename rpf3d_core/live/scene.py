"""Make the scene of a live simulator from a scene file, or from single parameters named like the keys of such a file.

A live scene is the same `Scene` as the scene of a run. Terrain and sources arrive in messages, so the scene has
placeholders for terrain and sources. If the user gives no default material, the scene has the default material of
thesis table 5-1.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

from rpf3d_core.errors import SceneError
from rpf3d_core.scene.listings.fields import SceneField, scene_fields
from rpf3d_core.scene.material import BODY_KEYS
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_of_values
from rpf3d_core.scene.shapes import KINDS

SCENE = "scene"
"""Name of the parameter that gives the path of a scene file."""

WRITTEN_NOWHERE = Path("parameters")
"""Path that messages name instead of a scene file, if the scene has no file."""

LISTED = "is a list, a file or a mapping, which a parameter cannot hold"
FROM_MESSAGES = "is received in messages"
EXCLUDED: Mapping[str, str] = {
    "path": "is the scene file itself",
    "terrain.files": FROM_MESSAGES,
    "terrain.pit": FROM_MESSAGES,
    "terrain.benches": FROM_MESSAGES,
    "terrain.berms": LISTED,
    "terrain.split": LISTED,
    "terrain.up": "is z in every message (REP 103)",
    "zones": LISTED,
    **dict.fromkeys(
        (f"rock.shape.{key}" for key in (*KINDS[1:], "corners", "weights")),
        "is for runs; live rocks are points or spheres",
    ),
    "contact.rigid": "belongs to rocks with a shape",
    **dict.fromkeys((f"materials.default.{key}" for key in BODY_KEYS), "belongs to rocks with a shape"),
    "materials.default.draw": "is for distributions, which a parameter cannot hold",
    "sources": FROM_MESSAGES,
    "rocks": "cannot be set: a live answer grows until it reaches its target",
    "rebound.angle_table.rows": LISTED,
    "rebound.stochastic_matrix": LISTED,
    "rebound.[own]": "is a user's program, which a parameter may not name",
    "effects.scarring.zones": "is for several zones, but live terrain has only one",
    "effects.drag_layer.polygons": LISTED,
    "effects.forest.file": LISTED,
    "effects.forest.within": LISTED,
    "effects.forest.deflection.frontal": LISTED,
    "effects.forest.deflection.lateral": LISTED,
    "effects.forest.deflection.scratch": LISTED,
    "effects.barriers": LISTED,
    "effects.[own]": "is a user's program, which a parameter may not name",
    "areas_of_interest": LISTED,
    "hazard.reach_levels": LISTED,
    "hazard.matrix.object_width": "belongs to the matrix, which is a mapping",
    "hazard.matrix": LISTED,
    "hazard.passage_per_metre": "is a map of runs; live maps show the reach probability in the cells of the grid",
    "method": "is for comparison with the thesis; live answers are exact",
    "outputs": "is an output of runs; live output has its own parameters",
    "observed": "is for comparison with field observations",
    "unknowns": "has priors and samples, which a parameter cannot hold",
    "calibration": "is for `rpf3d calibrate`",
    "materials.default.library": "names ranges, which a parameter cannot hold",
    "data_hint": "is about missing files",
}
"""Fields of a scene that cannot be given as live parameters, including all fields below them, and the reason.

A scene file may contain these fields, except for the shape of a body and the sizes of single sources.
"""

STAND_INS: Mapping[str, Any] = {
    "terrain": {"pit": {}},
    "sources": [{"name": "sources", "points": [[0.0, 0.0, 0.0]]}],
    "materials": {"default": {"normal_restitution": 0.5, "tangential_restitution": 0.8}},
}


@cache
def live_parameters() -> tuple[SceneField, ...]:
    """Return the fields of a scene that users may give as single parameters, in the order of the reference.

    `SceneField.default` of each result is the value that the scene has if no parameter gives the field; None if the
    scene then has no such field. For a field of a model or an effect, `default` is the value that the field has if a
    scene names this model or effect.
    """
    standard = live_scene({})
    offered = (field for field in scene_fields() if why_excluded(field.key) is None)
    return tuple(replace(field, default=_default(field, standard)) for field in offered)


def live_scene(values: Mapping[str, Any]) -> Scene:
    """Return the scene from parameters such as `rock.diameter`, or from the scene file in the parameter `scene`.

    A parameter below a model or an effect also chooses this model or effect, as in a scene file; `effects.<name>: true`
    chooses an effect with all its defaults.

    Raises
    ------
    SceneError
        A value is refused (one line for each refused value), the scene file is refused or sets a shape of a body or the
        size of a single source, or other parameters are given in addition to `scene`.
    """
    given = {name: value for name, value in values.items() if name != SCENE}
    if values.get(SCENE):
        return _from_file(str(values[SCENE]), given)
    faults = [_fault(name, value) for name, value in given.items()]
    if any(faults):
        raise SceneError("\n".join(fault for fault in faults if fault))
    return scene_of_values(_written(given), WRITTEN_NOWHERE)


def why_excluded(key: str) -> str | None:
    """Return why a field of a scene cannot be given as a live parameter; None if the field can be given.

    key : key path of the field, such as `rock.diameter`
    """
    return next((why for at, why in EXCLUDED.items() if key == at or key.startswith(f"{at}.")), None)


def _from_file(path: str, given: Mapping[str, Any]) -> Scene:
    if given:
        raise SceneError(
            f"parameter `{SCENE}` names a scene file, which has all settings; remove it, or these parameters: "
            f"{', '.join(f'`{name}`' for name in sorted(given))}"
        )
    scene = read_scene(path)
    if scene.rock.is_body:
        raise SceneError(f"{path}: `rock.shape` is for runs; live rocks are points or spheres, so remove it")
    for source in scene.sources:
        if source.size_key is not None:
            raise SceneError(
                f"{path}: source {source.name!r} has a `{source.size_key}`, but live sources are received in messages "
                f"without it; set `rock.{source.size_key}`, the size of all live rocks"
            )
    return scene


def _fault(name: str, value: Any) -> str | None:
    """Return a sentence if the name of a parameter is wrong, or if its value names a model that does not exist.

    The result is None without an error. All other values are checked later, when the scene is built.
    """
    known = {field.key: field for field in live_parameters()} if name else {}
    if name not in known:
        return f"parameter `{name}` {_no_parameter(name, known)}"
    field = known[name]
    if field.names and field.choices and value not in field.choices:
        *others, last = field.choices
        return (
            f"parameter `{name}` is {value!r}, but must be {', '.join(others)} or {last}; "
            f"any other model needs a scene file (parameter `{SCENE}`)"
        )
    return None


def _no_parameter(name: str, known: Iterable[str]) -> str:
    why = why_excluded(name)
    if why is not None:
        return f"{why}; a scene file may give it (parameter `{SCENE}`)"
    near = get_close_matches(name, list(known), n=1)
    return f"is not a key of a scene; did you mean `{near[0]}`?" if near else "is not a key of a scene"


def _written(given: Mapping[str, Any]) -> dict[str, Any]:
    """Return values with dotted names such as `rock.diameter` nested as in a scene file, with placeholders added.

    Raise a SceneError if a parameter belongs to an effect that another parameter sets to false.
    """
    scene: dict[str, Any] = {key: _copied(value) for key, value in STAND_INS.items()}
    naming = {field.key for field in live_parameters() if field.names} if given else set()
    for name in sorted(given, key=lambda key: key not in naming):  # models and effects before their parameters
        *above, last = name.split(".")
        if name not in naming:
            _at(scene, above)[last] = given[name]
        elif given[name] is not False:
            _at(scene, above)[last] = {} if given[name] is True else {given[name]: {}}
    _refuse_parameters_of_what_is_switched_off(given, naming)
    return scene


def _refuse_parameters_of_what_is_switched_off(given: Mapping[str, Any], naming: set[str]) -> None:
    for effect in (name for name in given if name in naming and given[name] is False):
        below = [name for name in given if name.startswith(f"{effect}.")]
        if below:
            raise SceneError(f"parameter `{effect}` is false, but `{below[0]}` is set; remove one of them")


def _at(scene: dict[str, Any], path: list[str]) -> dict[str, Any]:
    for step in path:
        scene = scene.setdefault(step, {})
    return scene


def _copied(value: Any) -> Any:
    return {key: _copied(item) for key, item in value.items()} if isinstance(value, Mapping) else value


def _default(field: SceneField, standard: Scene) -> Any:
    """Return the value that a field has if no parameter gives it.

    For a field of a model or effect, this is the default of the field. For any other field, it is the value in
    `standard`, the scene without parameters.
    """
    if field.within or field.names:
        return field.default
    value: Any = standard
    for step in field.key.split("."):
        value = value[step] if isinstance(value, Mapping) else getattr(value, step)
    return value
