"""Check whether enough persons have acknowledged. Only names are compared, because a node cannot prove who called."""

import unicodedata
from typing import NamedTuple

from rpf3d_core.alerts.levels import ANOTHER_PERSON, Acknowledgement, Alert, Level
from rpf3d_core.alerts.site_model import AcknowledgeSpec
from rpf3d_core.alerts.time_units import ns_of, when


class Acknowledged(NamedTuple):
    """The acknowledgements after a decision.

    waiting : acknowledgements that wait for another person
    until_ns : time (ns) at which the wait ends, None if no acknowledgement waits
    lacking : why the acknowledgement of this decision has no effect yet; "" if enough persons have acknowledged
    """

    waiting: tuple[Acknowledgement, ...]
    until_ns: int | None
    lacking: str


def person_of(name: str) -> str:
    """Return a name in the form in which names are compared: its letters and digits, without accents and case.

    >>> person_of("J. Meyer"), person_of("j meyer"), person_of("Müller")
    ('jmeyer', 'jmeyer', 'muller')
    """
    return "".join(each for each in unicodedata.normalize("NFKD", name).casefold() if each.isalnum())


def acknowledged_by(
    previous: Alert | None, given: Acknowledgement | None, terms: AcknowledgeSpec, now_ns: int, is_reset: bool
) -> Acknowledged:
    """Return the acknowledgements that wait after a decision, and why the new acknowledgement has no effect yet.

    previous : the previous decision
    given : the new acknowledgement, or None if there is none or another rule has made it void
    terms : the site's rules for acknowledgements; now_ns : time of the decision (ns)
    is_reset : True if the evidence got worse or has a fault; then earlier acknowledgements no longer count
    """
    waiting = () if previous is None or is_reset else _still_waiting(previous, terms, now_ns)
    if given is None or previous is None:
        return _waiting(waiting, terms, "")
    others = tuple(one for one in waiting if person_of(one.by) != person_of(given.by))
    if 1 + len(others) >= _persons_for(previous.held, terms):
        return _waiting((), terms, "")
    until = when(given.at_ns + ns_of(terms.within_s))
    return _waiting((given,), terms, f"{ANOTHER_PERSON} by {until}, under a name other than {given.by}")


def waiting_sentences(acknowledged: Acknowledged) -> tuple[str, ...]:
    """Return a sentence for each acknowledgement that waits, for the reasons of an alert."""
    if acknowledged.until_ns is None:
        return ()
    until = when(acknowledged.until_ns)
    return tuple(f"{one.by} has acknowledged: {one.why}; {ANOTHER_PERSON} by {until}" for one in acknowledged.waiting)


def _persons_for(held: Level, terms: AcknowledgeSpec) -> int:
    """Return the number of persons who must acknowledge before the held level `held` falls."""
    return terms.persons if held >= Level[terms.held_from.upper()] else 1


def _still_waiting(previous: Alert, terms: AcknowledgeSpec, now_ns: int) -> tuple[Acknowledgement, ...]:
    longest = ns_of(terms.within_s)
    return tuple(one for one in previous.waiting if 0 <= now_ns - one.at_ns <= longest)


def _waiting(waiting: tuple[Acknowledgement, ...], terms: AcknowledgeSpec, lacking: str) -> Acknowledged:
    """Return the given acknowledgements as `Acknowledged`, with the time at which the oldest of them expires.

    lacking : as in `Acknowledged`
    """
    until_ns = min((one.at_ns + ns_of(terms.within_s) for one in waiting), default=None)
    return Acknowledged(waiting=waiting, until_ns=until_ns, lacking=lacking)
