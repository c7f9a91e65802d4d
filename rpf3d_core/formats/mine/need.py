"""Import the libraries of the extra `mine`, which are needed for some formats only."""

from pathlib import Path
from typing import Any

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.extras import library_of


def needed(path: Path, library: str) -> Any:
    """Return a library of the extra `mine`, imported by its name; the message of an error names the file `path`.

    Raises
    ------
    TerrainError
        The library is not installed; the message states how to install it.
    """
    return library_of("mine", library, f"{path}: {path.suffix.lower()} files need", TerrainError)
