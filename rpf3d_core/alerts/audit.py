"""Audit a decision log: make every decision again, compare the results bit for bit, and check the hashes of lines."""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Alert, Level
from rpf3d_core.alerts.lines import (
    BEGINNING,
    FORMAT,
    Decision,
    Unreadable,
    alert_content,
    canonical,
    content_of,
    decision_of,
)
from rpf3d_core.alerts.log_files import files_in
from rpf3d_core.alerts.site import site_of
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.errors import InputError, SceneError

MOST_FINDINGS = 100
"""Largest number of findings that an audit keeps. In a damaged log, each line could otherwise give a finding."""


LATER = ("areas", "since", "terrain_digest", "terrain_stamp_ns")
"""Values of an alert that logs of older versions do not have."""

LATER_OF_AREA = ("since", "origin", "judged")
"""Values of an area that logs of older versions do not have; they are missing if the alert has no `since`."""


class LevelChange(NamedTuple):
    """A decision that an audit shows: the first decision, or a decision with a change or with an acknowledgement.

    A change is one of these: the level or the held level of the site, or the level of an area, differs from the
    previous decision; the alarm goes on or off; faults begin or end; other acknowledgements wait for another person.

    line : number of the line in the log; alert : the decision; before : the previous decision, None if there is none
    version : version of rpf3d that made the decision
    """

    line: int
    alert: Alert
    before: Alert | None
    version: str


@dataclass
class Audit:
    """The result of auditing a log.

    files, lines, decisions : numbers of files, lines and decisions that were read
    reproduced : number of decisions that were reproduced bit for bit
    versions : versions of rpf3d that wrote decisions, in order; refused : number of refused acknowledgements
    changes : the decisions that the audit shows, in order
    notes : sentences that help the reader; findings : sentences about errors
    hidden : number of findings that are not kept, beyond MOST_FINDINGS; head : hash of the last line
    """

    files: int = 0
    lines: int = 0
    decisions: int = 0
    reproduced: int = 0
    refused: int = 0
    versions: list[str] = field(default_factory=list)
    changes: list[LevelChange] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    findings: list[str] = field(default_factory=list)
    hidden: int = 0
    head: str = BEGINNING

    @property
    def sound(self) -> bool:
        """True if every decision was reproduced and nothing is damaged or missing."""
        return not self.findings and self.reproduced == self.decisions


def audit_log(path: str | Path, head: str | None = None) -> Audit:
    """Audit a log, given its folder or one of its files, and return the result.

    Parameters
    ----------
    path : str or Path
        The folder of the log, or a single file. With a single file, the files before it are not read.
    head : str or None
        A hash (64 hex digits) that was noted elsewhere. If no line of the log has this hash, lines have been removed or
        the log has been written again from the beginning.

    Raises
    ------
    InputError
        There is no log at the path, the log cannot be read, or no line is a line of a log.
    """
    files = _files(Path(path))
    reading = _AuditState(seeking=head)
    try:
        for number, file in files:
            reading.read(number, file)
    except OSError as error:
        raise InputError(f"{path}: the log cannot be read: {error.strerror}") from None
    if reading.last is None and reading.audit.lines:
        count = f"{reading.audit.lines:,}"
        raise InputError(f"{path}: is not a decision log: none of its {count} lines is a line of a decision log")
    if head is not None and not reading.found:
        reading.blame(f"no line of the log has the hash {head}: lines were removed, or the whole log was written again")
    return reading.audit


def _files(path: Path) -> list[tuple[int, Path]]:
    """Return the files of a log with their numbers, in order; a single file has the number 0.

    Raise InputError if there is no log at the path.
    """
    if path.is_file():
        return [(0, path)]
    files = files_in(path) if path.is_dir() else []
    if not files:
        what = "the folder has no decision log" if path.is_dir() else "there is no such log"
        raise InputError(f"{path}: {what}")
    return files


