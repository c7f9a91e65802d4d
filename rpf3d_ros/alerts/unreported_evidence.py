"""The faults of places that their topic no longer reports, from the answers to these places.

A place that is missing in a message is either gone or merely not part of the message. If rocks from the place may
reach a limit of the site, or if this is not known in time, this is a fault. The fault ends when a later answer shows no
danger, the place is reported again and this message is answered, the topic publishes an empty message, or persons
acknowledge.
"""

import threading
from collections.abc import Callable, Collection, Mapping

from rpf3d_core.alerts.evidence import Evidence
from rpf3d_core.alerts.site_model import EvidenceSpec, Thresholds
from rpf3d_core.alerts.time_units import ns_of, when
from rpf3d_core.alerts.unreported import is_judged, possible_levels, shown_levels
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.alerts.checked_places import ALWAYS, ANY, ANYWHERE, CheckedPlaces, Expected, Place
from rpf3d_ros.alerts.source_topics import BY_HAND

Shown = Callable[[str], Collection[Evidence]]
"""A function that returns the answers to the reported sources of a topic on which a decision is made."""

MOST_SHOWN = 20
"""Largest number of sets of unreported places of a topic that are kept: a person may acknowledge an earlier alert."""

REMEDY = (
    "look at the slope and acknowledge; or let the sensor report the places again, or publish an empty message if it "
    "sees no source. If the sensor scans wall after wall, state evidence.scan_period_s in the site file (0: each "
    "message has all places)"
)
"""What to do about places that are no longer reported."""


MAY_LAST = (
    "topic {}: danger was possible, and its newest sources are not answered yet; if this fault stays, the sensor "
    "reports places faster than they are answered: {}"
)
"""Sentence of a fault without unreported places: the answers so far show less danger, but may lack a place."""


