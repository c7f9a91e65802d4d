"""Alarm contacts, the outputs of an alarm bridge for a PLC. They open by themselves when the bridge ends or hangs.

There are two kinds: a file, and a TCP connection. Both replace hardware: on a site, use a relay that opens as soon as
the bridge no longer powers its coil.

Each contact has a separate thread. If the bridge has not called `set` for LOOKED seconds, the thread opens the
contact.
"""

import contextlib
import fcntl
import math
import os
import socket
import threading
import time
from pathlib import Path

CLOSED, OPEN = b"closed\n", b"open\n"
"""The words for the two states; a program that does not read `closed` must treat the contact as open."""

LOOKED = 1.0
"""Time (s) since the last call of `set` after which a contact opens, because the bridge hangs."""

VALID = 2.0
"""Time (s) for which the content of the file, or a TCP line, is valid; afterwards a reader must see an open contact."""

BEAT = 0.25
"""Time (s) between two writes of the file; each write extends the validity."""

UNTIL = b"valid_until "
"""Word in the last line of the file, in front of the time at which the validity of the file ends."""

LOOPBACK = "127.0.0.1"
REPEAT = 0.5
"""Time (s) between two lines to each connected program."""


class Wanted:
    """The state that a contact must have: closed if the last call of `set` asked for this and was recent, else open."""

    def __init__(self) -> None:
        self.changed = threading.Condition()
        self.has_ended = False
        self._is_closed, self._said_at = False, 0.0

    def set(self, is_closed: bool) -> None:
        """Store the state that the contact must have, and the time of the call; is_closed : True for closed."""
        with self.changed:
            is_new, self._is_closed, self._said_at = is_closed != self._is_closed, is_closed, time.monotonic()
            if is_new:
                self.changed.notify_all()

    def end(self) -> None:
        """Store that the contact must stay open from now on, and that the contact's threads must end."""
        with self.changed:
            self.has_ended, self._is_closed = True, False
            self.changed.notify_all()

    @property
    def is_closed(self) -> bool:
        """True if the contact must be closed now."""
        return self._is_closed and time.monotonic() - self._said_at <= LOOKED

    def wait_unless(self, is_closed: bool, longest: float) -> None:
        """Wait until a call changes the wanted state to the opposite of `is_closed`, `end` is called, or time is up.

        Return at once if the wanted state is already the opposite. The wait does not end when LOOKED seconds have
        passed without `set`, which also opens the contact; so `longest` must be short.

        is_closed : state to compare with, True for closed; longest : longest time to wait (s)
        """
        with self.changed:
            self.changed.wait_for(lambda: self.has_ended or self.is_closed != is_closed, longest)

    def wait_for_end(self, longest: float) -> None:
        """Wait until `end` is called, at most `longest` (s)."""
        with self.changed:
            self.changed.wait_for(lambda: self.has_ended, longest)


