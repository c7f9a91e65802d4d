"""Find a free port for a program that a test starts later."""

import itertools
import os
import socket

LOWEST, COUNT = 20_000, 12_000
"""First port and number of ports to try; Linux gives connections only higher ports (32768 and above)."""

_numbers = itertools.count(37 * os.getpid())
"""Numbers of the next ports to try; processes begin at different ports, and repeat a port only after COUNT others."""


def free_port() -> int:
    """Return a TCP port of 127.0.0.1 that no program currently uses. Raises RuntimeError if there is none."""
    for number in itertools.islice(_numbers, COUNT):
        port = LOWEST + number % COUNT
        with socket.socket() as probe:
            try:
                probe.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise RuntimeError("no port is free")
