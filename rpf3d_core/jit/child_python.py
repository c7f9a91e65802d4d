"""How to start a program of this package in a process of its own: its command line and its environment."""

import os
import sys
from pathlib import Path

HOME = Path(__file__).parents[2]
"""Folder that contains the package `rpf3d_core`, so that the other process finds the package from any folder."""


def command_of(module: str, *words: str) -> list[str]:
    """Return the command line of a module of this package, such as `rpf3d_core.jit.background`, with its arguments."""
    return [sys.executable, "-P", "-m", module, *words]


def environment_of_child() -> dict[str, str]:
    """Return this process's environment, in which another Python finds the same modules."""
    return {**os.environ, "PYTHONPATH": os.pathsep.join([str(HOME), *filter(None, sys.path)])}
