"""Make the command line and the environment with which a module of this package runs in a separate process."""

import os
import sys
from pathlib import Path

HOME = Path(__file__).parents[2]
"""Folder that contains the package `rpf3d_core`, so that the other process finds the package from any folder."""


def command_of(module: str, *words: str) -> list[str]:
    """Return the command line of a module of this package, such as `rpf3d_core.jit.background`, with its arguments."""
    return [sys.executable, "-P", "-m", module, *words]


def environment_of_child() -> dict[str, str]:
    """Return the environment of this process for a child, with PYTHONPATH set to all module paths of this process."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(HOME), *filter(None, sys.path)])}
