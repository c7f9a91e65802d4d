"""Compute the sizes of a rock's fragments: a fractal law, fitted to the rock's volume and the impact's new surface.

Observed: the number of fragments with a volume above U is proportional to U^(-D / 3). So the volume of the k-th
largest fragment is proportional to k^(-p), p = 3 / D (Ruiz-Carulla et al. 2017 and Matas et al. 2017, after Perfect
1997: D is a dimension over lengths, so the exponent for volumes is -3 / D). For a rock of volume V and surface A_0, two
balances determine the volumes V_k of all fragments:

    volume    V_k = V k^(-p) / zeta(p),                             k = 1, 2, ... without end
    surface   zeta(2 p / 3) / zeta(p)^(2 / 3) = (A_0 + A_new) / A_0    if fragments have the shape of the rock

zeta is Riemann's zeta function. The only solution has p > 3/2 (D < 2: the surface of a fractal of dimension 2 is
infinite). The more surface A_new an impact creates, the smaller are p and the largest fragment, and the larger is each
fragment from the fifth on, because d ln V_k / dp = |zeta'(p) / zeta(p)| - ln k and |zeta' / zeta| < 1.51 < ln 5. The
second, third and fourth fragments first grow with A_new, too, but then shrink again by up to 12, 3 and 0.2 %.

The balances and their solution are derived here (mark D in docs/reference/effects.md). The meaning of the dimension D
is from the abstract of Perfect 1997; everything else is from texts that quote the publications. A comparison without
any fitting: at A_new / (A_new + A_0) = 0.25, 0.5, 0.7, the share 1 / zeta(p) of the largest fragment is 0.88, 0.69,
0.55. RockGIS' source code calls this share the survival rate; its values are 0.87, 0.74, 0.64.
"""

import math
from typing import NamedTuple

from rpf3d_core.jit.dispatch import kernel

LOGS = tuple(math.log(k) for k in range(2, 12))
"""Logarithms of k = 2 to 11, for the terms of a zeta function that are added one by one."""
LAST = 12.0
"""Number k of the first term of a zeta function that is not added one by one.

The Euler-Maclaurin formula gives the sum from this term on, with a relative error below 1e-14.
"""
LOG_LAST = math.log(LAST)
MOST = 60.0
"""Largest value of 2 p / 3 - 1 (-) in the search; the second fragment then has only 2^-91 of the rock's volume."""
EXACT = 1e-14
"""Relative error of the surface (-) at which the search for the size law ends: a few rounding errors."""
TRIES = 100
"""Largest number of steps of the search for the size law; 12 are usual."""


class Cascade(NamedTuple):
    """The size law of a rock's fragments: the k-th largest fragment has the volume V k^(-p) / zeta(p).

    exponent : p (-); largest : 1 / zeta(p), share of the rock's volume V in the largest fragment (-)
    """

    exponent: float
    largest: float


@kernel
def zeta_less_one(excess: float) -> float:
    """Return Riemann's zeta(1 + excess) - 1, for excess > 0, which the balances of volume and surface need.

    Source: NIST DLMF 25.2.8 to 25.2.10 (Euler-Maclaurin summation of the zeta function).
    """
    s, total = 1.0 + excess, 0.0
    for log in LOGS:
        total += math.exp(-s * log)
    square = LAST * LAST
    rest = LAST / excess + 0.5
    term = s / (12.0 * LAST)
    rest += term
    term *= -(s + 1.0) * (s + 2.0) / (60.0 * square)
    rest += term
    term *= -(s + 3.0) * (s + 4.0) / (42.0 * square)
    rest += term
    term *= -(s + 5.0) * (s + 6.0) / (40.0 * square)
    rest += term
    term *= -(s + 7.0) * (s + 8.0) * 10.0 / (396.0 * square)
    rest += term
    return total + math.exp(-s * LOG_LAST) * rest


@kernel
def log_surface(excess: float) -> float:
    """Return the logarithm of the ratio of the fragments' total surface to the rock's surface.

    excess : 2 p / 3 - 1 > 0, with p the exponent of the size law
    """
    return math.log1p(zeta_less_one(excess)) - 2.0 / 3.0 * math.log1p(zeta_less_one(0.5 + 1.5 * excess))


@kernel
def cascade_of(created: float) -> Cascade:
    """Return the size law of the fragments of a rock, from the surface that the impact creates.

    created : A_new / A_0 (-), new surface / surface of the rock; at 0, the largest fragment is almost the whole rock
    """
    excess = _excess_of(created)
    return Cascade(1.5 * (1.0 + excess), 1.0 / (1.0 + zeta_less_one(0.5 + 1.5 * excess)))


@kernel
def _excess_of(created: float) -> float:
    """Return t = 2 p / 3 - 1, with p the exponent of the size law that satisfies the balance of surfaces.

    created : A_new / A_0 (-), surface created by the impact / surface of the rock; the result is MOST (60) at 0

    The search is by false position (Illinois) between a lower and an upper bound of t. The bounds follow from
    1 / t < zeta(1 + t) < 1 + 1 / t, zeta(p)^(2/3) < 1.9, and zeta(1 + t) - 1 < 1.5 * 2^-t for t > 1.
    """
    if not created > 0.0:
        return MOST
    low = 1.0 / (1.9 * (1.0 + created))
    high = min(1.0 / created, max(1.0, math.log2(1.5 / created)), MOST)
    above, below, side = _off(low, created), _off(high, created), 0
    if below >= 0.0:
        return high
    middle = low
    for _ in range(TRIES):
        middle = (low * below - high * above) / (below - above)
        off = _off(middle, created)
        if abs(off) <= EXACT:
            break
        if off > 0.0:
            low, above, below = middle, off, (0.5 * below if side > 0 else below)
            side = 1
        else:
            high, below, above = middle, off, (0.5 * above if side < 0 else above)
            side = -1
    return middle


@kernel
def _off(excess: float, created: float) -> float:
    """Return ln(a) - ln(created), where a is the value of A_new / A_0 that belongs to the size law with this excess.

    The result is 0 for the excess that `_excess_of` searches, and above 0 if the excess is too small.
    excess : 2 p / 3 - 1; created : A_new / A_0 (-), surface created by the impact / surface of the rock
    """
    return math.log(math.expm1(log_surface(excess))) - math.log(created)


@kernel
def share_at(cascade: Cascade, rank: int) -> float:
    """Return the share (-) of a rock's volume that one of its fragments has.

    cascade : the size law; rank : place of the fragment in descending order of size, from 1
    """
    return cascade.largest * math.exp(-cascade.exponent * math.log(rank))


@kernel
def count_from(cascade: Cascade, least: float) -> int:
    """Return how many fragments of a rock are large enough to be simulated.

    cascade : the size law; least : smallest volume of a simulated fragment, as a share of the rock's volume (-), > 0
    """
    count = 0
    while share_at(cascade, count + 1) >= least:
        count += 1
    return count
