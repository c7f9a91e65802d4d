"""Get the files of rerun's web viewer from the program that rerun's wheel installs.

The files are inside this program, and rerun has no function that returns the files. So this module lets the program
serve the files on the loopback address for about a second, and copies the files. `rerun.serve_web_viewer` is not used,
because that server listens on all interfaces.
"""

import http.client
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from rpf3d_core.errors import InputError
from rpf3d_core.recordings.replay import LOOPBACK, check_rerun

PAGES = {
    "index.html": "text/html; charset=utf-8",
    "re_viewer.js": "text/javascript; charset=utf-8",
    "re_viewer_bg.wasm": "application/wasm",
    "favicon.ico": "image/x-icon",
}
"""Files of the viewer and their content types."""
LATEST = 30.0
"""Time (s) after which rerun's program counts as failed; it serves its files after 0.5 s on an idle machine."""
PAUSE = 0.05
"""Time (s) between two attempts to connect to rerun's program."""


def viewer_pages() -> dict[str, bytes]:
    """Return the content of the web viewer's files, by the names of PAGES.

    Raises
    ------
    InputError
        rerun is not installed, or its program does not serve the files.
    """
    check_rerun()
    page, data = _free_port(), _free_port()
    with _serving(page, data) as program:
        _wait(program, page)
        return {name: _file(page, name) for name in PAGES}


@contextmanager
def _serving(page: int, data: int) -> Iterator["subprocess.Popen[bytes]"]:
    """Run rerun's program, which serves its files; end the program and its child when the `with` block ends.

    page : port of the files; data : port on which the program also listens, for live data
    """
    command = [sys.executable, "-m", "rerun", "--serve-web", "--bind", LOOPBACK, "--port", str(data),
               "--web-viewer-port", str(page)]  # fmt: skip
    quiet = subprocess.DEVNULL
    # The program runs in its own session: it starts a child, and only a signal to the group ends both.
    program = subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet, start_new_session=True)
    try:
        yield program
    finally:
        with suppress(ProcessLookupError):
            os.killpg(program.pid, signal.SIGKILL)
        program.wait()


def _wait(program: "subprocess.Popen[bytes]", port: int) -> None:
    """Wait until rerun's program accepts connections at a port.

    Raise InputError if the program ends, or accepts no connection within LATEST (30) seconds.
    """
    end = time.monotonic() + LATEST
    while time.monotonic() < end and program.poll() is None:
        with suppress(OSError), socket.create_connection((LOOPBACK, port), timeout=1.0):
            return
        time.sleep(PAUSE)
    raise InputError("rerun's web viewer did not start; try `rpf3d replay` without --web")


def _file(port: int, name: str) -> bytes:
    """Return the content of a file that rerun's program serves at a port.

    Raise InputError if the program does not send the file.
    """
    connection = http.client.HTTPConnection(LOOPBACK, port, timeout=LATEST)
    try:
        connection.request("GET", f"/{name}")
        answer = connection.getresponse()
        content = answer.read()
    except (OSError, http.client.HTTPException) as fault:
        raise InputError(f"rerun's web viewer did not send {name} ({fault})") from fault
    finally:
        connection.close()
    if answer.status != http.HTTPStatus.OK or not content:
        raise InputError(f"rerun's web viewer has no {name}; rpf3d needs rerun-sdk 0.41")
    return content


def _free_port() -> int:
    """Return a port of the loopback address that no program uses."""
    with socket.socket() as probe:
        probe.bind((LOOPBACK, 0))
        return int(probe.getsockname()[1])