class FileContact:
    """A dry contact that other programs read from a file: closed while this process holds the file's lock.

    The first line of the file is the word `open` or `closed`, the last line `valid_until` and a time (s since 1970,
    UTC). A reader must also require that this time has not passed, and is at most VALID (s) ahead: a process that is
    stopped, or that hangs, keeps its lock. The system releases the lock when the process ends, also after `kill -9`.
    """

    def __init__(self, path: Path) -> None:
        """Create the contact in the open state.

        Raises OSError if the file cannot be written, or if another bridge uses the file.
        """
        self._owner = os.open(path.with_name(f"{path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(self._owner, fcntl.LOCK_EX | fcntl.LOCK_NB)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        except OSError as error:
            os.close(self._owner)
            if isinstance(error, BlockingIOError):
                raise OSError(f"another alarm bridge uses {path}") from None
            raise
        self._wanted, self._is_locked = Wanted(), False
        self._write(OPEN, _until())
        self._thread = threading.Thread(target=self._run, name="contact", daemon=True)
        self._thread.start()

    def set(self, is_closed: bool) -> None:
        """Ask the contact's thread to close the contact if `is_closed` is True, else to open it; do not wait.

        Call this at least every LOOKED seconds; otherwise the thread opens the contact.

        The contact cannot be closed while another program holds a lock on the file to read it; the next attempt follows
        after BEAT seconds.
        """
        self._wanted.set(is_closed)

    def close(self) -> None:
        """Open the contact, end its thread, and close the file; the contact cannot be used afterwards."""
        self._wanted.end()
        self._thread.join(1.0)
        os.close(self._file)
        os.close(self._owner)

    def _run(self) -> None:
        while True:
            until = _until()  # before the state is read: if the process is stopped here, the content is old
            has_ended, is_closed = self._wanted.has_ended, self._wanted.is_closed
            try:
                self._show(is_closed, until)
            except OSError:  # the disk fails: open, and try again
                self._unlock()
            if has_ended:
                return
            self._wanted.wait_unless(is_closed, BEAT)

    def _show(self, is_closed: bool, until: float) -> None:
        if not is_closed:
            self._unlock()
            self._write(OPEN, until)
            return
        if not self._is_locked:
            try:
                fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                return
            self._is_locked = True
        self._write(CLOSED, until)

    def _unlock(self) -> None:
        fcntl.flock(self._file, fcntl.LOCK_UN)
        self._is_locked = False

    def _write(self, word: bytes, until: float) -> None:
        os.pwrite(self._file, word.ljust(len(CLOSED), b"\n") + b"%s%014.3f\n" % (UNTIL, until), 0)


def is_closed(path: Path) -> bool:
    """True if the contact of a file is closed: a process locks the file, and its content is valid and `closed`."""
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return _says_closed(os.read(file, 64))
    finally:
        os.close(file)
    return False


def _says_closed(content: bytes) -> bool:
    """True if the content of a contact file is `closed`, and the end of its validity is neither past nor far ahead."""
    _, _, until = content.partition(UNTIL)
    return content.startswith(CLOSED) and _is_valid(until)


def _is_valid(until: bytes) -> bool:
    """True if a time (text, s since the epoch), the end of a validity, is neither past nor far ahead."""
    try:
        left = float(until) - time.time()
    except ValueError:
        return False
    return 0.0 <= left <= VALID


class TcpContact:
    """Sends a line such as `closed 1793651234.5` to each program on loopback, every REPEAT seconds and at each change.

    The line has the word `closed` or `open`, and the time (s since the epoch) at which it becomes invalid. A program
    must treat the contact as open if the time in its last line is past, or if the connection ends. So lines that wait
    in the buffers of a slow program do not keep the contact closed. A program whose connection cannot be accepted yet,
    for example because too many files are open, receives no line until then.
    """

    def __init__(self, port: int) -> None:
        """Create the contact in the open state. Raises OSError if the port is not free; port : 0 for any free port."""
        self._server = socket.create_server((LOOPBACK, port))
        self.port = int(self._server.getsockname()[1])
        self._wanted = Wanted()
        threading.Thread(target=self._accept, name="contact", daemon=True).start()

    def set(self, is_closed: bool) -> None:
        """Close the contact if `is_closed` is True, else open it; call this at least every LOOKED seconds."""
        self._wanted.set(is_closed)

    def close(self) -> None:
        """Free the port, and make the threads of the connections end and close them; do not wait for these threads."""
        self._wanted.end()
        with contextlib.suppress(OSError):
            self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()

    def _accept(self) -> None:
        while not self._wanted.has_ended:
            try:
                self._accept_one()
            except (OSError, RuntimeError):  # RuntimeError: no further thread can be started
                self._wanted.wait_for_end(REPEAT)

    def _accept_one(self) -> None:
        connection, _ = self._server.accept()
        try:
            connection.settimeout(REPEAT)
            threading.Thread(target=self._serve, args=(connection,), name="contact", daemon=True).start()
        except (OSError, RuntimeError):
            connection.close()
            raise

    def _serve(self, connection: socket.socket) -> None:
        with connection, contextlib.suppress(OSError):
            while not self._wanted.has_ended:
                until = _until()  # before the state is read: if the process is stopped here, the line is old
                is_closed = self._wanted.is_closed
                connection.sendall(_line(is_closed, until))
                self._wanted.wait_unless(is_closed, REPEAT)


def _line(is_closed: bool, until: float) -> bytes:
    """Return the line for connected programs.

    is_closed : True if the contact is closed; until : when the line becomes invalid (s since the epoch)
    """
    word = (CLOSED if is_closed else OPEN).strip()
    return b"%s %.3f\n" % (word, until)


def _until() -> float:
    """Return the time (s since the epoch) at which the current state becomes invalid, in whole milliseconds.

    The time is rounded down: a reader who reads at once must not find it more than VALID ahead.
    """
    return math.floor((time.time() + VALID) * 1000.0) / 1000.0


def line_says_closed(line: bytes) -> bool:
    """True if a line of a TCP contact says `closed`, and the end of its validity is neither past nor far ahead."""
    word, _, until = line.strip().partition(b" ")
    return word == CLOSED.strip() and _is_valid(until)
