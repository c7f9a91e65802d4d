"""Write files completely or not at all, at paths that the user chooses."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rpf3d_core.errors import InputError


def _mask() -> int:
    """Return the permission mask (umask) of this process, which limits the permissions of new files."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


MASK = _mask()
"""The permission mask. It is read only once, because while it is read, files of other threads are writable by all."""


def check_target(path: Path, replace: bool) -> None:
    """Raise an `InputError` if a file to write exists and must not be replaced, or if its folder does not exist."""
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
    if path.exists() and not replace:
        raise InputError(f"{path}: exists; tick `replace the file if it exists`, or give another name")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Yield the path of a temporary file to write, which is moved to `path` at the end, or deleted after an error.

    Raises
    ------
    InputError
        The file cannot be written.
    """
    try:
        number, part = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
        os.close(number)
        try:
            yield Path(part)
            os.chmod(part, path.stat().st_mode & 0o777 if path.exists() else 0o666 & ~MASK)
            os.replace(part, path)
        except BaseException:
            os.unlink(part)
            raise
    except OSError as fault:
        raise InputError(f"{path}: could not be written ({fault.strerror or fault})") from fault


def write_whole(path: Path, text: str) -> None:
    """Write a text file completely; raise an `InputError` and keep an existing file if it cannot be written."""
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")
