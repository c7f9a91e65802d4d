"""Choose the source that is worst for a figure of a place: a zone, an area of interest, a barrier or a distance.

The choice is ALL (all rocks together) if no source is worse. A share of a source counts as worse only if the interval
of this share lies outside the 95 % interval of the share of all rocks. With n sources that have rocks in the
denominator, the interval of a source has the level 1 - 0.05 / n. So if all n sources are equal, chance selects one of
them at a place with a probability of at most 5 %. A value, such as a p95 energy, counts as worse if it is larger than
the value of all rocks.
"""

from statistics import NormalDist
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.statistics import wilson_intervals

ALL = -1
"""Number in place of a source: all rocks together."""


class Counts(NamedTuple):
    """The numerators and denominators of shares at P places, for each of S sources and for all rocks together.

    each, each_of : (S, P) rocks of each source that the share counts, and in total
    all, all_of : (P,) the same for the rocks of all sources
    """

    each: Any
    each_of: Any
    all: Any
    all_of: Any


def with_largest_share(counts: Counts) -> IntArray:
    """Return for each place the source (P,) whose share has the highest lower end; ALL if none is clearly worse.

    The result contains numbers of sources. The ends are those of the interval of the share. A source is clearly worse
    if the lower end of its interval is above the interval of all rocks.
    """
    low = _lower_ends(counts)
    return np.where(low.max(axis=0) > _ends_of_all(counts)[1], low.argmax(axis=0), ALL)


def with_smallest_share(counts: Counts) -> IntArray:
    """Return for each place the source (P,) whose share has the lowest upper end; ALL if none is clearly worse.

    The result contains numbers of sources. The ends are those of the interval of the share. A source is clearly worse
    if the upper end of its interval is below the interval of all rocks. Sources without rocks in the denominator do not
    count.
    """
    high = np.where(counts.each_of > 0, _ends(counts)[1], 2.0)
    return np.where(high.min(axis=0) < _ends_of_all(counts)[0], high.argmin(axis=0), ALL)


def with_largest_value(each: FloatArray, together: FloatArray) -> IntArray:
    """Return for each place the source (P,) with the largest value; ALL if no source exceeds the value of all rocks.

    each, together : (S, P) and (P,) values >= 0 of each source, and of all rocks, in one unit; NaN if unknown
    """
    values = np.nan_to_num(each, nan=-1.0)
    return np.where(values.max(axis=0) > np.nan_to_num(together, nan=-1.0), values.argmax(axis=0), ALL)


def clearly_above(counts: Counts) -> Any:
    """Return flags (S, P): True where the lower end of the share of a source is above the interval of all rocks."""
    return _lower_ends(counts) > _ends_of_all(counts)[1]


def further_figures(count: int, of: str) -> str:
    """Return the sentence " {count} more figures of {of} differ as clearly.", with a leading space; "" for 0.

    The sentence follows a warning about one figure that differs between a source and all rocks.

    count : number of further figures; of : words for what the figures describe, such as "the bench table"
    """
    if not count:
        return ""
    return f" {count} more figure{'s' if count > 1 else ''} of {of} differ{'' if count > 1 else 's'} as clearly."


def _ends(counts: Counts) -> tuple[FloatArray, FloatArray]:
    """Return the ends (S, P) of the intervals of the shares of S sources, at the level 1 - 0.05 / n.

    n is the number of sources with rocks in the denominator at any place. Where a source has no such rocks, the ends
    have no meaning.
    """
    of = np.maximum(counts.each_of, 1).astype(float)
    z = NormalDist().inv_cdf(1.0 - 0.025 / max(int(np.any(counts.each_of > 0, axis=-1).sum()), 1))
    return wilson_intervals(np.where(counts.each_of > 0, counts.each, 0).astype(float), of, z)


def _lower_ends(counts: Counts) -> FloatArray:
    """Return the lower ends (S, P) of the intervals of the sources; 0 for a source without rocks at a place."""
    return np.where(counts.each_of > 0, _ends(counts)[0], 0.0)


def _ends_of_all(counts: Counts) -> tuple[FloatArray, FloatArray]:
    """Return the ends (P,) of the 95 % intervals of all rocks together."""
    return wilson_intervals(np.asarray(counts.all, dtype=float), np.maximum(counts.all_of, 1).astype(float))
