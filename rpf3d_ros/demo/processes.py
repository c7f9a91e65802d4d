"""Run nodes as child processes, isolated from other ROS systems: loopback only, own domain, own log folder."""

import ctypes
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import IO

from rpf3d_ros.demo.domains import free_domain

GRACE = 15.0
"""Time that a node has to end after SIGINT before it is killed (s); closing a large recording takes a few seconds."""

TAIL = 20
"""Number of lines of each node's output that are shown after a failure."""

SET_PARENT_DEATH_SIGNAL = 1
"""The option PR_SET_PDEATHSIG of Linux' prctl(2), by which a node ends together with the demo."""

LIBC = ctypes.CDLL(None) if sys.platform == "linux" else None

_taken: list[IO[str]] = []
"""Locks of the domains that this process holds until its end."""


def isolated_environment(logs: Path) -> dict[str, str]:
    """Return environment variables with which nodes communicate on this machine only, in a reserved ROS domain.

    logs : folder of the nodes' ROS logs

    Raises InputError if no domain is free.
    """
    domain, lock = free_domain()
    _taken.append(lock)
    return {
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "ROS_DOMAIN_ID": str(domain),
        "ROS_LOG_DIR": str(logs),
    }


def node_process(module: str, ros_arguments: list[str], logs: Path) -> subprocess.Popen[bytes]:
    """Start a node of this package with this process' environment; the node's output goes to logs/<module>.out.

    On Linux the node ends when the thread that started the node ends.
    """
    command = [sys.executable, "-m", f"rpf3d_ros.nodes.{module}", "--ros-args", *ros_arguments]
    root = str(Path(__file__).resolve().parents[2])
    path = os.pathsep.join(filter(None, [root, os.environ.get("PYTHONPATH", "")]))
    with (logs / f"{module}.out").open("wb") as output:
        return subprocess.Popen(
            command, stdout=output, stderr=output, env={**os.environ, "PYTHONPATH": path}, preexec_fn=_end_with_parent
        )


def _end_with_parent() -> None:
    if LIBC is not None:
        LIBC.prctl(SET_PARENT_DEATH_SIGNAL, int(signal.SIGTERM))


def ended(process: subprocess.Popen[bytes]) -> int:
    """Stop a node with SIGINT and return its exit code; kill the node if it still runs after GRACE (s)."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(GRACE)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


def tails(logs: Path) -> str:
    """Return the last lines of every node's output, to explain a failure."""
    parts = []
    for output in sorted(logs.glob("*.out")):
        lines = output.read_text(errors="replace").splitlines()[-TAIL:]
        parts += [f"--- {output.stem}", *lines]
    return "\n".join(parts)