class _AuditState:
    """The state of an audit between lines of the log: what was found so far, and the last decision for comparison."""

    def __init__(self, seeking: str | None) -> None:
        self.audit, self.seeking, self.found = Audit(), seeking, False
        self.last: dict[str, Any] | None = None
        self.last_alert: Alert | None = None
        self.file_number, self.is_part = 0, False
        self.older: set[str] = set()
        self.sites: dict[str, Thresholds] = {}

    def blame(self, sentence: str) -> None:
        """Add a finding: a sentence about an error in the log. Beyond MOST_FINDINGS, only count it."""
        if len(self.audit.findings) < MOST_FINDINGS:
            self.audit.findings.append(sentence)
        else:
            self.audit.hidden += 1

    def read(self, number: int, path: Path) -> None:
        """Audit one file of the log.

        number : number of the file in the log, from 1; 0 if the file is audited alone
        """
        if number > self.file_number + 1:
            self.blame(f"{path.parent}: the files before {path.name} are missing")
        self.file_number, self.audit.files = number, self.audit.files + 1
        line = 0
        for line, raw in enumerate(_lines(path), start=1):
            self._line(f"{path.name}, line {line}", raw, first=line == 1, alone=number == 0)
        if line == 0:
            self.blame(f"{path.name}: is empty")

    def _line(self, place: str, raw: bytes, first: bool, alone: bool) -> None:
        self.audit.lines += 1
        content = content_of(raw)
        if content is None:
            torn = not raw.endswith(b"\n")
            why = "was cut off: its end was never written" if torn else "was damaged or changed after it was written"
            self.blame(f"{place}: {why}; its content is unknown")
            return
        self._chain(place, content, first and alone)
        self.last, self.audit.head = content, content["sha256"]
        self.found = self.found or content["sha256"] == self.seeking
        try:
            self._kind(place, content)
        except (Unreadable, SceneError) as error:
            self.blame(f"{place}: {error}")

    def _chain(self, place: str, content: dict[str, Any], begins_alone: bool) -> None:
        """Check by number and by hash that no line before this line is missing or changed.

        place : file and line, for messages; begins_alone : True for the first line of a file that is audited alone
        """
        before, number = (BEGINNING, 0) if self.last is None else (self.last["sha256"], self.last["n"] + 1)
        if begins_alone and self.last is None:
            self.is_part = content["n"] > 0
            if self.is_part:
                line = f"line {content['n']} of the log"
                self.audit.notes.append(f"{place}: is {line}; the audit does not read earlier files")
            return
        if content["n"] > number:
            self.blame(f"{place}: {content['n'] - number} lines before this line are missing")
        elif content["n"] < number:
            self.blame(f"{place}: has number {content['n']}, but must have number {number}")
        elif content["before"] != before:
            self.blame(f"{place}: contains another hash than that of the previous line, which was changed or replaced")

    def _kind(self, place: str, content: dict[str, Any]) -> None:
        kind = content["kind"]
        if kind == "file" and content.get("format") != FORMAT:
            raise Unreadable(f"has the format {content.get('format')}, but this version reads the format {FORMAT}")
        if kind == "site":
            self._site(place, content)
        elif kind == "decision":
            self._decision(place, content)
        elif kind == "torn":
            kept = content.get("kept_as")
            self.audit.notes.append(
                f"{place}: when the log was opened again, its last line was cut off; this line is kept as {kept}"
            )
            if content.get("damaged"):
                self.blame(f"{place}: the bytes in {kept} are damaged lines, and the decisions in them are missing")
        elif kind == "refused":
            self.audit.refused += 1
        elif kind != "file":
            raise Unreadable(f"has the kind {kind!r}, which this version does not know")

    def _site(self, place: str, content: dict[str, Any]) -> None:
        text = str(content.get("text"))
        if hashlib.sha256(text.encode(errors="replace")).hexdigest() != content.get("digest"):
            self.blame(f"{place}: the digest does not belong to the thresholds in this line")
        self.sites[str(content.get("digest"))] = site_of(text)

    def _decision(self, place: str, content: dict[str, Any]) -> None:
        """Repeat a logged decision from its logged inputs, and compare the result with the logged alert.

        Raise Unreadable if the decision cannot be repeated, or if no earlier line has its thresholds.

        place : file and line, for messages; content : of the line, from `content_of`
        """
        self.audit.decisions += 1
        version = str(content.get("version"))
        if version not in self.audit.versions:
            self.audit.versions.append(version)
        decision = decision_of(content)
        self._continues(place, decision, content)
        self.last_alert = decision.alert
        thresholds = self.sites.get(str(content.get("site")))
        if thresholds is None:
            raise Unreadable("the thresholds of this decision are not in the log before this line")
        again = self._as_written(place, alert_content(_decided_again(decision, thresholds)), content["alert"])
        if canonical(again) == canonical(content["alert"]):
            self.audit.reproduced += 1
        else:
            self.blame(f"{place}: {_difference(content['alert'], again)}")
        if _is_change(decision):
            self.audit.changes.append(
                LevelChange(line=content["n"], alert=decision.alert, before=decision.previous, version=version)
            )

    def _as_written(self, place: str, again: dict[str, Any], written: dict[str, Any]) -> dict[str, Any]:
        """Return the recomputed alert, reduced to the values that the logged alert has.

        A value is missing in the log if an older version of rpf3d did not write it. The audit gets one note for each
        name of a missing value.

        place : position in the log, for the note
        again, written : the recomputed and the logged alert, as plain values
        """
        lacking = [name for name in LATER if name not in written]
        for name in lacking:
            if name not in self.older:
                self.older.add(name)
                why = "because an older version wrote it; the other values are compared"
                self.audit.notes.append(f"{place}: has no `{name}`, {why}")
        if "since" in lacking:
            again = {**again, "areas": [_without(area, LATER_OF_AREA) for area in again["areas"]]}
        return _without(again, lacking)

    def _continues(self, place: str, decision: Decision, content: dict[str, Any]) -> None:
        """Check that a decision continues from the previous decision in the log, so that no decision is missing.

        place : file and line, for messages; decision, content : the decision in this line, and the content of the line
        """
        if lost := content.get("lost"):
            self.blame(f"{place}: {lost} decisions before this line could not be written, so they are not in the log")
        elif self.audit.decisions == 1 and self.is_part:
            return  # the previous decision is in a file that is not read
        elif decision.previous != self.last_alert:
            self.blame(f"{place}: does not continue the previous decision in the log")


