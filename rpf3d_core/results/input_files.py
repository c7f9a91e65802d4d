"""List the files that a run read, with their digests, so that a report can compare them with the present files."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rpf3d_core.formats.meshes import companion_of
from rpf3d_core.scene.model import Scene

SCENE = "scene"
"""Name of the scene file in the list of files; all other files have the key path of the scene that names them."""


def input_files(scene: Scene) -> list[dict[str, str]]:
    """Return key, full path and digest (SHA-256, 64 hex digits) of the scene file and of each file that it names.

    A file that is not there is left out, such as the scene file of a scene made in Python.
    """
    named = ((SCENE, scene.path), *_paths("", scene.model_dump(exclude={"path", "data_hint"})))
    return [{"key": key, "path": str(path.resolve()), "sha256": digest_of_file(path)}
            for key, path in dict.fromkeys(named) if path.is_file()]  # fmt: skip


def digest_of_file(path: Path) -> str:
    """Return the digest (SHA-256, 64 hex digits) of the bytes of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _paths(key: str, value: Any) -> Iterator[tuple[str, Path]]:
    """Yield the files in a value of a scene, with their key paths, and the companion of each file."""
    if isinstance(value, Path):
        yield key, value
        if (other := companion_of(value)) is not None:
            yield key, other
    elif isinstance(value, Mapping | list | tuple):
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for name, item in items:
            yield from _paths(f"{key}.{name}" if key else str(name), item)
