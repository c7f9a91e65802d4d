"""Run a command as a user does at a terminal: the command shows its progress, and Ctrl-C interrupts the command."""

import os
import pty
import signal
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path

import pytest

from programs.command_line import COMMAND, LONGEST, environment

WIDTH = 100
"""Columns of the terminal."""


class OnATerminal:
    """A command that runs on a pseudo-terminal, so that it shows its progress.

    shown : all text that has appeared on the terminal
    """

    def __init__(self, *words: object, cwd: Path, width: int = WIDTH, command: Sequence[str] = tuple(COMMAND)) -> None:
        self.screen, other = pty.openpty()
        self.process = subprocess.Popen(
            [*command, *map(str, words)], cwd=cwd, env=environment(TERM="xterm", COLUMNS=str(width)),
            stdin=subprocess.DEVNULL, stdout=other, stderr=other, start_new_session=True,
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # background jobs ignore Ctrl-C by default
        )  # fmt: skip
        os.close(other)
        self.shown = ""

    def until(self, text: str) -> None:
        """Wait until a text appears on the terminal; the test fails if it does not appear in time."""
        end = time.monotonic() + LONGEST
        while text not in self.shown:
            assert time.monotonic() < end, f"{text!r} did not appear: {self.shown[-500:]!r}"
            if not self._read():
                pytest.fail(f"{text!r} did not appear before the end: {self.shown[-500:]!r}")

    def send(self, number: int) -> None:
        """Send a signal; Ctrl-C sends SIGINT."""
        self.process.send_signal(number)

    def end(self) -> int:
        """Wait until the command has ended, and return its exit code."""
        while self._read():
            pass
        return self.process.wait(LONGEST)

    def close(self) -> None:
        """Kill the command and close the terminal."""
        self.process.kill()
        self.process.wait()
        os.close(self.screen)

    def _read(self) -> bool:
        try:
            more = os.read(self.screen, 65536)
        except OSError:  # the other side is closed
            return False
        self.shown += more.decode(errors="replace")
        return bool(more)
