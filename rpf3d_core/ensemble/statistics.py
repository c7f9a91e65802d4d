"""Compute shares of rocks with their 95 % intervals, as plain values that can be written to JSON."""

from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NORMAL_QUANTILE_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution, for confidence intervals."""

PERCENTILES = (5, 25, 50, 75, 95)
"""Percentiles that the summary of a run reports."""


@lru_cache(maxsize=65_536)
def wilson_interval(count: int, total: int) -> tuple[float, float]:
    """Return the 95 % confidence interval (low, high) of the share count / total, due to the number of rocks.

    total : >= 1

    Sources
    -------
    Wilson 1927, J. Am. Stat. Assoc. 22:209-212. Unlike the normal approximation, the interval is valid at 0 and at 1.

    Examples
    --------
    >>> low, high = wilson_interval(0, 100)
    >>> round(low, 4), round(high, 4)
    (0.0, 0.037)
    """
    low, high = wilson_intervals(np.array([count], dtype=float), total)
    return float(low[0]), float(high[0])


def wilson_intervals(
    count: FloatArray, total: int | FloatArray, z: float = NORMAL_QUANTILE_95
) -> tuple[FloatArray, FloatArray]:
    """Return the lower (N,) and upper (N,) ends of the confidence intervals of shares count / total.

    count : (N,); total : >= 1, one number for all shares or (N,)
    z : two-sided quantile of the normal distribution, by default for intervals of 95 %
    If rocks have unequal weights, a count need not be a whole number: it is then the number of rocks of equal weight
    whose share has the same relative variance (`hazard.passages`). Source: as `wilson_interval`.
    """
    z2 = z**2
    share = count / total
    middle = (share + z2 / (2 * total)) / (1 + z2 / total)
    half = z / (1 + z2 / total) * np.sqrt(share * (1 - share) / total + z2 / (4 * total**2))
    # At a count of 0 or of `total` the two terms are equal except for rounding.
    return np.where(count == 0.0, 0.0, middle - half), np.where(count == total, 1.0, middle + half)


def share_of(count: int, total: int) -> dict[str, Any]:
    """Return a count of rocks with its share of `total` (-) and the share's 95 % interval, as the outputs report them.

    Share and interval are None if `total` is 0.
    """
    if total == 0:
        return {"rocks": 0, "share": None, "interval_95": None}
    return {"rocks": int(count), "share": count / total, "interval_95": list(wilson_interval(int(count), total))}


def sampling_of(share: dict[str, Any]) -> Any:
    """Return the sampling interval [low, high] (-) of a share from `share_of`; None if its total is 0.

    A share with a predictive interval has this interval as `interval_95`, and the key `sampling`
    (`hazard.benches.with_predictive`).
    """
    return share.get("sampling", share["interval_95"])


def words_on_pieces(rocks: int, pieces: int) -> str:
    """Return a warning about shares of a run with fragments: each fragment counts as one rock, like a released rock.

    rocks : number of released rocks and fragments together; pieces : number of fragments
    """
    return (
        f"{pieces:,} of {rocks:,} rocks are pieces of the other {rocks - pieces:,}: shares and reach probability are "
        "of all of them together, not of rocks released, and their intervals are too narrow"
    )
