"""Decide the alert level of each area of interest: the level of the site alone does not show which area to evacuate.

An area follows the same rules as the site. The held level of an area rises immediately. It falls only when an
acknowledgement lowers the held level of the site, and then the held levels of all areas fall together. Therefore the
held level of the site is the highest held level of all areas. If the evidence is not believed, the state of every area
is unknown.
"""

from collections.abc import Iterable, Mapping

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level
from rpf3d_core.alerts.limits import LimitFinding, limits_of
from rpf3d_core.alerts.origins import Origin
from rpf3d_core.alerts.outlines import is_moved, judged_of, place_is_over
from rpf3d_core.alerts.since import shown_by, since_of
from rpf3d_core.alerts.site_model import Thresholds

NO_ANSWER = "there is no answer"
UNTOLD = "the answer does not contain this area"
UNLIMITED = "the site file no longer has limits for this area"


def area_alerts(
    previous: Alert | None,
    worst: Mapping[str, LimitFinding] | None,
    thresholds: Thresholds,
    is_faulty: bool,
    steps_down: bool,
    is_small: bool,
    now_ns: int,
) -> tuple[AreaAlert, ...]:
    """Return an alert for each area of the answer that has limits, and for each area that the site file names in full.

    "In full" means: by its name, not by a pattern. Another area of the previous decision also gets an alert if the
    evidence is not believed, or if the held level of this area is above normal and is not lowered.

    Parameters
    ----------
    previous : Alert or None
        The previous decision.
    worst : mapping from names to LimitFinding, or None
        For each area, the answer's finding with the highest level, from `worst_of`; None if there is no answer.
    thresholds : Thresholds
        The thresholds of the site.
    is_faulty : bool
        True if the evidence is not believed.
    steps_down : bool
        True if an acknowledgement lowers the held levels.
    is_small : bool
        True if too few rocks flew to judge an area.
    now_ns : int
        Time of the decision (ns).
    """
    found = {} if worst is None else worst
    before, unknown = _held_before(previous)
    areas = {} if previous is None else {area.name: area for area in previous.areas}
    left = [name for name, held in before.items() if is_faulty or (held > Level.NORMAL and not steps_down)]
    alerts = []
    for name in dict.fromkeys([*found, *thresholds.named_in_full, *left]):
        finding = found.get(name) or LimitFinding(
            name=name, level=Level.NORMAL, why=_why_no_finding(name, worst is not None, thresholds)
        )
        held = finding.level if steps_down else max(before.get(name, unknown), finding.level)
        level = Level.FAULT if is_faulty and held != Level.EVACUATE else held
        shown = shown_by(areas.get(name), previous)
        alerts.append(
            AreaAlert(
                name=name, level=level, held=held, evident=finding.level, why=finding.why,
                since=since_of(level, shown, now_ns), origin=_origin_of(held, finding, areas.get(name)),
                judged=judged_of(areas.get(name), found.get(name), is_small),
            )
        )  # fmt: skip
    return tuple(alerts)


def worst_of(findings: Iterable[LimitFinding]) -> dict[str, LimitFinding]:
    """Return the finding with the highest alert level of each area, by name: this finding gives the area its level."""
    worst: dict[str, LimitFinding] = {}
    for finding in findings:
        if finding.name not in worst or finding.level > worst[finding.name].level:
            worst[finding.name] = finding
    return worst


def got_worse(previous: Alert, worst: Mapping[str, LimitFinding]) -> bool:
    """Return True if the new answer gives an area a higher alert level than the answer of the previous decision gave.

    For an area that has moved, every level above normal counts as higher: no decision was made for its new place. An
    area that the previous decision does not contain counts as normal there. If the previous decision contains no areas
    (log of an older version), the evident level of the site counts for every area.

    worst : for each area, by name, the new answer's finding with the highest level
    """
    unknown = Level.NORMAL if previous.areas else previous.evident
    before = {
        area.name: Level.NORMAL if area.name in worst and is_moved(area, worst[area.name]) else area.evident
        for area in previous.areas
    }
    return any(finding.level > before.get(name, unknown) for name, finding in worst.items())


def undecided(
    previous: Alert | None, worst: Mapping[str, LimitFinding], thresholds: Thresholds, now_ns: int
) -> list[str]:
    """Return the names of areas for which the previous decision cannot be kept, if the new answer has too few rocks.

    These are areas that the previous decision does not contain, and areas that moved too long ago: the previous
    decision judged them at their former places.

    worst : for each area, by name, the answer's finding with the highest level; now_ns : time of the new decision (ns)
    """
    decided = {} if previous is None else {area.name: area for area in previous.areas}
    return [
        name
        for name, finding in worst.items()
        if name not in decided or place_is_over(decided[name], finding, thresholds, now_ns)
    ]


def _held_before(previous: Alert | None) -> tuple[dict[str, Level], Level]:
    """Return the held level of each area in the previous decision, by name, and one level for all other areas.

    A decision in the log of an older version contains no areas. Then every area has the held level of the site. The
    result names the areas that raised this level; their names are read from the sentences in `held_by`.
    """
    if previous is None:
        return {}, Level.NORMAL
    if previous.areas:
        return {area.name: area.held for area in previous.areas}, Level.NORMAL
    named = [sentence.partition(f": {previous.held.word}, for ")[0] for sentence in previous.held_by]
    return dict.fromkeys(named, previous.held), previous.held


def _origin_of(held: Level, finding: LimitFinding, before: AreaAlert | None) -> Origin | None:
    """Return the cluster of sources that caused the held level of an area, in this answer or earlier; None if unknown.

    finding : this answer's finding on the area; before : the previous decision on the area
    """
    if held == finding.level:
        return finding.origin
    return before.origin if before is not None and before.held == held else None


def _why_no_finding(name: str, is_answered: bool, thresholds: Thresholds) -> str:
    if limits_of(thresholds, name) is None:
        return UNLIMITED
    return UNTOLD if is_answered else NO_ANSWER
