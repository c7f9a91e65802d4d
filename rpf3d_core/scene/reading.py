"""Read a scene file: return a checked `Scene`, or report one sentence for each error."""

import hashlib
import json
from collections.abc import Mapping, Sized
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from rpf3d_core.errors import SceneError
from rpf3d_core.formats.yaml import Document, read_yaml, report_of
from rpf3d_core.scene.faults import NOT_SCENE_KEYS, faults_of, unknown_key
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.releases import SourceSpec, source_points
from rpf3d_core.scene.values import MISSING_FILE


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
    path = Path(path)
    document = read_yaml(path)
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
    return _filled_in(scene)


def scene_of_values(values: Mapping[str, Any], path: Path) -> Scene:
    """Return the scene from values that are not from a file, after a check; messages show `path` as its file.

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


def _filled_in(scene: Scene) -> Scene:
    """Return the scene with values that its files determine: reference system, and rocks of each source."""
    terrain = scene.terrain
    crs = terrain.crs or next(iter(terrain.crs_of_files().values()), None)
    sources = tuple(_a_rock_a_point(source, scene) for source in scene.sources)
    return scene.model_copy(update={"terrain": terrain.model_copy(update={"crs": crs}), "sources": sources})


def _a_rock_a_point(source: SourceSpec, scene: Scene) -> SourceSpec:
    """Return the source with one rock for each of its points, if the scene states no number of rocks for it."""
    if "rocks" in source.model_fields_set:
        return source
    if source.points_file:
        points: Sized = source_points(source, scene.terrain.up)
    else:
        points = source.points or ()
    return source.model_copy(update={"rocks": max(len(points), 1)})


def scene_digest(scene: Scene) -> str:
    """Return a digest (SHA-256, 64 hex digits) of everything in a scene that affects the result.

    The digest covers all keys, defaults included, except `path` and `data_hint`. Of a file, the digest covers the
    content, not the name or folder. Equal digests therefore mean equal results with the same version of rpf3d.
    """
    return _digest(scene.model_dump(exclude={"path", "data_hint"}))


def releases_digest(scene: Scene) -> str:
    """Return a digest (SHA-256, 64 hex digits) that is equal if two scenes release the same rocks, except for the seed.

    The digest covers places, velocities and sizes, but not the number of rocks: in a larger ensemble, the first rocks
    start exactly like the rocks of a smaller ensemble.
    """
    return _digest({
        "rock": scene.rock.model_dump(),
        "sources": [source.model_dump(exclude={"rocks"}) for source in scene.sources],
    })  # fmt: skip


def _digest(content: dict[str, Any]) -> str:
    text = json.dumps(_canonical(content), sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode()).hexdigest()


def _canonical(value: Any) -> Any:
    if isinstance(value, Path):
        with value.open("rb") as file:
            return {"sha256": hashlib.file_digest(file, "sha256").hexdigest()}
    if isinstance(value, Mapping):
        # Materials are matched in file order, so the order is part of the content.
        return [[key, _canonical(item)] for key, item in value.items()]
    return [_canonical(item) for item in value] if isinstance(value, list | tuple) else value


def _scene(path: Path, values: dict[str, Any]) -> Scene:
    written = {key: value for key, value in values.items() if key not in NOT_SCENE_KEYS}
    return Scene.model_validate({**written, "path": path}, context={"folder": path.parent})


def _data_hint(error: ValidationError, values: dict[str, Any]) -> str:
    """Return the scene's `data_hint`, which says where to get its files, if a file is missing; else ""."""
    is_missing = any(detail["type"] == MISSING_FILE for detail in error.errors())
    return f"\n{values['data_hint']}" if is_missing and "data_hint" in values else ""
