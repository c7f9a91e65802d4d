"""Store the counts of a cell, except bins, in one cache line of 64 bytes, because memory access limits the speed.

Sums, and counts that may exceed 2^32, have 64 bits. The numbers of distinct rocks and of deposits have 32 bits. Largest
values have single precision. So three arrays of different types share the same memory.
"""

from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray

LINE = 64
"""Size (bytes) of a cache line of the processor."""
LINE_ROCKS, LINE_DEPOSITS = 0, 1
"""Columns of `CacheLines.short`: numbers of rocks and of deposits."""
LINE_PASSAGES, LINE_IMPACTS, LINE_SUMS = 1, 2, 3
"""Columns of `CacheLines.long`: two counts, then the sums of energy, speed and height."""
LINE_MOST, LINE_FIRST = 12, 15
"""Columns of `CacheLines.single`: the largest energy, speed and height, and the earliest arrival."""


class CacheLines(NamedTuple):
    """The counts of S cells: three arrays that show the same memory as numbers of different types.

    long : (S, 8) int64; short : (S, 16) uint32; single : (S, 16) float32
    """

    long: Any
    short: Any
    single: Any


class Found(NamedTuple):
    """The counts of S cells without bins, as separate arrays.

    cell : (S,) number of each cell; rocks, passages, impacts, deposits : (S,) counts
    sums : (S, 3) of energy, speed and height, in units of `Scales.top` / `slots.SUM_UNITS`
    most : (S, 3) float32, the largest energy (J), speed (m/s) and height (m)
    first : (S,) float32, earliest arrival (s)
    ways : (S, 2) sums over the rocks of path lengths (in cell widths) and of their squares, times `ways.WAY_UNITS`;
        None if path lengths are not counted
    """

    cell: IntArray
    rocks: IntArray
    passages: IntArray
    impacts: IntArray
    deposits: IntArray
    sums: IntArray
    most: FloatArray
    first: FloatArray
    ways: Any = None


def empty_lines(room: int) -> CacheLines:
    """Return empty counts for `room` cells; unused memory is not allocated by the system."""
    words = LINE // 8
    memory = np.zeros((room + 1) * words, dtype=np.int64)
    ahead = -memory.ctypes.data % LINE // 8  # so that the counts of a cell fill exactly one cache line
    long = memory[ahead : ahead + room * words].reshape(room, words)
    return CacheLines(long=long, short=long.view(np.uint32), single=long.view(np.float32))


def found_in(lines: CacheLines, cell: IntArray, place: IntArray) -> Found:
    """Return the counts of cells (N,) as separate arrays, from the rows `place` (N,) of the cache lines.

    cell : (N,) numbers of the cells
    """
    long = lines.long[place]
    short, single = long.view(np.uint32), long.view(np.float32)
    return Found(
        cell=cell,
        rocks=short[:, LINE_ROCKS].astype(np.int64),
        passages=long[:, LINE_PASSAGES],
        impacts=long[:, LINE_IMPACTS],
        deposits=short[:, LINE_DEPOSITS].astype(np.int64),
        sums=long[:, LINE_SUMS : LINE_SUMS + 3],
        most=single[:, LINE_MOST : LINE_MOST + 3],
        first=single[:, LINE_FIRST],
    )


def add_found(lines: CacheLines, place: IntArray, found: Found) -> None:
    """Add the counts of N cells to the counts in distinct rows `place` (N,).

    Counts and sums add up; the largest values and the earliest arrival are kept. Path lengths are not added.

    lines : changed by this call
    """
    single = lines.single[place]
    fresh = lines.short[place, LINE_ROCKS] == 0
    first = np.where(fresh, found.first, np.minimum(single[:, LINE_FIRST], found.first))
    most = np.maximum(single[:, LINE_MOST : LINE_MOST + 3], found.most)
    lines.short[place, LINE_ROCKS] += found.rocks.astype(np.uint32)
    lines.short[place, LINE_DEPOSITS] += found.deposits.astype(np.uint32)
    lines.long[place, LINE_PASSAGES] += found.passages
    lines.long[place, LINE_IMPACTS] += found.impacts
    lines.long[place, LINE_SUMS : LINE_SUMS + 3] += found.sums
    lines.single[place, LINE_MOST : LINE_MOST + 3] = most
    lines.single[place, LINE_FIRST] = first
