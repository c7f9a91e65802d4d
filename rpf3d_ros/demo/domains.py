"""Reserve a ROS domain for one process, so that demos, measurements and tests of rpf3d on one machine stay separate.

A lock on a file reserves the domain. A program that does not use these locks may still use the same domain.
"""

import fcntl
import itertools
import os
import tempfile
from pathlib import Path
from typing import IO

from rpf3d_core.errors import InputError

DOMAINS = 101
"""Number of ROS domains that are used: ids 1 to 101 need no ports from the system's ephemeral range."""

_numbers = itertools.count(13 * os.getpid())
"""Numbers for the next domains to try; they increase, because nodes of a released domain may still be shutting down."""


def free_domain() -> tuple[int, IO[str]]:
    """Return a ROS domain and the lock that reserves it until the lock is closed.

    Raises InputError if all domains are taken.
    """
    for number in itertools.islice(_numbers, DOMAINS):
        domain = 1 + number % DOMAINS
        lock = None
        try:
            lock = (Path(tempfile.gettempdir()) / f"rpf3d_domain_{domain}.lock").open("a")
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:  # taken, or the file belongs to another user
            if lock is not None:
                lock.close()
            continue
        return domain, lock
    raise InputError(f"all {DOMAINS} ROS domains are taken by other processes on this machine")
