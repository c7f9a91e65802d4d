"""Remember the topics of sources and areas with a refused message: a fault, because the message may report danger.

The fault of a topic of areas ends when a later message of the topic is understood. A message of sources reports only
some regions, and the refused message may have reported other regions. So the fault of a topic of sources ends in one of
three cases:

- a message is understood after the refused sources have become too old
- enough persons acknowledge after a later message was understood
- enough persons acknowledge after the refused sources have become too old, even if no message was understood

While a topic has several publishers, an understood message does not count, because it is unknown which publisher sent
the message. A fault also stays after a restart, and while the node is not active.
"""

from collections.abc import Callable, Collection
from typing import NamedTuple

from rpf3d_core.alerts.site_model import AcknowledgeSpec
from rpf3d_ros.alerts.topic_votes import TopicVotes

CAUSE = "refused: {}"
"""Name of the cause of a standing fault; the topic replaces the braces."""

REFUSED = "a message on {0} was refused ({1}): publish a valid message on {0}"
"""Sentence of a fault; topic and reason replace the braces."""
FOLLOWED = (
    "a message on {0} was refused ({1}), and may have reported other sources than those understood since: look at the "
    "slope and acknowledge, or wait for {2:g} s"
)
"""Sentence once a later message was understood; topic, reason and time until the fault may end replace the braces."""


class Refusal(NamedTuple):
    """The refused messages of a topic with a fault.

    why : why the first of these messages was refused; it may have been received before a restart
    at : when the last of these messages was refused (s, steady clock)
    sentence : the sentence of the fault, as last reported
    is_followed : True if a later message of the topic was understood
    """

    why: str
    at: float
    sentence: str
    is_followed: bool = False


class RefusedInputs:
    """The topics that have a fault because a message was refused.

    Only one thread may call the methods; any thread may read `reasons`.

    report : called with the cause and the sentence of each fault; an empty sentence ends the fault
    """

    def __init__(
        self, report: Callable[[str, str], None], silence_s: float, terms: AcknowledgeSpec | None = None
    ) -> None:
        """Begin without refusals.

        silence_s : time (s) for which sources count. Once the last refused message of a topic is older than this time,
            an understood message or an acknowledgement ends the fault
        terms : how many persons must acknowledge to end the fault, whatever level is held; None for one person
        """
        self._report, self._silence, self._votes = report, silence_s, TopicVotes(terms)
        self._refused: dict[str, Refusal] = {}

    def refused(self, topic: str, why: str, at: float) -> None:
        """Record that a message of a topic was refused: report its fault, and cancel all acknowledgements.

        why : reason of the refusal; at : time of the refusal (s, steady clock)
        """
        first = self.reasons.get(topic, why)
        self._votes.cancel()
        self._tell(topic, Refusal(why=first, at=at, sentence=REFUSED.format(topic, why)))

    def repeat(self) -> None:
        """Report the fault of each topic; call this as soon as `report` can take faults."""
        for topic, refusal in self._refused.items():
            self._report(CAUSE.format(topic), refusal.sentence)

    def understood(self, topic: str, speakers: Callable[[], int], now: float, is_whole: bool) -> None:
        """Note an understood message of a topic, which may end the topic's fault; do nothing without a fault.

        While the topic has several publishers, the fault stays unchanged. Otherwise the fault ends if `is_whole` is
        True, or if the last refused message is longer ago than `silence_s`. If the fault does not end, its sentence
        changes: persons can then end the fault (`acknowledged`).

        speakers : returns the number of publishers of the topic; now : current time (s, steady clock)
        is_whole : True if the message replaces all earlier messages of the topic, as a message of areas does
        """
        refusal = self._refused.get(topic)
        if refusal is None or speakers() > 1:
            return
        if is_whole or now - refusal.at > self._silence:
            self._end(topic)
        elif not refusal.is_followed:
            sentence = FOLLOWED.format(topic, refusal.why, self._silence)
            self._tell(topic, refusal._replace(sentence=sentence, is_followed=True))

    def acknowledged(self, by: str, now: float, shown: Collection[str]) -> tuple[str, ...]:
        """Note an acknowledgement; return the topics whose faults it ends, none until enough persons have acknowledged.

        The fault of a topic can end if a message was understood after the last refused message, or if the last refused
        message is longer ago than `silence_s`. An acknowledgement counts only for topics for which this condition was
        true when the person acknowledged. A message that is refused later, on any topic, cancels all acknowledgements.

        by : name of the person; now : current time (s, steady clock)
        shown : the faults of the last alert. A fault that is not shown yet cannot be acknowledged
        """
        ready = tuple(
            topic
            for topic, refusal in self._refused.items()
            if refusal.sentence in shown and (refusal.is_followed or now - refusal.at > self._silence)
        )
        ended = self._votes.given(by, now, ready)
        for topic in ended:
            self._end(topic)
        return ended

    @property
    def reasons(self) -> dict[str, str]:
        """The reason why the first message of each topic with a fault was refused, by topic. Any thread may call.

        The reason does not change with each further message, because it is written to disk for a restart.
        """
        return {topic: refusal.why for topic, refusal in self._refused.items()}

    def _tell(self, topic: str, refusal: Refusal) -> None:
        self._refused = {**self._refused, topic: refusal}
        self._report(CAUSE.format(topic), refusal.sentence)

    def _end(self, topic: str) -> None:
        if topic in self._refused:
            self._refused = {each: refusal for each, refusal in self._refused.items() if each != topic}
            self._report(CAUSE.format(topic), "")