def _lines(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        yield from file


def _decided_again(decision: Decision, thresholds: Thresholds) -> Alert:
    """Make a logged decision again from its logged inputs, and return the alert, to compare it with the logged alert.

    Raises Unreadable if a forged line contains values that are not numbers.
    """
    previous, evidence, now_ns, given = decision.previous, decision.evidence, decision.now_ns, decision.acknowledgement
    try:
        return decide(previous, evidence, thresholds, now_ns, given, decision.reported)
    except (TypeError, AttributeError, ValueError) as error:
        raise Unreadable(f"the decision cannot be made again from the values in this line: {error}") from None


def _without(content: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    return {name: value for name, value in content.items() if name not in names}


def areas_changed(before: Alert | None, alert: Alert) -> list[tuple[str, Level, Level]]:
    """Return (name, level before, level after) of each area whose level changed, without changes equal to the site's.

    A change of an area equals the site's change if both levels are the same. An area without a previous level has
    NORMAL as its level before. Without a previous decision, or with a previous decision without areas, the list is
    empty.

    before : the previous decision, None without one; alert : the decision
    """
    if before is None or not before.areas:
        return []
    levels, site = {area.name: area.level for area in before.areas}, (before.level, alert.level)
    steps = [(area.name, levels.get(area.name, Level.NORMAL), area.level) for area in alert.areas]
    return [(name, was, now) for name, was, now in steps if was != now and (was, now) != site]


def _is_change(decision: Decision) -> bool:
    alert, previous = decision.alert, decision.previous
    if previous is None or alert.acknowledgement is not None or areas_changed(previous, alert):
        return True
    shown = [(one.level, one.held, one.alarm, bool(one.faults), one.waiting) for one in (previous, alert)]
    return shown[0] != shown[1]


def _difference(written: dict[str, Any], again: dict[str, Any]) -> str:
    """Return a sentence on the first value of a decision that was not reproduced.

    written, again : the logged and the recomputed alert, as plain values
    """
    keys = [key for key in again if canonical(again[key]) != canonical(written.get(key))]
    keys += [key for key in written if key not in again]
    difference = f"`{keys[0]}` is {canonical(written.get(keys[0]))}, but the audit gets {canonical(again.get(keys[0]))}"
    return f"the decision is not reproduced: {difference}" + (f" (and {len(keys) - 1} more)" if len(keys) > 1 else "")
