"""Keep the last good terrain on disk, so that a simulator can load it after a restart and report its age.

A folder contains the last whole survey and the patches since then. Each patch names the digest of the terrain to which
it was added. Whenever the process ends, the folder contains a terrain that was in use: a new whole survey replaces
the previous whole survey in one step, and patches that do not continue from the new whole survey are ignored. Only one
store at a time may use a folder: two stores would remove each other's patches.
"""

import fcntl
import os
import threading
import time
from collections import deque
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.live.ground import LiveTerrain, Workshop
from rpf3d_core.live.stored import SUFFIX, StoredSurvey, read_piece, sync_folder, write_piece
from rpf3d_core.live.survey import MeshSurvey, Survey

WHOLE = f"whole{SUFFIX}"
MOST_PATCHES = 64
"""Largest number of stored patches; the next patch is stored as a whole terrain instead.

Each stored patch makes a restart some hundredths of a second longer.
"""

LOCK = "in_use.lock"
"""Name of an empty file that is locked while a store is open, so that no second store uses the folder.

The file stays; the lock ends with its process, even after a crash.
"""


class StoredSurveys(NamedTuple):
    """The surveys of one terrain on disk: the whole survey and its patches.

    pieces : the stored surveys: the whole survey, then its patches in order
    faults : sentences about patches that could not be read; empty if all could be read
    unread : number of patches that are left out because of these faults
    """

    pieces: tuple[StoredSurvey, ...]
    faults: tuple[str, ...]
    unread: int = 0

    def age_s(self, now_ns: int | None = None) -> float:
        """Return the time (s) since the terrain was last built or patched, by the machine's clock; never below 0.

        now_ns : current time (ns), None to read the clock
        """
        now = time.time_ns() if now_ns is None else now_ns
        return max(now - self.pieces[-1].received_ns, 0) / 1e9

    def patches_ns(self, latest_ns: int) -> tuple[int, ...]:
        """Return the times at which the patches of the terrain were received (ns, by the machine's clock).

        A time later than `latest_ns` is replaced by `latest_ns`. For a terrain that was stored whole after patches, the
        times of these patches are not known: each gets the time at which that terrain was built. The number of these
        patches may be a lower bound (`StoredSurvey.patches`).
        """
        first, *patches = self.pieces
        times = [first.received_ns] * first.patches + [patch.received_ns for patch in patches]
        return tuple(min(time_ns, latest_ns) for time_ns in times)

    @property
    def patch_stamps_ns(self) -> tuple[int, ...]:
        """The stamp (ns) of each patch, in the order of `patches_ns`.

        Patches that were stored as one whole terrain all have the stamp of the last of these patches.
        """
        first, *patches = self.pieces
        return (*[first.stamp_ns] * first.patches, *(patch.stamp_ns for patch in patches))

    def ground(self, workshop: Workshop) -> LiveTerrain:
        """Return the terrain built from the stored whole survey and its patches; raise TerrainError if that fails."""
        first, *patches = self.pieces
        ground = workshop.whole(first.survey, first.stamp_ns, first.digest, first.whole_ns, first.whole_digest)
        for piece in patches:
            assert not isinstance(piece.survey, MeshSurvey)
            ground = workshop.patched(ground, piece.survey, piece.stamp_ns)
        return ground


def read_last(folder: Path) -> StoredSurveys | None:
    """Return the surveys of the last terrain that was stored in a folder; None if there is none.

    A damaged patch and all later patches are left out; `faults` then has a sentence. A patch that does not continue
    from the survey before it is ignored. Raises TerrainError if the whole survey is damaged, and OSError if a file
    cannot be read.
    """
    if not (folder / WHOLE).exists():
        return None
    pieces = [read_piece(folder / WHOLE)]
    paths = sorted(folder.glob(f"patch-*{SUFFIX}"))
    for number, path in enumerate(paths):
        try:
            piece = read_piece(path)
        except TerrainError as error:
            fault = f"{error}; the terrain before this patch is used"
            return StoredSurveys(tuple(pieces), (fault,), unread=len(paths) - number)
        if piece.upon == pieces[-1].digest:
            pieces.append(piece)
    return StoredSurveys(tuple(pieces), ())


