"""The state of one topic whose places may no longer be reported: expected answers, and the danger that was shown.

A danger that an answer has shown stays possible until all places of the topic, reported or not, are answered without
this danger.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.levels import Level

ALWAYS = 2**62
"""A time (ns) after every stamp."""

ANY = -1
"""Value of `Expected.stamp_ns` if an answer to the places of any message is expected."""

Place = tuple[float, ...]
"""Coordinates x, y, z (m) of a place."""

ANYWHERE: Mapping[str, Level] = {"": Level.EVACUATE}
"""A danger in unknown areas."""

MOST_EXPECTED = 100
"""Largest number of answers that are expected for one topic; a further answer replaces the last, with its deadline."""

MOST_MESSAGES = 1000
"""Largest number of messages that are remembered while none of them is answered; older messages are forgotten."""


class Expected(NamedTuple):
    """An expected answer to the unreported places after one message.

    stamp_ns : stamp of the message (ns); ANY if any answer is the expected one
    digest : digest of the places, as in `Trigger`; "" if it is not known
    until_ns : time until which the answer must arrive (ns)
    time_limit : how long the answer may take, and the key of the site file that states it, as the end of a sentence
    """

    stamp_ns: int
    digest: str
    until_ns: int
    time_limit: str


@dataclass
class Scans:
    """The messages of a topic with sources that are not answered yet, or were answered last.

    unreported_at : stamp of each message (ns) -> digest of the places that were unreported after it; "" if there were
        none
    last_parts : stamp of the first part of each scan in parts (ns) -> stamp of its last part so far
    """

    unreported_at: dict[int, str] = field(default_factory=dict)
    last_parts: dict[int, int] = field(default_factory=dict)

    def note(self, stamp_ns: int, first_ns: int, digest: str) -> None:
        """Note a message, or the places that are unreported after it; stamps as in `UnreportedEvidence.received`."""
        self.unreported_at[stamp_ns] = digest
        if stamp_ns > first_ns:
            self.last_parts[first_ns] = stamp_ns
        for known in (self.unreported_at, self.last_parts):
            while len(known) > MOST_MESSAGES:
                del known[next(iter(known))]  # type: ignore[attr-defined]

    def is_incomplete(self, stamp_ns: int) -> bool:
        """Return True if a further part of a scan was received after the part with this stamp (ns)."""
        return any(first <= stamp_ns < last for first, last in self.last_parts.items())

    def forget_before(self, stamp_ns: int) -> None:
        """Forget the messages with earlier stamps (ns), and of more than MOST_MESSAGES messages the earliest."""
        kept = {at: digest for at, digest in self.unreported_at.items() if at >= stamp_ns}
        self.unreported_at = dict(list(kept.items())[-MOST_MESSAGES:])
        parts = {first: last for first, last in self.last_parts.items() if last >= stamp_ns}
        self.last_parts = dict(list(parts.items())[-MOST_MESSAGES:])


@dataclass
class CheckedPlaces:
    """What is known about the places of a topic: answers, expected answers, and which danger is possible.

    where : which places are unreported, and until when they were reported, as a part of a sentence
    digest : digest of the unreported places, as in `Trigger`; "" if the topic has none
    expected : the answers to unreported places that are still expected, the oldest first; the places are judged if
        there is none
    judged_ns : stamp (ns) of the message whose unreported places the last answer judged, or of the message that ended
        the places; -1 if they ended without a message, ALWAYS if there is no answer that counts
    is_dangerous : True if rocks from the places of the last answer may reach a limit
    harmless : digest of the unreported places that were last answered without danger; "" if there are none, or if
        danger was shown later by another answer (`doubt`)
    is_doubtful : True if danger was shown again after the answer to `main_ns` (`doubt`)
    stands : True while a danger or fault of unreported places stands that was shown earlier: until the places are
        judged harmless or have ended, and the message without the places is answered
    why_failed : why the places could not be simulated; "" if they could
    is_due : True if the places must be simulated again for that reason
    received_ns : stamp (ns) of the newest message of the topic with sources; -1 if there is none
    scans : the messages of the topic with sources
    main_ns : stamp (ns) of the newest message of the topic whose answer counts; an answer of too few rocks does not
        count unless it shows danger; -1 if there is none
    changed_ns : stamp (ns) of the message that last changed the unreported places: only an answer to this message or a
        later one includes the places that it reports again
    danger_ns : stamp (ns) of the newest message whose answer may reach a limit or is missing; -1 if there is none,
        ALWAYS if the stamp is no longer valid
    shown_ns : stamp (ns) of the newest message with an answer, to reported or unreported places, that raised `danger`
    danger : area -> highest level that answers have shown to be possible there, until answers to all places of the
        topic show less (`settle`); `ANYWHERE` if the areas are not known; stamps that become invalid change nothing
    reported : the possible levels in the answer to `main_ns`, by area; None if that answer does not judge all reported
        places of the topic
    before : `danger` before `settle` last lowered it; lowered_ns : `main_ns` at this time, -1 if there is none
    is_restarted : True if stamps have become invalid, but the answers are not forgotten yet
    evidence : the last answer to unreported places that counts
    shown : the last values of `where`, each with the places (x, y, z) (m) that it describes
    """

    where: str = ""
    digest: str = ""
    expected: list[Expected] = field(default_factory=list)
    judged_ns: int = ALWAYS
    is_dangerous: bool = False
    harmless: str = ""
    is_doubtful: bool = False
    stands: bool = False
    why_failed: str = ""
    is_due: bool = False
    received_ns: int = -1
    scans: Scans = field(default_factory=Scans)
    main_ns: int = -1
    changed_ns: int = -1
    danger_ns: int = -1
    shown_ns: int = -1
    danger: dict[str, Level] = field(default_factory=dict)
    reported: dict[str, Level] | None = None
    before: Mapping[str, Level] = field(default_factory=dict)
    lowered_ns: int = -1
    is_restarted: bool = False
    evidence: Evidence | None = None
    shown: dict[str, frozenset[Place]] = field(default_factory=dict)

    @property
    def is_ended(self) -> bool:
        """True if the topic has no unreported places."""
        return not self.digest

    @property
    def is_unanswered(self) -> bool:
        """True if places of the topic, or a message that changed them, are not answered, or answers may be invalid."""
        is_behind = self.main_ns < max(self.received_ns, self.changed_ns)
        return bool(self.expected) or is_behind or self.is_doubtful or self.is_restarted

    @property
    def may_last(self) -> bool:
        """True if a danger that was shown may last, because places of the topic are not answered."""
        return bool(self.danger) and self.is_unanswered

    def exceeds(self, shown: Mapping[str, Level]) -> bool:
        """Return True if the danger is greater than the levels, by area, that a decision shows for this topic."""
        return any(shown.get(area, Level.NORMAL) < level for area, level in self.danger.items())

    @property
    def is_suspect(self) -> bool:
        """True if rocks from the reported or unreported places of the topic may reach a limit, or this is not known."""
        return self.is_unsettled or bool(self.danger) or self.main_ns <= max(self.danger_ns, self.received_ns - 1)

    @property
    def is_in_danger(self) -> bool:
        """True if danger was shown and did not end, or if it is not known whether there is danger.

        It is not known while a message with sources or new unreported places are not answered. After all answers were
        forgotten, `is_suspect` is True for every topic, but this property is True only if it was True before.
        """
        is_unanswered = self.received_ns > self.main_ns or any(each.stamp_ns != ANY for each in self.expected)
        return bool(self.danger or self.stands or self.is_dangerous or self.why_failed or is_unanswered)

    @property
    def is_unsettled(self) -> bool:
        """True if rocks from the unreported places may reach a limit, or this is not known."""
        return bool(self.stands or self.is_dangerous or self.expected or self.why_failed)

    @property
    def _are_all_answered(self) -> bool:
        """True if the answer to `main_ns` and the answers to unreported places together include all places.

        Either the unreported places have not changed since the message `main_ns`, and are judged. Or the places that
        were unreported at its time are judged: later messages may then still wait, but no answer to them has shown
        danger.
        """
        if not self.is_unsettled and self.main_ns >= self.changed_ns:
            return True
        is_judged = self.scans.unreported_at.get(self.main_ns) in ("", self.harmless)
        return is_judged and self.main_ns >= self.shown_ns and not (self.is_dangerous or self.why_failed)

    def raise_danger(self, levels: Mapping[str, Level], stamp_ns: int = -1) -> None:
        """Note possible levels, by area; stamp_ns : stamp of the message with this answer (ns), -1 if not known."""
        for area, level in levels.items():
            self.danger[area] = max(self.danger.get(area, Level.NORMAL), level)
        if levels:
            self.shown_ns = max(self.shown_ns, stamp_ns)

    def keep_danger(self) -> None:
        """Note a danger in unknown areas if danger is possible, but no answer has shown where."""
        if self.is_in_danger and not self.danger:
            self.raise_danger(ANYWHERE)

    def settle(self) -> None:
        """Set `stands` and, once the danger has ended, lower `danger`, after an answer or the end of the places.

        `stands` becomes True after a dangerous answer. It becomes False if the places are harmless or have ended, and
        the message without the places is answered. `danger` becomes that of the answer to `main_ns` if all places of
        the topic are answered, and the unreported places show no danger; otherwise a place that changes between
        reported and unreported would be in no answer.
        """
        if self.is_dangerous:
            self.stands = True
        elif self.main_ns >= self.judged_ns:
            self.stands = False
        if self.reported is not None and self._are_all_answered:
            self.stands = False
            if self.danger != self.reported:
                self.before, self.lowered_ns = dict(self.danger), self.main_ns
                self.danger = dict(self.reported)
            if self.danger_ns == ALWAYS:  # what was dangerous before the stamps became invalid is answered now
                self.danger_ns = self.main_ns if self.danger else -1
        self.scans.forget_before(self.main_ns)

    def receive(self, stamp_ns: int, first_ns: int) -> None:
        """Note a message with sources; stamps as in `UnreportedEvidence.received`.

        A further part of a scan may report what its earlier parts lack, so the answers to these parts end no danger.
        """
        self.received_ns = max(self.received_ns, stamp_ns)
        self.scans.note(stamp_ns, first_ns, self.digest)
        if first_ns <= self.main_ns < stamp_ns:
            self.reported = None
        if first_ns <= self.lowered_ns < stamp_ns:
            self.raise_danger(self.before)

    def expect(self, new: Expected) -> None:
        """Add an expected answer; if MOST_EXPECTED are expected, `new` replaces the last of them, with its deadline."""
        if len(self.expected) >= MOST_EXPECTED:
            last = self.expected.pop()
            new = new._replace(until_ns=last.until_ns, time_limit=last.time_limit)
        self.expected.append(new)

    def doubt(self, until_ns: int, time_limit: str) -> None:
        """Note that an older message was answered again, with danger: other ground or areas have made it dangerous.

        The answers so far may be for the former ground, so none of them ends this danger: the unreported places and the
        newest message must be answered again. until_ns, time_limit : as in `Expected`
        """
        self.reported, self.harmless, self.is_doubtful = None, "", True
        if not self.is_ended:
            self.is_due = True
            if not self.expected:
                self.expect(Expected(ANY, digest="", until_ns=until_ns, time_limit=time_limit))

    def set_unreported(self, digest: str, stamp_ns: int = -1) -> None:
        """Note that a message, or a person, has changed the unreported places.

        digest : as in the attribute; stamp_ns : stamp of the message (ns), -1 for the newest message with sources
        """
        self.digest, self.changed_ns = digest, max(self.received_ns, stamp_ns)
        if self.changed_ns in self.scans.unreported_at:  # not for a message without sources
            self.scans.unreported_at[self.changed_ns] = digest

    def answered(self, evidence: Evidence) -> None:
        """Note an answer to unreported places, and remove this and all earlier answers from the expected answers.

        The same places may be expected several times, because a message was sent twice, but are simulated once.
        """
        digests = [each.digest for each in self.expected]
        if evidence.sources_digest in digests:
            del self.expected[: len(digests) - digests[::-1].index(evidence.sources_digest)]
            self.expected = [each for each in self.expected if each.stamp_ns != ANY]
        else:  # an answer to places as they were before
            self.expected = [each for each in self.expected if each.stamp_ns >= evidence.trigger_stamp_ns]
        self.judged_ns = evidence.trigger_stamp_ns

    def expect_all_again(self, until_ns: int, time_limit: str) -> None:
        """Discard all answers to the unreported places of this topic; expect a new answer if there are such places.

        Answers to later messages stay expected: an earlier answer lacks their places. If an earlier answer to sources
        of this topic showed danger, the topic remains suspect.

        until_ns, time_limit : as in `Expected`
        """
        later = [each for each in self.expected if each.stamp_ns != ANY]
        again = Expected(ANY, digest="", until_ns=until_ns, time_limit=time_limit)
        self.expected = [] if self.is_ended else [again, *later]
        self.danger_ns = ALWAYS if self.danger_ns >= 0 else -1
        self.reported, self.harmless = None, ""
        self.evidence, self.is_dangerous = None, False
        self.judged_ns = -1 if self.is_ended else ALWAYS

    def restart(self) -> None:
        """Note that all stamps so far are invalid; answers to earlier messages are no longer expected by their stamp.

        `UnreportedEvidence.forget` follows, perhaps only after later messages have been received.
        """
        self.keep_danger()
        self.is_restarted = True
        self.expected = [each._replace(stamp_ns=ANY, digest="") for each in self.expected[:1]]
        self.scans, self.before, self.lowered_ns = Scans(), {}, -1
        self.received_ns = self.changed_ns = self.shown_ns = -1
