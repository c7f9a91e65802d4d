"""The faults of places that their topic no longer reports, from the answers to these places.

A place that is missing in a message is either gone or merely not part of the message. If rocks from the place may
reach a limit of the site, or if this is not known in time, this is a fault. The fault ends when a later answer shows no
danger, the place is reported again and this message is answered, the topic publishes an empty message, or persons
acknowledge.
"""

import threading
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.site_model import EvidenceSpec, Thresholds
from rpf3d_core.alerts.time_units import ns_of, when
from rpf3d_core.alerts.unreported import is_judged, may_reach_a_limit
from rpf3d_core.live.triggers import Trigger

ALWAYS = 2**62
"""A time (ns) after every stamp."""

ANY = -1
"""Value of `Expected.stamp_ns` if an answer to the places of any message is expected."""

Place = tuple[float, ...]
"""Coordinates x, y, z (m) of a place."""

MOST_SHOWN = 20
"""Largest number of sets of unreported places of a topic that are kept: a person may acknowledge an earlier alert."""

MOST_EXPECTED = 100
"""Largest number of answers that are expected for one topic; a further answer replaces the last, with its deadline."""

REMEDY = (
    "look at the slope and acknowledge; or let the sensor report the places again, or publish an empty message if it "
    "sees no source. If the sensor scans wall after wall, state evidence.scan_period_s in the site file (0: each "
    "message has all places)"
)
"""What to do about places that are no longer reported."""


