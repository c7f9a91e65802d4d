"""Open a run's recording in the rerun viewer."""

import importlib.util
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from rpf3d_core.errors import InputError

RECORDING = "run.rrd"
SUFFIX = ".rrd"
LOOPBACK = "127.0.0.1"
"""Address at which the viewer listens for live data: only programs on this machine can reach it."""
DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY")
SETTLED = 4.0
"""Time (s) after which a viewer that still runs counts as open; without a screen, a viewer ends after 1.6 s."""


def replay(folder: str | Path) -> "subprocess.Popen[bytes]":
    """Open the viewer with a recording file, or with the recording of a result folder; return the viewer's process.

    The function waits SETTLED (4) seconds for an error of the viewer, then returns and leaves the viewer open. If the
    viewer ends earlier without an error, the function returns immediately.

    Raises
    ------
    InputError
        The folder has no recording, rerun is not installed, there is no display, or the viewer ends with an error.
    """
    recording = recording_of(folder)
    command = viewer_command(recording)
    _check_display(recording)
    with tempfile.TemporaryFile() as log:
        viewer = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)
        try:
            code = viewer.wait(SETTLED)
        except subprocess.TimeoutExpired:
            return viewer
        if code:
            log.seek(0)
            lines = log.read().decode(errors="replace").strip().splitlines()
            raise InputError(f"{recording}: the rerun viewer could not open it ({lines[-1] if lines else code})")
        return viewer


def _check_display(recording: Path) -> None:
    """Raise an InputError if there is no display on Linux; the viewer's own message would be longer."""
    if sys.platform.startswith("linux") and not any(map(os.environ.get, DISPLAYS)):
        raise InputError(
            f"{recording}: there is no display to show it on (neither {' nor '.join(DISPLAYS)} is set); open it in a "
            "browser with --web"
        )


def recording_of(folder: str | Path) -> Path:
    """Return the path of a recording (.rrd); raise an InputError if the recording does not exist.

    folder : path of the recording, or of the result folder with the recording run.rrd
    """
    path = Path(folder)
    if path.suffix == SUFFIX and path.is_file():
        return path
    path = path / RECORDING
    if not Path(folder).is_dir():
        raise InputError(
            f"{folder}: is not a folder; give the folder that `rpf3d run --out` wrote, or a recording (*{SUFFIX})"
        )
    if not path.is_file():
        raise InputError(f"{folder}: contains no {RECORDING}; give the folder that `rpf3d run --out` wrote")
    return path


def viewer_command(recording: Path) -> list[str]:
    """Return the command line that opens the viewer with a recording; raise an InputError if rerun is not installed."""
    check_rerun()
    return [sys.executable, "-m", "rerun", "--bind", LOOPBACK, str(recording)]


def check_rerun() -> None:
    """Raise an `InputError` if rerun is not installed."""
    if importlib.util.find_spec("rerun") is None:
        raise InputError("replay needs rerun: pip install 'rerun-sdk>=0.41,<0.42'")
