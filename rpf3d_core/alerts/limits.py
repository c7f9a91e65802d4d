"""Find the level of an area from the limits of the site, and the reason as a sentence.

Limits are compared even if the evidence has faults: a number far beyond a limit raises the level even if the evidence
as a whole is not believed. A NaN reaches no limit; `sound.py` reports a NaN as a fault.
"""

from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.site_model import AreaLimitsSpec, EvidenceSpec, LimitsSpec, Thresholds


class LimitFinding(NamedTuple):
    """The level of an area according to one answer, and the reason as a sentence without the name of the area."""

    name: str
    level: Level
    why: str

    @property
    def sentence(self) -> str:
        """The area's name and the reason."""
        return f"{self.name}: {self.why}"


def findings_of(evidence: Evidence, thresholds: Thresholds) -> tuple[LimitFinding, ...]:
    """Return the finding for each area that has limits, in the order of the evidence."""
    return tuple(
        _finding(area, limits, thresholds.evidence)
        for area in evidence.areas
        if (limits := limits_of(thresholds, area.name)) is not None
    )


def without_limits(evidence: Evidence, thresholds: Thresholds) -> tuple[str, ...]:
    """Return the names of the areas in the evidence for which the site has no limits."""
    return tuple(area.name for area in evidence.areas if limits_of(thresholds, area.name) is None)


def limits_of(thresholds: Thresholds, name: str) -> AreaLimitsSpec | None:
    """Return the limits of an area: by its full name, else by the first matching pattern; None if neither exists."""
    if name in thresholds.areas:
        return thresholds.areas[name]
    return next((limits for pattern, limits in thresholds.areas.items() if fnmatchcase(name, pattern)), None)


def is_small(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """True if too few rocks flew to lower a level; a small answer may still raise a level."""
    return area.flown < terms.fewest_rocks


def _finding(area: AreaEvidence, spec: AreaLimitsSpec, terms: EvidenceSpec) -> LimitFinding:
    for level in (Level.EVACUATE, Level.RESTRICT, Level.WATCH):
        limits: LimitsSpec | None = getattr(spec, level.word)
        reached = list(_reached(area, limits, terms)) if limits is not None else []
        if reached:
            return LimitFinding(name=area.name, level=level, why=f"{level.word}, for {'; '.join(reached)}")
    return LimitFinding(name=area.name, level=Level.NORMAL, why=f"no limit is reached; {_share(area)}")


def _reached(area: AreaEvidence, limits: LimitsSpec, terms: EvidenceSpec) -> Iterator[str]:
    """Yield a sentence for each limit that is reached, with the number that reaches the limit."""
    if (limit := limits.reach_probability) is not None and _probability_reaches(area, limit, terms):
        yield f"{_share(area)}, limit {_percent(limit)}"
    energy = area.largest_energy if area.p95_energy is None else area.p95_energy
    if (energy_limit := limits.p95_energy_j) is not None and energy is not None and energy >= energy_limit:
        what = "largest energy, for too few rocks came for a p95," if area.p95_energy is None else "p95 energy"
        yield f"{what} {energy:.6g} J, limit {energy_limit:g} J"
    soonest = limits.first_arrival_s
    if soonest is not None and area.first_arrival_s is not None and area.first_arrival_s <= soonest.seconds:
        needed = f"{soonest.evacuation:g} s to clear it and {soonest.margin:g} s to spare"
        yield f"the first rock after {area.first_arrival_s:.1f} s, needed {needed}"


def _probability_reaches(area: AreaEvidence, limit: float, terms: EvidenceSpec) -> bool:
    """True if the share of rocks that reached an area reaches a limit; or, if so set, the upper end of its interval.

    A small answer is judged by the share alone. If no rock of 64 reaches the area, the interval still extends to 5.7 %:
    this figure is due to the small number of rocks and not to the slope.
    """
    upper = terms.reach_probability_is == "upper_end" and not is_small(area, terms)
    share = min(max(area.reached, 0), area.flown) / area.flown if area.flown > 0 else 0.0
    return share >= limit or (upper and area.high >= limit)


def _share(area: AreaEvidence) -> str:
    if area.flown == 0 == area.reached:
        return "no source, so no rock flew"
    return f"{area.reached:,} of {area.flown:,} rocks came (up to {_percent(area.high)})"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
