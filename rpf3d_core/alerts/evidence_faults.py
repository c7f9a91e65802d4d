"""Check whether evidence can be believed: each reason against it is a fault, written as a sentence.

Evidence arrives through other machines, so its numbers may be wrong or missing. A NaN fails every check in this file.
"""

import math
from collections.abc import Iterator

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.levels import Alert
from rpf3d_core.alerts.limits import hidden_level, level_of, limits_of, with_more_reached
from rpf3d_core.alerts.outlines import outdated_faults
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_core.alerts.time_units import ns_of, span


def faults_of(
    previous: Alert | None, evidence: Evidence | None, thresholds: Thresholds, now_ns: int
) -> tuple[str, ...]:
    """Return the reasons why the evidence is not believed at this time; empty if the evidence is believed.

    previous : the previous decision; now_ns : time of the decision (ns)
    """
    return (*_clock_faults(previous, now_ns), *_evidence_faults(previous, evidence, thresholds, now_ns))


def went_back(previous: Alert | None, now_ns: int) -> bool:
    """Return True if the clock was set back: the time now is earlier than the time of the previous decision."""
    return previous is not None and now_ns < previous.at_ns


def _clock_faults(previous: Alert | None, now_ns: int) -> Iterator[str]:
    if previous is not None and went_back(previous, now_ns):
        yield f"the clock went back by {span(previous.at_ns - now_ns)} since the previous decision"


def _evidence_faults(
    previous: Alert | None, evidence: Evidence | None, thresholds: Thresholds, now_ns: int
) -> Iterator[str]:
    if evidence is None:
        yield "there is no evidence: no sources or no terrain have been received, or no rock could fly"
        return
    yield from evidence.faults
    yield from _stamp_faults(evidence, thresholds, now_ns)
    newest = previous.evidence_at_ns if previous is not None else None
    if newest is not None and evidence.at_ns < newest:
        yield f"the answer is {span(newest - evidence.at_ns)} older than the answer of an earlier decision"
    yield from _ensemble_faults(evidence, thresholds)
    yield from _area_names_faults(evidence, thresholds)
    yield from outdated_faults(evidence, thresholds, now_ns)
    for area in evidence.areas:
        yield from (f"{area.name}: {fault}" for fault in _area_faults(area, evidence.sources))
        if limits_of(thresholds, area.name) is not None:
            yield from (f"{area.name}: {fault}" for fault in _unknown_faults(area, thresholds))
            yield from (f"{area.name}: {fault}" for fault in _cut_off_faults(area, evidence.unfinished, thresholds))


def _stamp_faults(evidence: Evidence, thresholds: Thresholds, now_ns: int) -> Iterator[str]:
    """Yield a fault for each time stamp that is missing, too old or in the future.

    An answer that is older than its sources is also a fault.
    """
    limits = thresholds.evidence
    ahead = ns_of(limits.clock_tolerance_s)
    for what, stamp, longest in (
        ("the sources are", evidence.trigger_stamp_ns, limits.sources_max_age_s),
        ("the terrain is", evidence.terrain_stamp_ns, limits.terrain_max_age_s),
        ("the answer is", evidence.at_ns, None),
    ):
        age = now_ns - stamp
        if stamp == 0:
            yield f"{what} without a time stamp: the stamp is 0"
        elif longest is not None and age > ns_of(longest):
            yield f"{what} stale: stamped {span(age)} ago, at most {longest:g} s are allowed"
        if age < -ahead:
            yield f"{what} stamped {span(-age)} in the future"
    if evidence.at_ns < evidence.trigger_stamp_ns - ahead:
        yield "the answer is older than the stamp of its sources"


def _ensemble_faults(evidence: Evidence, thresholds: Thresholds) -> Iterator[str]:
    """Yield a fault for impossible numbers of sources and rocks, which are a sign of damaged evidence.

    There is also a fault if the share of rocks that were cut off in flight is above `most_unfinished` of the site.
    """
    most = max((area.flown for area in evidence.areas), default=0)
    if evidence.sources < 0:
        yield f"the number of sources is {evidence.sources}, which is impossible"
    elif evidence.sources == 0 and most > 0:
        yield f"{most} rocks flew, but there is no source"
    if evidence.unfinished < 0 or evidence.unfinished > max(most, 0):
        yield f"{evidence.unfinished} of {most} rocks were cut off in flight, which is impossible"
    elif evidence.unfinished and evidence.unfinished / most > thresholds.evidence.most_unfinished:
        allowed = f"at most a share of {thresholds.evidence.most_unfinished:g} is allowed"
        yield f"{evidence.unfinished} of {most} rocks were cut off in flight, {allowed}"


def _area_names_faults(evidence: Evidence, thresholds: Thresholds) -> Iterator[str]:
    names = [area.name for area in evidence.areas]
    for name in thresholds.named_in_full:
        if name not in names:
            yield f"{name}: the site file watches this area, but the answer does not contain it"
    if all(limits_of(thresholds, name) is None for name in names):
        yield "the answer contains no area with limits in the site file, so no area is watched"


