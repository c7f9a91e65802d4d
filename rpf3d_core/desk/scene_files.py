"""Detect whether the files of a scene have changed since the desk read them."""

from pathlib import Path

from rpf3d_core.errors import InputError
from rpf3d_core.scene.files import files_of
from rpf3d_core.scene.model import Scene

Stamp = tuple[tuple[str, int, int], ...]
"""Path, size (bytes) and time of the last change (ns) of each file of a scene; -1 and -1 if the file is missing."""


def stamp_of(scene: Scene) -> Stamp:
    """Return path, size (bytes) and time of the last change (ns) of each file of a scene.

    Size and time of a missing file are -1. If two results for a scene are equal, the files have not changed between
    the two calls.
    """
    return tuple((str(path), *_size_and_time(path)) for path in sorted({path for _, path in files_of(scene)}))


def check_unchanged(scene: Scene, stamp: Stamp) -> None:
    """Raise an `InputError` that names the changed files if any file of a scene has changed since an earlier stamp.

    stamp : earlier result of `stamp_of` for the same scene
    """
    changed = sorted({path for path, *_ in set(stamp_of(scene)) ^ set(stamp)})
    if changed:
        raise InputError(f"{', '.join(changed)}: changed since the rocks flew; press Run, then Report")


def _size_and_time(path: Path) -> tuple[int, int]:
    try:
        found = path.stat()
    except OSError:
        return -1, -1
    return found.st_size, found.st_mtime_ns
