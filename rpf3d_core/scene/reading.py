"""Read a scene file: return a checked `Scene`, or report one sentence for each error."""

import hashlib
import json
import shlex
from collections.abc import Mapping, Sized
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rpf3d_core.errors import SceneError
from rpf3d_core.formats.meshes import companion_of
from rpf3d_core.formats.yaml import Document, parse_yaml, read_yaml, report_of
from rpf3d_core.scene.faults import NOT_SCENE_KEYS, faults_of, unknown_key
from rpf3d_core.scene.files import digest_of_file
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.material import BODY_KEYS
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.models.sphere import COULOMB_SPHERE
from rpf3d_core.scene.releases import OPTIONAL, SourceSpec, source_points
from rpf3d_core.scene.unknowns import ROOTS
from rpf3d_core.scene.values import MISSING_FILE

MAYBE_SCENES = (".yaml", ".yml", ".txt", ".csv", "")
"""Extensions of files that may be scenes, although some of them may also be terrain."""


def read_scene(path: str | Path) -> Scene:
    """Read a scene file, and return the scene after a check of every value.

    Parameters
    ----------
    path : str or Path
        A YAML file. Paths in the file are relative to its folder and must exist.

    Returns
    -------
    Scene
        SI units, input axes; file paths made absolute.

    Raises
    ------
    SceneError
        One line for each fault: file, line, key, value and the valid values; then the scene's `data_hint` if a file is
        missing.
    InputError
        A file of points is damaged and the number of its points sets the number of rocks.
    """
    _refuse_terrain(Path(path))
    return _checked(Path(path), read_yaml(Path(path)))


def _refuse_terrain(path: Path) -> None:
    """Raise a SceneError if the path leads to a terrain file; the message has the command that writes its scene."""
    suffix = path.suffix.lower()
    if suffix in MAYBE_SCENES or not path.is_file():
        return
    from rpf3d_core.formats.grids import DEM_EXTENSIONS  # imported only for files that are no scenes
    from rpf3d_core.formats.meshes import EXPORTS, MESH_READERS

    if suffix in (*MESH_READERS, *DEM_EXTENSIONS, *EXPORTS):
        raise SceneError(
            f"{path}: is a terrain file, not a scene file; write a scene for it first: rpf3d new FOLDER --terrain "
            f"{shlex.quote(str(path))}"
        )


def scene_of_text(text: str, path: Path) -> Scene:
    """Return the scene from the text of a scene file, after a check of every value; errors are as in `read_scene`.

    path : the file that messages show; files in the scene are relative to its folder
    """
    return _checked(path, parse_yaml(text, path))


def _checked(path: Path, document: Document) -> Scene:
    """Return the scene of a document, after a check of every value; errors are as in `read_scene`."""
    if not isinstance(document.values, dict):
        raise SceneError(f"{path}: must hold a mapping of keys (terrain, materials, sources, ...), but does not")
    faults = [unknown_key((key,), document) for key in document.values if key in NOT_SCENE_KEYS]
    try:
        scene = _scene(path, document.values)
    except ValidationError as error:
        faults += faults_of(error.errors(), document)
        hint = _data_hint(error, document.values)
        raise SceneError(report_of(path, [*document.faults, *faults]) + hint) from None
    if faults or document.faults:
        raise SceneError(report_of(path, [*document.faults, *faults]))
    check_unknowns(scene)
    return filled_in(scene)


def check_unknowns(scene: Scene) -> None:
    """Refuse priors of values that the scene does not have or that cannot be unknown, and priors with a wrong range.

    A range is wrong if `min` or `max` is not a valid value of the key. The priors of `unknowns` and of `calibration`
    are checked.

    Raises
    ------
    SceneError
        The first fault; the message has the key path.
    """
    spec = scene.unknowns
    named = {} if spec is None else dict(spec.priors)
    named |= {} if scene.calibration is None else scene.calibration.unknowns
    bare = scene.model_copy(update={"unknowns": None, "calibration": None}) if named else scene
    for path, prior in named.items():
        check_may_be_unknown(scene, path)
        for end in (prior.min, prior.max):
            with_values(bare, {path: end})


