"""Import the libraries of the extra `mine`, which are needed for some formats only."""

import importlib
from pathlib import Path
from typing import Any

from rpf3d_core.errors import TerrainError


def needed(path: Path, library: str) -> Any:
    """Return a library that reads a file.

    Raises
    ------
    TerrainError
        The library is not installed; the message states how to install it.
    """
    try:
        return importlib.import_module(library)
    except ImportError as fault:
        raise TerrainError(
            f"{path}: {path.suffix.lower()} files need the library {library.partition('.')[0]}, which is not installed "
            f"({fault}); install it with: pip install 'rpf3d[mine]'"
        ) from fault
