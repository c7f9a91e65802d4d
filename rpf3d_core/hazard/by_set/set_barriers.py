"""Counts at barriers for each parameter set, and the predictive intervals of shares, energies and heights there.

At barriers, paths are used as simulated: they are not displaced by the error of the model.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.hazard.barrier_arrivals import HELD, OVER, THROUGH
from rpf3d_core.hazard.barriers import AtBarrier, BarrierTally
from rpf3d_core.hazard.by_source.source_arrivals import SourceArrivals
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.unknowns.predictive import Interval, ranked_if_enough, shares_of_site

P95 = 95
FIRST = {"first_caught": HELD, "first_broken_through": THROUGH, "first_flown_over": OVER}
"""Names of the results of first arrivals, with their places in `AtBarrier.first`."""

Bands = Mapping[str, tuple[float, float]]
"""Predictive intervals (low, high) of the figures of one barrier, by name; both ends are NaN if unknown.

came : share (-) of all rocks that arrived at the barrier
first_caught, first_broken_through, first_flown_over, caught : shares (-) of the rocks that arrived
energy (J), height (m) : 95th percentiles over first arrivals
"""


class SetCounts(NamedTuple):
    """The counts of S parameter sets at one barrier, for N sources; N is 1 for all rocks together.

    came, held : (S, N) number (-) of rocks that arrived, and that were caught in the end
    first : (S, N, 4) number of rocks by the result of their first arrival, as `AtBarrier.first`
    energy (J), height (m) : (S, N) 95th percentiles over first arrivals, NaN for fewer than 20 rocks
    """

    came: FloatArray
    held: FloatArray
    first: FloatArray
    energy: FloatArray
    height: FloatArray


class BarrierSets:
    """The counts at B barriers, for each parameter set: call `begin` before the rocks of a set fly.

    The tally of the run does the counting; `begin` selects the parameter set to which the tally adds rocks. Creating
    the object empties the tally's counts for each source: from then on, they are kept separately for each set.

    tally : counts at the barriers of the run, empty so far; sets : number of parameter sets
    """

    def __init__(self, tally: BarrierTally, sets: int) -> None:
        self._tally = tally
        self._counted = [tuple(AtBarrier() for _ in tally.names) for _ in range(sets)]
        if tally.sources is not None:
            tally.sources = tally.sources.over_sets(sets)

    def begin(self, number: int) -> None:
        """Start to count for parameter set `number`: all rocks from now until the next call of `begin` belong to it."""
        self._tally.part = self._counted[number]
        if self._tally.sources is not None:
            self._tally.sources.set = number

    def bands(self, rocks: FloatArray) -> tuple[Bands, ...]:
        """Return the predictive intervals at each barrier, of shares (-), p95 energies (J) and p95 heights (m).

        rocks : (S,) number (-) of rocks flown with each set
        """
        return tuple(_bands(_together(at), rocks[:, None])[0] for at in zip(*self._counted, strict=True))

    def source_bands(self, rocks: FloatArray) -> tuple[tuple[Bands, ...], ...]:
        """Return the intervals of `bands` for each of N sources; () if sources are not counted.

        rocks : (S, N) number (-) of rocks flown with each set from each source
        """
        if self._tally.sources is None:
            return ()
        found = self._tally.sources
        return tuple(zip(*(_bands(_each(found, b), rocks) for b in range(len(self._tally.names))), strict=True))


def _together(at: Sequence[AtBarrier]) -> SetCounts:
    """Return the counts of all rocks together at one barrier; at : the counts of each of S sets there."""
    first = np.array([each.first for each in at], dtype=float)[:, None]
    held = np.array([[float(each.held)] for each in at])
    energy, height = (np.array([[_p95(getattr(each, name))] for each in at]) for name in ("energy", "height"))
    return SetCounts(first[..., 1:].sum(axis=2), held, first, energy, height)


def _each(found: SourceArrivals, b: int) -> SetCounts:
    """Return the counts of each source at barrier number `b`."""
    first, held = found.first[:, :, b].astype(float), found.held[:, :, b].astype(float)
    energy, height = (
        values[b].percentiles(P95, FEWEST_ROCKS).reshape(found.sources, -1).T for values in (found.energy, found.height)
    )
    return SetCounts(first[..., 1:].sum(axis=2), held, first, energy, height)


def _bands(counts: SetCounts, rocks: FloatArray) -> list[Bands]:
    """Return the predictive intervals at one barrier for each of N sources.

    counts : at this barrier; rocks : (S, N) number (-) of rocks flown with each set from each source
    """
    did = {name: counts.first[..., place] for name, place in FIRST.items()} | {"caught": counts.held}
    found = {
        "came": shares_of_site(counts.came, rocks),
        **{name: shares_of_site(count, counts.came) for name, count in did.items()},
        "energy": ranked_if_enough(counts.energy),
        "height": ranked_if_enough(counts.height),
    }
    return [{name: _ends(ends, number) for name, ends in found.items()} for number in range(rocks.shape[1])]


def _p95(sample: Sample) -> float:
    """Return the 95th percentile of a sample, NaN for fewer than 20 rocks."""
    return sample.percentiles((P95,))[0] if sample.count >= FEWEST_ROCKS else np.nan


def _ends(intervals: Interval, number: int) -> tuple[float, float]:
    return float(intervals.low[number]), float(intervals.high[number])
