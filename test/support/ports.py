"""A port for a program that a test starts later."""

import itertools
import os
import socket

LOWEST, COUNT = 20_000, 12_000
"""Ports below those that the system gives to connections (32768 and higher on Linux), which may take one meanwhile."""

_numbers = itertools.count(37 * os.getpid())
"""Next port to try: another one in each process, and no port twice."""


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
