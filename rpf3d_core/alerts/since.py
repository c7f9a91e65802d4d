"""Since when an alert level is shown without a break, as a subscriber sees it."""

from typing import NamedTuple

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level, Since

KEPT_AFTER_ITS_END = (Level.EVACUATE, Level.FAULT)
"""Levels that a subscriber still shows after the decision has ended; any other level is then shown as a fault."""


class ShownLevel(NamedTuple):
    """What a decision shows of the site or an area: the level, since when, and when the decision ends (ns)."""

    level: Level
    since: Since
    valid_until_ns: int


def shown_by(one: Alert | AreaAlert | None, decision: Alert | None) -> ShownLevel | None:
    """Return what a decision shows of the site or of an area; None if it does not know since when.

    one : the decision itself for the site, or its decision on the area; None if it has none
    """
    if one is None or decision is None or one.since is None:
        return None
    return ShownLevel(level=one.level, since=one.since, valid_until_ns=decision.valid_until_ns)


def since_of(level: Level, before: ShownLevel | None, now_ns: int) -> Since:
    """Return since when a level that is shown now (ns) is shown without a break.

    before : what the previous decision shows; None if there is none, or if it does not know since when
    """
    shown = _at_its_end(before) if before is not None and now_ns >= before.valid_until_ns else before
    level_ns, not_normal_ns = now_ns, None if shown is None else shown.since.not_normal_ns
    if shown is not None and shown.level == level:
        level_ns = min(shown.since.level_ns, now_ns)
    if level == Level.NORMAL:
        return Since(level_ns=level_ns, not_normal_ns=None)
    return Since(level_ns=level_ns, not_normal_ns=now_ns if not_normal_ns is None else min(not_normal_ns, now_ns))


def _at_its_end(before: ShownLevel) -> ShownLevel:
    """Return what a subscriber shows after a decision has ended and no other has followed."""
    if before.level in KEPT_AFTER_ITS_END:
        return before
    end, since = before.valid_until_ns, before.since.not_normal_ns
    return before._replace(level=Level.FAULT, since=Since(level_ns=end, not_normal_ns=end if since is None else since))
