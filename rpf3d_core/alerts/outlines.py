"""Compare the place for which an area was judged with the area's current place: a moved area is judged again."""

from collections.abc import Iterator, Mapping

from rpf3d_core.alerts.evidence import Evidence, Outdated
from rpf3d_core.alerts.levels import Alert, AreaAlert, Judged
from rpf3d_core.alerts.limits import LimitFinding, limits_of
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.time_units import ns_of, span


def judged_of(before: AreaAlert | None, finding: LimitFinding | None, is_small: bool) -> Judged | None:
    """Return the outline for which an area is judged after a decision; None if the outline is not known.

    If too few rocks flew for a new outline, the area is still judged for its former outline.

    before : the previous decision on the area; finding : the answer's finding on the area, None if there is none
    is_small : True if too few rocks flew to judge an area
    """
    judged = None if before is None else before.judged
    if finding is None:
        return judged
    if judged is None or not is_small or judged.outline == finding.outline:
        return Judged(outline=finding.outline, moved_ns=None)
    return judged if judged.moved_ns is not None else judged._replace(moved_ns=finding.outlined_ns)


def is_moved(before: AreaAlert, finding: LimitFinding) -> bool:
    """Return True if the previous decision judged the area for another outline than the outline in the answer.

    before : the previous decision on the area; finding : the answer's finding on the area
    """
    return before.judged is not None and before.judged.outline != finding.outline


def places_end_ns(
    previous: Alert | None,
    worst: Mapping[str, LimitFinding],
    evidence: Evidence,
    thresholds: Thresholds,
    is_small: bool,
) -> list[int]:
    """Return the times (ns) until which moved areas may still be judged for their former places.

    If no answer has judged a moved area for its new place by then, the decision has a fault. An area that has not moved
    has no time in the list.

    Parameters as in `decide`; worst : for each area, by name, the answer's finding with the highest level
    is_small : True if too few rocks flew to judge an area
    """
    longest = ns_of(thresholds.evidence.moved_area_s)
    moved = [outdated.since_ns for outdated in _watched(evidence, thresholds)]
    if is_small and previous is not None:
        judged = [judged_of(area, worst[area.name], is_small) for area in previous.areas if area.name in worst]
        moved += [one.moved_ns for one in judged if one is not None and one.moved_ns is not None]
    return [since_ns + longest for since_ns in moved]


def place_is_over(before: AreaAlert, finding: LimitFinding, thresholds: Thresholds, now_ns: int) -> bool:
    """Return True if the previous decision judged an area for a place that the area left too long ago.

    The function is for answers with too few rocks, which cannot judge the area for its new place.

    before : the previous decision on the area; finding : the answer's finding; now_ns : time of the new decision (ns)
    """
    judged = judged_of(before, finding, is_small=True)
    moved_ns = None if judged is None else judged.moved_ns
    return moved_ns is not None and now_ns - moved_ns >= ns_of(thresholds.evidence.moved_area_s)


def outdated_faults(evidence: Evidence, thresholds: Thresholds, now_ns: int) -> Iterator[str]:
    """Yield a fault for each watched area that moved too long ago and is not yet at its new place in all answers."""
    longest = thresholds.evidence.moved_area_s
    for outdated in _watched(evidence, thresholds):
        age = now_ns - outdated.since_ns
        if age >= ns_of(longest):
            yield (
                f"{outdated.name}: the area moved {span(age)} ago, and some sources are not yet simulated for its new "
                f"place (at most {longest:g} s are allowed)"
            )


def _watched(evidence: Evidence, thresholds: Thresholds) -> list[Outdated]:
    return [outdated for outdated in evidence.outdated if limits_of(thresholds, outdated.name) is not None]
