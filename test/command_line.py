"""The program as a user runs it: in a process of its own."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
COMMAND = [sys.executable, "-m", "rpf3d_core.cli"]
LONGEST = 120.0
"""Seconds after which a command hangs: the compiled engine may have to be compiled first (10 s), on a busy machine."""


def environment(**changes: str) -> dict[str, str]:
    """This process' environment, with the package in reach from any folder."""
    return {**os.environ, "PYTHONPATH": str(ROOT), **changes}


def rpf3d(*arguments: Any, cwd: Path | None = None, **changes: str) -> "subprocess.CompletedProcess[str]":
    """Run `rpf3d` with these arguments to its end, in this environment with some changes."""
    words = [*COMMAND, *map(str, arguments)]
    return subprocess.run(words, cwd=cwd, env=environment(**changes), capture_output=True, text=True, timeout=LONGEST)


def python(program: str, cwd: Path | None = None, **changes: str) -> "subprocess.CompletedProcess[str]":
    """Run a Python program in a fresh interpreter."""
    return subprocess.run(
        [sys.executable, "-c", program], cwd=cwd, env=environment(**changes), capture_output=True, text=True,
        timeout=LONGEST,
    )  # fmt: skip