def _area_faults(area: AreaEvidence, sources: int) -> Iterator[str]:
    if area.flown < 0 or not 0 <= area.reached <= area.flown:
        yield f"{area.reached} of {area.flown} rocks reached the area, which is impossible"
    elif area.flown == 0 and sources > 0:
        yield "there are sources, but no rock flew"
    elif not 0.0 <= area.low <= area.reached / max(area.flown, 1) <= area.high <= min(area.flown, 1):
        yield f"the interval {area.low} to {area.high} does not belong to {area.reached} of {area.flown} rocks"
    for what, value in (
        ("p95 energy", area.p95_energy),
        ("largest energy", area.largest_energy),
        ("first arrival", area.first_arrival_s),
    ):
        if value is not None and not 0.0 <= value < math.inf:
            yield f"the {what} is {value}, which is impossible"
        elif value is not None and area.reached <= 0:
            yield f"no rock reached the area, but there is a {what}"
    yield from _predictive_faults(area)
    yield from _end_faults(area)
    yield from _missing_faults(area)


def _predictive_faults(area: AreaEvidence) -> Iterator[str]:
    """Yield a fault for a predictive interval or a `left_high` of an area that cannot be right.

    The interval must come from parameter sets and contain the sampling interval. `left_high` must not be below the
    upper end of the interval.
    """
    low, high = area.predictive_low, area.predictive_high
    if area.sets < 0 or (low is None) != (high is None) or (low is not None and area.sets == 0):
        yield f"a predictive interval from {low} to {high} over {area.sets} parameter sets is impossible"
    elif low is not None and high is not None and not 0.0 <= low <= area.low <= area.high <= high <= 1.0:
        yield f"the predictive interval {low} to {high} does not contain the sampling interval"
    elif area.left_high is not None and not (high is not None and high <= area.left_high <= 1.0):
        yield f"with the rocks that left the terrain, the upper end {high} becomes an impossible {area.left_high}"


def _end_faults(area: AreaEvidence) -> Iterator[str]:
    """Yield a fault for an `energy_high`, `energy_sets` or `first_arrival_low_s` of an area that cannot be right.

    Such values are: an impossible number; an `energy_high` below the energy of all rocks together; a
    `first_arrival_low_s` later than the first arrival of all rocks.
    """
    energy, arrival = area.energy_high, area.first_arrival_low_s
    for what, end in (("upper end of the energy", energy), ("lower end of the first arrival", arrival)):
        if end is not None and not (area.sets > 0 and 0.0 <= end < math.inf):
            yield f"the {what} is {end} over {area.sets} parameter sets, which is impossible"
    if not 0 <= area.energy_sets <= max(area.sets, 0):
        yield f"{area.energy_sets} of {area.sets} parameter sets have a p95 energy, which is impossible"
    if energy is not None and area.pooled_energy is not None and energy < area.pooled_energy:
        yield f"the upper end of the energy {energy} is below the energy of all rocks, {area.pooled_energy}"
    if arrival is not None and area.first_arrival_s is not None and arrival > area.first_arrival_s:
        yield f"the lower end {arrival} of the first arrival is later than that of all rocks, {area.first_arrival_s}"


def _unknown_faults(area: AreaEvidence, thresholds: Thresholds) -> Iterator[str]:
    """Yield a fault if too much of an area has no terrain, or if rocks that left the terrain may have reached the area.

    The rocks that left the terrain are a fault in two cases: their share is too large, or the area would have a higher
    level if these rocks were counted as rocks that reached the area. An impossible number is also a fault.
    """
    terms = thresholds.evidence
    if not 0.0 <= area.share_without_energy <= 1.0:
        yield f"a share of {area.share_without_energy} of rocks with unknown energy is impossible"
    if not 0.0 <= area.uncovered <= 1.0 or not 0 <= area.left <= max(area.flown, 0):
        yield f"{area.uncovered:g} of the area without terrain, or {area.left} rocks that left it, is impossible"
        return
    if area.uncovered > terms.most_uncovered:
        yield (
            f"{100 * area.uncovered:.3g} % of the area, or of one of its outlines, has no terrain (at most "
            f"{100 * terms.most_uncovered:.3g} % is allowed): publish a survey that covers the area, or correct the "
            "coordinates of its outlines or machines"
        )
    hidden = hidden_level(area, thresholds)
    is_hidden = hidden is not None and hidden > level_of(area, thresholds)
    if is_hidden or (area.left and area.left / area.flown > terms.most_left):
        yield (
            f"{area.left:,} of {area.flown:,} rocks left the terrain, over its edge or into a hole, and may reach the "
            "area: publish a survey on which the rocks stop"
        )


def _cut_off_faults(area: AreaEvidence, unfinished: int, thresholds: Thresholds) -> Iterator[str]:
    """Yield a fault if the level of an area would be higher if all rocks that were cut off had reached the area.

    unfinished : number of rocks whose flight was cut off, as in `Evidence`
    """
    if unfinished > 0 and level_of(with_more_reached(area, unfinished), thresholds) > level_of(area, thresholds):
        yield (
            f"{unfinished:,} rocks were cut off in flight; if they reached the area, its level would be higher:"
            " allow longer flights and more impacts in the scene"
        )


def _missing_faults(area: AreaEvidence) -> Iterator[str]:
    """Yield a fault for an area whose rocks have no energy or arrival time, or a p95 above the largest energy."""
    if area.reached > 0 and (area.largest_energy is None or area.first_arrival_s is None):
        yield "rocks reached the area, but their energy or their arrival time is unknown"
    both = (area.p95_energy, area.largest_energy)
    if both[0] is not None and both[1] is not None and both[0] > both[1]:
        yield f"the p95 energy {both[0]} is above the largest energy, {both[1]}"
