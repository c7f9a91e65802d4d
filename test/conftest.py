"""What all tests need: no deadlines, signals that reach a child as from a terminal, and children that leave nothing."""

import os
import signal

from hypothesis import HealthCheck, settings

# How long an example takes on a machine with other work to do says nothing of what is tested.
settings.register_profile("rpf3d", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("rpf3d")

# A child whose disk is full would leave half of the byte code of what it imports then, to be imported next.
os.environ["PYTHONDONTWRITEBYTECODE"] = "1"

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it runs in the background ignore Ctrl-C, and children inherit that; one that is to be
    # interrupted would go on for ever. A handler of Python's own is none any more in a child.
    signal.signal(signal.SIGINT, signal.default_int_handler)
