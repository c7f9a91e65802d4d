"""A small file next to the folder of a decision log: it shows that a log was begun, also if the folder is lost.

Without it, a node whose log was deleted could not be distinguished from a node that starts for the first time. The
file is `<folder>.begun`. It is renamed to `<folder>.unlogged` if decisions were made that no file of the log has.
Renaming needs no room on a full disk. Each change of the name is on disk before the node goes on.
"""

import contextlib
from pathlib import Path

from rpf3d_core.alerts.log_files import sync_folder

BEGUN, UNLOGGED = ".begun", ".unlogged"


class Witness:
    """The file next to a log folder; folder : the folder of the log."""

    def __init__(self, folder: Path) -> None:
        whole = folder.resolve()
        self.begun_path = whole.with_name(f"{whole.name}{BEGUN}") if whole.name else whole / BEGUN
        self.unlogged_path = self.begun_path.with_suffix(UNLOGGED)

    @property
    def is_there(self) -> bool:
        """True if a log was begun in the folder earlier."""
        return self.begun_path.exists() or self.unlogged_path.exists()

    @property
    def is_unlogged(self) -> bool:
        """True if decisions were made that the log does not have, and no person has acknowledged since."""
        return self.unlogged_path.exists()

    def begin(self) -> None:
        """Note that a log was begun. Raises OSError if the file cannot be made."""
        if not self.is_there:
            self.begun_path.touch()
            sync_folder(self.begun_path.parent)

    def unlog(self) -> bool:
        """Note that decisions are made that the log does not have; do nothing if the file cannot be changed.

        Return True if this was not noted before.
        """
        was_unlogged = self.is_unlogged
        with contextlib.suppress(OSError):
            if self.begun_path.exists():
                self.begun_path.replace(self.unlogged_path)
            else:
                self.unlogged_path.touch()
            sync_folder(self.begun_path.parent)
        return not was_unlogged and self.is_unlogged

    def settle(self) -> None:
        """Note that a person has acknowledged that decisions are missing; do nothing if the file cannot be changed."""
        with contextlib.suppress(OSError):
            if self.unlogged_path.exists():
                self.unlogged_path.replace(self.begun_path)
                sync_folder(self.begun_path.parent)
