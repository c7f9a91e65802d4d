"""Faults of sources from before the start that the node can no longer judge, although they may be dangerous.

The node no longer has their topic, because the topic was removed or has another name, or their places refer to another
origin of the map. Without the fault, the danger would be forgotten silently. The fault ends when enough persons who saw
the fault have acknowledged. Until then, the fault stays after each further start, even if the node has the topic again.
"""

import time
from collections.abc import Callable, Collection, Mapping
from typing import Any

from rpf3d_core.alerts.site_model import AcknowledgeSpec
from rpf3d_ros.alerts.topic_votes import TopicVotes

CAUSE = "before the start: {}"
"""Name of the cause of a standing fault; the topic replaces the braces."""

NO_TOPIC = (
    "danger was possible on {0}, and then the node was started without this topic: look at the slope that {0} watched, "
    "and acknowledge"
)
OTHER_ORIGIN = (
    "danger was possible at places that {0} had reported, and then the node was started with another map_origin "
    "(before: {1}; then: {2}): look at the slope that {0} watches, and acknowledge"
)
UNKNOWN_ORIGIN = (
    "danger was possible at places that {0} had reported before the update of rpf3d, whose older version did not save "
    "map_origin (then: {2}): if it has changed, look at the slope that {0} watches; acknowledge"
)


class TopicsBefore:
    """The topics of sources from before the start that cannot be judged; each has a standing fault.

    Only one thread may call the methods; any thread may read `reasons`.

    report : called with the cause and the sentence of each fault; an empty sentence ends the fault
    terms : how many persons must acknowledge to end a fault; None for one person
    before : the sentence of the fault of each topic
    """

    def __init__(
        self, report: Callable[[str, str], None], terms: AcknowledgeSpec | None, before: Mapping[str, str]
    ) -> None:
        self._report, self._votes = report, TopicVotes(terms)
        self._reasons = dict(before)

    def repeat(self) -> None:
        """Report the fault of each topic; call this as soon as `report` can take faults."""
        for topic, sentence in self._reasons.items():
            self._report(CAUSE.format(topic), sentence)

    def acknowledged(self, by: str, shown: Collection[str]) -> tuple[str, ...]:
        """Note an acknowledgement by a person; return the topics whose faults it ends, and end these faults.

        shown : the faults of the last alert. A fault that is not shown yet cannot be acknowledged
        """
        seen = [topic for topic, sentence in self._reasons.items() if sentence in shown]
        ended = self._votes.given(by, time.monotonic(), seen)
        self._reasons = {topic: sentence for topic, sentence in self._reasons.items() if topic not in ended}
        for topic in ended:
            self._report(CAUSE.format(topic), "")
        return ended

    @property
    def reasons(self) -> dict[str, str]:
        """The sentence of each fault, by topic, to save for the next start. Any thread may call."""
        return dict(self._reasons)


def unjudged_topics(memory: Mapping[str, Any], known: Collection[str], origin: Collection[float]) -> dict[str, str]:
    """Return the sentence of the fault of each topic of sources that cannot be judged, by topic.

    These are topics on which danger was possible, if the node no longer has the topic. Danger was possible if the last
    answer showed danger or was missing, or if a message was refused or lost. If `map_origin` has changed, or was not
    saved, the result also has all topics whose last answer showed danger or was missing. Sentences from earlier starts
    are kept.

    memory : the saved state; known : names of the topics that the node has; origin : `map_origin` of the node (m)
    """
    dangers = set(memory["dangers"]) if "dangers" in memory else _topics_with_places(memory)
    suspects = {*dangers, *memory.get("missed", ()), *memory.get("refused", ())}
    found = {topic: NO_TOPIC.format(topic) for topic in sorted(suspects) if topic not in known}
    former = memory.get("map_origin")
    if former is None or has_moved(memory, origin):
        words = UNKNOWN_ORIGIN if former is None else OTHER_ORIGIN
        moved = {topic: words.format(topic, former, list(origin)) for topic in sorted(dangers)}
        found = {**moved, **found}
    saved: Mapping[str, str] = memory.get("unjudged", {})
    return {topic: _joined(saved.get(topic, ""), found.get(topic, "")) for topic in sorted({*saved, *found})}


def has_moved(memory: Mapping[str, Any], origin: Collection[float]) -> bool:
    """Return True if the saved origin of the map differs from `origin` (m); False if no origin was saved."""
    return "map_origin" in memory and bool(memory["map_origin"] != list(origin))


def _topics_with_places(memory: Mapping[str, Any]) -> set[str]:
    """Return the topics with saved places, or with too many places to save; for the state of an older version."""
    saved = memory.get("places", {})
    return {topic for topic in saved if topic} | set(saved.get("", ()))


def _joined(saved: str, found: str) -> str:
    """Return two sentences as one; `saved` alone if it contains `found` already."""
    return saved if found in saved else "; ".join(filter(None, (saved, found)))
