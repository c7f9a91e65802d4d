"""A small file next to the folder of a decision log: it shows that a log was begun, also if the folder is lost.

Without this file, a node whose log was deleted could not be distinguished from a node that starts for the first time.
The file is `<folder>.begun`. It is renamed to `<folder>.unlogged` if decisions, or facts that the node's next start
needs, are missing on disk. Renaming needs no room on a full disk. Each change of the name is on disk before the node
continues.
"""

import contextlib
from pathlib import Path

from rpf3d_core.alerts.log_files import sync_folder

BEGUN, UNLOGGED = ".begun", ".unlogged"


class Witness:
    """The file next to a log folder that shows whether a log was begun, and whether decisions or facts are missing.

    folder : the folder of the log
    """

    def __init__(self, folder: Path) -> None:
        whole = folder.resolve()
        self.begun_path = whole.with_name(f"{whole.name}{BEGUN}") if whole.name else whole / BEGUN
        self.unlogged_path = self.begun_path.with_suffix(UNLOGGED)
        self._own_ns: int | None = None  # time of the last change of the file when this object renamed it
        self._is_synced = False

    @property
    def is_there(self) -> bool:
        """True if a log was begun in the folder earlier."""
        return self.begun_path.exists() or self.unlogged_path.exists()

    @property
    def is_unlogged(self) -> bool:
        """True if the file has the note that decisions, or facts for the node's next start, are missing on disk."""
        return self.unlogged_path.exists()

    @property
    def is_own(self) -> bool:
        """True if this object made the note that decisions or facts are missing, and no other program made it since."""
        return self._own_ns is not None and self._own_ns == self._changed_ns()

    def begin(self) -> None:
        """Create the file that shows that a log was begun, unless it exists. Raises OSError if this is impossible."""
        if not self.is_there:
            self.begun_path.touch()
            sync_folder(self.begun_path.parent)

    def unlog(self) -> None:
        """Note, by renaming the file, that decisions or facts are missing on disk; do nothing if this is impossible.

        If another program has made this note already, only the time of the file is changed. The other program then sees
        that the note is no longer its own (`is_own`), and does not remove it.
        """
        if self._is_synced and self.is_unlogged:
            return
        with contextlib.suppress(OSError):
            if not self.is_unlogged:
                self._rename_to_unlogged()
            elif not self.is_own:
                self.unlogged_path.touch()
            sync_folder(self.begun_path.parent)
            self._is_synced = True

    def _rename_to_unlogged(self) -> None:
        if self.begun_path.exists():
            self.begun_path.replace(self.unlogged_path)
        else:
            self.unlogged_path.touch()
        self._own_ns = self._changed_ns()

    def _changed_ns(self) -> int | None:
        try:
            return self.unlogged_path.stat().st_mtime_ns
        except OSError:
            return None

    def settle(self) -> None:
        """Remove the note that decisions or facts are missing on disk; do nothing if the file cannot be changed.

        Call this only if nothing is missing now, or if a person has acknowledged that something is missing.
        """
        with contextlib.suppress(OSError):
            if self.unlogged_path.exists():
                self.unlogged_path.replace(self.begun_path)
                self._own_ns, self._is_synced = None, False
                sync_folder(self.begun_path.parent)
