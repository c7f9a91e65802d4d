"""Combine the answers for several walls of a mine into the worst result, so that no answer hides a worse answer."""

import hashlib
import math
from collections.abc import Iterator, Sequence
from typing import Any

from rpf3d_core.alerts.evidence import AreaEvidence, Evidence
from rpf3d_core.alerts.origins import NOT_KNOWN, Origins
from rpf3d_core.ensemble.statistics import wilson_interval


def together(parts: Sequence[Evidence]) -> Evidence:
    """Combine the evidence of several walls into one `Evidence`: for each area of interest, the worst result counts.

    parts : the evidence of each wall, at least one, the newest last

    The result has the areas of the newest part with areas. All numbers of rocks that decide on a level are scaled to
    the part with the fewest rocks and rounded up, so the result is as uncertain as this part. The pooled numbers of
    rocks, which are only displayed, are sums. The result has the stamps of the oldest trigger and the oldest survey,
    the faults and notes of all parts, the total number of sources, and one digest of all sources. The number of
    unfinished rocks is the largest scaled number of all parts. The newest part gives all other values.
    """
    newest = parts[-1]
    if len(parts) == 1:
        return newest
    watched = next((part.areas for part in reversed(parts) if part.areas), ())
    flown = min((area.flown for part in parts for area in part.areas), default=0)
    digests = hashlib.sha256(" ".join(part.sources_digest for part in parts).encode()).hexdigest()
    return newest._replace(
        trigger_stamp_ns=min(part.trigger_stamp_ns for part in parts),
        terrain_stamp_ns=min(part.terrain_stamp_ns for part in parts),
        sources_digest=digests,
        sources=sum(part.sources for part in parts),
        areas=tuple(worst_of(list(_evidence_on(parts, area.name)), flown) for area in watched),
        faults=tuple(dict.fromkeys(fault for part in parts for fault in part.faults)),
        notes=tuple(dict.fromkeys(note for part in parts for note in part.notes)),
        unfinished=max(scaled(part.unfinished, _flown(part), flown) for part in parts),
    )


def _evidence_on(parts: Sequence[Evidence], name: str) -> Iterator[AreaEvidence]:
    """Return the evidence of the area `name` in each part; parts without this area are skipped."""
    return (area for part in parts for area in part.areas if area.name == name)


def _flown(part: Evidence) -> int:
    return max((area.flown for area in part.areas), default=0)


def worst_of(results: list[AreaEvidence], flown: int) -> AreaEvidence:
    """Return for one area the worst value of each figure in several results.

    The number of clusters and the pooled numbers of rocks are sums. The outline is that of the last result.

    results : the results for the area, at least one; flown : number of rocks to which all numbers of rocks are scaled
    """
    reached = max(scaled(area.reached, area.flown, flown) for area in results)
    left = max(scaled(area.left, area.flown, flown) for area in results)
    low, high = wilson_interval(reached, max(flown, 1))
    p95 = [energy for area in results if (energy := area.pooled_energy) is not None]
    largest = [area.largest_energy for area in results if area.largest_energy is not None]
    first = [area.first_arrival_s for area in results if area.first_arrival_s is not None]
    has_p95 = any(area.p95_energy is not None for area in results)
    predictive_low, predictive_high = _predictive_of(results, low, high)
    return AreaEvidence(
        name=results[0].name,
        flown=flown,
        reached=reached,
        low=low,
        high=high,
        p95_energy=max(p95, default=None) if has_p95 else None,
        largest_energy=max(largest, default=None),
        first_arrival_s=min(first, default=None),
        left=min(left, flown),
        uncovered=max(area.uncovered for area in results),
        clusters=sum(area.clusters for area in results),
        pooled_flown=sum(area.pooled_flown for area in results),
        pooled_reached=sum(area.pooled_reached for area in results),
        sets=max(area.sets for area in results),
        predictive_low=predictive_low,
        predictive_high=predictive_high,
        left_high=_left_high_of(results, predictive_high),
        origins=_origins_of(results, flown),
        outline=results[-1].outline,
        without_energy=max(area.share_without_energy for area in results) if left > 0 else None,
        **_ends_over_sets(results),
    )


