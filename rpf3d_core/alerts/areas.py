"""What is decided of each area: which one to clear, for whom a level of the whole site does not say enough.

The rules are those of the site. What is held of an area rises at once, and falls only when the site steps down, which
it does as a whole: so the highest that is held of any area is what is held of the site. Where the evidence is not
believed, nobody knows of any area.
"""

from collections.abc import Iterable, Mapping

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level
from rpf3d_core.alerts.limits import LimitFinding, limits_of
from rpf3d_core.alerts.site_model import Thresholds

NO_ANSWER = "there is no answer"
UNTOLD = "the answer says nothing of it"
UNLIMITED = "the site has no limits for it any more"


def area_alerts(
    previous: Alert | None,
    worst: Mapping[str, LimitFinding] | None,
    thresholds: Thresholds,
    is_faulty: bool,
    steps_down: bool,
) -> tuple[AreaAlert, ...]:
    """What is decided of the areas of the answer that have limits, and of those that the site names in full.

    Of others that the decision before told of, those stay of which a level is held, and with a fault all.

    Parameters
    ----------
    previous : Alert or None
        The decision before.
    worst : mapping from names to LimitFinding, or None
        What the answer says of each area, as `worst_of`; None where there is no answer.
    is_faulty : bool
        Whether the evidence is not believed.
    steps_down : bool
        Whether an acknowledgement lowers what is held.
    """
    found = {} if worst is None else worst
    before, unknown = _held_before(previous)
    left = [name for name, held in before.items() if is_faulty or (held > Level.NORMAL and not steps_down)]
    alerts = []
    for name in dict.fromkeys([*found, *thresholds.named_in_full, *left]):
        finding = found.get(name) or LimitFinding(name, Level.NORMAL, _why_untold(name, worst is not None, thresholds))
        held = finding.level if steps_down else max(before.get(name, unknown), finding.level)
        level = Level.FAULT if is_faulty and held != Level.EVACUATE else held
        alerts.append(AreaAlert(name, level, held, finding.level, finding.why))
    return tuple(alerts)


def worst_of(findings: Iterable[LimitFinding]) -> dict[str, LimitFinding]:
    """Name -> the worst that is said of that area, in the order of the answer."""
    worst: dict[str, LimitFinding] = {}
    for finding in findings:
        if finding.name not in worst or finding.level > worst[finding.name].level:
            worst[finding.name] = finding
    return worst


def got_worse(previous: Alert, worst: Mapping[str, LimitFinding]) -> bool:
    """Whether the answer says more of any area than the one before did."""
    unknown = Level.NORMAL if previous.areas else previous.evident
    before = {area.name: area.evident for area in previous.areas}
    return any(finding.level > before.get(name, unknown) for name, finding in worst.items())


def undecided(previous: Alert | None, worst: Mapping[str, LimitFinding]) -> list[str]:
    """Areas of the answer that the decision before did not tell of."""
    decided = {area.name for area in previous.areas} if previous is not None else set()
    return [name for name in worst if name not in decided]


def _held_before(previous: Alert | None) -> tuple[dict[str, Level], Level]:
    """Name -> what was held of that area, and what may have been of any other.

    Logs of before areas were decided tell of none. Then any may have been the one; those that raised the level are
    named by the sentences that hold it.
    """
    if previous is None:
        return {}, Level.NORMAL
    if previous.areas:
        return {area.name: area.held for area in previous.areas}, Level.NORMAL
    named = [sentence.partition(f": {previous.held.word}, for ")[0] for sentence in previous.held_by]
    return dict.fromkeys(named, previous.held), previous.held


def _why_untold(name: str, is_answered: bool, thresholds: Thresholds) -> str:
    if limits_of(thresholds, name) is None:
        return UNLIMITED
    return UNTOLD if is_answered else NO_ANSWER
