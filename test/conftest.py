"""What all tests need: no deadlines, and signals that reach a child as from a terminal."""

import signal

from hypothesis import HealthCheck, settings

# How long an example takes on a machine with other work to do says nothing of what is tested.
settings.register_profile("rpf3d", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("rpf3d")

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it runs in the background ignore Ctrl-C, and children inherit that; one that is to be
    # interrupted would go on for ever. A handler of Python's own is none any more in a child.
    signal.signal(signal.SIGINT, signal.default_int_handler)
