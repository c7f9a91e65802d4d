"""Run the program as a user does: in a separate process, or, faster, in this process."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from rpf3d_core import cli

ROOT = Path(__file__).parents[3]
COMMAND = [sys.executable, "-m", "rpf3d_core.cli"]
LONGEST = 300.0
"""Timeout of a command (s): the compiled engine may first have to be compiled (10 s), on a busy machine."""


def environment(**changes: str) -> dict[str, str]:
    """Return this process's environment with the project as PYTHONPATH; changes : variables to add or replace."""
    return {**os.environ, "PYTHONPATH": str(ROOT), **changes}


def rpf3d(*arguments: Any, cwd: Path | None = None, **changes: str) -> "subprocess.CompletedProcess[str]":
    """Run `rpf3d` with arguments in a separate process until it ends; changes : environment variables to set."""
    words = [*COMMAND, *map(str, arguments)]
    return subprocess.run(words, cwd=cwd, env=environment(**changes), capture_output=True, text=True, timeout=LONGEST)


def python(program: str, cwd: Path | None = None, **changes: str) -> "subprocess.CompletedProcess[str]":
    """Run the text of a Python program in a new interpreter until it ends; changes : environment variables to set."""
    return subprocess.run(
        [sys.executable, "-c", program], cwd=cwd, env=environment(**changes), capture_output=True, text=True,
        timeout=LONGEST,
    )  # fmt: skip


def call(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    """Run `rpf3d` with the arguments `words` in this process, and return the exit code.

    Exceptions of the command other than SystemExit are not caught.
    """
    monkeypatch.setattr(sys, "argv", ["rpf3d", *map(str, words)])
    try:
        cli.main()
    except SystemExit as end:
        return int(end.code or 0)
    return 0


def refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], *words: object, printed: str = ""
) -> str:  # fmt: skip
    """Run `rpf3d` and return its error message without "rpf3d: "; the message must be one line, the exit code 2.

    printed : start of the text that the command must print to standard output; by default it must print nothing
    """
    assert call(monkeypatch, *words) == 2
    output = capsys.readouterr()
    assert output.out.startswith(printed) if printed else output.out == "", "nothing but the complaint is said"
    (line,) = output.err.splitlines()
    assert line.startswith("rpf3d: ")
    return line.removeprefix("rpf3d: ")
