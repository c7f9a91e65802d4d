"""Check the places of sources with each message: which sources to simulate, and which places are no longer reported."""

import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.live.triggers import Trigger
from rpf3d_ros.engine.topic_votes import TopicVotes
from rpf3d_ros.engine.unreported_evidence import UnreportedEvidence
from rpf3d_ros.engine.unreported_places import ReportedPlaces

CAUSE = "places: {}"
"""Name of the cause of a standing fault: the node had to forget places of a topic; the topic replaces the braces."""

FORGOTTEN = (
    "{} had reported {} that it reports no longer, and the node has forgotten some of these places: look at the slope "
    "and acknowledge, or publish an empty message if the sensor sees no source"
)
"""Sentence of the fault of forgotten places: topic, and how many places."""


class PlaceChecks:
    """The places that each topic has reported, and the faults of places that are no longer reported.

    thresholds : thresholds of the site; distance : distance (m) within which two reports are about the same place
    checks : the answers to unreported places; report : called with the cause and the sentence of a standing fault
    end : called with a topic whose unreported places need no further answers

    Only one thread may call; any thread may call `to_remember`.
    """

    def __init__(
        self, thresholds: Thresholds, distance: float, checks: UnreportedEvidence,
        report: Callable[[str, str], None], end: Callable[[str], None],
    ) -> None:  # fmt: skip
        self._period = thresholds.evidence.scan_period_s
        self._places = ReportedPlaces(self._period, distance)
        self._checks, self._report, self._end = checks, report, end
        self._votes = TopicVotes(thresholds.acknowledge)
        self._forgotten: frozenset[str] = frozenset()

    def submitted(self, trigger: Trigger) -> list[Trigger]:
        """Return the triggers to answer after a message of sources: unreported places, if any, then the sources."""
        topic, stamp_ns = trigger.topic, trigger.stamp_ns
        is_suspect, is_failed = topic in self._checks.suspects, self._checks.is_failed(topic)
        update = self._places.received(trigger, time.monotonic(), is_suspect, is_failed)
        self._report_forgotten(topic, update.too_many, is_over=not len(trigger.positions) or self._period is not None)
        if update.is_ended:
            self._checks.end(topic, stamp_ns)
            self._end(topic)
        if update.unreported is None:
            return [update.trigger]
        self._checks.expect(topic, stamp_ns, len(update.unreported.positions), update.last_ns)
        return [update.unreported, update.trigger]

    def acknowledged(self, by: str, shown: Collection[str]) -> tuple[str, ...]:
        """Note an acknowledgement by a person; return the topics whose faults of unreported places it ends.

        shown : the faults of the last alert. A fault that is not shown yet cannot be acknowledged
        """
        seen = [topic for topic, fault in self._checks.faults().items() if fault in shown]
        ended = self._votes.given(by, time.monotonic(), dict.fromkeys((*seen, *sorted(self._forgotten))))
        self._places.forget(ended)
        for topic in ended:
            self._checks.end(topic)
            self._end(topic)
            self._report_forgotten(topic, "", is_over=True)
        return ended

    def restart(self) -> None:
        """Note that all answers were forgotten, because the clock went back or the node is not active."""
        self._places.restart()

    def to_remember(self) -> dict[str, Any]:
        """Return the places to save for the next start, as plain values, if danger is possible there; {} for none."""
        places = self._places.to_remember(self._checks.suspects)
        return {"places": places} if places else {}

    def restore(self, saved: Mapping[str, Any], topics: Collection[str]) -> None:
        """Continue from the places that were saved before a restart, for the topics that the node still has.

        saved : value of the key "places" of `to_remember`
        """
        places, lacking = self._places.restore(saved, topics)
        for topic in places:
            self._checks.suspect(topic)
        for topic in lacking:
            self._report_forgotten(topic, "too many places before the start of the node")

    def _report_forgotten(self, topic: str, many: str, is_over: bool = False) -> None:
        """Report that places of a topic were forgotten; many : how many places, "" if none were.

        is_over : True if an earlier fault of this kind ends
        """
        if many:
            self._forgotten |= {topic}
            self._report(CAUSE.format(topic), many if self._period is not None else FORGOTTEN.format(topic, many))
        elif is_over and topic in self._forgotten:
            self._forgotten -= {topic}
            self._report(CAUSE.format(topic), "")
