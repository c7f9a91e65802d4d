"""Find, for each message of sources, which sources to simulate, and which places its topic no longer reports."""

import math
import time
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.time_units import ns_of, when
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.alerts.first_scans import FirstScans
from rpf3d_ros.alerts.topic_votes import TopicVotes
from rpf3d_ros.alerts.unreported_evidence import Place, UnreportedEvidence
from rpf3d_ros.alerts.unreported_places import ReportedPlaces, Update

CAUSE = "places: {}"
"""Name of the cause of a standing fault: the node had to forget places of a topic; the topic replaces the braces."""

FORGOTTEN = (
    "{} had reported {} that it reports no longer, and the node has forgotten some of these places{}: look at the "
    "slope and acknowledge, or publish an empty message if the sensor sees no source"
)
"""Sentence of the fault of forgotten places; the braces stand for the topic, how many places, and when."""

FORGOTTEN_IN_A_SCAN = (
    "{} has reported {} within evidence.scan_period_s, and the node has forgotten some of these places{}: report fewer "
    "places, or correct this time in the site file; or look at the slope and acknowledge"
)
"""As FORGOTTEN, for a site with a scan period."""

FORGOTTEN_PARTS = (
    "{} has reported {} in messages with one stamp, and the node has forgotten some of these places{}: report fewer "
    "places, or let the stamp of each scan be later; then acknowledge"
)
"""As FORGOTTEN, for a scan in several messages."""

FORGOTTEN_BEFORE = (
    "{} had reported more places before the start of the node than the node remembers: look at the slope and "
    "acknowledge, or publish an empty message if the sensor sees no source"
)
"""As FORGOTTEN, for places from before a restart; the braces stand for the topic."""


class Forgotten(NamedTuple):
    """A fault of a topic whose places the node had to forget.

    sentence : sentence of the fault
    at_ns : stamp of the last message with too many places (ns); at_s : when it was received (s, steady clock)
    """

    sentence: str
    at_ns: int
    at_s: float


