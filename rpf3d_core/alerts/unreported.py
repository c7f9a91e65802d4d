"""Judge answers for places that their sensor may no longer report: which levels may rocks from these places cause?"""

from collections.abc import Iterable

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.limits import hidden_level, is_small, level_of, with_more_reached
from rpf3d_core.alerts.site_model import Thresholds


def possible_levels(evidence: Evidence, thresholds: Thresholds) -> dict[str, Level]:
    """Return the areas in which rocks from the sources of an answer reach a limit, or may reach one, and the levels.

    Rocks that left the terrain or were cut off in flight count as rocks that reached the area.
    """
    levels = {area.name: _possible_level(area, evidence.unfinished, thresholds) for area in evidence.areas}
    return {name: level for name, level in levels.items() if level > Level.NORMAL}


def shown_levels(answers: Iterable[Evidence], thresholds: Thresholds) -> dict[str, Level]:
    """Return for each area the highest level that one of some answers gives by itself; NORMAL without limits."""
    found: dict[str, Level] = {}
    for evidence in answers:
        for area in evidence.areas:
            found[area.name] = max(found.get(area.name, Level.NORMAL), level_of(area, thresholds))
    return found


def is_judged(evidence: Evidence, thresholds: Thresholds) -> bool:
    """Return True if enough rocks flew to judge all areas of an answer; False for an answer without areas."""
    return bool(evidence.areas) and not any(is_small(area, thresholds.evidence) for area in evidence.areas)


def _possible_level(area: AreaEvidence, unfinished: int, thresholds: Thresholds) -> Level:
    return max(
        level_of(area, thresholds),
        hidden_level(area, thresholds) or Level.NORMAL,
        level_of(with_more_reached(area, unfinished), thresholds) if unfinished > 0 else Level.NORMAL,
    )