def check_may_be_unknown(scene: Scene, path: str) -> None:
    """Refuse a key path that cannot be an unknown, because all parameter sets share terrain, releases and obstacles.

    Raises
    ------
    SceneError
        The path is not below a key in ROOTS, or belongs to an effect with obstacles, such as trees. The message has
        the path.
    """
    root, _, rest = path.partition(".")
    if root not in ROOTS:
        raise SceneError(f"{scene.path}: `{path}` cannot be an unknown; unknowns are coefficients below "
                         f"{', '.join(ROOTS)}")  # fmt: skip
    effect = scene.effects.named.get(rest.partition(".")[0]) if root == "effects" else None
    if effect is not None and effect.OBSTACLES is not None:
        raise SceneError(f"{scene.path}: `{path}` cannot be an unknown, because all parameter sets share the "
                         "obstacles; give a number")  # fmt: skip


def scene_of_values(values: Mapping[str, Any], path: Path) -> Scene:
    """Return the scene from values that are not from a file, such as ROS parameters, after a check of every value.

    Relative paths of files start at the working directory. Priors are not checked; `check_unknowns` does this.

    path : the path that later messages about the scene show as its file

    Raises
    ------
    SceneError
        One line for each fault: parameter, value and the valid values.
    """
    try:
        return Scene.model_validate({**values, "path": path})
    except ValidationError as error:
        document = Document(values=values, lines={}, faults=[])
        sentences = {fault.sentence for fault in faults_of(error.errors(), document)}
        raise SceneError("\n".join(f"parameter {sentence}" for sentence in sorted(sentences))) from None


def filled_in(scene: Scene) -> Scene:
    """Return the scene with the values that its files determine: reference system, and default numbers of rocks.

    A source of points without a number of rocks gets one rock for each point. This number still counts as a default, so
    it changes if the source gets other points.
    """
    terrain = scene.terrain
    crs = terrain.crs or next(iter(terrain.crs_of_files().values()), None)
    sources = tuple(_a_rock_a_point(source, scene) for source in scene.sources)
    return scene.model_copy(update={"terrain": terrain.model_copy(update={"crs": crs}), "sources": sources})


def _a_rock_a_point(source: SourceSpec, scene: Scene) -> SourceSpec:
    """Return a source; if the scene states no number of its rocks, the source gets one rock for each of its points.

    A source without points, such as a line or an area, gets one rock.
    """
    if "rocks" in source.model_fields_set:
        return source
    if source.points_file:
        points: Sized = source_points(source, scene.terrain.up)
    else:
        points = source.points or ()
    filled = source.model_copy(update={"rocks": max(len(points), 1)})
    filled.model_fields_set.discard("rocks")
    return filled


def scene_digest(scene: Scene) -> str:
    """Return a digest (SHA-256, 64 hex digits) of everything in a scene that affects the result.

    The digest covers all keys, defaults included, except `path`, `data_hint`, `calibration` and optional keys that are
    not given. For a file, it covers the content, not the name or folder. Equal digests therefore mean equal results
    with the same version of rpf3d.
    """
    content = _without_optional(scene.model_dump(exclude={"path", "data_hint"}), scene.rock.is_body)
    content["terrain"] = _given({**content["terrain"], "files": _files(scene)}, ("benches", "split"))
    return _digest(content | {"rebound": _with_sphere(scene, content["rebound"])})


def releases_digest(scene: Scene) -> str:
    """Return a digest (SHA-256, 64 hex digits) of the rocks and sources of a scene.

    Scenes with equal digests release the same rocks if their seeds and terrains are equal, too. The digest covers
    places, velocities and sizes, but not the number of rocks: in a larger ensemble, the first rocks start exactly like
    the rocks of a smaller ensemble.
    """
    return _digest({
        "rock": _rock(scene.rock.model_dump(), scene.rock.is_body),
        "sources": [_given(source.model_dump(exclude={"rocks"}), OPTIONAL) for source in scene.sources],
    })  # fmt: skip


