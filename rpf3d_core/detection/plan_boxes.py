"""Boxes in plan, measured in parts of a cell and packed into four bytes: the boxes of a bucket fit into one cache line.

One function rounds the coordinates of all boxes to parts, and its result never decreases when a coordinate increases.
So boxes that overlap in metres also overlap in parts, for any rounding; a few more boxes overlap only in parts.
"""

from rpf3d_core.jit.dispatch import kernel

PARTS = 128
"""Number of parts of a cell along each axis: the largest number that a byte can count in addition to its guard bit."""
GUARDS = 0x80808080
"""The highest bit of each of four bytes."""


@kernel
def part_of(value: float, origin: float, per_cell: float, index: int) -> int:
    """Return the part of cell `index` nearest to a coordinate (m), along one axis; per_cell : cells per metre."""
    return int(min(max(((value - origin) * per_cell - index) * PARTS, 0.0), PARTS - 1.0))


@kernel
def packed_box(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """Return the box of a facet as four bytes; the upper ends count down from the last part."""
    return low_x | (PARTS - 1 - high_x) << 8 | low_y << 16 | (PARTS - 1 - high_y) << 24


@kernel
def packed_probe(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """Return the probe of a box: the largest bytes of packed boxes that overlap this box, each byte with its guard bit.

    `overlap` compares a probe with a packed box.
    """
    return GUARDS | high_x | (PARTS - 1 - low_x) << 8 | high_y << 16 | (PARTS - 1 - low_y) << 24


@kernel
def overlap(box: int, probe: int) -> bool:
    """True if a packed box and the box of a probe overlap: one subtraction compares four pairs of bytes.

    A byte of the box that exceeds the probe's byte clears the guard bit.
    """
    return (probe - box) & GUARDS == GUARDS
