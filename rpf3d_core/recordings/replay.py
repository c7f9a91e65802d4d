"""Opening a run's recording in the rerun viewer."""

import importlib.util
import subprocess
import sys
from pathlib import Path

from rpf3d_core.errors import InputError

RECORDING = "run.rrd"
LOOPBACK = "127.0.0.1"
"""The viewer listens for live data; only this machine may reach it."""


def replay(folder: str | Path) -> "subprocess.Popen[bytes]":
    """Open the viewer on the recording of a result folder, and return its process without waiting for it.

    Raises
    ------
    InputError
        If the folder holds no recording, or rerun is not installed.
    """
    return subprocess.Popen(viewer_command(recording_of(folder)))


def recording_of(folder: str | Path) -> Path:
    """The recording in a result folder; `InputError` if there is none."""
    path = Path(folder) / RECORDING
    if not Path(folder).is_dir():
        raise InputError(f"{folder}: is not a folder; give the folder that `rpf3d run --out` wrote")
    if not path.is_file():
        raise InputError(f"{folder}: holds no {RECORDING}; give the folder that `rpf3d run --out` wrote")
    return path


def viewer_command(recording: Path) -> list[str]:
    """The command that shows a recording; `InputError` if rerun is not installed."""
    if importlib.util.find_spec("rerun") is None:
        raise InputError("replay needs rerun: pip install 'rerun-sdk>=0.38,<0.42'")
    return [sys.executable, "-m", "rerun", "--bind", LOOPBACK, str(recording)]
