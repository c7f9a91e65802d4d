"""The alert levels, the contents of an alert, and the acknowledgement that lowers a level."""

from enum import IntEnum
from typing import NamedTuple

from rpf3d_core.alerts.origins import Origin
from rpf3d_core.errors import InputError

ANOTHER_PERSON = "another person must acknowledge"
"""Text that the reply to an acknowledgement contains if another person must acknowledge, too."""


class Level(IntEnum):
    """The alert level that is shown to the mine, from normal to evacuate; or a fault.

    `FAULT` means that the danger is unknown. `FAULT` is not a level of danger, and never means that an area is safer.
    """

    NORMAL = 0
    WATCH = 1
    RESTRICT = 2
    EVACUATE = 3
    FAULT = 4

    @property
    def word(self) -> str:
        """The alert level in lower case, as written in messages."""
        return self.name.lower()

    @property
    def severity(self) -> int:
        """Rank of the alert level for display, from 0 for normal: a fault ranks above restrict, and below evacuate."""
        return _SEVERITY.index(self)


_SEVERITY = (Level.NORMAL, Level.WATCH, Level.RESTRICT, Level.FAULT, Level.EVACUATE)


class Acknowledgement(NamedTuple):
    """A person's statement that the alert level may fall: the person's name, the reason, and the time (ns).

    client : names of the nodes that may have sent the acknowledgement, as far as ROS shows them; "" if unknown
    """

    by: str
    why: str
    at_ns: int
    client: str = ""


class Since(NamedTuple):
    """Times (ns, by the node's clock) since which the shown alert level has not changed, and has not been normal.

    level_ns : time since which this level has been shown
    not_normal_ns : time since which no alert has shown normal; None if the level is normal
    """

    level_ns: int
    not_normal_ns: int | None


class Judged(NamedTuple):
    """The outline for which an area is judged.

    outline : digest of the outline
    moved_ns : time (ns) at which the area got a newer outline, for which too few rocks have flown so far; None if the
        area has no newer outline
    """

    outline: str
    moved_ns: int | None


class AreaAlert(NamedTuple):
    """The decision on one area of interest; `level`, `held` and `evident` have the same meaning as in `Alert`.

    why : the reason for `evident`, a sentence without the name of the area
    since : since when `level` is shown; None in a log of an older version
    origin : the cluster of sources that caused `held`, from the newest answer whose level equals `held`; None if `held`
        is normal, or if the cluster is not known
    judged : the outline for which the area is judged; None in a log of an older version, and before the first answer
        that contains the area
    """

    name: str
    level: Level
    held: Level
    evident: Level
    why: str
    since: Since | None = None
    origin: Origin | None = None
    judged: Judged | None = None


class Alert(NamedTuple):
    """A decision on the site and on each area: the levels, the reasons and the time of validity.

    level : the level shown; `EVACUATE` if `held` is `EVACUATE`, else `FAULT` if there are faults, else `held`
    held : the held level, NORMAL to EVACUATE: the highest level of danger since the level last fell; a fault does not
        change `held`
    evident : the level that the evidence of this decision gives by itself, NORMAL to EVACUATE
    reasons : sentences, at least one: faults, why the level is held, the findings for the areas
    faults : sentences, the reasons why the evidence is not believed
    held_by : sentences, the reasons in the decision that raised the level to `held`; empty at NORMAL
    held_since_ns : time of the decision that raised or lowered the level to `held`
    worse_ns : time of the last decision at which the evident level of the site or of an area rose, or the clock was set
        back; an acknowledgement given before this time does not count
    at_ns : time of this decision; valid_until_ns : end of its validity; afterwards the state must be read as a fault
    evidence_at_ns : time of the newest answer of this decision and, unless the clock was set back, of all earlier
        decisions; answers from the future do not count. None without such an answer
    alarm : True if the alarm of the site is on
    acknowledgement : the acknowledgement given with this decision, or None; void : why the acknowledgement did not
        lower the level, or empty
    areas : the decision on each area with limits, and on each other area of the previous decision while its level is
        held or there are faults; the highest `held` of the areas is the `held` of the site
    since : since when `level` is shown; None in a log of an older version
    terrain_digest, terrain_stamp_ns : digest and stamp of the whole survey of the terrain in the evidence; "" and 0
        without evidence
    waiting : acknowledgements that have no effect before another person acknowledges
    waiting_until_ns : time (ns) at which the first of these acknowledgements expires; None if none waits
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
    since: Since | None = None
    terrain_digest: str = ""
    terrain_stamp_ns: int = 0
    waiting: tuple[Acknowledgement, ...] = ()
    waiting_until_ns: int | None = None


def acknowledgement(by: str, why: str, at_ns: int, client: str = "") -> Acknowledgement:
    """Return a person's statement that the alert level may fall, after a check that name and reason are given.

    by : name of the person; why : the reason; at_ns : time, ns; client : as in `Acknowledgement`

    Raises
    ------
    InputError
        The name of the person or the reason is missing.
    """
    if not by.strip():
        raise InputError("an acknowledgement needs the name of the person who gives it")
    if not why.strip():
        raise InputError(f"an acknowledgement needs a reason; {by.strip()} gave no reason")
    return Acknowledgement(by=by.strip(), why=why.strip(), at_ns=at_ns, client=client)
