"""The files of a decision log: their names, the last lines of each file, and safe writing to disk."""

import os
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.alerts.lines import content_of

STEM, ENDING = "decisions-", ".jsonl"

OPENING = b'{"kind":'
"""First bytes of each line."""


class NotLogged(OSError):
    """Raised if a decision log cannot be opened, or if a line or the state of the node cannot be written to disk.

    The message has the reason. A decision that could not be written is valid, and must still be published.
    """


class Tail(NamedTuple):
    """The state of a log file at its last sound line; a sound line is one with a correct hash.

    end : position (bytes) after the last sound line; size : size of the file (bytes)
    last : the last sound line, None if the file has no sound line
    decision : the last sound line with a decision, None if the file has no decision
    site : digest of the last thresholds in the file, None if the file has no thresholds
    broken : True if a line before the last sound line was changed
    doubtful : True if a damaged line after the last decision may be a decision that was published. A line whose writing
        was interrupted does not count, because its decision was never published
    """

    end: int
    size: int
    last: dict[str, Any] | None
    decision: dict[str, Any] | None
    site: str | None
    broken: bool
    doubtful: bool = False


def file_name(number: int) -> str:
    """Return the name of the log file with a number, counted from 1; the names sort like the numbers."""
    return f"{STEM}{number:06d}{ENDING}"


def files_in(folder: Path) -> list[tuple[int, Path]]:
    """Return the log files of a folder with their numbers, in order."""
    named = [(path.name.removeprefix(STEM).removesuffix(ENDING), path) for path in folder.glob(f"{STEM}*{ENDING}")]
    return sorted((int(digits), path) for digits, path in named if digits.isdecimal())


def tail_of(path: Path) -> Tail:
    """Read a log file and return its state: where the last line with a correct hash ends, and the last decision."""
    last, decision, site, broken, end, seen, doubtful = None, None, None, False, 0, 0, False
    with path.open("rb") as file:
        for raw in file:
            seen += len(raw)
            content = content_of(raw)
            if content is None:
                doubtful = doubtful or not _was_interrupted(raw)
                continue
            doubtful = doubtful and content["kind"] != "decision"
            broken = broken or end != seen - len(raw)
            last, end = content, seen
            decision = content if content["kind"] == "decision" else decision
            site = content.get("digest") if content["kind"] == "site" else site
    return Tail(end=end, size=seen, last=last, decision=decision, site=site, broken=broken, doubtful=doubtful)


def _was_interrupted(raw: bytes) -> bool:
    """Return True if the bytes are the beginning of a line whose writing was interrupted, so it was never published.

    Zeros or other bytes show that the disk has damaged the line after it was written.
    """
    return raw[: len(OPENING)] == OPENING[: len(raw)] and not raw.endswith(b"\n") and b"\0" not in raw


def write_whole(descriptor: int, data: bytes, size: int) -> None:
    """Append bytes to a file and wait until they are on disk; on failure cut the file back to its former size.

    descriptor : of the file, open for appending; data : the bytes; size : size of the file (bytes) before this call

    Raises
    ------
    OSError
        The bytes are not on disk: the disk is full or missing.
    """
    try:
        if os.fstat(descriptor).st_size != size:  # an earlier attempt could not restore the size
            os.ftruncate(descriptor, size)
        written = 0
        while written < len(data):
            written += os.write(descriptor, data[written:])
        os.fsync(descriptor)
    except OSError:
        _take_back(descriptor, size)
        raise


def _take_back(descriptor: int, size: int) -> None:
    """Cut a file back to a size (bytes), if possible, after a write failed.

    The next attempt to write checks the size again.
    """
    try:
        os.ftruncate(descriptor, size)
    except OSError:
        return


def sync_folder(folder: Path) -> None:
    """Wait until the names of new files in a folder are on disk, so that a power failure cannot lose a file."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def set_aside(path: Path, end: int, number: int) -> tuple[Path, bytes]:
    """Move an incomplete line at the end of a log file, after the position `end` (bytes), into a separate file.

    Return the path of the separate file, and the moved bytes.

    number : number of the incomplete line, which becomes part of the name of the separate file
    """
    with path.open("rb") as file:
        file.seek(end)
        torn = file.read()
    aside = path.with_name(f"{path.stem}.torn-{number:08d}")
    with aside.open("ab") as kept:
        kept.write(torn)
        kept.flush()
        os.fsync(kept.fileno())
    sync_folder(path.parent)
    os.truncate(path, end)
    return aside, torn
