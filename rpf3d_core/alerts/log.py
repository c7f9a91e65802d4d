"""The decision log: lines of JSON that are only appended; each line is on disk before its alert is published.

A log is a folder of numbered files. Each line contains the hash of the previous line, also from one file to the next,
so a changed or missing line is found. Each decision is logged with all inputs of `decide`, so `rpf3d audit` can repeat
the decision.

A state file (`state_file`) in the folder has facts that the lines lack: the last decision if the disk is full, and what
the node has received (`memory`). A file next to the folder (`witness`) shows that a log was begun.
"""

import fcntl
import hashlib
import os
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from rpf3d_core.alerts.levels import Acknowledgement, Alert
from rpf3d_core.alerts.lines import (
    BEGINNING,
    FORMAT,
    Decision,
    Unreadable,
    alert_content,
    alert_of,
    decision_content,
    decision_of,
    line_of,
)
from rpf3d_core.alerts.log_files import (
    NotLogged,
    Tail,
    file_name,
    files_in,
    set_aside,
    sync_folder,
    tail_of,
    write_whole,
)
from rpf3d_core.alerts.site import site_digest, site_text
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.state_file import NAME as STATE
from rpf3d_core.alerts.state_file import StateFile
from rpf3d_core.alerts.witness import Witness

LARGEST_BYTES = 16 * 1024 * 1024
"""Size (bytes) at which a log file is full, and the next line begins a new file: some thousand decisions."""


