"""Write files completely or not at all, where the user says."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rpf3d_core.errors import InputError


def _mask() -> int:
    """Return the mask of permissions of new files."""
    mask = os.umask(0)
    os.umask(mask)
    return mask


MASK = _mask()
"""The mask of permissions, read once: while it is read, another thread would create files that all may write."""


def check_target(path: Path, replace: bool) -> None:
    """Raise an `InputError` if a file to write exists and may not be replaced, or if its folder does not exist."""
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
    if path.exists() and not replace:
        raise InputError(f"{path}: exists; tick `replace`, or give another name")


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give the path of a file to write, which becomes the file at `path` at the end; after an error, nothing changes.

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
    """Write a text file completely, or leave what was there; `InputError` if it cannot be written."""
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")
