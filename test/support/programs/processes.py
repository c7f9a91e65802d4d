"""Look up which processes run, and what they use, in /proc (proc(5))."""

import os
from pathlib import Path

PROC = Path("/proc")


def is_there(pid: int) -> bool:
    """Return True if a process has not ended; a zombie (ended, but not yet waited for by its parent) has ended."""
    return _state(pid) not in ("", "Z", "X")


def children_of(pid: int) -> list[int]:
    """Return the ids of the child processes of a process that have not ended."""
    everyone = [int(path.name) for path in PROC.iterdir() if path.name.isdigit()]
    return [each for each in everyone if is_there(each) and _fields(each)[1:2] == [str(pid)]]


def threads_of(pid: int) -> int:
    """Return the number of threads of a process; 0 if the process has ended."""
    try:
        return len(list((PROC / str(pid) / "task").iterdir()))
    except OSError:
        return 0


def computed(pid: int) -> float:
    """Return the CPU time (s) that a running process has used, in user and system mode."""
    fields = _fields(pid)
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def _state(pid: int) -> str:
    return (_fields(pid) or [""])[0]


def _fields(pid: int) -> list[str]:
    """Return the fields of a process after its name: state, number of the parent, and so on; [] if it has ended."""
    try:
        return (PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []
