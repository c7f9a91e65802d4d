"""The faults of places that their topic no longer reports, from the answers to these places.

A place that is missing in a message was either gone or merely not part of the message. If rocks from the place may
reach a limit of the site, this is a fault until the place is reported again, the topic publishes an empty message, or
persons acknowledge.
"""

import threading
from collections.abc import Callable
from dataclasses import dataclass

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.time_units import when
from rpf3d_core.alerts.unreported import is_judged, may_reach_a_limit

ALWAYS = 2**62
"""A time (ns) after every stamp."""

REMEDY = (
    "look at the slope and acknowledge; or let the sensor report the places again, or publish an empty message if it "
    "sees no source. If the sensor scans wall after wall, state evidence.scan_period_s in the site file (0: each "
    "message has all places)"
)
"""What to do about places that are no longer reported."""


@dataclass
class CheckedPlaces:
    """The check of the unreported places of a topic.

    stamp_ns : stamp (ns) of the message after which the present places were checked, or ended
    is_ended : True if the topic has no unreported places
    count : number of places; last_ns : when the last of the places was reported last (ns), 0 if not known
    is_dangerous : True if rocks from the present places may reach a limit; None until they are judged
    is_failed : True if the places could not be simulated, because of an error or because there is no terrain
    stands : True from a dangerous answer until the places are judged harmless or end, and the message without them is
        answered
    main_ns : stamp (ns) of the newest message of the topic that is answered
    danger_ns : stamp (ns) of the newest message whose answer may reach a limit; -1 if there is none
    evidence : the last answer to the present places that counts
    """

    stamp_ns: int = -1
    is_ended: bool = True
    count: int = 0
    last_ns: int = 0
    is_dangerous: bool | None = False
    is_failed: bool = False
    stands: bool = False
    main_ns: int = -1
    danger_ns: int = -1
    evidence: Evidence | None = None

    @property
    def is_fault(self) -> bool:
        """True if the unreported places are a fault now."""
        is_open = self.is_dangerous is None and self.main_ns >= self.stamp_ns and self.danger_ns >= self.last_ns
        return self.stands or self.is_failed or is_open

    def settle(self) -> None:
        """End a standing danger if the present places are harmless and the message without them is answered."""
        if self.is_dangerous:
            self.stands = True
        elif self.is_dangerous is False and self.main_ns >= self.stamp_ns:
            self.stands = False


class UnreportedEvidence:
    """The unreported places of each topic and their answers. Any thread may call.

    changed : called after a fault has ended without an answer
    """

    def __init__(self, thresholds: Thresholds, changed: Callable[[], None] = lambda: None) -> None:
        self._thresholds, self._changed = thresholds, changed
        self._topics: dict[str, CheckedPlaces] = {}
        self._lock = threading.Lock()

    def _of(self, topic: str) -> CheckedPlaces:
        return self._topics.setdefault(topic, CheckedPlaces())

    def expect(self, topic: str, stamp_ns: int, count: int, last_ns: int) -> None:
        """Note that unreported places will be answered; they are a fault meanwhile if the topic reported danger.

        stamp_ns : stamp of the message that does not report the places; count, last_ns : as in `CheckedPlaces`
        """
        with self._lock:
            one = self._of(topic)
            one.stamp_ns, one.count, one.last_ns, one.is_ended = stamp_ns, count, last_ns, False
            one.is_dangerous, one.is_failed, one.evidence = None, False, None

    def end(self, topic: str, stamp_ns: int = -1) -> None:
        """Note that a topic has no unreported places; a fault ends as soon as a message of this stamp is answered.

        stamp_ns : stamp of the message that ends them (ns); -1 to end a fault at once
        """
        with self._lock:
            one = self._of(topic)
            one.stamp_ns, one.is_ended, one.evidence = stamp_ns, True, None
            one.is_dangerous = one.is_failed = False
            one.settle()
        self._changed()

    def suspect(self, topic: str) -> None:
        """Note that the topic had reported danger before a restart."""
        with self._lock:
            self._of(topic).danger_ns = ALWAYS

    def note(self, topic: str, evidence: Evidence) -> None:
        """Note an answer to the unreported places of a topic, or a fault in its place.

        Without areas and faults, no rock can be released from the places any more: they are harmless.
        """
        with self._lock:
            one = self._of(topic)
            if one.is_ended or evidence.trigger_stamp_ns < one.stamp_ns:
                return
            if not evidence.areas:
                one.is_failed = bool(evidence.faults)
                one.is_dangerous = None if evidence.faults else False
            elif may_reach_a_limit(evidence, self._thresholds):
                one.is_dangerous, one.is_failed, one.evidence = True, False, evidence
            elif is_judged(evidence, self._thresholds):
                one.is_dangerous, one.is_failed, one.evidence = False, False, evidence
            one.settle()

    def note_reported(self, topic: str, evidence: Evidence) -> None:
        """Note an answer to the sources that a topic reports, or a fault in its place."""
        is_danger = may_reach_a_limit(evidence, self._thresholds) or not evidence.areas
        with self._lock:
            one = self._of(topic)
            one.main_ns = max(one.main_ns, evidence.trigger_stamp_ns)
            if is_danger and evidence.sources:
                one.danger_ns = max(one.danger_ns, evidence.trigger_stamp_ns)
            one.settle()

    def faults(self) -> dict[str, str]:
        """Return the fault of each topic with dangerous unreported places as a sentence, by topic."""
        with self._lock:
            return {topic: _sentence(topic, one) for topic, one in self._topics.items() if one.is_fault}

    def parts(self) -> list[Evidence]:
        """Return the answers to unreported places, which must be for the present terrain and areas like all answers."""
        with self._lock:
            return [one.evidence for one in self._topics.values() if one.evidence is not None]

    @property
    def suspects(self) -> tuple[str, ...]:
        """The topics whose last answer, or whose unreported places, may reach a limit, or are not judged yet."""
        with self._lock:
            return tuple(
                topic for topic, one in self._topics.items()
                if one.is_fault or one.is_dangerous is not False or 0 <= one.main_ns <= one.danger_ns
            )  # fmt: skip

    def is_failed(self, topic: str) -> bool:
        """Return True if the unreported places of a topic must be simulated again, because of an error."""
        with self._lock:
            return topic in self._topics and self._topics[topic].is_failed

    def forget(self) -> None:
        """Note that all answers are forgotten and earlier stamps are invalid; what was a danger remains suspect."""
        with self._lock:
            for one in self._topics.values():
                one.stands = one.is_fault
                one.danger_ns = ALWAYS if one.danger_ns >= 0 else -1
                one.main_ns = one.stamp_ns = -1
                one.is_failed, one.evidence = False, None
                one.is_dangerous = False if one.is_ended else None

    def lose(self) -> None:
        """Note that an error lost the answers: unreported places are a fault until they are simulated again."""
        with self._lock:
            for one in self._topics.values():
                one.danger_ns = ALWAYS if one.danger_ns >= 0 else -1
                one.is_failed, one.evidence = not one.is_ended, None
                one.is_dangerous = False if one.is_ended else None


def _sentence(topic: str, one: CheckedPlaces) -> str:
    places = "a place was" if one.count == 1 else f"{one.count:,} places were"
    until = f"until {when(one.last_ns)}" if one.last_ns > 0 else "before the start of the node"
    which = "and is" if one.count == 1 else "and are"
    verdict = "could not be simulated" if one.is_failed else "may reach a limit of the site"
    gone = f"{places} reported by topic {topic} {until} {which} not reported any more"
    return f"{gone}; rocks from there {verdict}: {REMEDY}"
