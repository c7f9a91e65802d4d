"""Find the alert level of an area from the limits of the site, and the reason as a sentence.

Limits are compared even if the evidence has faults: a number far beyond a limit raises the level even if the evidence
as a whole is not believed. A NaN reaches no limit; `evidence_faults.py` reports a NaN as a fault.
"""

import math
from collections.abc import Iterator
from fnmatch import fnmatchcase
from typing import NamedTuple

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.origins import NOT_KNOWN, Origin
from rpf3d_core.alerts.site_model import AreaLimitsSpec, EvidenceSpec, LimitsSpec, Thresholds
from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.unknowns.predictive import ENOUGH

RARE = 0.05
"""Largest share (-) of the rocks in an area that may have unknown energies while the p95 energy stays bounded.

If at most this share of the rocks has unknown energies, the p95 energy of all rocks in the area is at most the largest
known energy.
"""


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
    """A limit that the rocks in an area reach, as a sentence.

    origin : the cluster of sources whose rocks reach the limit; None if it is not known
    """

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
    """Return the site's limits for an area; None if the site file has none.

    The limits under the full name of the area have priority; otherwise the first pattern that matches the name counts.
    """
    if name in thresholds.areas:
        return thresholds.areas[name]
    return next((limits for pattern, limits in thresholds.areas.items() if fnmatchcase(name, pattern)), None)


def hidden_level(area: AreaEvidence, thresholds: Thresholds) -> Level | None:
    """Return the level of an area as if all rocks that left the terrain had reached the area; None without such rocks.

    The energy of these rocks (`AreaEvidence.left`) counts as infinite and their arrival as immediate, because both are
    unknown. If these rocks are at most 5 % (RARE) of all rocks in the area, the largest known energy replaces the p95
    energy. The share of 5 % must hold in each cluster of sources, so that the rocks of one cluster do not hide the
    rocks of another. With unknowns, the upper end of the energy over the parameter sets always counts as infinite. If
    `left_high` is None, all rocks in `left` are counted in one parameter set, the worst case.
    """
    if area.left <= 0:
        return None
    share = with_more_reached(area, area.left)
    predictive = share.predictive_high if area.left_high is None else area.left_high
    is_rare = area.share_without_energy <= RARE
    return level_of(
        share._replace(
            predictive_high=predictive, p95_energy=area.largest_energy if is_rare else None, largest_energy=math.inf,
            energy_high=None if area.sets == 0 else math.inf, first_arrival_s=0.0,
        ), thresholds,
    )  # fmt: skip


def with_more_reached(area: AreaEvidence, count: int) -> AreaEvidence:
    """Return the evidence of an area as if `count` more of the flown rocks had reached the area.

    The additional rocks are assumed to be of one parameter set. Only the share of rocks and its intervals change, not
    energy and arrival.
    """
    reached = min(max(area.reached, 0) + count, max(area.flown, 0))
    low, high = wilson_interval(reached, max(area.flown, 1))
    predictive = area.predictive_high
    if predictive is not None:
        predictive = min(predictive + max(area.sets, 1) * count / max(area.flown, 1), 1.0)
    return area._replace(reached=reached, low=low, high=high, predictive_high=predictive)


def level_of(area: AreaEvidence, thresholds: Thresholds) -> Level:
    """Return the level that the evidence of an area gives by itself; NORMAL for an area without limits."""
    limits = limits_of(thresholds, area.name)
    return Level.NORMAL if limits is None else _finding(area, limits, thresholds.evidence).level


