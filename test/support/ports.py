"""Find a free port for a program that a test starts later."""

import itertools
import os
import socket

LOWEST, COUNT = 20_000, 12_000
"""Range of ports: below those that the system gives to connections (32768 and higher on Linux) at any time."""

_numbers = itertools.count(37 * os.getpid())
"""Numbers of the next ports to try: each process begins at another port, and takes no port twice."""


def free_port() -> int:
    """Return a TCP port of the loopback address that no program uses."""
    for number in itertools.islice(_numbers, COUNT):
        port = LOWEST + number % COUNT
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise RuntimeError("no port is free")
