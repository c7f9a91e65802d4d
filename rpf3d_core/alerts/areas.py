"""What is decided of each area: which one to clear, for whom a level of the whole site does not say enough.

The rules are those of the site. What is held of an area rises at once, and falls only when the site steps down, which
it does as a whole: so the highest that is held of any area is what is held of the site.
"""

from collections.abc import Iterable

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level
from rpf3d_core.alerts.limits import Finding
from rpf3d_core.io.site_model import Thresholds

UNTOLD = "the answer says nothing of it"
NO_ANSWER = "there is no answer"


def area_alerts(
    previous: Alert | None,
    findings: tuple[Finding, ...] | None,
    thresholds: Thresholds,
    is_faulty: bool,
    steps_down: bool,
) -> tuple[AreaAlert, ...]:
    """Each area of the answer that has limits, those that the site names in full, and others of which a level is held.

    Parameters
    ----------
    previous : Alert or None
        The decision before.
    findings : tuple of Finding, or None
        What the answer says, of an area perhaps several times: the worst counts. None where there is no answer; then
        all areas of the decision before are told of.
    is_faulty : bool
        Whether the site's evidence is not believed.
    steps_down : bool
        Whether an acknowledgement lowers what is held.
    """
    worst = _worst(findings or ())
    before = {} if previous is None else {area.name: area.held for area in previous.areas}
    unknown = Level.NORMAL if previous is None or previous.areas else previous.held  # no areas: a log of before them
    named = thresholds.named_in_full
    told: list[AreaAlert] = []
    for name in dict.fromkeys([*worst, *named, *before]):
        finding = worst.get(name, Finding(name, Level.NORMAL, NO_ANSWER if findings is None else UNTOLD))
        held = finding.level if steps_down else max(before.get(name, unknown), finding.level)
        if name in worst or name in named or held > Level.NORMAL or findings is None:
            level = held if held == Level.EVACUATE or not is_faulty else Level.FAULT
            told.append(AreaAlert(name, level, held, finding.level, finding.why))
    return tuple(told)


def _worst(findings: Iterable[Finding]) -> dict[str, Finding]:
    """Name -> the worst that is said of that area, in the order of the answer."""
    worst: dict[str, Finding] = {}
    for finding in findings:
        if finding.name not in worst or finding.level > worst[finding.name].level:
            worst[finding.name] = finding
    return worst