def _origins_of(results: list[AreaEvidence], flown: int) -> Origins | None:
    """Return the origin of each figure of the combined result: the cluster that gave the worst value of this figure.

    The result is None if no result has origins. flown : number of rocks to which all numbers of rocks are scaled
    """
    if all(area.origins is None for area in results):
        return None
    most = max(results, key=lambda area: scaled(area.reached, area.flown, flown))
    widest = max(results, key=lambda area: -1.0 if area.predictive_high is None else area.predictive_high)
    strongest = max(results, key=lambda area: -1.0 if area.pooled_energy is None else area.pooled_energy)
    first = min(results, key=lambda area: math.inf if area.first_arrival_s is None else area.first_arrival_s)
    energy, first_arrival = (strongest.origins or NOT_KNOWN).energy, (first.origins or NOT_KNOWN).first_arrival
    high, low = max(results, key=_energy_high).origins, min(results, key=_arrival_low).origins
    of_high = None if high is None else high.energy_high or high.energy
    of_low = None if low is None else low.first_arrival_low or low.first_arrival
    return Origins(
        reached=(most.origins or NOT_KNOWN).reached,
        predictive=(widest.origins or NOT_KNOWN).predictive,
        energy=energy,
        first_arrival=first_arrival,
        energy_high=None if of_high == energy else of_high,
        first_arrival_low=None if of_low == first_arrival else of_low,
    )


def _ends_over_sets(results: list[AreaEvidence]) -> dict[str, Any]:
    """Return the fields `energy_high`, `energy_sets` and `first_arrival_low_s` of the worst result, by name.

    `energy_high` and `energy_sets` are missing if `energy_high` is None in all results; `first_arrival_low_s` is
    missing if it is None in all results. If only some results lack one of these ends, the figure of all rocks together
    replaces this end in these results. So the worst value is at least as bad as the figure of all rocks in each result.
    """
    ends: dict[str, Any] = {}
    if any(area.energy_high is not None for area in results):
        strongest = max(results, key=_energy_high)
        ends |= {"energy_high": _energy_high(strongest), "energy_sets": strongest.energy_sets}
    if any(area.first_arrival_low_s is not None for area in results):
        ends |= {"first_arrival_low_s": min(map(_arrival_low, results))}
    return ends


def _energy_high(area: AreaEvidence) -> float:
    """Return the larger of `pooled_energy` and `energy_high` (J) of an area; -1 if both are None."""
    ends = [end for end in (area.pooled_energy, area.energy_high) if end is not None]
    return max(ends, default=-1.0)


def _arrival_low(area: AreaEvidence) -> float:
    """Return the smaller of `first_arrival_s` and `first_arrival_low_s` (s) of an area; infinite if both are None."""
    ends = [end for end in (area.first_arrival_s, area.first_arrival_low_s) if end is not None]
    return min(ends, default=math.inf)


def _predictive_of(results: list[AreaEvidence], low: float, high: float) -> tuple[float | None, float | None]:
    """Return the worst predictive interval of several results, widened to contain their worst sampling interval.

    low, high : ends (-) of this sampling interval

    Both returned ends are None if no result is from parameter sets, or if a result from parameter sets has no interval.
    """
    over = [(area.predictive_low, area.predictive_high) for area in results if area.sets]
    lows, highs = [end for end, _ in over if end is not None], [end for _, end in over if end is not None]
    if not over or len(lows) < len(over) or len(highs) < len(over):
        return None, None
    return min(low, max(lows)), max(high, *highs)


def _left_high_of(results: list[AreaEvidence], predictive_high: float | None) -> float | None:
    """Return the largest `left_high` of several results, at least `predictive_high`, the worst upper end (-).

    `left_high` is the upper end (-) of the share of rocks that reach an area, if every rock that left the terrain and
    may have reached the area had reached it.

    The returned value is None if `predictive_high` is None, if no result is from parameter sets, or if a result from
    parameter sets lacks `left_high`.
    """
    ends = [area.left_high for area in results if area.sets]
    known = [end for end in ends if end is not None]
    if predictive_high is None or not ends or len(known) < len(ends):
        return None
    return max(predictive_high, *known)


def scaled(count: int, of: int, to: int) -> int:
    """Return a number of rocks, `count` out of `of`, scaled to a total of `to` rocks and rounded up; 0 if `of` is 0."""
    return -(-count * to // of) if of else 0
