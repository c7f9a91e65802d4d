"""What all tests need: how many at once, and that a signal means to a child what it means on a terminal."""

import os
import signal

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it runs in the background ignore Ctrl-C, and children inherit that; one that is to be
    # interrupted would go on for ever. A handler of Python's own is none any more in a child.
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_xdist_auto_num_workers(config):
    """One more than there are cores: a test of live nodes mostly waits for them."""
    return len(os.sched_getaffinity(0)) + 1
