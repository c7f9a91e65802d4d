"""Contacts of an alarm bridge that open by themselves when the bridge ends: a lock on a file, and a TCP connection.

Both replace hardware: on a site, use a relay that opens as soon as the bridge no longer powers its coil.
"""

import contextlib
import fcntl
import os
import socket
import threading
from pathlib import Path

CLOSED, OPEN = b"closed\n", b"open\n"
"""The words for the two states; a program that does not read the first word must treat the contact as open."""

LOOPBACK = "127.0.0.1"
REPEAT = 0.5
"""Time (s) between two lines to each connected program."""


class FileContact:
    """A dry contact that other programs read from a file: closed while this process holds the file's lock.

    The file also contains the word `open` or `closed`. The system releases the lock when the process ends, also after
    `kill -9`.
    """

    def __init__(self, path: Path) -> None:
        """Create the contact in the open state. Raises OSError if the file cannot be written."""
        self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        self._is_closed = False
        self._write(OPEN)

    def set(self, is_closed: bool) -> None:
        """Close or open the contact.

        The contact cannot be closed while another program reads the file; it then stays open until the next call.
        """
        if is_closed == self._is_closed:
            return
        if not is_closed:
            fcntl.flock(self._file, fcntl.LOCK_UN)
            self._is_closed = False
            self._write(OPEN)
            return
        with contextlib.suppress(BlockingIOError):
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._is_closed = True
            self._write(CLOSED)

    def close(self) -> None:
        """Open the contact and close the file."""
        self.set(False)
        os.close(self._file)

    def _write(self, word: bytes) -> None:
        os.pwrite(self._file, word.ljust(len(CLOSED)), 0)


def is_closed(path: Path) -> bool:
    """True if the dry contact of a file is closed: a process holds its lock, and the word is `closed`."""
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return os.read(file, len(CLOSED)) == CLOSED
    finally:
        os.close(file)
    return False


class TcpContact:
    """Sends a line `closed` or `open` to each connected program, on loopback, every REPEAT seconds and at each change.

    A program must treat the contact as open if the connection ends, or if no line arrives for two seconds.
    """

    def __init__(self, port: int) -> None:
        """Create the contact in the open state. Raises OSError if the port is not free; port : 0 for any free port."""
        self._server = socket.create_server((LOOPBACK, port))
        self.port = int(self._server.getsockname()[1])
        self._is_closed = False
        self._changed = threading.Condition()
        self._ended = False
        threading.Thread(target=self._accept, name="contact", daemon=True).start()

    def set(self, is_closed: bool) -> None:
        """Close or open the contact."""
        with self._changed:
            if self._is_closed != is_closed:
                self._is_closed = is_closed
                self._changed.notify_all()

    def close(self) -> None:
        """End all connections and free the port."""
        with self._changed:
            self._ended = True
            self._changed.notify_all()
        with contextlib.suppress(OSError):
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()

    def _accept(self) -> None:
        while not self._ended:
            try:
                connection, _ = self._server.accept()
            except OSError:
                return
            connection.settimeout(REPEAT)
            threading.Thread(target=self._serve, args=(connection,), name="contact", daemon=True).start()

    def _serve(self, connection: socket.socket) -> None:
        with connection, contextlib.suppress(OSError):
            while not self._ended:
                connection.sendall(CLOSED if self._is_closed else OPEN)
                before = self._is_closed
                with self._changed:
                    self._changed.wait_for(lambda before=before: self._ended or self._is_closed != before, REPEAT)