def is_small(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """Return True if an answer is small: too few rocks flew to lower an alert level.

    A small answer may still raise the level.

    With unknowns, an answer is also small if the site compares predictive intervals and the answer has none yet.

    area : evidence of the answer on one area; terms : the site's rules for evidence
    """
    return area.flown < terms.fewest_rocks or lacks_predictive(area, terms)


def is_small_answer(evidence: Evidence, terms: EvidenceSpec) -> bool:
    """Return True if there are sources, but too few rocks flew to lower an alert level or to show an area as safe.

    terms : the site's rules for evidence
    """
    return evidence.sources != 0 and any(is_small(area, terms) for area in evidence.areas)


def lacks_predictive(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """Return True if an answer lacks the predictive interval that the site compares; False in a scene without unknowns.

    area : evidence of the answer on one area; terms : the site's rules for evidence
    """
    return terms.interval == "predictive" and area.sets > 0 and area.predictive_high is None


def upper_end(area: AreaEvidence, terms: EvidenceSpec) -> float:
    """Return the upper end (-) of the interval of the share of rocks that reached an area.

    The interval is the predictive interval if the site chooses predictive intervals and the area has one, else the
    sampling interval.

    terms : the site's rules for evidence
    """
    if terms.interval == "predictive" and area.predictive_high is not None:
        return area.predictive_high
    return area.high


def _is_predictive(area: AreaEvidence, terms: EvidenceSpec) -> bool:
    """Return True if `upper_end` is the upper end of the predictive interval; parameters as in `upper_end`."""
    return terms.interval == "predictive" and area.predictive_high is not None


def _finding(area: AreaEvidence, spec: AreaLimitsSpec, terms: EvidenceSpec) -> LimitFinding:
    for level in (Level.EVACUATE, Level.RESTRICT, Level.WATCH):
        limits: LimitsSpec | None = getattr(spec, level.word)
        reached = list(_reached(area, limits, terms)) if limits is not None else []
        if reached:
            why = f"{level.word} because {'; '.join(each.sentence for each in reached)}"
            return LimitFinding(name=area.name, level=level, why=why, origin=reached[0].origin)
    why = "; ".join(["no limit is reached", _share(area, terms), *_ends_below(area, spec, terms)])
    return LimitFinding(name=area.name, level=Level.NORMAL, why=why)


def _ends_below(area: AreaEvidence, spec: AreaLimitsSpec, terms: EvidenceSpec) -> Iterator[str]:
    """Yield a text on the energy and a text on the first arrival of rocks, for an area that reaches no limit.

    The site must have a limit for the energy, or for the arrival, and the area must have such a figure (`energies_of`,
    `arrivals_of`); otherwise this text is omitted. A scene without unknowns has neither text.

    spec : the site's limits for the area; terms : the site's rules for evidence
    """
    limits = [each for each in (spec.watch, spec.restrict, spec.evacuate) if each is not None and area.sets > 0]
    if energies_of(area, terms) and any(each.p95_energy_j is not None for each in limits):
        yield _energy(area, terms)
    if arrivals_of(area, terms) and any(each.first_arrival_s is not None for each in limits):
        yield _arrival(area, terms)


def _reached(area: AreaEvidence, limits: LimitsSpec, terms: EvidenceSpec) -> Iterator[ReachedLimit]:
    """Yield each limit of one alert level that the rocks in an area reach, as the reason for this level.

    limits : the site's limits of the level in the area; terms : the site's rules for evidence
    """
    origins = area.origins or NOT_KNOWN
    if (limit := limits.reach_probability) is not None and _probability_reaches(area, limit, terms):
        is_predictive = _share_of(area) < limit and _is_predictive(area, terms)
        origin = origins.predictive if is_predictive else origins.reached
        yield ReachedLimit(sentence=f"{_share(area, terms)}, limit {_percent(limit)}", origin=origin)
    energies, energy_limit = energies_of(area, terms), limits.p95_energy_j
    if energy_limit is not None and any(energy >= energy_limit for energy in energies):
        is_pooled = area.pooled_energy is not None and area.pooled_energy >= energy_limit
        origin = origins.energy if is_pooled else origins.energy_high or origins.energy
        yield ReachedLimit(sentence=f"{_energy(area, terms)}, limit {energy_limit:g} J", origin=origin)
    arrivals, soonest = arrivals_of(area, terms), limits.first_arrival_s
    if soonest is not None and any(arrival <= soonest.seconds for arrival in arrivals):
        needed = f"evacuation takes {soonest.evacuation:g} s plus a margin of {soonest.margin:g} s"
        is_pooled = area.first_arrival_s is not None and area.first_arrival_s <= soonest.seconds
        origin = origins.first_arrival if is_pooled else origins.first_arrival_low or origins.first_arrival
        yield ReachedLimit(sentence=f"{_arrival(area, terms)}, but {needed}", origin=origin)


def _probability_reaches(area: AreaEvidence, limit: float, terms: EvidenceSpec) -> bool:
    """Return True if the share of rocks that reached an area is at or above a limit of the site.

    If the site file has `reach_probability_is: upper_end`, the limit is also compared with the upper end of the share's
    interval. For a small answer (`is_small`), only the share is compared: if 0 of 64 rocks reach the area, the upper
    end is 5.7 % because of the small number of rocks, and not because of the slope.
    """
    upper = terms.reach_probability_is == "upper_end" and not is_small(area, terms)
    return _share_of(area) >= limit or (upper and upper_end(area, terms) >= limit)


def _share_of(area: AreaEvidence) -> float:
    """Return the share (-) of rocks that reached an area, from 0 to 1 even if the numbers of rocks are impossible."""
    return min(max(area.reached, 0), area.flown) / area.flown if area.flown > 0 else 0.0


def _share(area: AreaEvidence, terms: EvidenceSpec) -> str:
    if area.flown == 0 == area.reached:
        return "there is no source, so no rock flew"
    most = f"up to {_percent(upper_end(area, terms))}{_of(area, terms)}"
    sentence = f"{area.reached:,} of {area.flown:,} rocks reached the area ({most})"
    if area.clusters <= 1:
        return sentence
    return f"{sentence}, the worst of {area.clusters:,} clusters of sources ({_pooled(area)} of all rocks)"


def _of(area: AreaEvidence, terms: EvidenceSpec) -> str:
    """Return a text that names the interval whose upper end is compared with a limit; "" without unknowns."""
    if area.sets == 0:
        return ""
    if _is_predictive(area, terms):
        return f", predictive over {area.sets:,} parameter sets"
    return ", from the number of rocks only"


def energies_of(area: AreaEvidence, terms: EvidenceSpec) -> tuple[float, ...]:
    """Return the energies (J) to compare with a limit: the energy of all rocks, and its upper end over parameter sets.

    The result is empty if no rock reached the area, not even on a path displaced by the misfit. The upper end is left
    out if the site compares sampling intervals. The energy of all rocks is always compared, so that a wrong upper end
    hides no danger.

    terms : the site's rules for evidence
    """
    return _known(area.pooled_energy, area.energy_high, terms)


def arrivals_of(area: AreaEvidence, terms: EvidenceSpec) -> tuple[float, ...]:
    """Return the first arrivals (s) to compare with a limit: of all rocks, and of the fastest parameter set.

    The result is empty if no rock reached the area, not even on a path displaced by the misfit. The arrival of the
    fastest set is left out if the site compares sampling intervals.

    terms : the site's rules for evidence
    """
    return _known(area.first_arrival_s, area.first_arrival_low_s, terms)


def _known(pooled: float | None, end: float | None, terms: EvidenceSpec) -> tuple[float, ...]:
    compared = (pooled, end if terms.interval == "predictive" else None)
    return tuple(value for value in compared if value is not None)


def _energy(area: AreaEvidence, terms: EvidenceSpec) -> str:
    """Return the energy in an area as text for the reason of an alert level; with unknowns, also its upper end.

    The upper end is that over the parameter sets.

    terms : the site's rules for evidence
    """
    what = "largest energy (too few rocks for a p95)" if area.p95_energy is None else "p95 energy"
    sentence = "no rock reached the area" if area.pooled_energy is None else f"{what} {area.pooled_energy:.6g} J"
    if area.sets == 0:
        return sentence
    if terms.interval != "predictive" or area.energy_high is None:
        return f"{sentence} (of all parameter sets together)"
    if area.energy_sets >= ENOUGH:
        return f"{sentence} (up to {area.energy_high:.6g} J, predictive over {area.energy_sets:,} parameter sets)"
    few = f"only {area.energy_sets} have a p95, {ENOUGH} are needed for a predictive interval"
    return f"{sentence} (up to {area.energy_high:.6g} J, the largest of all {area.sets:,} parameter sets: {few})"


def _arrival(area: AreaEvidence, terms: EvidenceSpec) -> str:
    """Return the first arrival in an area as text for the reason of an alert level; with unknowns, also its lower end.

    The lower end is the first arrival of the fastest parameter set.

    terms : the site's rules for evidence
    """
    first = area.first_arrival_s
    sentence = "no rock reached the area" if first is None else f"the first rock arrives after {first:.1f} s"
    if area.sets == 0:
        return sentence
    if first is None and area.first_arrival_low_s is not None and terms.interval == "predictive":
        sentence = "no rock reached the area on its own path, but some do on paths displaced by the misfit"
    if terms.interval != "predictive" or area.first_arrival_low_s is None:
        return f"{sentence} (of all parameter sets together)"
    return f"{sentence} (after {area.first_arrival_low_s:.1f} s in the fastest of {area.sets:,} parameter sets)"


def _pooled(area: AreaEvidence) -> str:
    return f"{area.pooled_reached:,} of {area.pooled_flown:,}"


def _percent(share: float) -> str:
    return f"{100.0 * share:.3g} %"