def _without_optional(content: dict[str, Any], bodies: bool) -> dict[str, Any]:
    """Return the keys and values of a scene without `calibration`, and without optional keys that are not given.

    So a scene that does not use these keys has the same digest as in versions of rpf3d that did not know them. The key
    `contact` stays only for rocks with a shape; `_with_sphere` adds the contact model of spheres.

    bodies : True if the rocks have a shape
    """
    keys = (*BODY_KEYS, "library")
    materials = {name: _given(material, keys) for name, material in content["materials"].items()}
    contact = _given(content["contact"], (COULOMB_SPHERE,)) if bodies and content["contact"] else None
    kept = {key: value for key, value in content.items() if key != "calibration"}  # no run reads it
    kept = _given({**kept, "contact": contact}, ("contact", "unknowns"))
    sources = [_given(source, OPTIONAL) for source in content["sources"]]
    return kept | {"rock": _rock(content["rock"], bodies), "materials": materials, "sources": sources}


def _files(scene: Scene) -> list[dict[str, Any]] | None:
    """Return the keys and values of each terrain file for the digest; None if the terrain is not from files.

    If the scene states no `unit` for a file, the key `unit` is left out. `zone` is None if the file's layers are zones.
    """
    if scene.terrain.files is None:
        return None
    return [
        _given({**file.model_dump(), "zone": None if file.has_layers_as_zones else file.zone}, ("unit",))
        for file in scene.terrain.files
    ]


def _rock(rock: dict[str, Any], bodies: bool) -> dict[str, Any]:
    """Return the keys and values of `rock`, for the digest; `shape` is included for rocks with a shape only."""
    return (
        {**rock, "shape": _given(rock["shape"], ("sphere",))} if bodies else _given({**rock, "shape": None}, ("shape",))
    )


def _with_sphere(scene: Scene, rebound: dict[str, Any]) -> dict[str, Any]:
    """Return the keys and values of `rebound` for the digest, with a key `coulomb_sphere` just before `own`.

    For spheres, this key has the parameters of the contact model, and all other values are None; else this key is None.
    """
    sphere = scene.impact_model.model_spec.model_dump() if scene.rock.is_sphere else None
    models = rebound if sphere is None else dict.fromkeys(rebound)
    return {key: models[key] for key in models if key != "own"} | {COULOMB_SPHERE: sphere, "own": models["own"]}


def _given(values: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    """Return a section of a scene without the named keys whose value is None."""
    return {key: value for key, value in values.items() if key not in keys or value is not None}


def _digest(content: dict[str, Any]) -> str:
    text = json.dumps(_canonical(content), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _canonical(value: Any) -> Any:
    if isinstance(value, Path):
        content = {"sha256": digest_of_file(value)}
        other = companion_of(value)
        return content if other is None else {**content, "companion": _canonical(other)}
    if isinstance(value, Mapping):
        # Materials are matched in file order, so the order is part of the content.
        return [[key, _canonical(item)] for key, item in value.items()]
    return [_canonical(item) for item in value] if isinstance(value, list | tuple) else value


def _scene(path: Path, values: dict[str, Any]) -> Scene:
    written = {key: value for key, value in values.items() if key not in NOT_SCENE_KEYS}
    return Scene.model_validate({**written, "path": path}, context={"folder": path.parent})


def _data_hint(error: ValidationError, values: dict[str, Any]) -> str:
    """Return the scene's `data_hint`, which states where to get its files, if a file is missing; else ""."""
    is_missing = any(detail["type"] == MISSING_FILE for detail in error.errors())
    return f"\n{values['data_hint']}" if is_missing and "data_hint" in values else ""
