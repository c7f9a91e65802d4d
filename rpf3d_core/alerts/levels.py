"""The levels of an alert, the contents of an alert, and the acknowledgement that lowers a level."""

from enum import IntEnum
from typing import NamedTuple

from rpf3d_core.errors import InputError


class Level(IntEnum):
    """The level that the mine is shown.

    `FAULT` means that the danger is unknown. It is not a level of danger, and never safer than one.
    """

    NORMAL = 0
    WATCH = 1
    RESTRICT = 2
    EVACUATE = 3
    FAULT = 4

    @property
    def word(self) -> str:
        """The level in lower case, as written in messages."""
        return self.name.lower()

    @property
    def severity(self) -> int:
        """Rank of the level for display: a fault ranks above restrict, and below evacuate, which it never hides."""
        return _SEVERITY.index(self)


_SEVERITY = (Level.NORMAL, Level.WATCH, Level.RESTRICT, Level.FAULT, Level.EVACUATE)


class Acknowledgement(NamedTuple):
    """A person's statement that the level may fall: the person's name, the reason, and the time (ns)."""

    by: str
    why: str
    at_ns: int


class AreaAlert(NamedTuple):
    """The decision on one area, by the rules of `Alert`; level, held and evident have the same meaning there.

    why : what the answer says about the area, a sentence without the area's name
    """

    name: str
    level: Level
    held: Level
    evident: Level
    why: str


class Alert(NamedTuple):
    """A decision.

    level : the level shown; `EVACUATE` if that is held, else `FAULT` if there are faults, else `held`
    held : the highest level of danger since the last step down, NORMAL to EVACUATE, with or without faults
    evident : the level that the evidence of this decision gives by itself, NORMAL to EVACUATE
    reasons : sentences, at least one: faults, what holds the level, what the answer says about the areas
    faults : sentences, the reasons why the evidence is not believed
    held_by : sentences, what raised `held`, word for word as at that time; empty at NORMAL
    held_since_ns : time of the decision that raised `held` or stepped down to it
    worse_ns : time of the decision at which the evident level of the site or of an area last rose, or the clock went
        back; without the latter, no acknowledgement would count for a long time
    at_ns : time of this decision; valid_until_ns : end of its validity, from which on it must be taken as a fault
    evidence_at_ns : time of the newest evidence so far, None before the first
    alarm : True if the site's alarm sounds
    acknowledgement : the one that came with this decision, or None; void : why it did not lower the level, or empty
    areas : the decision on each area that the site has limits for; the highest `held` among them is the `held` above
    """

    level: Level
    held: Level
    evident: Level
    reasons: tuple[str, ...]
    faults: tuple[str, ...]
    held_by: tuple[str, ...]
    held_since_ns: int
    worse_ns: int
    at_ns: int
    valid_until_ns: int
    evidence_at_ns: int | None
    alarm: bool
    acknowledgement: Acknowledgement | None = None
    void: str = ""
    areas: tuple[AreaAlert, ...] = ()


def acknowledgement(by: str, why: str, at_ns: int) -> Acknowledgement:
    """Return an acknowledgement by a person, for a reason, at a time (ns).

    Raises
    ------
    InputError
        The name of the person or the reason is missing.
    """
    if not by.strip():
        raise InputError("an acknowledgement needs the name of the person who gives it")
    if not why.strip():
        raise InputError(f"an acknowledgement needs a reason; {by.strip()} gives none")
    return Acknowledgement(by=by.strip(), why=why.strip(), at_ns=at_ns)
