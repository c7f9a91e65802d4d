"""The state file of a decision log: facts that must survive a restart, also while the disk is full.

The file is written in full when it is created. Later it is only overwritten in place, which needs no new room on most
file systems. It has two slots, which are written in turn, so an interrupted write leaves the other slot readable.
"""

import os
from pathlib import Path
from typing import Any

from rpf3d_core.alerts.lines import BEGINNING, content_of, line_of
from rpf3d_core.alerts.log_files import sync_folder

NAME = "state"
"""Name of the state file in the folder of the log."""

SLOT = 64 * 1024
"""Size (bytes) of a slot. An alert with 50 areas takes about half of a slot."""

SLOTS = 2

BLOCK = 4096
"""Size (bytes) of the blocks of a slot: blocks that stay zero are not written, to spare a flash disk."""


class StateFile:
    """The state file of a log folder, with facts that its lines do not have, such as the number of missing decisions.

    facts : the last facts on disk, as plain values; empty if there are none
    is_damaged : True if the file exists, but neither slot can be read
    """

    def __init__(self, folder: Path) -> None:
        """Read the state file of a folder, if there is one. Raises OSError if the file cannot be opened."""
        self._path, self._file, self._number = folder / NAME, -1, 0
        self._filled = [SLOT] * SLOTS  # number of bytes of each slot that may be other than zero
        self.facts: dict[str, Any] = {}
        self.is_damaged = False
        if self._path.exists():
            self._file = os.open(self._path, os.O_RDWR)
            self._read()

    @property
    def exists(self) -> bool:
        """True if the state file is on disk."""
        return self._file >= 0

    def close(self) -> None:
        """Close the state file; all facts that `write` accepted are on disk."""
        if self._file >= 0:
            os.close(self._file)
        self._file = -1

    def write(self, facts: dict[str, Any]) -> None:
        """Replace the facts in the state file; return when the new facts are on disk.

        Raises
        ------
        OSError
            The facts are not on disk.
        TypeError, ValueError
            JSON cannot express a value, or the facts are larger than a slot.
        """
        raw, _ = line_of(self._number + 1, BEGINNING, "state", {"facts": facts})
        if len(raw) > SLOT:
            raise ValueError(f"{len(raw)} bytes of facts do not fit into a slot of {SLOT} bytes")
        if self._file < 0:
            self._create(raw)
        else:
            self._overwrite(raw, (self._number + 1) % SLOTS)
        self._number, self.facts, self.is_damaged = self._number + 1, facts, False

    def _create(self, raw: bytes) -> None:
        """Create the file with all its slots; the file gets its name only after all its bytes are on disk.

        raw : the line with the first facts
        """
        part = self._path.with_name(f"{NAME}.part")
        file = os.open(part, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o644)
        try:
            place = (self._number + 1) % SLOTS * SLOT
            data = (bytes(place) + raw).ljust(SLOTS * SLOT, b"\0")
            if os.pwrite(file, data, 0) != len(data):
                raise OSError(f"{part}: not all bytes could be written")
            os.fsync(file)
            part.replace(self._path)
            sync_folder(self._path.parent)
        except OSError:
            os.close(file)
            part.unlink(missing_ok=True)
            raise
        self._file = file
        self._filled = [len(raw) if slot * SLOT == place else 0 for slot in range(SLOTS)]

    def _overwrite(self, raw: bytes, slot: int) -> None:
        """Write a line into a slot, and overwrite the rest of a longer previous line with zeros.

        Earlier versions of rpf3d do not accept a slot that contains the rest of another line.

        raw : the line; slot : number of the slot, from 0
        """
        filled = max(len(raw), self._filled[slot])
        data = raw.ljust(-(-filled // BLOCK) * BLOCK, b"\0")
        self._filled[slot] = filled  # also if only a part can be written
        if os.pwrite(self._file, data, slot * SLOT) != len(data):
            raise OSError(f"{self._path}: not all bytes could be written")
        os.fsync(self._file)
        self._filled[slot] = len(raw)

    def _read(self) -> None:
        slots = [os.pread(self._file, SLOT, slot * SLOT) for slot in range(SLOTS)]
        found = [content_of(data.partition(b"\n")[0]) for data in slots]  # the rest may be from longer facts
        sound = [each for each in found if each is not None and isinstance(each.get("facts"), dict)]
        self.is_damaged = not sound
        if sound:
            newest = max(sound, key=lambda each: int(each["n"]))
            self._number, self.facts = newest["n"], newest["facts"]
