"""Write the scene folder of an import completely, or not at all after an error."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rpf3d_core.errors import InputError


def check_new_folder(folder: Path) -> Path:
    """Return the absolute path of an output folder, after a check that nothing there would be overwritten.

    Raises
    ------
    InputError
        The path is a file, a folder that is not empty, or cannot be written. A scene is never replaced, because a user
        may have edited it.
    """
    target = folder.resolve()
    if target.is_dir() and any(target.iterdir()):
        raise InputError(f"{folder}: is not empty; give the path of a new or empty folder")
    if target.exists() and not target.is_dir():
        raise InputError(f"{folder}: is a file; the scene needs the path of a folder")
    above = next(parent for parent in target.parents if parent.exists())
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        raise InputError(f"{folder}: cannot be written, because {above} is not a folder that may be written to")
    return target


@contextmanager
def new_folder(folder: Path) -> Iterator[Path]:
    """Yield a hidden folder next to `folder`, into which the caller writes an import.

    When the `with` block ends, the hidden folder is renamed to `folder`; after an error, the hidden folder is deleted.

    Raises
    ------
    InputError
        As `check_new_folder`, or the folder could not be written.
    """
    target = check_new_folder(folder)
    part = target.with_name(f".{target.name}.{os.getpid()}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        part.mkdir(parents=True)
        yield part
        if target.exists():
            target.rmdir()
        part.rename(target)
    except OSError as fault:
        raise InputError(f"{folder}: could not be written ({fault.strerror or fault})") from fault
    finally:
        shutil.rmtree(part, ignore_errors=True)
