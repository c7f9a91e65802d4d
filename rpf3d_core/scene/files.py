"""Find the files that a scene names, and compute the digest of a file."""

import hashlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rpf3d_core.formats.meshes import companion_of
from rpf3d_core.scene.model import Scene


def files_of(scene: Scene) -> Iterator[tuple[str, Path]]:
    """Yield all files that a scene names, such as terrain, zones, points, shapes, samples and own models.

    Each file comes with the key path that names it, such as `terrain.files.0.path`. A Surpac .dtm file is followed by
    its companion, the .str file with its points, under the same key path.
    """
    return _files("", scene.model_dump(exclude={"path", "data_hint"}))


def digest_of_file(path: Path) -> str:
    """Return the digest (SHA-256, 64 hex digits) of the bytes of a file."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _files(key: str, value: Any) -> Iterator[tuple[str, Path]]:
    """Yield key path and file of each file in a value of a scene, as `files_of`.

    key : key path of the value, "" for the whole scene
    """
    if isinstance(value, Path):
        yield key, value
        if (other := companion_of(value)) is not None:
            yield key, other
    elif isinstance(value, Mapping | list | tuple | set | frozenset):
        items = value.items() if isinstance(value, Mapping) else enumerate(value)
        for name, item in items:
            yield from _files(f"{key}.{name}" if key else str(name), item)
