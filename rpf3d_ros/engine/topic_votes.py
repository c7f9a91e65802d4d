"""Count the persons who acknowledge faults of topics, until enough persons have acknowledged the same topics."""

from collections.abc import Iterable

from rpf3d_core.alerts.persons import person_of
from rpf3d_core.alerts.site_model import AcknowledgeSpec


class TopicVotes:
    """The persons who have acknowledged, and the topics whose faults each of them saw.

    terms : how many persons must acknowledge to end a fault, whatever level is held; None for one person
    """

    def __init__(self, terms: AcknowledgeSpec | None = None) -> None:
        self._terms = terms or AcknowledgeSpec()
        self._persons: dict[str, tuple[float, frozenset[str]]] = {}

    def given(self, by: str, now: float, topics: Iterable[str]) -> tuple[str, ...]:
        """Note an acknowledgement; return the topics whose faults it ends, none until enough persons acknowledged.

        by : name of the person; now : time (s, steady clock); topics : the topics whose faults the person saw
        """
        seen = tuple(topics)
        recent = {each: noted for each, noted in self._persons.items() if now - noted[0] <= self._terms.within_s}
        self._persons = {**recent, person_of(by): (now, frozenset(seen))}
        if len(self._persons) < self._terms.persons:
            return ()
        ended = tuple(topic for topic in seen if all(topic in each for _, each in self._persons.values()))
        self._persons = {}
        return ended

    def cancel(self) -> None:
        """Forget all acknowledgements, because the faults have changed."""
        self._persons = {}
