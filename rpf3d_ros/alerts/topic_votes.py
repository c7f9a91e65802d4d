"""Count the persons who acknowledge faults of topics, until enough persons have acknowledged the same faults."""

from collections.abc import Hashable, Iterable
from typing import TypeVar

from rpf3d_core.alerts.persons import person_of
from rpf3d_core.alerts.site_model import AcknowledgeSpec

Fault = TypeVar("Fault", bound=Hashable)
"""Type of the values that identify a fault: a topic, or a topic with the sentence or the place of a fault."""


class TopicVotes:
    """The persons who have acknowledged, and the faults that each of them saw.

    terms : how many persons must acknowledge to end a fault, whatever level is held; None for one person
    """

    def __init__(self, terms: AcknowledgeSpec | None = None) -> None:
        self._terms = terms or AcknowledgeSpec()
        self._persons: dict[str, tuple[float, frozenset[Hashable]]] = {}

    def given(self, by: str, now: float, faults: Iterable[Fault]) -> tuple[Fault, ...]:
        """Note an acknowledgement; return the faults that it ends, none until enough persons acknowledged.

        When enough persons have acknowledged within the time that the site sets, the faults that all of them saw end.
        Then all acknowledgements are forgotten. An acknowledgement of a person who saw no fault is not noted.

        by : name of the person; now : current time (s, steady clock); faults : the faults that the person saw
        """
        seen = tuple(faults)
        if not seen:
            return ()
        recent = {each: noted for each, noted in self._persons.items() if now - noted[0] <= self._terms.within_s}
        self._persons = {**recent, person_of(by): (now, frozenset(seen))}
        if len(self._persons) < self._terms.persons:
            return ()
        ended = tuple(fault for fault in seen if all(fault in each for _, each in self._persons.values()))
        self._persons = {}
        return ended

    def cancel(self) -> None:
        """Forget all acknowledgements, because the faults have changed."""
        self._persons = {}
