"""How many cores this process may use."""

import os


def usable_cores() -> int:
    """Return the number of cores that this process may use, where the system says so; else of all cores."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
