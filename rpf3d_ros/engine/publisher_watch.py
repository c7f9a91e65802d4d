"""Judge the publishers of each topic, and find faults of three kinds.

- The messages of a publisher with the wrong quality of service or type are never received, and the middleware reports
  this only in the log.
- Two publishers of one topic contradict each other, or report different walls.
- A sensor that is connected and has never published a message does not watch its wall, although no message is wrong or
  old. A publisher of areas that sent its outline before the node was active never sends the outline again, although
  the node needs it.
"""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import NamedTuple

from rclpy.qos import QoSCompatibility, QoSProfile, qos_check_compatible


class SeenPublisher(NamedTuple):
    """A publisher in the ROS graph.

    node : full name of its node; kind : type of its messages; qos : its quality of service
    identity : number of the publisher in the middleware, different for each publisher
    """

    node: str
    kind: str
    qos: QoSProfile
    identity: Hashable = None


class WatchedTopic(NamedTuple):
    """A topic whose publishers are judged.

    name : as in docs/reference/topics.md; kind : type of its messages
    qos : quality of service of the node's subscription; None for a topic that the node itself publishes
    is_single : True if more than one publisher is a fault
    group : name of a group of topics, at least one of which needs a publisher; "" for none
    """

    name: str
    kind: str
    qos: QoSProfile | None
    is_single: bool = True
    group: str = ""


class PublisherFinding(NamedTuple):
    """A fault or warning about the publishers of a topic.

    topic : name of the topic, or of a group of topics without a publisher; sentence : describes the problem
    is_fault : True for a fault of the evidence, False for a warning
    """

    topic: str
    sentence: str
    is_fault: bool


class PublisherWatch:
    """Finds publishers whose messages cannot be received, and topics with several publishers or none.

    overlap_s : time (s) for which two publishers of a topic are only a warning, because a killed publisher stays
        visible for some time. The time begins when the second-oldest visible publisher was first seen, so a program
        that is killed and started again several times is not a fault
    """

    def __init__(self, topics: Sequence[WatchedTopic], overlap_s: float) -> None:
        self._topics, self._overlap = tuple(topics), overlap_s
        self._first_seen: dict[tuple[str, str, Hashable], float] = {}

    def findings(self, seen: Mapping[str, Sequence[SeenPublisher]], at: float) -> list[PublisherFinding]:
        """Return the current faults of the publishers, and warnings about them.

        seen : the publishers of each watched topic, by the topic's name; at : time of a steady clock (s)
        """
        now = [(topic, one.node, one.identity) for topic, publishers in seen.items() for one in publishers]
        self._first_seen = {each: self._first_seen.get(each, at) for each in now}
        found = [one for topic in self._topics for one in self._of_topic(topic, seen.get(topic.name, ()), at)]
        return [*found, *self._without_publisher(seen)]

    def _of_topic(self, topic: WatchedTopic, seen: Sequence[SeenPublisher], at: float) -> Iterable[PublisherFinding]:
        fitting = fitting_of(topic, seen)
        for each in seen:
            if why := _misfit(topic, each):
                yield PublisherFinding(
                    topic.name, f"{topic.name}: messages from {each.node} cannot be received: {why}", True
                )
        if topic.is_single and len(fitting) > 1:
            ages = sorted(at - self._first_seen[topic.name, each.node, each.identity] for each in fitting)
            yield PublisherFinding(topic.name, _several(topic, fitting), ages[-2] >= self._overlap)

    def _without_publisher(self, seen: Mapping[str, Sequence[SeenPublisher]]) -> Iterable[PublisherFinding]:
        for group in dict.fromkeys(topic.group for topic in self._topics if topic.group):
            names = [topic.name for topic in self._topics if topic.group == group]
            if not any(seen.get(name) for name in names):
                yield PublisherFinding(group, f"no publisher of {group}: {', '.join(names)}", False)


class Connection(NamedTuple):
    """Times (s, of a steady clock) at which a publisher of a topic was seen: the first, and the last.

    All publishers of the topic count as one, because a program that is started again is not a new sensor.
    """

    since: float
    last: float


MUTE_SENSOR = "check the sensor; a sensor that sees nothing must publish empty messages"
"""Advice in the fault of a mute topic of sources: its publisher is connected, but no message was accepted."""

