"""Find the addresses at which a program and its children listen, as the kernel reports them (Linux)."""

import contextlib
import os
import socket
import struct
from pathlib import Path

LISTEN = "0A"
"""State of a listening socket in /proc/net/tcp."""


def family(process: int) -> list[int]:
    """Return the ids of a process and its living descendants; descendants of a process that has ended are not found."""
    found = [process]
    for one in found:
        with contextlib.suppress(OSError):
            for task in Path(f"/proc/{one}/task").iterdir():
                found += [int(child) for child in (task / "children").read_text().split()]
    return found


def session(leader: int) -> list[int]:
    """Return the ids of the processes in the session of a leader, such as children that a program has left behind."""
    return [one for one in map(int, filter(str.isdigit, os.listdir("/proc"))) if _session_of(one) == leader]


def listening_addresses(process: int) -> set[str]:
    """Return the addresses, such as "127.0.0.1", at which a process and its descendants listen."""
    inodes = {inode for one in family(process) for inode in _sockets(one)}
    addresses = set()
    for table in ("tcp", "tcp6"):
        for line in Path(f"/proc/net/{table}").read_text().splitlines()[1:]:
            columns = line.split()
            if columns[3] == LISTEN and columns[9] in inodes:
                addresses.add(_address(columns[1].partition(":")[0]))
    return addresses


def _sockets(process: int) -> set[str]:
    """Return the inode numbers of the sockets that a process has open, as text."""
    found = set()
    with contextlib.suppress(OSError):
        for link in Path(f"/proc/{process}/fd").iterdir():
            with contextlib.suppress(OSError):
                target = os.readlink(link)
                if target.startswith("socket:["):
                    found.add(target[8:-1])
    return found


def _session_of(process: int) -> int:
    with contextlib.suppress(OSError):
        return int(Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[3])
    return 0


def _address(hexadecimal: str) -> str:
    """Return an address of /proc/net, such as "0100007F", as text, such as "127.0.0.1".

    /proc/net has words of four bytes, in the byte order of the machine.
    """
    words = [int(hexadecimal[i : i + 8], 16) for i in range(0, len(hexadecimal), 8)]
    packed = b"".join(struct.pack("=I", word) for word in words)
    return socket.inet_ntop(socket.AF_INET if len(packed) == 4 else socket.AF_INET6, packed)
