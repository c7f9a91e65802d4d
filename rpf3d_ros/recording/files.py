"""Write a recording as a series of files.

Each file begins with the current state. A new file begins when the last file has reached a size or an age, or after a
fault. With rotation, file names are <stem>_<UTC>_<number>.rrd: the names sort by time, and no file is replaced.
"""

import re
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from rpf3d_ros.recording.entries import RecordingEntry
from rpf3d_ros.recording.stream import Recording, file_recording

MEGABYTE = 1_000_000
RETRY = 2.0
"""Time (s) between two attempts to begin a new file after a write has failed."""

FAULTS = (OSError, RuntimeError)
"""Errors that rerun raises if a file cannot be written."""


@dataclass(frozen=True)
class Rotation:
    """Size and age at which a recording begins a new file, and the number of files that are kept.

    megabytes, minutes : size and age at which a new file begins; 0: no limit
    keep : number of files kept; 0: all
    """

    megabytes: float = 0.0
    minutes: float = 0.0
    keep: int = 0

    @property
    def rotates(self) -> bool:
        """True if the recording rotates: a new file begins at a size or age limit."""
        return self.megabytes > 0.0 or self.minutes > 0.0


class Head:
    """The entries with which every new file of a recording begins: current terrain, patches, sources, areas, alerts.

    In a thinned recording, the last rocks and hazard maps are among them.
    """

    def __init__(self) -> None:
        self._kept: dict[str, RecordingEntry] = {}

    def note(self, entries: Iterable[RecordingEntry]) -> None:
        """Keep the entries that are part of the state; new terrain deletes the patches of the old terrain."""
        for entry in entries:
            if entry.keeps == "terrain":
                self._kept = {name: kept for name, kept in self._kept.items() if not name.startswith("terrain/")}
            if entry.keeps:
                self._kept.pop(entry.keeps, None)
                self._kept[entry.keeps] = entry

    def entries(self) -> list[RecordingEntry]:
        """Return the entries that a new file begins with, oldest first."""
        return list(self._kept.values())


def draw(recording: Recording, entries: Iterable[RecordingEntry]) -> None:
    """Add entries to a recording, each at its own time."""
    for entry in entries:
        recording.at(entry.stamp_ns, entry.event)
        entry.draw(recording)


