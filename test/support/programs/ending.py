"""End a node by a signal, and check the CPU time and the wall time until it has ended."""

import os
import resource
import signal
import subprocess
import time

from messages.live_peer import PATIENCE

from programs.processes import computed

COMPUTING = 2.0
"""Largest CPU time (s) between the signal and the end of a node."""

WALL = 6.0
"""Largest wall time (s) between the signal and the end, if no more programs run than the machine has cores."""


def ended_in_time(
    process: "subprocess.Popen[bytes]", number: int = signal.SIGTERM, computing: float = COMPUTING, wall: float = WALL
) -> int:
    """End a process by a signal, check that it ends in time, and return its exit code.

    number : signal number; computing : largest CPU time (s); wall : largest wall time (s), which `load()` multiplies
    """
    before, children, began = computed(process.pid), _of_children(), time.monotonic()
    process.send_signal(number)
    code = process.wait(PATIENCE)
    took = time.monotonic() - began
    assert _of_children() - children - before < computing
    assert took < wall * load()
    return code


def load() -> float:
    """Return the mean number of programs that shared a core in the last minute; at least 1."""
    return max(1.0, os.getloadavg()[0] / len(os.sched_getaffinity(0)))


def _of_children() -> float:
    """Return the CPU time (s) of all child processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime
