"""Judge places that their sensor no longer reports: may rocks from these places reach a limit of the site?"""

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.limits import hidden_level, is_small, level_of, with_more_reached
from rpf3d_core.alerts.site_model import Thresholds


def may_reach_a_limit(evidence: Evidence, thresholds: Thresholds) -> bool:
    """Return True if rocks from the sources of an answer reach a limit of the site, or may reach one.

    Rocks that left the terrain or were cut off in flight count as rocks that reached the area.
    """
    return any(_may_reach(area, evidence.unfinished, thresholds) for area in evidence.areas)


def is_judged(evidence: Evidence, thresholds: Thresholds) -> bool:
    """Return True if enough rocks flew to judge all areas of an answer; False for an answer without areas."""
    return bool(evidence.areas) and not any(is_small(area, thresholds.evidence) for area in evidence.areas)


def _may_reach(area: AreaEvidence, unfinished: int, thresholds: Thresholds) -> bool:
    levels = (
        level_of(area, thresholds),
        hidden_level(area, thresholds) or Level.NORMAL,
        level_of(with_more_reached(area, unfinished), thresholds) if unfinished > 0 else Level.NORMAL,
    )
    return max(levels) > Level.NORMAL
