"""Counts at barriers for each parameter set, and the predictive intervals of shares, energies and heights there.

At barriers, paths are used as simulated: they are not displaced by the error of the model.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.hazard.barrier_arrivals import HELD, OVER, THROUGH
from rpf3d_core.hazard.barriers import AtBarrier, BarrierTally
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


class BarrierSets:
    """The counts at B barriers, for each parameter set: call `begin` before the rocks of a set fly."""

    def __init__(self, tally: BarrierTally, sets: int) -> None:
        self._tally = tally
        self._counted = [tuple(AtBarrier() for _ in tally.names) for _ in range(sets)]

    def begin(self, number: int) -> None:
        """Start to count for parameter set `number`: all rocks from now until the next call of `begin` belong to it."""
        self._tally.part = self._counted[number]

    def bands(self, rocks: FloatArray) -> tuple[Bands, ...]:
        """Return the predictive intervals at each barrier, of shares (-), p95 energies (J) and p95 heights (m).

        rocks : (S,) number (-) of rocks flown with each set
        """
        return tuple(_bands(at, rocks) for at in zip(*self._counted, strict=True))


def _bands(at: Sequence[AtBarrier], rocks: FloatArray) -> Bands:
    """Return the predictive intervals at one barrier.

    at : the counts of each of S sets at the barrier; rocks : (S,) number (-) of rocks flown with each set
    """
    came = np.array([float(each.first[1:].sum()) for each in at])
    did = {name: np.array([float(each.first[place]) for each in at]) for name, place in FIRST.items()}
    did["caught"] = np.array([float(each.held) for each in at])
    p95 = {name: np.array([_p95(getattr(each, name)) for each in at]) for name in ("energy", "height")}
    return {
        "came": _share(came, rocks),
        **{name: _share(count, came) for name, count in did.items()},
        **{name: _ends(ranked_if_enough(values[:, None])) for name, values in p95.items()},
    }


def _share(counts: FloatArray, of: FloatArray) -> tuple[float, float]:
    """Return the predictive interval of a share (-); both ends are NaN if fewer than 39 sets have rocks.

    counts, of : (S,) numbers of rocks of each set, numerator and denominator of the share
    """
    return _ends(shares_of_site(counts[:, None], of[:, None]))


def _p95(sample: Sample) -> float:
    """Return the 95th percentile of a sample, NaN for fewer than 20 rocks."""
    return sample.percentiles((P95,))[0] if sample.count >= FEWEST_ROCKS else np.nan


def _ends(interval: Interval) -> tuple[float, float]:
    return float(interval.low[0]), float(interval.high[0])
