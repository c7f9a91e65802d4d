"""Sorting of whole numbers together with their original places."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop

Keys = NDArray[np.int64]

LARGEST_BITS = 63
"""Bits of a non-negative int64."""


def bits_left(count: int) -> int:
    """Return the number of bits that each of `count` keys may have for the fast sort."""
    return LARGEST_BITS - count.bit_length()


def sort_keys(keys: Keys, bits: int) -> tuple[Keys, NDArray[np.int32]]:
    """Return keys (N,) >= 0 of at most `bits` bits in rising order, and the original place (N,) of each.

    The array `keys` is overwritten. Key and place are packed into one integer if they fit: sorting values is several
    times faster than sorting indices. Equal keys then stay in their order; otherwise their order is undefined.
    """
    if bits > bits_left(len(keys)):
        order = np.argsort(keys)
        return keys[order], order.astype(np.int32)
    shift, place = len(keys).bit_length(), np.empty(len(keys), np.int32)
    _pack(keys, shift)
    keys.sort()
    _unpack(keys, shift, place)
    return keys, place


@loop
def _pack(keys: Any, shift: int) -> None:
    """Append the place of each key to the key, in its low bits."""
    for i in range(len(keys)):
        keys[i] = (keys[i] << shift) + i


@loop
def _unpack(keys: Any, shift: int, place: Any) -> None:
    """Split keys and places."""
    for i in range(len(keys)):
        place[i] = keys[i] & ((1 << shift) - 1)
        keys[i] >>= shift
