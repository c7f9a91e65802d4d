"""The version of rpf3d, which every decision states."""

import importlib.metadata
from functools import cache


@cache
def version() -> str:
    """Return the version of rpf3d, as written in decisions; "not installed" if Python finds no installed package.

    The version is read from disk once, at the start of a node with a log: no later answer waits for a slow disk.
    """
    try:
        return importlib.metadata.version("rpf3d")
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
