"""Find the alert level of an area from the limits of the site, and the reason as a sentence.

Limits are compared even if the evidence has faults: a number far beyond a limit raises the level even if the evidence
as a whole is not believed. A NaN reaches no limit; `evidence_faults.py` reports a NaN as a fault.
"""

from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.origins import NOT_KNOWN, Origin
from rpf3d_core.alerts.site_model import AreaLimitsSpec, EvidenceSpec, LimitsSpec, Thresholds
from rpf3d_core.ensemble.statistics import wilson_interval


class LimitFinding(NamedTuple):
    """The alert level that one answer gives an area, and the reason as a sentence without the name of the area.

    origin : the cluster of sources that gives the level; None if no limit is reached, or if the cluster is not known
    outline, outlined_ns : as in `AreaEvidence`
    """

    name: str
    level: Level
    why: str
    origin: Origin | None = None
    outline: str = ""
    outlined_ns: int = 0

    @property
    def sentence(self) -> str:
        """The area's name and the reason for its alert level, as a sentence for the reasons of an alert."""
        return f"{self.name}: {self.why}"


class ReachedLimit(NamedTuple):
    """A limit that the rocks in an area reach: the sentence that says so, and the cluster of sources of its figure."""

    sentence: str
    origin: Origin | None


def findings_of(evidence: Evidence, thresholds: Thresholds) -> tuple[LimitFinding, ...]:
    """Return the alert level of each area that has limits, with the reason, in the order of the evidence."""
    return tuple(
        _finding(area, limits, thresholds.evidence)._replace(outline=area.outline, outlined_ns=area.outlined_ns)
        for area in evidence.areas
        if (limits := limits_of(thresholds, area.name)) is not None
    )


def without_limits(evidence: Evidence, thresholds: Thresholds) -> tuple[str, ...]:
    """Return the names of areas in the evidence that have no limits; the alert mentions them as not watched."""
    return tuple(area.name for area in evidence.areas if limits_of(thresholds, area.name) is None)


def limits_of(thresholds: Thresholds, name: str) -> AreaLimitsSpec | None:
    """Return the site's limits for an area: under its full name, else under the first pattern that matches; or None."""
    if name in thresholds.areas:
        return thresholds.areas[name]
    return next((limits for pattern, limits in thresholds.areas.items() if fnmatchcase(name, pattern)), None)


def hidden_level(area: AreaEvidence, thresholds: Thresholds) -> Level | None:
    """Return the level that an area would have if all rocks that left the terrain had reached it; None if none left.

    Only the share of rocks counts here, because no one knows the energy of a rock that left. Without `left_high`, all
    rocks that left may belong to one parameter set.
    """
    if area.left <= 0:
        return None
    reached = min(max(area.reached, 0) + area.left, max(area.flown, 0))
    low, high = wilson_interval(reached, max(area.flown, 1))
    predictive = area.left_high
    if predictive is None and area.predictive_high is not None:
        predictive = min(area.predictive_high + max(area.sets, 1) * area.left / max(area.flown, 1), 1.0)
    return level_of(area._replace(reached=reached, low=low, high=high, predictive_high=predictive), thresholds)


def level_of(area: AreaEvidence, thresholds: Thresholds) -> Level:
    """Return the level that the evidence of an area gives by itself; NORMAL for an area without limits."""
    limits = limits_of(thresholds, area.name)
    return Level.NORMAL if limits is None else _finding(area, limits, thresholds.evidence).level


