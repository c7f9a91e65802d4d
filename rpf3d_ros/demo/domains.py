"""ROS domains that one process at a time on a machine has: demos, measurements and tests hear their own nodes only."""

import fcntl
import itertools
import os
import tempfile
from pathlib import Path
from typing import IO

from rpf3d_core.errors import InputError

DOMAINS = 101
"""Domain ids 1 to 101 need no ports from the operating system's ephemeral range."""

_numbers = itertools.count(13 * os.getpid())
"""Where to look next: a domain that was just left may still have nodes that are ending."""


def free_domain() -> tuple[int, IO[str]]:
    """A ROS domain, and the lock that keeps other processes out of it until it is closed.

    Raises InputError where all are taken.
    """
    for number in itertools.islice(_numbers, DOMAINS):
        domain = 1 + number % DOMAINS
        lock = None
        try:
            lock = (Path(tempfile.gettempdir()) / f"rpf3d_domain_{domain}.lock").open("a")
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:  # taken; or the file is another user's, who has taken it before
            if lock is not None:
                lock.close()
            continue
        return domain, lock
    raise InputError(f"all {DOMAINS} ROS domains are taken by other processes on this machine")
