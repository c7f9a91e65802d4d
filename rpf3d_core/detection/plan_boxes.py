"""Boxes in plan, counted in parts of one cell and packed into four bytes: a bucket's boxes fit into one cache line.

The same function rounds the box of a facet and the box of a probe to parts, and never falls as a coordinate grows. So
boxes that overlap in metres also overlap in parts, whatever the rounding; a few more boxes overlap in parts only.
"""

from rpf3d_core.jit.dispatch import kernel

PARTS = 128
"""Parts of a cell, along x and along y: as many as a byte can count next to its guard bit."""
GUARDS = 0x80808080
"""The highest bit of each of four bytes."""


@kernel
def part_of(value: float, origin: float, per_cell: float, index: int) -> int:
    """Return the part of cell `index` that a coordinate (m) lies in, or the nearest; per_cell : cells per metre."""
    return int(min(max(((value - origin) * per_cell - index) * PARTS, 0.0), PARTS - 1.0))


@kernel
def packed_box(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """Return the box of a facet as four bytes; the upper ends count down from the last part."""
    return low_x | (PARTS - 1 - high_x) << 8 | low_y << 16 | (PARTS - 1 - high_y) << 24


@kernel
def packed_probe(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """Return a box to compare with packed boxes: the bytes that theirs must not exceed, each with its guard set."""
    return GUARDS | high_x | (PARTS - 1 - low_x) << 8 | high_y << 16 | (PARTS - 1 - low_y) << 24


@kernel
def overlap(box: int, probe: int) -> bool:
    """True if a packed box and a probe have a part in common: four comparisons of bytes in one subtraction.

    A byte of the box that exceeds the probe's byte borrows the guard bit.
    """
    return (probe - box) & GUARDS == GUARDS
