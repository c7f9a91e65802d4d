"""The last good terrain on disk, so that a simulator that was killed comes back with it and says how old it is.

A folder holds the last whole survey, and the patches that were sewn in since, each naming the digest of the ground that
it was laid upon. Whatever moment the process dies at, the folder holds a ground that was flown over: a whole survey
replaces the one before in one step, and patches that do not follow on from it are not of it. One store at a time keeps
its ground in a folder: two would take each other's patches away.
"""

import fcntl
import os
import threading
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.ground import Ground, Workshop
from rpf3d_core.live.stored import SUFFIX, Piece, read_piece, sync_folder, write_piece
from rpf3d_core.live.survey import MeshSurvey, Survey

WHOLE = f"whole{SUFFIX}"
MOST_PATCHES = 64
"""Patches after which the ground is written whole: each takes some hundredths of a second on the way back."""

LOCK = "in_use.lock"
"""An empty file, locked while a store is open; it stays, and the lock ends with its process, whatever that dies of."""


class Last(NamedTuple):
    """What was kept: the pieces in order, the first of them whole, and sentences about what could not be read."""

    pieces: tuple[Piece, ...]
    faults: tuple[str, ...]

    def age_s(self, now_ns: int | None = None) -> float:
        """Seconds since the last piece became ground, by the clock of the machine; never below 0."""
        now = time.time_ns() if now_ns is None else now_ns
        return max(now - self.pieces[-1].received_ns, 0) / 1e9

    def ground(self, workshop: Workshop) -> Ground:
        """The ground that the pieces make. Raises TerrainError."""
        first, *patches = self.pieces
        ground = workshop.whole(first.survey, first.stamp_ns, first.digest)
        for piece in patches:
            assert not isinstance(piece.survey, MeshSurvey)
            ground = workshop.patched(ground, piece.survey, piece.stamp_ns)
        return ground


def read_last(folder: Path) -> Last | None:
    """The last ground that was kept in a folder; None where there is none.

    A patch that is damaged ends the list, with a sentence. Raises TerrainError where the whole survey is damaged, and
    OSError where it cannot be read.
    """
    if not (folder / WHOLE).exists():
        return None
    pieces, faults = [read_piece(folder / WHOLE)], []
    try:
        for path in sorted(folder.glob(f"patch-*{SUFFIX}")):
            piece = read_piece(path)
            if piece.upon == pieces[-1].digest:
                pieces.append(piece)
    except TerrainError as error:
        faults.append(f"{error}; the terrain is that before this patch")
    return Last(tuple(pieces), tuple(faults))


class Store:
    """Keeps grounds in a folder, on a thread of its own; the newest wins where they come faster than it writes."""

    def __init__(self, folder: Path, most_patches: int = MOST_PATCHES) -> None:
        """Open the store in a folder, which is made where it is missing.

        Raises
        ------
        InputError
            Another store is open there.
        OSError
            The folder cannot be made.
        """
        self.folder, self._most = folder, most_patches
        folder.mkdir(parents=True, exist_ok=True)
        self._lock, self._unlocked = _locked(folder)
        self._waiting: deque[Piece] = deque()
        self._changed = threading.Condition()
        self._last, self._patches, self._busy, self._closed = "", 0, False, False
        self._gap = False  # a piece is missing on the disk, so patches do not follow on what is there
        self.fault = self._unlocked
        self._thread = threading.Thread(target=self._run, name="store", daemon=True)
        self._thread.start()

    def keep(self, ground: Ground, survey: Survey) -> None:
        """Keep a ground and the survey that made it, or was sewn in last; returns at once.

        After many patches the ground itself is copied, which takes some hundredths of a second.
        """
        follows = ground.patches > 0 and self._patches < self._most and self._last and not self._gap
        upon = self._last if follows else ""
        if ground.patches and not follows:
            survey = mesh_of(ground)
        piece = Piece(survey, ground.digest, upon, ground.stamp_ns, ground.received_ns)
        with self._changed:
            if not upon:
                self._waiting.clear()  # what it replaces need not be written any more
            self._last, self._patches = ground.digest, self._patches + 1 if upon else 0
            self._waiting.append(piece)
            self._changed.notify_all()

    def follow(self, last: Last) -> None:
        """Patches that come are laid upon what was read from this folder."""
        self._last, self._patches = last.pieces[-1].digest, len(last.pieces) - 1

    def flush(self, timeout: float | None = None) -> bool:
        """Wait until all is on the disk, no longer than the timeout (s); whether it is."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting and not self._busy, timeout)

    def close(self, timeout: float | None = None) -> bool:
        """Write what waits, and end; wait at most timeout (s) for that. True where it has ended.

        The folder is free as soon as all is written, which may be after that.
        """
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join(timeout)
        return not self._thread.is_alive()

    def _run(self) -> None:
        try:
            self._write_what_comes()
        finally:
            if self._lock >= 0:
                os.close(self._lock)

    def _write_what_comes(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._waiting or self._closed)
                if not self._waiting:
                    return
                piece, self._busy = self._waiting.popleft(), True
            if not (piece.upon and self._gap):
                self._try_to_write(piece)
            with self._changed:
                self._busy = False
                self._changed.notify_all()

    def _try_to_write(self, piece: Piece) -> None:
        """Write a piece; where that fails, no patch is written, and the fault stands, until a whole ground is there."""
        try:
            self._write(piece)
        except Exception as error:  # whatever it is, the thread goes on
            self.fault, self._gap = f"the terrain could not be kept in {self.folder}: {error}", True
        else:
            self.fault, self._gap = self._unlocked, False

    def _write(self, piece: Piece) -> None:
        """A patch goes behind those that are there; a whole survey takes the place of all."""
        old = sorted(self.folder.glob(f"patch-*{SUFFIX}"))
        if piece.upon:
            number = int(old[-1].stem.partition("-")[2]) + 1 if old else 1
            write_piece(self.folder / f"patch-{number:06d}{SUFFIX}", piece)
            return
        write_piece(self.folder / WHOLE, piece)
        for path in old:
            path.unlink()
        sync_folder(self.folder)


def _locked(folder: Path) -> tuple[int, str | None]:
    """A descriptor that holds the lock of a folder; or -1 and why there is none: a bad disk keeps nobody from flying.

    Raises InputError where another has it.
    """
    handle = -1
    try:
        handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if handle >= 0:
            os.close(handle)
        if isinstance(error, BlockingIOError):
            raise InputError(f"{folder}: another simulator keeps its terrain there; name another folder") from error
        return -1, f"{folder} could not be locked, so another simulator may write there, too: {error}"
    return handle, None


def mesh_of(ground: Ground) -> MeshSurvey:
    """A copy of a ground as a mesh in the map frame, without the rows that patches have left empty."""
    triangles = ground.terrain.triangles
    return MeshSurvey(
        ground.terrain.frame.points_to_input(ground.terrain.vertices), triangles[triangles[:, 0] != triangles[:, 1]]
    )
