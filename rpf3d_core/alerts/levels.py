"""The levels of an alert, what an alert says, and the acknowledgement that lets one step down."""

from enum import IntEnum
from typing import NamedTuple

from rpf3d_core.errors import InputError


class Level(IntEnum):
    """What the mine is told. `FAULT` means that nobody knows: it is no level of danger, and never safer than one."""

    NORMAL = 0
    WATCH = 1
    RESTRICT = 2
    EVACUATE = 3
    FAULT = 4

    @property
    def word(self) -> str:
        """The level in lower case, as it stands in messages."""
        return self.name.lower()

    @property
    def severity(self) -> int:
        """Rank among what may be shown: a fault stands above restrict and below evacuate, which it never hides."""
        return _SEVERITY.index(self)


_SEVERITY = (Level.NORMAL, Level.WATCH, Level.RESTRICT, Level.FAULT, Level.EVACUATE)


class Acknowledgement(NamedTuple):
    """Somebody has looked and says why the level may fall: their name, the reason, and when (ns)."""

    by: str
    why: str
    at_ns: int


class AreaAlert(NamedTuple):
    """What is decided of one area, by the rules of `Alert`: level, held and evident are as there.

    why : what the answer says of the area, a sentence without its name
    """

    name: str
    level: Level
    held: Level
    evident: Level
    why: str


class Alert(NamedTuple):
    """A decision.

    level : what is shown; `EVACUATE` where that is held, else `FAULT` where there are faults, else `held`
    held : the highest level of danger since the last step down, NORMAL to EVACUATE, faults or not
    evident : what the evidence of this decision says by itself, NORMAL to EVACUATE
    reasons : sentences, at least one: faults, what holds the level, what the areas say
    faults : sentences, those of the reasons for which the evidence is not believed
    held_by : sentences, what raised `held`, word for word as it was said then; empty at NORMAL
    held_since_ns : the decision that raised it, or stepped down to it; worse_ns : that at which what is
        evident of the site or of an area last rose, or the clock went back, lest no acknowledgement count for long
    at_ns : when this was decided; valid_until_ns : from then on it says nothing any more, and must be taken as a fault
    evidence_at_ns : of the newest evidence seen so far, None before the first
    alarm : whether the site's alarm sounds
    acknowledgement : the one that came with this decision, or None; void : why it did not lower the level, or empty
    areas : what is decided of each area that the site has limits for; the highest `held` among them is that above
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
    """An acknowledgement by a person, for a reason, at a time (ns).

    Raises
    ------
    InputError
        Nobody is named, or no reason is.
    """
    if not by.strip():
        raise InputError("an acknowledgement needs the name of the person who gives it")
    if not why.strip():
        raise InputError(f"an acknowledgement needs a reason; {by.strip()} gives none")
    return Acknowledgement(by.strip(), why.strip(), at_ns)
