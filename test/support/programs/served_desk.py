"""Start `rpf3d desk` as a user does: in a separate process, on a free port."""

import re
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

import pytest

from programs.command_line import COMMAND, environment
from programs.listening import listening_addresses

LONGEST = 300.0
"""Longest time (s) that a test waits for the end of the desk, on a busy machine."""


class ServedDesk(NamedTuple):
    """A running desk.

    address : URL of the page, with its token; heard : addresses at which the desk listened during its start
    """

    process: "subprocess.Popen[str]"
    address: str
    heard: set[str]

    @property
    def base(self) -> str:
        """The address without the token, such as http://127.0.0.1:40001."""
        return f"http://{urlsplit(self.address).netloc}"

    @property
    def port(self) -> int:
        return int(urlsplit(self.address).port or 0)


@contextmanager
def served_desk(*words: object, cwd: Path | None = None) -> Iterator[ServedDesk]:
    """Yield a running `rpf3d desk` with the arguments `words`; end the desk after the `with` block if it still runs.

    The test is skipped if a library of the extra `desk` is not installed.
    """
    for library in ("trame", "trame_vtk", "ruamel.yaml"):
        pytest.importorskip(library, reason="the extra `desk` is not installed")
    command = [*COMMAND, "desk", "--no-open", *map(str, words)]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=cwd, start_new_session=True,
        env=environment(TRAME_ARGS="--host 0.0.0.0 --port 1", TRAME_DEFAULT_HOST="0.0.0.0"),
    )  # fmt: skip
    heard: set[str] = set()
    lines: list[str] = []
    try:
        reader = threading.Thread(target=lambda: lines.append(process.stdout.readline()))  # type: ignore[union-attr]
        reader.start()
        while reader.is_alive():
            heard |= listening_addresses(process.pid)
            reader.join(0.02)
        found = re.findall(r"desk on (http://\S+)", lines[0])
        assert found, process.communicate(timeout=LONGEST)[1]
        yield ServedDesk(process, found[0], heard | listening_addresses(process.pid))
    finally:
        if process.poll() is None:
            process.terminate()  # not killed, so that the desk deletes its results
        process.communicate(timeout=LONGEST)
