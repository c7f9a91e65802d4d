"""Find since when a subscriber shows an alert level without interruption, also if a decision expired in between."""

from typing import NamedTuple

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level, Since

KEPT_AFTER_ITS_END = (Level.EVACUATE, Level.FAULT)
"""Levels that a subscriber still shows after the validity of a decision has ended; other levels become a fault."""


class ShownLevel(NamedTuple):
    """The level that a decision shows for the site or for an area.

    since : the times (ns) since when this level is shown, and since when the level is not normal
    valid_until_ns : end of the validity of the decision (ns)
    """

    level: Level
    since: Since
    valid_until_ns: int


def shown_by(part: Alert | AreaAlert | None, decision: Alert | None) -> ShownLevel | None:
    """Return the level that a decision shows for the site or for an area, with the start of the level.

    Return None if there is no such level, or if the start of the level is unknown.

    part : for the site, the decision itself; for an area, the part of the decision on this area, None if there is none
    decision : the decision, which states the end of the validity; None if there is none
    """
    if part is None or decision is None or part.since is None:
        return None
    return ShownLevel(level=part.level, since=part.since, valid_until_ns=decision.valid_until_ns)


def since_of(level: Level, before: ShownLevel | None, now_ns: int) -> Since:
    """Return when the level of a new decision began to be shown without interruption, and when it ceased to be normal.

    If the previous decision has expired, it counts as a fault from the end of its validity, unless its level is
    `evacuate` or `fault`: these two levels stay as they are.

    level : the level in the new decision, of the site or of an area
    before : the level in the previous decision; None if there is none, or if its start is unknown
    now_ns : time of the new decision (ns)
    """
    shown = _at_its_end(before) if before is not None and now_ns >= before.valid_until_ns else before
    level_ns, not_normal_ns = now_ns, None if shown is None else shown.since.not_normal_ns
    if shown is not None and shown.level == level:
        level_ns = min(shown.since.level_ns, now_ns)
    if level == Level.NORMAL:
        return Since(level_ns=level_ns, not_normal_ns=None)
    return Since(level_ns=level_ns, not_normal_ns=now_ns if not_normal_ns is None else min(not_normal_ns, now_ns))


def _at_its_end(before: ShownLevel) -> ShownLevel:
    """Return the level that a subscriber shows after the validity of a decision has ended without a new decision.

    This level is a fault that begins at the end of the validity; but `evacuate` and a fault stay unchanged.
    """
    if before.level in KEPT_AFTER_ITS_END:
        return before
    end, since = before.valid_until_ns, before.since.not_normal_ns
    return before._replace(level=Level.FAULT, since=Since(level_ns=end, not_normal_ns=end if since is None else since))