def is_small(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """True if too few rocks flew to lower an alert level; a small answer may still raise the level.

    With unknowns, an answer without predictive interval is small, too.
    """
    return area.flown < terms.fewest_rocks or lacks_predictive(area, terms)


def lacks_predictive(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """True if the site compares predictive intervals, the scene has unknowns, and this answer has no interval yet."""
    return terms.interval == "predictive" and area.sets > 0 and area.predictive_high is None


def upper_end(area: AreaEvidence, terms: EvidenceSpec) -> float:
    """Return the upper end (-) of the interval of the share of rocks that reached an area, as the site chooses it."""
    if terms.interval == "predictive" and area.predictive_high is not None:
        return area.predictive_high
    return area.high


def _is_predictive(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """True if `upper_end` is that of the predictive interval."""
    return terms.interval == "predictive" and area.predictive_high is not None


def _finding(area: AreaEvidence, spec: AreaLimitsSpec, terms: EvidenceSpec) -> LimitFinding:
    for level in (Level.EVACUATE, Level.RESTRICT, Level.WATCH):
        limits: LimitsSpec | None = getattr(spec, level.word)
        reached = list(_reached(area, limits, terms)) if limits is not None else []
        if reached:
            why = f"{level.word}, for {'; '.join(each.sentence for each in reached)}"
            return LimitFinding(name=area.name, level=level, why=why, origin=reached[0].origin)
    return LimitFinding(name=area.name, level=Level.NORMAL, why=f"no limit is reached; {_share(area, terms)}")


def _reached(area: AreaEvidence, limits: LimitsSpec, terms: EvidenceSpec) -> Iterator[ReachedLimit]:
    """Yield each limit that the rocks in an area reach, as the reason for its alert level."""
    origins = area.origins or NOT_KNOWN
    if (limit := limits.reach_probability) is not None and _probability_reaches(area, limit, terms):
        is_predictive = _share_of(area) < limit and _is_predictive(area, terms)
        origin = origins.predictive if is_predictive else origins.reached
        yield ReachedLimit(sentence=f"{_share(area, terms)}, limit {_percent(limit)}", origin=origin)
    energy = area.largest_energy if area.p95_energy is None else area.p95_energy
    if (energy_limit := limits.p95_energy_j) is not None and energy is not None and energy >= energy_limit:
        what = "largest energy, for too few rocks came for a p95," if area.p95_energy is None else "p95 energy"
        yield ReachedLimit(sentence=f"{what} {energy:.6g} J, limit {energy_limit:g} J", origin=origins.energy)
    soonest = limits.first_arrival_s
    if soonest is not None and area.first_arrival_s is not None and area.first_arrival_s <= soonest.seconds:
        needed = f"{soonest.evacuation:g} s to clear it and {soonest.margin:g} s to spare"
        sentence = f"the first rock after {area.first_arrival_s:.1f} s, needed {needed}"
        yield ReachedLimit(sentence=sentence, origin=origins.first_arrival)


def _probability_reaches(area: AreaEvidence, limit: float, terms: EvidenceSpec) -> bool:
    """True if the share of rocks that reached an area is at or above a limit of the site.

    If the site says `upper_end`, the upper end of the interval of the share is compared too. A small answer is judged
    by the share alone. If no rock of 64 reaches the area, the interval still extends to 5.7 %: this figure is due to
    the small number of rocks and not to the slope.
    """
    upper = terms.reach_probability_is == "upper_end" and not is_small(area, terms)
    return _share_of(area) >= limit or (upper and upper_end(area, terms) >= limit)


def _share_of(area: AreaEvidence) -> float:
    """Return the share (-) of rocks that reached an area, also for impossible numbers of rocks."""
    return min(max(area.reached, 0), area.flown) / area.flown if area.flown > 0 else 0.0


def _share(area: AreaEvidence, terms: EvidenceSpec) -> str:
    if area.flown == 0 == area.reached:
        return "no source, so no rock flew"
    told = f"{area.reached:,} of {area.flown:,} rocks came (up to {_percent(upper_end(area, terms))}{_of(area, terms)})"
    if area.clusters <= 1:
        return told
    return f"{told}, the worst of {area.clusters:,} clusters of sources ({_pooled(area)} of all rocks)"


def _of(area: AreaEvidence, terms: EvidenceSpec) -> str:
    """Return which interval an upper end is of, as words for a reason; empty for a scene without unknowns."""
    if area.sets == 0:
        return ""
    if _is_predictive(area, terms):
        return f", predictive over {area.sets:,} parameter sets"
    return ", by the number of rocks alone"


def _pooled(area: AreaEvidence) -> str:
    return f"{area.pooled_reached:,} of {area.pooled_flown:,}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
