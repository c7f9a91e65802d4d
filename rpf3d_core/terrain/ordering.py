"""Sorting whole numbers together with where they came from."""

import numpy as np
from numpy.typing import NDArray

Keys = NDArray[np.int64]

LARGEST_BITS = 63
"""Bits of a non-negative int64."""


def bits_left(count: int) -> int:
    """Bits that each of a number of keys may have to be sorted the fast way."""
    return LARGEST_BITS - count.bit_length()


def sort_keys(keys: Keys, bits: int) -> tuple[Keys, NDArray[np.int32]]:
    """Keys (N,) >= 0 of at most a number of bits in rising order, and the place (N,) that each had; keys is spent.

    Key and place are packed into one integer where they fit: sorting values is several times faster than sorting
    indices. Equal keys then stay in their order; otherwise their order is left open.
    """
    if bits > bits_left(len(keys)):
        order = np.argsort(keys)
        return keys[order], order.astype(np.int32)
    shift = len(keys).bit_length()
    keys <<= shift
    keys += np.arange(len(keys))
    keys.sort()
    order = keys & ((1 << shift) - 1)
    keys >>= shift
    return keys, order.astype(np.int32)
