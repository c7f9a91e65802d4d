"""What all tests need: that a signal means to a child process what it means on a terminal."""

import signal

if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    # A shell lets what it runs in the background ignore Ctrl-C, and children inherit that; one that is to be
    # interrupted would go on for ever. A handler of Python's own is none any more in a child.
    signal.signal(signal.SIGINT, signal.default_int_handler)
