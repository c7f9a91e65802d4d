"""Read a file with the reader of its format, after a check that the file is not missing or empty."""

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from rpf3d_core.errors import TerrainError

T = TypeVar("T")


def read_whole(path: Path, reader: Callable[[Path], T]) -> T:
    """Read a whole file with a reader, and return the result of the reader.

    Raises
    ------
    TerrainError
        The file is missing, empty or cannot be opened, or the reader refuses it.
    """
    try:
        if path.stat().st_size == 0:
            raise TerrainError(f"{path}: is empty")
        return reader(path)
    except OSError as fault:
        raise TerrainError(f"{path}: cannot be read ({fault.strerror or fault})") from fault