class PlaceChecks:
    """The places that each topic has reported, and the faults of places that are no longer reported.

    thresholds : thresholds of the site; distance : distance (m) within which two reports are about the same place
    checks : the answers to unreported places; scans : the first scan of each topic
    report : called with the cause and the sentence of a standing fault
    end : called with a topic whose unreported places need no further answers

    Only one thread may call; any thread may call `to_remember`.
    """

    def __init__(
        self, thresholds: Thresholds, distance: float, checks: UnreportedEvidence, scans: FirstScans,
        report: Callable[[str, str], None], end: Callable[[str], None],
    ) -> None:  # fmt: skip
        self._period = thresholds.evidence.scan_period_s
        self._places = ReportedPlaces(self._period, distance)
        self._checks, self._scans, self._report, self._end = checks, scans, report, end
        self._votes = TopicVotes(thresholds.acknowledge)
        self._forgotten: Mapping[str, Forgotten] = {}
        self._put_aside: dict[str, Forgotten] = {}  # faults that the last message of a topic has ended, without sources

    def submitted(self, trigger: Trigger) -> list[Trigger]:
        """Store the places that a message of sources reports, and return the triggers to answer.

        The result has up to two triggers: first the places that the topic no longer reports, if they must be
        simulated, then the sources of the message. It has none for a message without sources that has the stamp of a
        message with sources. With a scan period, the last trigger also has the places of earlier
        messages within the period. The call may begin or end faults of the topic.

        trigger : the sources of the message
        """
        topic, now_s = trigger.topic, time.monotonic()
        self._scans.received(topic, trigger.stamp_ns, now_s)
        is_suspect, is_due = topic in self._checks.suspects, self._checks.is_due(topic)
        update = self._places.received(trigger, now_s, is_suspect, is_due)
        self._note_forgotten(update, trigger, now_s)
        if update.trigger is None:
            return []
        if update.was_suspect:
            self._checks.suspect(topic)
        if len(trigger.positions):
            self._checks.received(topic, update.trigger.stamp_ns, trigger.stamp_ns)
        if update.is_ended:
            self._checks.end(topic, update.trigger.stamp_ns)
            self._end(topic)
        if update.unreported is None:
            return [update.trigger]
        self._checks.expect(update.unreported, update.last_ns)
        return [update.unreported, update.trigger]

    def _note_forgotten(self, update: Update, trigger: Trigger, now_s: float) -> None:
        """Begin or end the fault of forgotten places after a message.

        A message without sources ends the fault, unless a further message with its stamp has sources.

        update : its result; trigger : the sources of the message; now_s : current time (s, steady clock)
        """
        topic, ended = trigger.topic, self._put_aside.get(trigger.topic)
        if len(trigger.positions) or update.is_nothing:  # an empty message that is sent twice changes nothing
            self._put_aside.pop(topic, None)
        if update.too_many:
            self._forget(topic, update, trigger.stamp_ns, now_s)
        elif update.is_resumed and ended is not None:
            self._report_forgotten(topic, ended.sentence, ended.at_ns, ended.at_s)
        elif update.is_nothing or self._is_known_again(trigger, now_s):
            if update.is_nothing and topic in self._forgotten:
                self._put_aside[topic] = self._forgotten[topic]
            self._end_forgotten(topic)

    def acknowledged(self, by: str, shown: Collection[str]) -> tuple[str, ...]:
        """Note an acknowledgement by a person; return the topics with a fault of their places that it ends.

        An acknowledgement counts only for the places and faults that the person saw. If several persons must
        acknowledge, only what all of them saw counts. Acknowledged places are forgotten. The fault of unreported places
        ends if no place of the topic is left; otherwise the other places are simulated again. A fault of forgotten
        places ends at once.

        shown : the faults of the last alert. A fault that is not shown yet cannot be acknowledged
        """
        seen: list[tuple[str, Place | str]] = [
            (topic, place) for topic in self._checks.faults() for place in self._checks.places_of(topic, shown)
        ]
        seen += [(topic, each.sentence) for topic, each in self._forgotten.items() if each.sentence in shown]
        acknowledged = self._votes.given(by, time.monotonic(), seen)
        ended = []
        for topic in dict.fromkeys(topic for topic, _ in acknowledged):
            about = {each for other, each in acknowledged if other == topic}
            if topic in self._forgotten and self._forgotten[topic].sentence in about:
                self._end_forgotten(topic)
                ended.append(topic)
            places = [each for each in about if not isinstance(each, str)]
            if places and self._places.forget(topic, set(places)):
                self._checks.end(topic)
                self._end(topic)
                ended.append(topic)
        return tuple(dict.fromkeys(ended))

    def restart(self) -> None:
        """Record that all answers were forgotten, because the clock went back or the node is not active.

        The first scan of each topic begins again. Faults of forgotten places stay.
        """
        self._places.restart()
        self._checks.restart()
        self._scans.restart()
        self._forgotten = {topic: each._replace(at_ns=0) for topic, each in self._forgotten.items()}  # not a valid time

    def to_remember(self) -> dict[str, Any]:
        """Return what to save for the next start, as plain values: places, and topics on which danger is possible.

        The key "places" has the places of topics that may be dangerous, or are not judged; the key is missing if there
        are none. The key "dangers" has the topics.
        """
        places = self._places.to_remember(self._checks.suspects, self._forgotten)
        dangers = sorted({*self._checks.dangers, *self._forgotten})
        return {**({"places": places} if places else {}), "dangers": dangers}

    def restore(
        self, saved: Mapping[str, Any], topics: Collection[str], dangers: Collection[str] | None = None
    ) -> None:
        """Continue from the places that were saved before a restart, for the topics that the node still has.

        Report a fault for each topic whose places could not all be saved.

        saved, dangers : values of the keys "places" and "dangers" of `to_remember`. `dangers` is None for the state of
            an older version: danger then counts as possible on all topics with places
        topics : topics of sources that the node has
        """
        places, lacking = self._places.restore(saved, topics, time.monotonic())
        for topic in places if dangers is None else dangers:
            if topic in topics:
                self._checks.suspect(topic)
        for topic in lacking:
            self._report_forgotten(topic, FORGOTTEN_BEFORE.format(topic), 0, -math.inf)

    def _is_known_again(self, trigger: Trigger, now_s: float) -> bool:
        """Return True if places were forgotten, but all places must have been reported again since.

        This is true when more than a scan period has passed; without a scan period it is always False.

        now_s : current time (s, steady clock)
        """
        known = self._forgotten.get(trigger.topic)
        if known is None or self._period is None:
            return False
        is_over = trigger.stamp_ns - known.at_ns > ns_of(self._period)
        return is_over and now_s - known.at_s > self._period

    def _forget(self, topic: str, update: Update, at_ns: int, at_s: float) -> None:
        """Report that places of a topic were forgotten; at_ns, at_s : as in `Forgotten`."""
        at = f", the last of them at {when(at_ns)}" if at_ns > 0 else ""
        sentence = FORGOTTEN if self._period is None else FORGOTTEN_IN_A_SCAN
        sentence = FORGOTTEN_PARTS if update.are_parts else sentence
        self._report_forgotten(topic, sentence.format(topic, update.too_many, at), at_ns, at_s)

    def _report_forgotten(self, topic: str, sentence: str, at_ns: int, at_s: float) -> None:
        self._forgotten = {**self._forgotten, topic: Forgotten(sentence=sentence, at_ns=at_ns, at_s=at_s)}
        self._report(CAUSE.format(topic), sentence)

    def _end_forgotten(self, topic: str) -> None:
        if topic in self._forgotten:
            self._forgotten = {each: one for each, one in self._forgotten.items() if each != topic}
            self._report(CAUSE.format(topic), "")