MAY_LAST = (
    "topic {}: danger was possible, and its newest sources are not answered yet; if this fault stays, the sensor "
    "reports places faster than they are answered: see evidence.scan_period_s of the site file"
)
"""Sentence of a fault without unreported places: the newest answer shows no danger, but may lack a place."""


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
class CheckedPlaces:
    """What is known about the unreported places of a topic: answers, expected answers, and whether danger is possible.

    where : which places, and until when they were reported, as a part of a sentence
    is_ended : True if the topic has no unreported places
    expected : the answers that are still expected, the oldest first; the places are judged if there is none
    judged_ns : stamp (ns) of the message whose unreported places the last answer judged, or of the message that ended
        the places; -1 if they ended without a message, ALWAYS if there is no answer that counts
    is_dangerous : True if rocks from the places of the last answer may reach a limit
    stands : True while a danger or fault stands that was shown earlier: until the places are judged harmless or have
        ended, and the message without the places is answered
    why_failed : why the places could not be simulated; "" if they could
    is_due : True if the places must be simulated again for that reason
    received_ns : stamp (ns) of the newest message of the topic with sources; -1 if there is none
    main_ns : stamp (ns) of the newest message of the topic whose answer counts; an answer of too few rocks does not
        count unless it shows danger; -1 if there is none
    changed_ns : `received_ns` when the unreported places last changed, or when a further part of a scan was received:
        only an answer to this message or a later one includes the places that it reports again
    danger_ns : stamp (ns) of the newest message whose answer may reach a limit or is missing; -1 if there is none,
        ALWAYS if the stamp is no longer valid
    reports_danger : True if the answer to `main_ns` shows danger, or is missing: then a level or another fault is shown
    reports_none : True if the answer to `main_ns` shows that there is no danger at all reported places of the topic
    has_danger : True from an answer that shows danger, or does not include all sources, until the answers to all
        places of the topic show no danger (`settle`); stamps that become invalid do not change this value
    evidence : the last answer to unreported places that counts
    shown : the last values of `where`, each with the places (x, y, z) (m) that it describes
    """

    where: str = ""
    is_ended: bool = True
    expected: list[Expected] = field(default_factory=list)
    judged_ns: int = ALWAYS
    is_dangerous: bool = False
    stands: bool = False
    why_failed: str = ""
    is_due: bool = False
    received_ns: int = -1
    main_ns: int = -1
    changed_ns: int = -1
    danger_ns: int = -1
    reports_danger: bool = False
    reports_none: bool = False
    has_danger: bool = False
    evidence: Evidence | None = None
    shown: dict[str, frozenset[Place]] = field(default_factory=dict)

    @property
    def is_open(self) -> bool:
        """True if danger was shown and may last, although the answer that counts does not show it.

        The danger may last while places of the topic, reported or unreported, are not answered.
        """
        is_unanswered = bool(self.expected) or self.main_ns < self.received_ns
        return self.has_danger and not self.reports_danger and is_unanswered

    @property
    def is_suspect(self) -> bool:
        """True if rocks from the reported or unreported places of the topic may reach a limit, or this is not known."""
        return self.is_unsettled or self.has_danger or self.main_ns <= max(self.danger_ns, self.received_ns - 1)

    @property
    def is_in_danger(self) -> bool:
        """True if danger was shown and did not end, or if it is not known whether there is danger.

        It is not known while a message with sources or new unreported places are not answered. After all answers were
        forgotten, `is_suspect` is True for every topic, but this property is True only if it was True before.
        """
        is_unanswered = self.received_ns > self.main_ns or any(each.stamp_ns != ANY for each in self.expected)
        return bool(self.has_danger or self.stands or self.is_dangerous or self.why_failed or is_unanswered)

    @property
    def is_unsettled(self) -> bool:
        """True if rocks from the unreported places may reach a limit, or this is not known."""
        return bool(self.stands or self.is_dangerous or self.expected or self.why_failed)

    def settle(self) -> None:
        """Set `stands` and, once the danger has ended, `has_danger`, after an answer or the end of the places.

        `stands` becomes True after a dangerous answer. It becomes False if the places are harmless or have ended, and
        the message without the places is answered. `has_danger` becomes False if all places of the topic are answered
        and show no danger; otherwise a place that changes between reported and unreported would be in no answer.
        """
        if self.is_dangerous:
            self.stands = True
        elif self.main_ns >= self.judged_ns:
            self.stands = False
        if self.reports_none and not self.is_unsettled and self.main_ns >= self.changed_ns:
            self.has_danger = False
            if self.danger_ns == ALWAYS:
                self.danger_ns = -1  # what was dangerous before the stamps became invalid is so no longer

    def expect(self, new: Expected) -> None:
        """Add an expected answer; if MOST_EXPECTED are expected, `new` replaces the last of them, with its deadline."""
        if len(self.expected) >= MOST_EXPECTED:
            last = self.expected.pop()
            new = new._replace(until_ns=last.until_ns, time_limit=last.time_limit)
        self.expected.append(new)

    def received(self, evidence: Evidence) -> None:
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

        If an earlier answer to sources of this topic showed danger, the topic remains suspect.

        until_ns, time_limit : as in `Expected`
        """
        self.expected = [] if self.is_ended else [Expected(ANY, digest="", until_ns=until_ns, time_limit=time_limit)]
        self.danger_ns = ALWAYS if self.danger_ns >= 0 else -1
        self.reports_danger = self.reports_none = False
        self.evidence, self.is_dangerous = None, False
        self.judged_ns = -1 if self.is_ended else ALWAYS


class UnreportedEvidence:
    """The unreported places of each topic and their answers. Any thread may call.

    now : returns the time of the node's clock (ns)
    changed : called after the unreported places of a topic have ended, so that the faults may have changed
    """

    def __init__(self, thresholds: Thresholds, now: Callable[[], int], changed: Callable[[], None]) -> None:
        self._thresholds, self._now, self._changed = thresholds, now, changed
        terms = thresholds.evidence
        self._longest_ns, self._longest = ns_of(terms.changed_terrain_s), _within(terms, "changed_terrain_s")
        self._moved_ns, self._moved = self._longest_ns, self._longest
        if terms.moved_area_s < terms.changed_terrain_s:
            self._moved_ns, self._moved = ns_of(terms.moved_area_s), _within(terms, "moved_area_s")
        self._has_areas = False
        self._topics: dict[str, CheckedPlaces] = {}
        self._lock = threading.Lock()

    def _of(self, topic: str) -> CheckedPlaces:
        return self._topics.setdefault(topic, CheckedPlaces())

    def expect(self, trigger: Trigger, last_ns: int) -> None:
        """Record that unreported places will be answered; they are a fault meanwhile if the topic had danger.

        They are also a fault if the answer takes longer than `changed_terrain_s`.

        trigger : the places, with the stamp of the message that does not report them
        last_ns : latest time (ns) at which one of the places was last reported; 0 if not known
        """
        with self._lock:
            one = self._of(trigger.topic)
            one.where, one.is_ended, one.changed_ns = _where(trigger, last_ns), False, one.received_ns
            until_ns = self._now() + self._longest_ns
            one.expect(Expected(trigger.stamp_ns, trigger.digest, until_ns, self._longest))
            one.shown.pop(one.where, None)
            one.shown[one.where] = frozenset(map(tuple, trigger.positions.tolist()))
            one.shown = dict(list(one.shown.items())[-MOST_SHOWN:])

    def received(self, topic: str, stamp_ns: int, is_further_part: bool = False) -> None:
        """Note a message of a topic with sources, which may be dangerous until they are answered.

        stamp_ns : stamp of the message (ns)
        is_further_part : True if the message is a further part of a scan, so the answer to the first part lacks places
        """
        with self._lock:
            one = self._of(topic)
            one.received_ns = max(one.received_ns, stamp_ns)
            if is_further_part:
                one.changed_ns = one.received_ns

    def watch(self, outlines: Mapping[str, str]) -> None:
        """Set the current areas. If these are the first areas, expect new answers to the unreported places.

        The former answers were made without any area, so they judge nothing.

        outlines : digest of the outline of each area, by name
        """
        until_ns = self._now() + self._moved_ns
        with self._lock:
            is_first, self._has_areas = bool(outlines) and not self._has_areas, bool(outlines)
            for one in self._topics.values() if is_first else ():
                if one.evidence is not None and not one.evidence.areas:
                    one.expect(Expected(stamp_ns=ANY, digest="", until_ns=until_ns, time_limit=self._moved))

    def places_of(self, topic: str, shown: Collection[str]) -> frozenset[Place]:
        """Return the unreported places (x, y, z) (m) of a topic that are in the faults of an alert (`shown`)."""
        with self._lock:
            known = dict(self._topics[topic].shown) if topic in self._topics else {}
        begins = {_begin(topic, where): places for where, places in known.items()}
        return frozenset().union(
            *(places for begin, places in begins.items() if any(fault.startswith(begin) for fault in shown))
        )

    def end(self, topic: str, stamp_ns: int = -1) -> None:
        """Record that a topic has no unreported places any more, and call `changed`.

        A fault of these places ends as soon as the message with the stamp `stamp_ns`, or a later message, is answered.

        stamp_ns : stamp of the message that ends the places (ns); -1 to end a fault immediately
        """
        now_ns = self._now()
        with self._lock:
            one = self._of(topic)
            one.stands = bool(self._fault_of(topic, one, now_ns))
            one.is_ended, one.expected, one.judged_ns, one.evidence = True, [], stamp_ns, None
            one.is_dangerous, one.why_failed, one.is_due = False, "", False
            one.changed_ns = max(one.received_ns, stamp_ns)
            one.settle()
        self._changed()

    def suspect(self, topic: str) -> None:
        """Record that the topic had reported danger before a restart."""
        with self._lock:
            one = self._of(topic)
            one.danger_ns, one.has_danger = ALWAYS, True

    def note(self, topic: str, evidence: Evidence) -> None:
        """Note an answer to the unreported places of a topic, or the fault that there is no answer.

        An answer also counts if further places were added after its sources were queued. Otherwise a sensor whose
        messages come faster than the answers would never get an answer that counts. An answer with a fault, for example
        because some places are over a hole, judges nothing, but may show danger. An answer that comes too late, when
        the places have changed, only shows that the topic had danger.
        """
        is_danger = may_reach_a_limit(evidence, self._thresholds)
        with self._lock:
            one = self._of(topic)
            one.has_danger = one.has_danger or is_danger
            if one.is_ended or (one.judged_ns != ALWAYS and evidence.trigger_stamp_ns < one.judged_ns):
                return
            if evidence.faults:
                one.why_failed, one.is_due = evidence.faults[0], not evidence.areas
            if is_danger or (not evidence.faults and self._is_harmless(evidence)):
                one.received(evidence)
                one.evidence, one.is_dangerous = evidence, is_danger
                if not evidence.faults:
                    one.why_failed, one.is_due = "", False
            one.settle()

    def note_reported(self, topic: str, evidence: Evidence, is_whole: bool = True) -> None:
        """Note an answer to the sources that a topic reports, or the fault that there is no answer.

        is_whole : True if the topic has reported all its places since answers were forgotten (`FirstScans`); only then
            may a harmless answer end an earlier danger
        """
        is_danger = may_reach_a_limit(evidence, self._thresholds) or not evidence.areas
        with self._lock:
            one = self._of(topic)
            counts = is_danger or is_judged(evidence, self._thresholds)
            if not evidence.sources:  # of two messages with one stamp, the message with sources counts
                counts = evidence.trigger_stamp_ns > one.received_ns
            is_newest = counts and evidence.trigger_stamp_ns >= one.main_ns
            if is_newest:
                one.main_ns, one.reports_danger = evidence.trigger_stamp_ns, is_danger and bool(evidence.sources)
            if is_danger and evidence.sources:
                one.danger_ns, one.has_danger = max(one.danger_ns, evidence.trigger_stamp_ns), True
            if evidence.sources and evidence.faults:  # some sources released no rock: nothing is known about them
                one.has_danger = True
            is_harmless = not (is_danger or evidence.faults) and is_judged(evidence, self._thresholds)
            if is_newest:
                one.reports_none = is_whole and (is_harmless or not evidence.sources)
            one.settle()

    def faults(self) -> dict[str, str]:
        """Return the fault of each topic with dangerous or unjudged unreported places as a sentence, by topic."""
        now_ns = self._now()
        with self._lock:
            found = {topic: self._fault_of(topic, one, now_ns) for topic, one in self._topics.items()}
        return {topic: fault for topic, fault in found.items() if fault}

    def _fault_of(self, topic: str, one: CheckedPlaces, now_ns: int) -> str:
        """Return the fault of a topic, "" for none; now_ns : current time (ns)."""
        late = [each for each in one.expected if now_ns >= each.until_ns]
        if one.why_failed:
            verdict = f"could not be simulated ({one.why_failed})"
        elif (one.stands and not one.is_ended) or (one.is_open and one.expected):
            verdict = "may reach a limit of the site"
        elif late:
            verdict = f"have not been simulated within {late[0].time_limit}"
        else:
            return MAY_LAST.format(topic) if one.stands or one.is_open else ""
        return f"{_begin(topic, one.where)} {verdict}: {REMEDY}"

    def _is_harmless(self, evidence: Evidence) -> bool:
        """Return True if an answer without danger counts: enough rocks flew to judge all areas, or there is no area."""
        return is_judged(evidence, self._thresholds) or not (evidence.areas or self._has_areas)

    def ends_ns(self) -> list[int]:
        """Return the times (ns), later than now, at which expected answers become faults if they do not arrive."""
        now_ns = self._now()
        with self._lock:
            late_ns = [min(each.until_ns for each in one.expected) for one in self._topics.values() if one.expected]
        return [each for each in late_ns if each > now_ns]

    def parts(self) -> list[Evidence]:
        """Return the answers to unreported places, to check that they are for the current terrain and areas."""
        with self._lock:
            return [one.evidence for one in self._topics.values() if one.evidence is not None]

    @property
    def suspects(self) -> tuple[str, ...]:
        """The topics whose last answer, or whose unreported places, may reach a limit, or are not judged yet."""
        with self._lock:
            return tuple(topic for topic, one in self._topics.items() if one.is_suspect)

    @property
    def dangers(self) -> tuple[str, ...]:
        """The topics on which danger is possible now, or was possible when all answers were forgotten."""
        with self._lock:
            return tuple(topic for topic, one in self._topics.items() if one.is_in_danger)

    def is_due(self, topic: str) -> bool:
        """Return True if the unreported places of a topic must be simulated again because the last attempt failed."""
        with self._lock:
            return topic in self._topics and self._topics[topic].is_due

    def restart(self) -> None:
        """Record that the stamps of earlier messages are invalid, before any later message is received.

        `forget` follows, perhaps only after later messages have been received.
        """
        with self._lock:
            for one in self._topics.values():
                one.has_danger = one.is_in_danger
                one.received_ns = one.changed_ns = -1

    def forget(self) -> None:
        """Note that all answers are forgotten; a danger shown earlier stays possible."""
        now_ns = self._now()
        with self._lock:
            for topic, one in self._topics.items():
                one.stands = bool(self._fault_of(topic, one, now_ns))
                one.has_danger = one.is_in_danger
                one.expect_all_again(now_ns + self._longest_ns, self._longest)
                one.main_ns = -1
                one.why_failed, one.is_due = "", False

    def lose(self) -> None:
        """Record that an error lost the answers: unreported places are a fault until they are simulated again."""
        now_ns = self._now()
        with self._lock:
            for one in self._topics.values():
                one.expect_all_again(now_ns + self._longest_ns, self._longest)
                if not one.is_ended:
                    one.why_failed, one.is_due = "their answer was lost", True


def _begin(topic: str, where: str) -> str:
    """Return the beginning of the sentence of a fault; topic : topic of the sources; where : as in `CheckedPlaces`."""
    return f"topic {topic} no longer reports {where}; rocks from there"


def _within(terms: EvidenceSpec, key: str) -> str:
    return f"{getattr(terms, key):g} s (evidence.{key})"


def _where(trigger: Trigger, last_ns: int) -> str:
    """Return as text which places a topic no longer reports, and until when it reported them.

    trigger : the places; last_ns : latest time (ns) at which one of them was reported, 0 if not known
    """
    x, y, z = trigger.positions[0]
    at, more = f"the place at ({x:.1f}, {y:.1f}, {z:.1f}) m", len(trigger.positions) - 1
    which = at if not more else f"{at} and {more:,} other{'s' if more > 1 else ''}"
    until = f"reported until {when(last_ns)}" if last_ns > 0 else "reported before the start of the node"
    return f"{which} ({until})"