class DecisionLog:
    """The decision log in a folder, open for one writer.

    head : hash (64 hex digits) of the last line; if a person notes this hash elsewhere, a later audit can find whether
        this line was removed
    last_alert : the last decision, from which a restarted node must continue; None if there is none
    problems : sentences about problems found on opening, such as an incomplete line; empty if there were none
    unknown : why a level above that of `last_alert` may have been held; "" if `last_alert` is certain. The reason
        stays, also after a restart, until `settle` is called
    memory : what the node had received before the log was opened, as plain values
    missing : number of decisions that are not in the log, found on opening
    """

    def __init__(self, folder: str | Path, version: str, largest_bytes: int = LARGEST_BYTES) -> None:
        """Open or begin the log in a folder, for decisions of a version of rpf3d.

        version : of rpf3d; largest_bytes : size of a log file at which the next line begins a new file

        Raises
        ------
        NotLogged
            The folder cannot be written to, or another process writes a log there.
        """
        self.folder, self.version, self.largest_bytes = Path(folder), version, largest_bytes
        self.head = BEGINNING
        self.last_alert: Alert | None = None
        self.problems: tuple[str, ...] = ()
        self.unknown, self.missing = "", 0
        self.memory: dict[str, Any] = {}
        self._received: dict[str, Any] | None = self.memory
        self._state: StateFile | None = None
        self._witness = Witness(self.folder)
        self._next, self._lost, self._site = 0, 0, ""
        self._file, self._number, self._size, self._lock = -1, 0, 0, -1
        try:
            self._open()
        except OSError as error:
            self.close()
            raise _not_logged(self.folder, error) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, value: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def close(self) -> None:
        """Close the files; every line is already on disk."""
        for descriptor in (self._file, self._lock):
            if descriptor >= 0:
                os.close(descriptor)
        self._file, self._lock = -1, -1
        if self._state is not None:
            self._state.close()

    def decided(self, decision: Decision, thresholds: Thresholds) -> str:
        """Append a decision and return the hash of its line.

        The thresholds are written before the decision, unless they equal the last thresholds in the file.

        Raises
        ------
        NotLogged
            The decision is not on disk. The next decision in the log states the number of missing decisions before it.
        """
        lost = {"lost": self._lost} if self._lost else {}
        content = {"version": self.version, "site": site_digest(thresholds), **lost, **decision_content(decision)}
        try:
            self._append([("decision", content)], thresholds)
        except (OSError, TypeError, ValueError) as error:  # TypeError, ValueError: JSON cannot express a value
            self._lost, self.last_alert = self._lost + 1, decision.alert
            self._keep(lost=self._lost, next=self._next, alert=_content(decision.alert))
            raise _not_logged(self.folder, error) from error
        self._lost, self.last_alert = 0, decision.alert
        self._follow()
        return self.head

    def remember(self, received: dict[str, Any]) -> None:
        """Save the state that the node's next start needs; write it to disk only if it has changed.

        received : the state, as plain values, such as the topics that have published

        Raises
        ------
        NotLogged
            The values are not on disk. Unless a later call succeeds, the next start does not trust the log.
        """
        self._received = received
        if received != self._facts.get("memory") and (why := self._keep(memory=received)):
            raise NotLogged(f"{self.folder}: the received inputs cannot be saved for the next start: {why}")

    def lose_received(self) -> None:
        """Note on disk that the state for the node's next start (`remember`) could not be saved.

        Unless a later call of `remember` succeeds, the next start does not trust the log.
        """
        self._received = None
        self._witness.unlog()

    def settle(self) -> None:
        """Clear `unknown`, because a person has acknowledged that a higher level may have been held.

        The reason is also removed from the state file, and the note of missing decisions from the file of `Witness`.
        """
        self.unknown = ""
        self._keep(unknown="")
        self._witness.settle()

    def refused(self, given: Acknowledgement, because: str) -> str:
        """Log an acknowledgement that was refused before any decision, and return the hash of its line.

        given : the acknowledgement; because : the reason for the refusal

        Raises
        ------
        NotLogged
            The line is not on disk.
        """
        try:
            self._append([("refused", {**given._asdict(), "because": because})], None)
        except OSError as error:
            raise _not_logged(self.folder, error) from error
        return self.head

    @property
    def _facts(self) -> dict[str, Any]:
        return {} if self._state is None else self._state.facts

    def _keep(self, **facts: Any) -> str:
        """Replace some facts of the state file; return "" if they are on disk, else the reason why they are not.

        After a failure, the next start must not trust the log; a note of this is made in the file of `Witness`.
        """
        assert self._state is not None
        try:
            self._state.write({**self._facts, **facts})
        except (OSError, TypeError, ValueError) as error:
            self._witness.unlog()
            return str(getattr(error, "strerror", None) or error)
        return ""

    def _follow(self) -> None:
        """Update the state file after a decision was written to the log.

        If an earlier write failed, the file of `Witness` has a note. The note is removed if this log made the note,
        nothing is missing on disk now, and `unknown` is empty, so that no person must acknowledge the failure.
        """
        wanted = {"lost": 0, "alert": None, "file": self._number, "unknown": self.unknown}
        is_current = all(self._facts.get(name) == value for name, value in wanted.items()) or not self._keep(**wanted)
        is_remembered = self._received == (self._facts.get("memory") or {})
        if is_current and is_remembered and not self.unknown and self._witness.is_own:
            self._witness.settle()

    def _append(self, lines: list[tuple[str, dict[str, Any]]], thresholds: Thresholds | None) -> None:
        """Write all lines to disk, or none. Raises OSError if the lines are not on disk.

        lines : kind and content of each line
        thresholds : written before the last line, unless they equal the last thresholds in the file; or None
        """
        begins = self._file < 0 or self._size >= self.largest_bytes
        number = self._number + 1 if begins else self._number
        if begins:
            lines = [("file", {"format": FORMAT, "file": number, "version": self.version}), *lines]
        site = "" if begins else self._site
        if thresholds is not None and site_digest(thresholds) != site:
            site = site_digest(thresholds)
            place = len(lines) - 1  # before the decision
            lines = [*lines[:place], ("site", {"digest": site, "text": site_text(thresholds)}), *lines[place:]]
        data, head = b"", self.head
        for step, (kind, content) in enumerate(lines):
            raw, head = line_of(self._next + step, head, kind, content)
            data += raw
        self._begin_file(number, data) if begins else write_whole(self._file, data, self._size)
        self._size = len(data) if begins else self._size + len(data)
        self._next, self.head, self._site = self._next + len(lines), head, site

    def _begin_file(self, number: int, data: bytes) -> None:
        """Begin log file `number` with whole lines (`data`); on failure, no file is left behind."""
        path = self.folder / file_name(number)
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND, 0o644)
        try:
            write_whole(descriptor, data, 0)
            sync_folder(self.folder)
        except OSError:
            os.close(descriptor)
            path.unlink()
            raise
        if self._file >= 0:
            os.close(self._file)
        self._file, self._number = descriptor, number

    def _open(self) -> None:
        """Prepare to append: lock the folder, find the last line, and repair the effects of an interrupted write."""
        self.folder.mkdir(parents=True, exist_ok=True)
        self._lock = os.open(self.folder, os.O_RDONLY | os.O_DIRECTORY)
        fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        self._state = StateFile(self.folder)
        files = files_in(self.folder)
        self._number = files[-1][0] if files else 0
        tails = [(path, tail) for path, tail in _ends(files)]
        self._go_on_from([tail for _, tail in tails])
        self._judge([tail for _, tail in tails])
        if not tails:
            return
        path, tail = tails[0]
        if tail.broken:
            why = "lines in this file were damaged or changed; the file is kept, and the log continues in a new file"
            self.problems = (*self.problems, f"{path}: {why}")
            return
        self._resume(path, tail)

    def _go_on_from(self, tails: list[Tail]) -> None:
        """Set the number of the next line, the last hash and the last alert, so that the log can be continued.

        If the log lacks decisions that were made after its last line, the last alert is read from the state file.

        tails : the states of the last log files, newest first
        """
        last = next((tail.last for tail in tails if tail.last is not None), None)
        if last is not None:
            self._next, self.head = last["n"] + 1, last["sha256"]
        decision = next((tail.decision for tail in tails if tail.decision is not None), None)
        try:
            self.last_alert = None if decision is None else decision_of(decision).alert
            is_newer = decision is None or decision["n"] < int(self._facts.get("next", 0))
            if self._facts.get("lost") and is_newer:
                self._lost = self.missing = int(self._facts["lost"])
                self.last_alert = alert_of(self._facts["alert"])
        except Unreadable as error:
            self.problems = (*self.problems, f"{self.folder}: the last decision cannot be read: {error}")
            self.unknown = self.problems[-1]
        if self.missing:
            self.problems = (*self.problems, f"{self.folder}: the last {self.missing} decisions are not in the log")

    def _judge(self, tails: list[Tail]) -> None:
        """Set `unknown` and `memory` from the files on disk, and write `unknown` to disk before the log is repaired.

        The state file and the file of `Witness` are created if they are missing.

        tails : the states of the last log files, newest first

        Raises OSError if the state file of a new log cannot be written.
        """
        assert self._state is not None
        self.memory = self._received = dict(self._facts.get("memory") or {})
        self.unknown = self.unknown or self._why_unknown(tails) or str(self._facts.get("unknown", ""))
        if not self._state.exists:
            self._state.write({"unknown": self.unknown, "file": self._number, "memory": {}, "lost": 0, "alert": None})
        try:
            self._witness.begin()
        except OSError as error:
            if not tails:
                self.unknown = self.unknown or f"a first start cannot be distinguished from a lost log: {error}"
        if self.unknown != self._facts.get("unknown", ""):
            self._keep(unknown=self.unknown)
        if self.unknown and self.unknown not in self.problems:
            self.problems = (*self.problems, self.unknown)

    def _why_unknown(self, tails: list[Tail]) -> str:
        """Return a sentence on why decisions may be missing in the log; "" without a sign of missing decisions.

        If both the state file and the file of `Witness` are absent, this is not a sign of missing decisions: an older
        version of rpf3d wrote neither file.
        """
        assert self._state is not None
        newest = int(self._facts.get("file", 0))
        if self._witness.is_unlogged:
            return f"{self.folder}: decisions were made that are not in the log"
        if any(tail.doubtful for tail in tails):
            return f"{self.folder}: the last lines of the log are damaged"
        if newest > self._number:
            return f"{self.folder}: {file_name(newest)} is missing"
        if self._witness.is_there and not self._state.exists and not tails:
            return f"{self.folder}: the log that was begun there earlier is missing"
        if self._state.is_damaged or (self._witness.is_there and not self._state.exists):
            return f"{self.folder}: the file {STATE} of the log is missing or damaged"
        return ""

    def _resume(self, path: Path, tail: Tail) -> None:
        """Continue in the last log file; an incomplete line at its end is moved into a separate file, and logged.

        path : of the last log file; tail : its state
        """
        torn, aside = b"", path
        if tail.size > tail.end:
            aside, torn = set_aside(path, tail.end, self._next)
        if tail.last is None:  # the file has no sound line, so its number is free
            path.unlink()
            self._number -= 1
        else:
            self._file = os.open(path, os.O_WRONLY | os.O_APPEND)
            self._size, self._site = tail.end, tail.site or ""
            if not _ends_a_line(path):
                write_whole(self._file, b"\n", self._size)
                self._size += 1
        if torn:
            why = f"the last line was cut off; its {len(torn)} bytes are kept as {aside.name}"
            self.problems = (*self.problems, f"{path}: {why}")
            facts = {"bytes": len(torn), "of": hashlib.sha256(torn).hexdigest(), "kept_as": aside.name}
            facts |= {"damaged": True} if tail.doubtful else {}
            self._append([("torn", facts)], None)


def _content(alert: Alert) -> dict[str, Any] | None:
    """Return an alert as plain values; None if the conversion fails: no error may stop the publication of the alert."""
    try:
        return alert_content(alert)
    except (AttributeError, TypeError, KeyError):
        return None


def _ends(files: list[tuple[int, Path]]) -> list[tuple[Path, Tail]]:
    """Return paths and states of the last log files, from the newest back to the file that has the last decision."""
    found: list[tuple[Path, Tail]] = []
    for _, path in reversed(files):
        found.append((path, tail_of(path)))
        if found[-1][1].decision is not None:
            break
    return found


def _ends_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read() == b"\n"


def _not_logged(folder: Path, error: Exception) -> NotLogged:
    if isinstance(error, BlockingIOError):
        return NotLogged(f"{folder}: another process writes the decision log there")
    why = getattr(error, "strerror", None) or error
    return NotLogged(f"{folder}: the decision log cannot be written: {why}")
