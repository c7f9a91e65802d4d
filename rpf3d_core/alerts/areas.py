"""What is decided of each area: which one to clear, for whom a level of the whole site does not say enough.

The rules are those of the site. What is held of an area rises at once, and falls only when the site steps down, which
it does as a whole: so the highest that is held of any area is what is held of the site.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

from rpf3d_core.alerts.levels import Alert, AreaAlert, Level
from rpf3d_core.alerts.limits import Finding, limits_of
from rpf3d_core.io.site_model import Thresholds

NO_ANSWER = "there is no answer"
UNTOLD = "the answer says nothing of it"
UNLIMITED = "the site has no limits for it any more"
TOO_SMALL = "too few rocks to clear it, and no decision on it stands"


class Doubts(NamedTuple):
    """is_faulty : whether the evidence is not believed; is_small : whether it is of too few rocks to clear anything."""

    is_faulty: bool
    is_small: bool


def area_alerts(
    previous: Alert | None,
    worst: Mapping[str, Finding] | None,
    thresholds: Thresholds,
    doubts: Doubts,
    steps_down: bool,
) -> tuple[AreaAlert, ...]:
    """Each area of the answer that has limits, those that the site names in full, and those of the decision before of
    which a level is held, or nobody knows better.

    Parameters
    ----------
    previous : Alert or None
        The decision before.
    worst : mapping from names to Finding, or None
        What the answer says of each area, as `worst_of`; None where there is no answer.
    steps_down : bool
        Whether an acknowledgement lowers what is held.
    """
    before = _held_before(previous)
    standing = {area.name for area in previous.areas if area.level != Level.FAULT} if previous is not None else set()
    told: list[AreaAlert] = []
    for name in dict.fromkeys([*(worst or ()), *thresholds.named_in_full, *before]):
        evident = Level.NORMAL if worst is None or name not in worst else worst[name].level
        held = evident if steps_down else max(before.get(name, Level.NORMAL), evident)
        is_missed = doubts.is_small and name not in standing
        if name in before and not _is_told(name, worst, thresholds) and held == Level.NORMAL and not doubts.is_faulty:
            continue  # it has left
        is_unknown = (doubts.is_faulty or is_missed) and held != Level.EVACUATE
        why = _why(name, worst, thresholds)
        told.append(
            AreaAlert(
                name, Level.FAULT if is_unknown else held, held, evident,
                f"{TOO_SMALL}; {why}" if is_missed and not doubts.is_faulty else why,
            )
        )  # fmt: skip
    return tuple(told)


def worst_of(findings: Iterable[Finding]) -> dict[str, Finding]:
    """Name -> the worst that is said of that area, in the order of the answer."""
    worst: dict[str, Finding] = {}
    for finding in findings:
        if finding.name not in worst or finding.level > worst[finding.name].level:
            worst[finding.name] = finding
    return worst


def got_worse(previous: Alert, worst: Mapping[str, Finding]) -> bool:
    """Whether the answer says more of any area than the one before did."""
    unknown = Level.NORMAL if previous.areas else previous.evident  # no areas: of a version that did not tell of them
    before = {area.name: area.evident for area in previous.areas}
    return any(finding.level > before.get(name, unknown) for name, finding in worst.items())


def _held_before(previous: Alert | None) -> dict[str, Level]:
    """Name -> what was held of that area; of a version that did not tell of areas, those that raised the level."""
    if previous is None:
        return {}
    if not previous.areas:
        return {sentence.partition(": ")[0]: previous.held for sentence in previous.held_by}
    return {area.name: area.held for area in previous.areas}


def _is_told(name: str, worst: Mapping[str, Finding] | None, thresholds: Thresholds) -> bool:
    """Whether an area is told of whatever was before."""
    return name in (worst or ()) or name in thresholds.named_in_full


def _why(name: str, worst: Mapping[str, Finding] | None, thresholds: Thresholds) -> str:
    if worst is not None and name in worst:
        return worst[name].why
    if limits_of(thresholds, name) is None:
        return UNLIMITED
    return NO_ANSWER if worst is None else UNTOLD