MUTE_AREA = (
    "publish the area again, because the node receives no message from before its activation (an empty message if "
    "there is no area)"
)
"""Advice in the fault of a mute topic of areas: its publisher is connected, but no message was accepted."""


class MuteTopics:
    """Finds topics that have a publisher, but no accepted message since the node subscribed to the topic.

    longest_s : time (s) for which a publisher may be connected without a message; infinite for no limit
    remedy : what to do about a mute topic, for the sentence of the fault
    """

    def __init__(self, topics: Iterable[WatchedTopic], longest_s: float, remedy: str) -> None:
        self._topics, self._longest, self._remedy = tuple(topics), longest_s, remedy
        self._understood: set[str] = set()
        self._connected: dict[str, Connection] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the topics that are checked."""
        return tuple(topic.name for topic in self._topics)

    def understood(self, topic: str) -> None:
        """Note an accepted message of a topic, which is then no longer mute. A refused message does not count."""
        self._understood.add(topic)

    def findings(self, seen: Mapping[str, Sequence[SeenPublisher]], at: float) -> list[PublisherFinding]:
        """Return a fault for each topic that has had a publisher for too long without a message.

        A publisher whose messages cannot be received does not count, because `PublisherWatch` already reports it as a
        fault. A publisher that has ended still counts for `longest_s`.

        seen, at : as in `PublisherWatch.findings`
        """
        there = {topic.name: fitting_of(topic, seen.get(topic.name, ())) for topic in self._topics}
        for name, publishers in there.items():
            self._note(name, bool(publishers), at)
        return [
            PublisherFinding(name, f"{_mute(name, there[name], self._longest)}: {self._remedy}", True)
            for name, each in self._connected.items()
            if name not in self._understood and each.last - each.since > self._longest
        ]

    def _note(self, name: str, is_there: bool, at: float) -> None:
        known = self._connected.get(name)
        if is_there:
            self._connected[name] = Connection(since=at if known is None else known.since, last=at)
        elif known is not None and at - known.last > self._longest:
            del self._connected[name]


def fitting_of(topic: WatchedTopic, seen: Iterable[SeenPublisher]) -> list[SeenPublisher]:
    """Return the publishers of a topic whose messages the node can receive."""
    return [each for each in seen if not _misfit(topic, each)]


def sentences_by_topic(findings: Iterable[PublisherFinding], topics: Iterable[str]) -> dict[str, str]:
    """Return the faults of each topic, by topic, as one sentence; "" for a topic without a fault.

    findings : from `PublisherWatch` or `MuteTopics`; warnings are skipped
    """
    sentences: dict[str, str] = dict.fromkeys(topics, "")
    for finding in findings:
        if finding.is_fault:
            sentences[finding.topic] = "; ".join(filter(None, (sentences.get(finding.topic, ""), finding.sentence)))
    return sentences


def _misfit(topic: WatchedTopic, publisher: SeenPublisher) -> str:
    """Return why no message of a publisher is received, and what would be right; "" if messages are received."""
    if publisher.kind != topic.kind:
        return f"it publishes {publisher.kind}; the type must be {topic.kind}"
    if topic.qos is None:
        return ""
    verdict, why = qos_check_compatible(publisher.qos, topic.qos)
    if verdict != QoSCompatibility.ERROR:
        return ""
    return f"its quality of service is not compatible ({why.removeprefix('ERROR: ').rstrip(';. ')})"


def _several(topic: WatchedTopic, seen: Sequence[SeenPublisher]) -> str:
    nodes = ", ".join(sorted(each.node for each in seen))
    if topic.qos is None:
        return f"{len(seen)} programs publish {topic.name} ({nodes}): stop all but one"
    return f"{topic.name} has {len(seen)} publishers ({nodes}): stop all but one, or give each a topic of its own"


def _mute(name: str, seen: Sequence[SeenPublisher], longest_s: float) -> str:
    nodes = ", ".join(sorted(each.node for each in seen)) or "which has ended"
    return (
        f"{name} has had a publisher ({nodes}) for more than {longest_s:g} s, but no valid message has been "
        "received since the node was activated"
    )
