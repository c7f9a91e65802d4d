"""The fault of a node that does not know which level was held before its start; it ends when persons acknowledge it."""

from rpf3d_core.alerts.levels import ANOTHER_PERSON
from rpf3d_core.alerts.persons import person_of
from rpf3d_core.alerts.site_model import AcknowledgeSpec
from rpf3d_core.alerts.time_units import ns_of

ADVICE = "a higher level may have been held: look at every area, then acknowledge"
"""Advice to persons in the sentence of the fault, after the reason."""


class UnknownBefore:
    """The fault that the level held before the start is unknown, with the persons who have acknowledged the fault.

    The fault ends when as many persons as the site demands have acknowledged it. This number does not depend on the
    current level, because any level may have been held. Only one thread may call.
    """

    def __init__(self, why: str, terms: AcknowledgeSpec) -> None:
        """Begin without acknowledgements.

        why : why the level before the start is unknown, "" if it is known
        terms : how many persons must acknowledge, and within which time
        """
        self._why, self._terms = why, terms
        self._persons: dict[str, int] = {}

    @property
    def sentences(self) -> tuple[str, ...]:
        """The fault, as a sentence; empty if the level is known or enough persons have acknowledged."""
        return (f"the level before the start is unknown ({self._why}): {ADVICE}",) if self._why else ()

    def acknowledged(self, by: str, now_ns: int, other_faults: tuple[str, ...]) -> str:
        """Note an acknowledgement; return why the fault stays, or "" if it has ended.

        by : name of the person; now_ns : current time (ns)
        other_faults : the other faults at this time. If there are any, neither this acknowledgement nor earlier
            acknowledgements count, because the person cannot have seen the danger
        """
        if other_faults:
            self._persons = {}
            return f"the other faults must end first: {other_faults[0]}"
        recent = {each: at for each, at in self._persons.items() if 0 <= now_ns - at <= ns_of(self._terms.within_s)}
        self._persons = {**recent, person_of(by): now_ns}
        if len(self._persons) < self._terms.persons:
            return f"the level before the start is unknown, and {ANOTHER_PERSON}"
        self._why, self._persons = "", {}
        return ""