class Store:
    """Writes each new terrain to a folder on a separate thread, so that a restarted simulator has a terrain.

    A new whole terrain replaces the surveys that are not yet written.

    fault : a sentence on why the terrain could not be saved or the folder could not be locked; None without a fault
    """

    def __init__(
        self, folder: Path, most_patches: int = MOST_PATCHES, map_origin: tuple[float, ...] | None = None,
        longest_edge: float | None = None,
    ) -> None:  # fmt: skip
        """Open the store in a folder, which is created if it is missing.

        most_patches : largest number of stored patches; the next patch is stored as a whole terrain instead
        map_origin, longest_edge : (m) as in `StoredSurvey`, written with each survey; None if they are not known

        Raises
        ------
        InputError
            Another store is open in this folder.
        OSError
            The folder cannot be created.
        """
        self.folder, self._most, self._map_origin = folder, most_patches, map_origin
        self._longest_edge = longest_edge
        folder.mkdir(parents=True, exist_ok=True)
        self._lock, self._unlocked = _locked(folder)
        self._waiting: deque[StoredSurvey] = deque()
        self._changed = threading.Condition()
        self._last, self._patches, self._busy, self._closed = "", 0, False, False
        self._gap = False  # a survey is missing or damaged on the disk, so patches cannot continue from the disk
        self.fault = self._unlocked
        self._thread = threading.Thread(target=self._run, name="store", daemon=True)
        self._thread.start()

    def keep(self, ground: LiveTerrain, survey: Survey, is_patch: bool = False) -> None:
        """Queue the survey of a new terrain for writing, and return without waiting for the disk.

        ground : the new terrain; survey : the whole survey that the terrain was built from, or the last patch
        is_patch : True if the survey is a patch; a patch that replaced the whole terrain is stored as a whole survey

        A patched terrain is copied and stored whole in three cases: `most_patches` patches are stored already, a survey
        is missing or damaged on disk, or no survey has been stored yet. The copy takes some hundredths of a second.
        """
        follows = ground.patches > 0 and self._patches < self._most and self._last and not self._gap
        upon = self._last if follows else ""
        if ground.patches and not follows:
            survey = mesh_of(ground)
        piece = StoredSurvey(
            survey=survey, digest=ground.digest, upon=upon, stamp_ns=ground.stamp_ns, received_ns=ground.received_ns,
            whole_ns=ground.whole_ns, patches=0 if upon else max(ground.patches, int(is_patch)),
            whole_digest=ground.whole_digest, map_origin=self._map_origin,
            longest_edge=self._longest_edge,
        )  # fmt: skip
        with self._changed:
            if not upon:
                self._waiting.clear()  # the whole terrain replaces all waiting surveys
            self._last, self._patches = ground.digest, self._patches + 1 if upon else 0
            self._waiting.append(piece)
            self._changed.notify_all()

    def follow(self, last: StoredSurveys) -> None:
        """Continue after a restart from the surveys that are in this folder, so that later patches are added to them.

        If a patch could not be read, the next patched terrain is stored whole, in place of all files: a later restart
        would not read patches behind the damaged file.

        last : these surveys, from `read_last`
        """
        self._last, self._patches = last.pieces[-1].digest, len(last.pieces) - 1
        self._gap = last.unread > 0

    def flush(self, timeout: float | None = None) -> bool:
        """Wait until no survey is left to write, at most `timeout` (s); return True if none is left."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting and not self._busy, timeout)

    def close(self, timeout: float | None = None) -> bool:
        """Write the surveys that are still queued, and end the store; return True if it has ended within `timeout` (s).

        The folder is free once everything is written, which may be after the timeout.
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

    def _try_to_write(self, piece: StoredSurvey) -> None:
        """Write a survey to the folder; if that fails, set `fault`, and write no patch before the next whole survey.

        piece : the survey to write, whole or a patch
        """
        try:
            self._write(piece)
        except Exception as error:  # the thread must survive any error
            self.fault, self._gap = f"the terrain could not be saved in {self.folder}: {error}", True
        else:
            self.fault, self._gap = self._unlocked, False

    def _write(self, piece: StoredSurvey) -> None:
        """Write a survey to the folder: a patch as a further file, a whole survey in place of all files.

        piece : the survey to write, whole or a patch
        """
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
    """Lock a folder against a second store; return the descriptor of the lock and None, or -1 and why the lock failed.

    A lock that fails because of the disk raises no error, because a faulty disk must not stop the simulator. Raises
    InputError if another store has locked the folder.
    """
    handle = -1
    try:
        handle = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if handle >= 0:
            os.close(handle)
        if isinstance(error, BlockingIOError):
            raise InputError(f"{folder}: another simulator uses this folder; name another folder") from error
        return -1, f"{folder} could not be locked, so another simulator may write there, too: {error}"
    return handle, None


def mesh_of(ground: LiveTerrain) -> MeshSurvey:
    """Return the terrain with all its patches as one mesh survey, map frame, which can be stored as a whole survey.

    Patches replace removed facets by triangles without area: rows of the array whose first two vertices are equal. The
    result does not contain these triangles.
    """
    triangles = ground.terrain.triangles
    return MeshSurvey(
        ground.terrain.frame.points_to_input(ground.terrain.vertices), triangles[triangles[:, 0] != triangles[:, 1]]
    )
