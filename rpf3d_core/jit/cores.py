"""Find out how many cores this process may use, and whether one of them is free."""

import os

FEWEST_CORES = 2
"""Smallest number of cores with which a second process saves time."""


def usable_cores() -> int:
    """Return the number of cores that this process may use; if it is unknown, the number of all cores, at least 1."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def has_spare_core() -> bool:
    """Return True if a processor core is free for a second process.

    The process must have at least FEWEST_CORES (2) cores, and the system's load, if known, must be below the number of
    these cores.

    Without a free core, a second process costs time, because two processes need a sixth more computing time in total.
    """
    cores = usable_cores()
    return cores >= FEWEST_CORES and (not hasattr(os, "getloadavg") or os.getloadavg()[0] < cores)
