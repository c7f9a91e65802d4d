"""Counter-based random numbers: a draw is a function of seed, source, rock and purpose, not of what was drawn before.

So any engine, any number of threads and any order give the same bits, and one more named effect leaves every other
draw as it was. The generator is Philox4x32-10 of Salmon et al. 2011 (SC'11, doi 10.1145/2063384.2063405), checked
against the vectors published with it.
"""

from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

ROUNDS = 10
MULTIPLIERS = (np.uint64(0xD2511F53), np.uint64(0xCD9E8D57))
WEYL = (0x9E3779B9, 0xBB67AE85)
LOW = np.uint64(0xFFFFFFFF)
HALF = np.uint64(32)


class Purpose(IntEnum):
    """What a number is drawn for; each has a stream of its own. Numbers are never reused or reordered."""

    ALONG_LINE = 0
    POSITION_X = 1
    POSITION_Y = 2
    POSITION_Z = 3
    VELOCITY_X = 4
    VELOCITY_Y = 5
    VELOCITY_Z = 6


def philox(counter: NDArray[np.uint64], key: tuple[int, int]) -> NDArray[np.uint64]:
    """Philox4x32-10: counter (4, N) and key (2,) of 32-bit words to (4, N) words of 32 random bits."""
    c0, c1, c2, c3 = counter
    k0, k1 = key
    for _ in range(ROUNDS):
        first, second = MULTIPLIERS[0] * c0, MULTIPLIERS[1] * c2
        c0, c1, c2, c3 = (
            (second >> HALF) ^ c1 ^ np.uint64(k0),
            second & LOW,
            (first >> HALF) ^ c3 ^ np.uint64(k1),
            first & LOW,
        )
        k0, k1 = (k0 + WEYL[0]) & 0xFFFFFFFF, (k1 + WEYL[1]) & 0xFFFFFFFF
    return np.stack([c0, c1, c2, c3])


def uniform(seed: int, source: int, rock: ArrayLike, purpose: Purpose) -> NDArray[np.float64]:
    """Numbers in [0, 1) of 53 random bits, one for each rock (R,) of a source.

    seed : 0 <= seed < 2^64; source, rock : 0 <= number < 2^32
    """
    rocks = np.asarray(rock, dtype=np.uint64)
    counter = np.stack([rocks, np.full_like(rocks, source), np.full_like(rocks, int(purpose)), np.zeros_like(rocks)])
    words = philox(counter, (seed & 0xFFFFFFFF, seed >> 32))
    high, low = words[0] >> np.uint64(5), words[1] >> np.uint64(6)
    draws: NDArray[np.float64] = (high.astype(float) * 2.0**26 + low.astype(float)) * 2.0**-53
    return draws
