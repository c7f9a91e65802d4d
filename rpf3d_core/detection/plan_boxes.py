"""The boxes of facets in plan, rounded and packed into four bytes each, so that a search compares them quickly.

The packed boxes of a usual bucket fit into one cache line.

A coordinate is rounded to a part, one of 128 equal strips of a cell. One function (`part_of`) rounds all coordinates,
and its result never decreases when a coordinate increases. So boxes that overlap in metres also overlap in parts, for
any rounding. A few boxes overlap in parts although they do not overlap in metres.
"""

from rpf3d_core.jit.dispatch import kernel

PARTS = 128
"""Number of parts of a cell along each axis: the most that a byte can count in addition to its guard bit."""
GUARDS = 0x80808080
"""The guard bits: the highest bit of each of four bytes, which shows the result of a comparison."""


@kernel
def part_of(value: float, origin: float, per_cell: float, index: int) -> int:
    """Return the number (0 to PARTS - 1) of the part of a cell in which a coordinate lies, along one axis.

    The parts are equal strips of the cell. For a coordinate outside the cell, the result is the nearest part.

    value : m, the coordinate; origin : m, start of the grid; per_cell : cells per metre; index : number of the cell
    """
    return int(min(max(((value - origin) * per_cell - index) * PARTS, 0.0), PARTS - 1.0))


@kernel
def packed_box(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """Return the box of a facet, given in parts of a cell, as four bytes.

    The two upper ends are stored as their distance from the last part, so that each byte is smaller for a larger box.

    low_x, high_x, low_y, high_y : first and last part along x and along y, 0 to PARTS - 1
    """
    return low_x | (PARTS - 1 - high_x) << 8 | low_y << 16 | (PARTS - 1 - high_y) << 24


@kernel
def packed_probe(low_x: int, high_x: int, low_y: int, high_y: int) -> int:
    """Return the box of an arc, given in parts of a cell, in the form that `overlap` compares with the boxes of facets.

    Each byte is the largest value that the same byte of a packed box may have if both boxes overlap. The highest bit of
    each byte, its guard bit, is set.

    low_x, high_x, low_y, high_y : first and last part along x and along y, 0 to PARTS - 1
    """
    return GUARDS | high_x | (PARTS - 1 - low_x) << 8 | high_y << 16 | (PARTS - 1 - low_y) << 24


@kernel
def overlap(box: int, probe: int) -> bool:
    """Return True if the packed box of a facet overlaps the packed box of an arc; one subtraction compares both boxes.

    If a byte of `box` exceeds the same byte of `probe`, the subtraction clears the guard bit of this byte.

    box : of a facet, from `packed_box`; probe : of an arc, from `packed_probe`
    """
    return (probe - box) & GUARDS == GUARDS