DANGER = "may reach a limit of the site"
"""Verdict on unreported places at which danger is possible."""


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
        self._advice = "report fewer sources, or less often"
        if terms.scan_period_s is None:
            self._advice = "see evidence.scan_period_s of the site file"
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
            one.where = _where(trigger, last_ns)
            one.set_unreported(trigger.digest)
            until_ns = self._now() + self._longest_ns
            one.expect(Expected(trigger.stamp_ns, trigger.digest, until_ns, self._longest))
            one.shown.pop(one.where, None)
            one.shown[one.where] = frozenset(map(tuple, trigger.positions.tolist()))
            one.shown = dict(list(one.shown.items())[-MOST_SHOWN:])

    def received(self, topic: str, stamp_ns: int, first_ns: int) -> None:
        """Note a message of a topic with sources, which may be dangerous until they are answered.

        stamp_ns : stamp (ns) of the sources to simulate, which is later for each further part of a scan
        first_ns : stamp (ns) of the message, which is also that of the first part
        """
        if topic == BY_HAND:  # a click counts until it is too old, and no later message answers for it
            return
        with self._lock:
            self._of(topic).receive(stamp_ns, first_ns)

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
                    one.harmless = ""

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

        stamp_ns : stamp of the message that ends the places (ns); -1 to end a fault of unreported places immediately
        """
        now_ns = self._now()
        with self._lock:
            one = self._of(topic)
            if stamp_ns < 0 and one.is_ended:
                return  # a person acknowledged places that were reported again: only the answer to them ends the fault
            one.stands = bool(_verdict(one, now_ns))
            one.expected, one.judged_ns, one.evidence = [], stamp_ns, None
            one.is_dangerous, one.why_failed, one.is_due = False, "", False
            one.set_unreported("", stamp_ns)
            one.settle()
        self._changed()

    def suspect(self, topic: str) -> None:
        """Record that the topic had reported danger before a restart."""
        with self._lock:
            one = self._of(topic)
            one.danger_ns = ALWAYS
            one.raise_danger(ANYWHERE)

    def note(self, topic: str, evidence: Evidence) -> None:
        """Note an answer to the unreported places of a topic, or the fault that there is no answer.

        An answer also counts if further places were added after its sources were queued. Otherwise a sensor whose
        messages come faster than the answers would never get an answer that counts. An answer with a fault, for example
        because some places are over a hole, judges nothing, but may show danger. An answer that comes too late, when
        the places have changed, only shows that the topic had danger.
        """
        levels = possible_levels(evidence, self._thresholds)
        is_harmless = not (levels or evidence.faults) and self._is_harmless(evidence)
        with self._lock:
            one = self._of(topic)
            one.raise_danger(levels, evidence.trigger_stamp_ns)
            if is_harmless:
                one.harmless = evidence.sources_digest
            elif one.harmless == evidence.sources_digest:
                one.harmless = ""
            if one.is_ended or (one.judged_ns != ALWAYS and evidence.trigger_stamp_ns < one.judged_ns):
                return
            if evidence.faults:
                one.why_failed, one.is_due = evidence.faults[0], not evidence.areas
            if levels or is_harmless:
                one.answered(evidence)
                one.evidence, one.is_dangerous = evidence, bool(levels)
                if not evidence.faults:
                    one.why_failed, one.is_due = "", False
            one.settle()

    def note_reported(self, topic: str, evidence: Evidence, is_whole: bool = True) -> None:
        """Note an answer to the sources that a topic reports, or the fault that there is no answer.

        is_whole : True if the topic has reported all its places since answers were forgotten (`FirstScans`); only then
            may a harmless answer end an earlier danger
        """
        if topic == BY_HAND:  # as in `received`
            return
        levels = possible_levels(evidence, self._thresholds) if evidence.areas else dict(ANYWHERE)
        is_judging = is_whole and not evidence.faults and is_judged(evidence, self._thresholds)
        stamp_ns, until_ns = evidence.trigger_stamp_ns, self._now() + self._longest_ns
        with self._lock:
            one = self._of(topic)
            if not evidence.sources:  # of two messages with one stamp, the message with sources counts
                if stamp_ns > one.received_ns and stamp_ns >= one.main_ns:
                    one.main_ns, one.reported, one.is_doubtful = stamp_ns, {} if is_whole else None, False
                one.settle()
                return
            one.raise_danger(levels, stamp_ns)
            if evidence.faults:  # some sources released no rock: nothing is known about them
                one.raise_danger(ANYWHERE)
            if levels:
                one.danger_ns = max(one.danger_ns, stamp_ns)
            if stamp_ns >= one.main_ns and (levels or is_judged(evidence, self._thresholds)):
                one.main_ns, one.is_doubtful = stamp_ns, False
                one.reported = levels if is_judging and not one.scans.is_incomplete(stamp_ns) else None
            elif levels:
                one.doubt(until_ns, self._longest)
            one.settle()

    def faults(self, shown: Shown | None = None) -> dict[str, str]:
        """Return the fault of each topic with a danger that a decision does not show as a sentence, by topic.

        Such a danger is that of unreported places, or one that was shown before and is not answered completely.

        shown : the answers on which the decision is made; None if the decision shows no danger
        """
        now_ns = self._now()
        with self._lock:
            found = {topic: self._fault_of(topic, one, now_ns, shown) for topic, one in self._topics.items()}
        return {topic: fault for topic, fault in found.items() if fault}

    def _fault_of(self, topic: str, one: CheckedPlaces, now_ns: int, shown: Shown | None) -> str:
        """Return the fault of a topic, "" for none; now_ns : current time (ns); shown : as in `faults`."""
        is_hidden = one.may_last and self._is_hidden(one, shown(topic) if shown else ())
        verdict = _verdict(one, now_ns)
        if is_hidden and one.expected and not one.why_failed:
            verdict = DANGER
        if verdict and not one.is_ended:
            return f"{_begin(topic, one.where)} {verdict}: {REMEDY}"
        return MAY_LAST.format(topic, self._advice) if verdict or is_hidden else ""

    def _is_hidden(self, one: CheckedPlaces, shown: Collection[Evidence]) -> bool:
        """Return True if a decision on some answers to a topic (`shown`) shows neither its danger nor a fault."""
        if any(evidence.faults or (evidence.sources and not evidence.areas) for evidence in shown):
            return False
        return one.exceeds(shown_levels(shown, self._thresholds))

    def _is_harmless(self, evidence: Evidence) -> bool:
        """Return True if an answer without danger counts: enough rocks flew to judge all areas, or there is no area."""
        return is_judged(evidence, self._thresholds) or not (evidence.areas or self._has_areas)

    def has_become_late(self, since_ns: int, now_ns: int) -> bool:
        """Return True if an expected answer has become late after `since_ns`, until `now_ns` (both ns)."""
        with self._lock:
            until_ns = [each.until_ns for one in self._topics.values() for each in one.expected]
        return any(since_ns < each <= now_ns for each in until_ns)

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
                one.restart()

    def forget(self) -> None:
        """Note that all answers are forgotten; a danger shown earlier stays possible."""
        now_ns = self._now()
        with self._lock:
            for topic, one in self._topics.items():
                one.stands = bool(self._fault_of(topic, one, now_ns, None))
                one.keep_danger()
                one.expect_all_again(now_ns + self._longest_ns, self._longest)
                one.main_ns, one.is_restarted = -1, False
                one.why_failed, one.is_due = "", False

    def lose(self) -> None:
        """Record that an error lost the answers: unreported places are a fault until they are simulated again."""
        now_ns = self._now()
        with self._lock:
            for one in self._topics.values():
                one.expect_all_again(now_ns + self._longest_ns, self._longest)
                if not one.is_ended:
                    one.why_failed, one.is_due = "their answer was lost", True


def _verdict(one: CheckedPlaces, now_ns: int) -> str:
    """Return as text why unreported places are a fault by themselves, "" if they are none; now_ns : now (ns)."""
    if one.why_failed:
        return f"could not be simulated ({one.why_failed})"
    if one.stands:
        return DANGER
    late = [each for each in one.expected if now_ns >= each.until_ns]
    return f"have not been simulated within {late[0].time_limit}" if late else ""


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
