"""The version of rpf3d, which every decision states."""

import importlib.metadata


def version() -> str:
    """Return the version of rpf3d, as written in decisions; "not installed" if Python finds no installed package."""
    try:
        return importlib.metadata.version("rpf3d")
    except importlib.metadata.PackageNotFoundError:
        return "not installed"