class RecordingFiles:
    """The files of a recording, of which one is open; `write` returns when the entries are on disk.

    head : (attribute) the entries with which every new file begins; path : (attribute) the newest file
    number : (attribute) number of the newest file; lost : (attribute) number of entries that could not be written
    """

    def __init__(
        self,
        file: Path,
        rotation: Rotation,
        monotonic: Callable[[], float] = time.monotonic,
        begun: Callable[[Path], None] = lambda path: None,
        forgotten: Callable[[Path], None] = lambda path: None,
    ) -> None:
        """Begin the first file; an existing file with the same name is replaced.

        file : path of the recording; with rotation, its folder and stem are used for the names of all files. A file
            that begins after a failed write also gets such a name, with its time and number
        rotation : when a new file begins; monotonic : returns the time of a monotonic clock (s)
        begun : called with the path of each new file
        forgotten : called with the path of each file that is deleted because enough newer files exist

        Raises OSError or RuntimeError if the file cannot be written, and InputError if rerun is missing.
        """
        self._file, self._rotation, self._monotonic = file, rotation, monotonic
        self._begun, self._forgotten = begun, forgotten
        self.head = Head()
        self.number, self.lost = 0, 0
        self.path = file
        self._recording: Recording | None = None
        self._since, self._retry_at = 0.0, 0.0
        self._begin()

    def write(self, entries: list[RecordingEntry]) -> None:
        """Write entries to the open file.

        Raises OSError or RuntimeError if the entries cannot be written; a later call then begins a new file. Attribute
        `lost` counts the entries that are not written. Entries that set a state stay in attribute `head`, so the next
        file contains them.
        """
        self.head.note(entries)
        if not entries and self._recording is not None:
            return
        if self._recording is None:
            self._begin_again(len(entries))
            entries = [entry for entry in entries if not entry.keeps]  # the new file already has the states
        assert self._recording is not None
        try:
            draw(self._recording, entries)
            self._recording.flush()
        except FAULTS:
            self._give_up(len(entries))
            raise
        if self._is_full():
            self._next()

    def check(self) -> None:
        """Begin a new file if the last file could not be written, or has reached the limit of size or age.

        Raises OSError or RuntimeError as in `write`.
        """
        if self._recording is None:
            self._begin_again(0)
        elif self._is_full():
            self._next()

    def close(self) -> None:
        """Write the footer of the current file. Raises OSError or RuntimeError if this fails."""
        recording, self._recording = self._recording, None
        if recording is not None:
            recording.close()

    def _is_full(self) -> bool:
        minutes, megabytes = self._rotation.minutes, self._rotation.megabytes
        if minutes > 0.0 and self._monotonic() - self._since >= 60.0 * minutes:
            return True
        return megabytes > 0.0 and self.path.stat().st_size >= MEGABYTE * megabytes

    def _next(self) -> None:
        try:
            self.close()
            self._begin()
        except FAULTS:
            self._give_up(0)
            raise
        self._forget_old()

    def _begin(self) -> None:
        self.number += 1
        if self._rotation.rotates or self.number > 1:
            self.path = numbered(self._file, self.number, datetime.now(UTC))
        recording = file_recording(self.path)
        try:
            draw(recording, self.head.entries())
            recording.flush()
        except FAULTS:
            _drop(recording)
            raise
        self._recording, self._since = recording, self._monotonic()
        self._begun(self.path)

    def _begin_again(self, lost: int) -> None:
        """Try to begin a new file. Raises OSError at once if the last attempt is less than RETRY seconds ago.

        lost : number of entries that count as lost if no file is begun
        """
        if self._monotonic() < self._retry_at:
            self.lost += lost
            raise OSError(f"a new attempt is made every {RETRY:g} s")
        self._retry_at = self._monotonic() + RETRY
        try:
            self._begin()
        except FAULTS:
            self.number, self.lost = self.number - 1, self.lost + lost
            if self.path != self._file:
                self.path.unlink(missing_ok=True)  # the next file begins with the same entries
            raise

    def _give_up(self, lost: int) -> None:
        """Abandon the open file after a fault; its earlier entries are readable, and `rpf3d recover` repairs it.

        lost : number of entries that were not written
        """
        self.lost += lost
        recording, self._recording = self._recording, None
        self._retry_at = self._monotonic() + RETRY
        if recording is not None:
            _drop(recording)

    def _forget_old(self) -> None:
        if self._rotation.keep > 0:
            for old in numbered_files(self._file)[: -self._rotation.keep]:
                old.unlink(missing_ok=True)
                self._forgotten(old)


def numbered(file: Path, number: int, at: datetime) -> Path:
    """Return the path of a file of a recording, with its time and number.

    >>> numbered(Path("shift.rrd"), 3, datetime(2026, 11, 21, 6, 30, 5, tzinfo=UTC)).name
    'shift_20261121T063005Z_0003.rrd'
    """
    return file.with_name(f"{file.stem}_{at:%Y%m%dT%H%M%SZ}_{number:04d}{file.suffix}")


def numbered_files(file: Path) -> list[Path]:
    """Return the files of a recording on disk whose names have a time and a number (`numbered`), oldest first."""
    name = re.compile(re.escape(file.stem) + r"_\d{8}T\d{6}Z_\d{4,}" + re.escape(file.suffix))
    return sorted(path for path in file.parent.glob(f"*{file.suffix}") if name.fullmatch(path.name))


def _drop(recording: Recording) -> None:
    """Close a recording that cannot be written, and ignore further errors."""
    with suppress(*FAULTS):  # the caller raises the original fault
        recording.close()
