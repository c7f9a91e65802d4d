"""Boxes in plan, in parts of one cell, four bytes each: a bucket's boxes fit into one line of the cache.

A facet's box and a probe's are rounded to parts by the same function, which never falls as a coordinate grows. So
boxes that overlap in metres overlap in parts, whatever rounding does; some more do.
"""

from rpf3d_core.jit.dispatch import kernel

PARTS = 128
"""Parts of a cell, along x and along y: what a byte can count beside its guard."""
GUARDS = 0x80808080
"""The highest bit of each of four bytes."""


@kernel
def part_of(value: float, origin: float, per_cell: float, index: int) -> int:
    """In which part of cell `index` a coordinate (m) lies, or the nearest one; per_cell : cells a metre."""
    return int(min(max(((value - origin) * per_cell - index) * PARTS, 0.0), PARTS - 1.0))


@kernel
def packed_box(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """A facet's box as four bytes; the upper ends count down from the last part."""
    return low_x | (PARTS - 1 - high_x) << 8 | low_y << 16 | (PARTS - 1 - high_y) << 24


@kernel
def packed_probe(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """A box to hold against packed ones: the bytes that theirs must not exceed, each with its guard set."""
    return GUARDS | high_x | (PARTS - 1 - low_x) << 8 | high_y << 16 | (PARTS - 1 - low_y) << 24


@kernel
def overlap(box: int, probe: int) -> bool:
    """Whether a packed box and a probe have a part in common: four comparisons of bytes in one subtraction.

    A byte of the box that exceeds the probe's borrows the guard.
    """
    return (probe - box) & GUARDS == GUARDS
