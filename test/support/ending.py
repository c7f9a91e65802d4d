"""End a node by a signal, and check how much it computes and how long it takes until it has ended."""

import os
import resource
import signal
import subprocess
import time

from live_peer import PATIENCE
from processes import computed

COMPUTING = 2.0
"""Seconds of computing after the signal: what a process that waits for nothing takes at most on an idle machine."""

WALL = 6.0
"""Seconds of wall time on a machine where no more programs run than it has cores."""


def ended_in_time(
    process: "subprocess.Popen[bytes]", number: int = signal.SIGTERM, computing: float = COMPUTING, wall: float = WALL
) -> int:
    """End a process by a signal, check the time that this takes, and return the exit code.

    computing : most seconds of computing; wall : most seconds of wall time, longer by the load of a busy machine
    """
    before, children, began = computed(process.pid), _of_children(), time.monotonic()
    process.send_signal(number)
    code = process.wait(PATIENCE)
    took = time.monotonic() - began
    assert _of_children() - children - before < computing
    assert took < wall * load()
    return code


def load() -> float:
    """Return the number of programs that share a core, over the last minute; at least 1."""
    return max(1.0, os.getloadavg()[0] / len(os.sched_getaffinity(0)))


def _of_children() -> float:
    """Return the seconds of computing of all child processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
