"""Sort integers together with their original positions, for the search for edges and for welding."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.jit.dispatch import loop

Keys = NDArray[np.int64]

LARGEST_BITS = 63
"""Number of bits that a non-negative int64 can use."""


def bits_left(count: int) -> int:
    """Return the largest width (bits) that `count` keys may have for the fast method of `sort_keys`."""
    return LARGEST_BITS - count.bit_length()


def sort_keys(keys: Keys, bits: int) -> tuple[Keys, NDArray[np.int32]]:
    """Return keys (N,) >= 0 of at most `bits` bits in ascending order, and the original position (N,) of each key.

    The array `keys` may be overwritten. Key and position are packed into one integer if they fit, because sorting
    values is several times faster than sorting indices. In this case equal keys keep their order; otherwise the order
    of equal keys is undefined.
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
    """Append to each key (N,) the key's position, in the low bits, so that sorting the keys moves the positions too.

    shift : number of bits of a position
    """
    for i in range(len(keys)):
        keys[i] = (keys[i] << shift) + i


@loop
def _unpack(keys: Any, shift: int, place: Any) -> None:
    """Split packed integers into keys, which stay in `keys` (N,), and positions, which are written into `place` (N,).

    shift : number of bits of a position
    """
    for i in range(len(keys)):
        place[i] = keys[i] & ((1 << shift) - 1)
        keys[i] >>= shift
