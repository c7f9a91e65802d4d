"""Counter-based random numbers: a draw is a function of seed, source, rock and purpose, not of earlier draws.

Therefore the bits are the same for any engine, any number of threads and any order, and an additional effect does not
change other draws. The generator is Philox4x32-10 of Salmon et al. 2011 (SC'11, doi 10.1145/2063384.2063405), checked
against the published test vectors. Its four counter words are

    rock | source | purpose + 256 zone | number

where `number` is the number of the impact, from 1. Zone and number are 0 in draws that depend on the rock alone.
"""

from enum import IntEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rpf3d_core.jit.dispatch import HAS_NUMBA, kernel, loop

ROUNDS = 10
MULTIPLIERS = (0xD2511F53, 0xCD9E8D57)
WEYL = (0x9E3779B9, 0xBB67AE85)
WORD = 0xFFFFFFFF
"""Mask of the low 32 bits of an integer, for arithmetic with 32-bit words.

Kernels compute with signed 64-bit integers. A product may overflow, but its bits are the same as in the unsigned
product. The mask removes the sign bits that a right shift of a negative number adds.
"""
MANY = 50_000
"""Least number of draws for which a compiled loop is used: it needs a tenth of the time and gives the same bits."""
ZONES = 256
"""Factor of the zone number in the stream number, so that there may be up to 256 purposes and 2^24 zones."""


class Purpose(IntEnum):
    """The purpose for which a random number is drawn; each purpose has a separate stream of numbers.

    Values are never reused or reordered.
    """

    ALONG_LINE = 0
    POSITION_X = 1
    POSITION_Y = 2
    POSITION_Z = 3
    VELOCITY_X = 4
    VELOCITY_Y = 5
    VELOCITY_Z = 6
    ROCK_SIZE = 7
    IN_AREA = 8
    ACROSS_FACET = 9
    ALONG_FACET = 10
    SPEED = 11
    TILT = 12
    TURN = 13
    NORMAL_RESTITUTION = 14
    TANGENTIAL_RESTITUTION = 15
    FRICTION_ANGLE = 16
    REBOUND_MATRIX = 20
    ROUGHNESS = 28
    ROUGHNESS_SHARE = 29
    ROUGHNESS_SIDE = 30
    ROUGHNESS_LATERAL = 31
    TREE_CLASS = 32
    TREE_ANGLE = 33
    TREE_SIDE = 34
    TREE_X = 36
    TREE_Y = 37
    TREE_DIAMETER = 39
    TREE_KIND = 40
    BREAKING = 48
    PIECE_TILT = 49
    PIECE_TURN = 50
    ROLLING_FRICTION = 60
    SHAPE = 61
    POSE = 62
    POSE_TURN = 63
    POSE_TILT = 64
    PARAMETER_SET = 65


@kernel
def philox_words(c0: Any, c1: Any, c2: Any, c3: Any, k0: int, k1: int) -> tuple[Any, Any, Any, Any]:
    """Return four random words of 32 bits from four counter words and two key words: the generator Philox4x32-10.

    Counter words are integers or, in Python, arrays (N,) of uint64; the bits are the same.
    """
    for _ in range(ROUNDS):
        first, second = MULTIPLIERS[0] * c0, MULTIPLIERS[1] * c2
        c0, c2 = ((second >> 32) & WORD) ^ c1 ^ k0, ((first >> 32) & WORD) ^ c3 ^ k1
        c1, c3 = second & WORD, first & WORD
        k0, k1 = (k0 + WEYL[0]) & WORD, (k1 + WEYL[1]) & WORD
    return c0, c1, c2, c3


@kernel
def uniform_at(seed: int, source: int, rock: int, stream: int, number: int) -> float:
    """Return one uniform random number in [0, 1) of a rock, with 53 random bits, for compiled code and Python alike.

    `uniform` gives the same numbers for many rocks, if `number` and the zone are 0.

    seed : 0 <= seed < 2^63; source : number of the source; rock : number of the rock in the source
    stream : a purpose + ZONES (256) times a zone; number : number of the impact from 1, or 0
    """
    return _uniform_of(rock, source, stream, number, seed & WORD, seed >> 32)


@kernel
def _uniform_of(rock: int, source: int, stream: int, number: int, k0: int, k1: int) -> float:
    """Return the random number in [0, 1) that belongs to four counter words and two key words of the generator.

    rock, source, stream, number : the counter words; k0, k1 : the key words, low and high 32 bits of the seed
    """
    high, low, _, _ = philox_words(rock, source, stream, number, k0, k1)
    return ((high >> 5) * 2.0**26 + (low >> 6)) * 2.0**-53  # type: ignore[no-any-return]


@loop
def _uniform_all(k0: int, k1: int, sources: Any, rocks: Any, stream: int, draws: Any) -> None:
    """Write one uniform random number in [0, 1) for each rock into `draws` (R,).

    k0, k1 : low and high 32 bits of the seed; sources, rocks : (R,) source of each rock, and its number in the source
    stream : purpose of the numbers
    """
    for i in range(len(draws)):
        draws[i] = _uniform_of(rocks[i], sources[i], stream, 0, k0, k1)


def philox(counter: NDArray[np.uint64], key: tuple[int, int]) -> NDArray[np.uint64]:
    """Return random words (4, N) of 32 bits from counters (4, N) and a key of two words: Philox4x32-10 on arrays.

    Tests compare the words with published values.
    """
    c0, c1, c2, c3 = counter
    return np.stack(philox_words(c0, c1, c2, c3, *key))


def uniform(seed: int, source: ArrayLike, rock: ArrayLike, purpose: Purpose) -> NDArray[np.float64]:
    """Return uniform random numbers (R,) in [0, 1), with 53 random bits: one for each rock.

    seed : 0 <= seed < 2^64; rock : (R,) number of each rock in its source, 0 to 2^32 - 1
    source : number of the source, 0 to 2^32 - 1, one for all rocks or (R,) one for each rock
    purpose : what the numbers are for, which selects their stream
    """
    rocks = np.asarray(rock, dtype=np.uint64)
    if HAS_NUMBA and rocks.size >= MANY:
        many = np.empty(rocks.size)
        sources = np.full(rocks.size, source, dtype=np.int64)
        _uniform_all(seed & WORD, seed >> 32, sources, rocks.astype(np.int64), int(purpose), many)
        return many
    counter = np.stack([rocks, np.full_like(rocks, source), np.full_like(rocks, int(purpose)), np.zeros_like(rocks)])
    words = philox(counter, (seed & WORD, seed >> 32))
    high, low = words[0] >> np.uint64(5), words[1] >> np.uint64(6)
    draws: NDArray[np.float64] = (high.astype(float) * 2.0**26 + low.astype(float)) * 2.0**-53
    return draws
