"""Test whether the shares of two independent ensembles differ: confidence interval, p value, and Holm's correction.

A share is a count out of a total, as in `statistics.share_of`.
"""

import math
from collections.abc import Sequence

from rpf3d_core.ensemble.statistics import wilson_interval

LEAST_EXPECTED = 5.0
"""Expected count below which an exact test replaces the normal approximation (Cochran 1954, Biometrics 10:417-451)."""
AS_LIKELY = 1.0 + 1e-7
"""Tolerance factor for rounding, by which Fisher's exact test compares chances, as in R's fisher.test.

A table counts as no more likely than the observed table if its chance is at most this factor times the chance of the
observed table.
"""


def newcombe_interval(a: int, n_a: int, b: int, n_b: int) -> tuple[float, float]:
    """Return the 95 % confidence interval of the difference of two shares, a / n_a - b / n_b; both totals >= 1.

    Sources
    -------
    Newcombe 1998, Stat. Med. 17:873-890, method 10: the hybrid of two Wilson score intervals, without continuity
    correction. Unlike the usual interval, this interval is valid for shares near 0 and 1 and for very different totals.
    """
    p, q = a / n_a, b / n_b
    (low_p, high_p), (low_q, high_q) = wilson_interval(a, n_a), wilson_interval(b, n_b)
    return p - q - math.hypot(p - low_p, high_q - q), p - q + math.hypot(high_p - p, q - low_q)


def p_value(a: int, n_a: int, b: int, n_b: int) -> float:
    """Return the two-sided p value of the hypothesis that two shares, a / n_a and b / n_b, are equal.

    The test is the pooled z test, or Fisher's exact test for small counts.
    """
    hits, rocks = a + b, n_a + n_b
    least = min(hits, rocks - hits) * min(n_a, n_b) / rocks
    return fisher_p(a, n_a, b, n_b) if least < LEAST_EXPECTED else pooled_z_p(a, n_a, b, n_b)


def pooled_z_p(a: int, n_a: int, b: int, n_b: int) -> float:
    """Return the two-sided p value that two shares are equal, by the pooled z test, for large counts.

    The test has no continuity correction; it equals Pearson's chi-square test.

    a, b : numbers of successes of the two samples; n_a, n_b : sizes of the samples
    """
    pooled = (a + b) / (n_a + n_b)
    spread = math.sqrt(pooled * (1.0 - pooled) * (1.0 / n_a + 1.0 / n_b))
    return 1.0 if spread == 0.0 else math.erfc(abs(a / n_a - b / n_b) / spread / math.sqrt(2.0))


def fisher_p(a: int, n_a: int, b: int, n_b: int) -> float:
    """Return the two-sided p value that two shares, a / n_a and b / n_b, are equal, by Fisher's exact test.

    The test is meant for small counts. All pairs of counts with the totals `n_a`, `n_b` and `a + b` are compared with
    the observed pair. The p value is the sum of the probabilities of all pairs that are at most as likely as the
    observed pair.

    Sources
    -------
    Fisher 1935, J. R. Stat. Soc. 98:39-82; the two-sided rule is that of R's fisher.test.
    """
    hits = a + b
    tables = range(max(0, hits - n_b), min(hits, n_a) + 1)
    chances = [_chance(k, n_a, hits - k, n_b) for k in tables]
    found = chances[a - tables.start]
    return min(1.0, sum(chance for chance in chances if chance <= found * AS_LIKELY))


def _chance(a: int, n_a: int, b: int, n_b: int) -> float:
    """Return the chance of the counts a out of n_a and b out of n_b if both shares are equal, given their sum a + b.

    This is the hypergeometric distribution.
    """
    return math.exp(log_choose(n_a, a) + log_choose(n_b, b) - log_choose(n_a + n_b, a + b))


def log_choose(n: int, k: int) -> float:
    """Return the logarithm of the number of ways to choose k of n things."""
    return math.lgamma(n + 1) - math.lgamma(k + 1) - math.lgamma(n - k + 1)


def holm(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected for the number of tests by Holm's method, in the order of `p_values`.

    If every difference with a corrected p value below 0.05 is called real, then the chance that one or more of these
    calls are wrong is at most 5 %.

    Sources
    -------
    Holm 1979, Scand. J. Stat. 6:65-70.
    """
    corrected, highest = [0.0] * len(p_values), 0.0
    for rank, i in enumerate(sorted(range(len(p_values)), key=p_values.__getitem__)):
        highest = max(highest, min(1.0, (len(p_values) - rank) * p_values[i]))
        corrected[i] = highest
    return corrected
