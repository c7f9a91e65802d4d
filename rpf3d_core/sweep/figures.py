"""The figures of a cell: the results of its run in each place, with predictive and sampling interval, for JSON."""

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import sampling_of, share_of
from rpf3d_core.hazard.by_source.each_source import worst_benches
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.results.findings import Run
from rpf3d_core.results.hazard_files.barriers_report import shown_section
from rpf3d_core.values import UNSTOPPED, Outcome

REACHED, STOPPED, RETAINED = "reached", "stopped", "retained"
ENERGY, HEIGHT, RUNOUT = "energy_p95", "height_p95", "runout_p95"
SHARES = (REACHED, STOPPED, RETAINED)
PREDICTIVE, SAMPLING = "predictive", "sampling"
BARRIER = "barrier"
"""Kind of the places that are barriers; the other kinds of places are those of the bench table."""
P95 = 95
Ends = tuple[float | None, float | None]
UNKNOWN: Ends = (None, None)


class Figure(NamedTuple):
    """One result of a cell of a sweep, with its 95 % intervals.

    result : "reached", "stopped", "retained" (shares), "energy_p95", "height_p95" or "runout_p95"; for the whole run
        also the name of an outcome, whose share is the value
    kind, place : kind and name of the place, "" for the whole run
    unit : -, J or m; value : None if it is unknown, such as a share of no rocks
    low, high : ends of the 95 % interval: the predictive interval or, if it is unknown, the sampling interval
    interval : "predictive" or "sampling", the kind of the interval from low to high
    sampling_low, sampling_high : ends of the 95 % sampling interval; None if unknown
    """

    result: str
    kind: str
    place: str
    unit: str
    value: float | None
    low: float | None
    high: float | None
    interval: str
    sampling_low: float | None
    sampling_high: float | None


def figures_of(run: Run) -> list[Figure]:
    """Return the results of a run with their intervals: of the whole run, then of each zone, area and barrier."""
    return [*_of_run(run), *_of_outcomes(run), *_of_benches(run), *_of_barriers(run.maps)]


def _of_run(run: Run) -> Iterator[Figure]:
    """Yield 95th percentiles: runout of the rocks that stopped, largest energy and largest height of all rocks."""
    totals = run.totals
    yield _without_far_ends(run, _percentile(run, (RUNOUT, "m", "runout"), totals.runout))
    yield _percentile(run, (ENERGY, "J", "max_energy"), totals.max_energy)
    yield _percentile(run, (HEIGHT, "m", "max_height"), totals.max_height)


def _percentile(run: Run, what: tuple[str, str, str], sample: Sample) -> Figure:
    """Return the figure with the 95th percentile of a quantity, in its unit.

    what : result, unit and name of the quantity; sample : values of the quantity
    """
    (result, unit, name), sets = what, run.maps.sets
    predictive = UNKNOWN if sets is None else _pair(sets.percentile(name)[f"p{P95}"])
    value = sample.summary((P95,)).get(f"p{P95}")
    return _figure((result, "", "", unit), value, predictive, sample.interval(P95))


def _without_far_ends(run: Run, runout: Figure) -> Figure:
    """Return the figure of the p95 runout, with None in place of the value and the upper ends that are not known.

    The p95 runout is computed from the rocks that stopped. The other rocks are assumed to have gone farther, because
    most of them left the terrain. If more than 5 % of all rocks did not stop, the p95 runout of all rocks is unknown,
    and the value is None. If 5 % or fewer did not stop, the value stays, although the p95 runout of all rocks may be
    larger (`tables.STOPPED_NOTE`).

    The upper end of an interval is None if the interval of the share of rocks that did not stop reaches above 5 %. The
    predictive interval of this share is taken without the widening for rare rocks (`unknowns.predictive.least_end`),
    because with the widening most upper ends would be None.

    runout : figure of the p95 runout of the rocks that stopped
    """
    rocks, sets = run.totals.rocks, run.maps.sets
    share = share_of(sum(run.totals.outcomes[each] for each in UNSTOPPED), rocks)
    most, few = share["interval_95"][1] if rocks else 1.0, 1.0 - P95 / 100.0
    predicted = most if sets is None or runout.interval == SAMPLING else sets.seen_outcome(*UNSTOPPED)[1]
    return runout._replace(
        value=None if share["share"] is None or share["share"] > few else runout.value,
        high=runout.high if predicted <= few else None, sampling_high=runout.sampling_high if most <= few else None,
    )  # fmt: skip


def _of_outcomes(run: Run) -> Iterator[Figure]:
    """Yield the share of all rocks with each outcome, also of outcomes that no rock has."""
    sets = run.maps.sets
    for outcome in Outcome:
        share = share_of(run.totals.outcomes[outcome], run.totals.rocks)
        predictive = None if sets is None else sets.outcome(outcome)
        yield _figure((outcome.name.lower(), "", "", "-"), share["share"], predictive, share["interval_95"])


def _of_benches(run: Run) -> Iterator[Figure]:
    """Yield shares and p95 energies of all zones and areas; with several sources, those of the worst source there."""
    for bench in worst_benches(run.terrain, run.maps):
        for name in SHARES:
            share = getattr(bench, name)
            intervals = (share.get("predictive"), sampling_of(share))
            yield _figure((name, bench.kind, bench.name, "-"), share["share"], *intervals)
        intervals = (bench.energy_predictive, bench.energy_sampling)
        yield _figure((ENERGY, bench.kind, bench.name, "J"), bench.energy_p95, *intervals)


def _of_barriers(maps: HazardMaps) -> Iterator[Figure]:
    """Yield the figures of each barrier: share of rocks that reached the barrier, caught share, p95 energy, p95 height.

    The caught share is a share of the rocks that reached the barrier. Energy (J), and height (m) above the ground, are
    measured when a rock first reaches the barrier. With several sources, each figure is that of its worst source.
    """
    for name, facts in shown_section(maps).items():
        shares = ((REACHED, facts["reached"]), (RETAINED, facts["caught"]))
        for result, share in shares:
            intervals = (share.get("predictive"), sampling_of(share))
            yield _figure((result, BARRIER, name, "-"), share["share"], *intervals)
        for result, unit, key in ((ENERGY, "J", "first_energy_j"), (HEIGHT, "m", "first_height_over_ground_m")):
            section: Mapping[str, Any] = facts[key]
            intervals = (section.get("p95_predictive"), section["p95_interval_95"])
            yield _figure((result, BARRIER, name, unit), section.get(f"p{P95}"), *intervals)


def _figure(what: tuple[str, str, str, str], value: Any, predictive: Any, sampling: Any) -> Figure:
    """Return a figure with its intervals.

    what : result, kind, place and unit; predictive, sampling : lower and upper end of the interval, or None
    """
    result, kind, place, unit = what
    wide, narrow = _pair(predictive), _pair(sampling)
    is_predictive = wide != UNKNOWN
    low, high = wide if is_predictive else narrow
    return Figure(
        result=result, kind=kind, place=place, unit=unit, value=_known(value), low=low, high=high,
        interval=PREDICTIVE if is_predictive else SAMPLING, sampling_low=narrow[0], sampling_high=narrow[1],
    )  # fmt: skip


def _pair(ends: Any) -> Ends:
    """Return both ends of an interval as plain numbers; None for an end that is not known."""
    return UNKNOWN if ends is None else (_known(ends[0]), _known(ends[1]))


def _known(value: Any) -> float | None:
    """Return a value as a plain number; None if it is not known or not finite."""
    return None if value is None or not abs(float(value)) < float("inf") else float(value)
