"""The memory of map counts: one slot (row) for each cell that rocks reached, and the loops that add to slots."""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.hazard.bins import Scales, bin_of
from rpf3d_core.hazard.walks.cache_lines import (
    LINE_DEPOSITS,
    LINE_FIRST,
    LINE_IMPACTS,
    LINE_MOST,
    LINE_PASSAGES,
    LINE_ROCKS,
    LINE_SUMS,
    CacheLines,
    empty_lines,
)
from rpf3d_core.hazard.walks.visits import DEPOSITS, FIRST, HEIGHT, IMPACTS, PASSAGES, SPEED2, Visits, energy2_of
from rpf3d_core.hazard.walks.ways import add_length
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.jit.prefetch import prefetch

AHEAD = 32
"""Number of visits whose memory is fetched together into the processor's cache, to save waiting time."""
SUM_UNITS = 2.0**34
"""Number of units in the largest value of the bins (`Scales.top`): sums are counted as whole numbers of these units.

Sums over 2^29 rocks then fit in 64 bits.
"""


class Slots(NamedTuple):
    """The counts of S cells that rocks reached, one slot (row) for each cell.

    cell : (S,) number of each cell; lines : a cache line per cell, with sums in units of `Scales.top` / SUM_UNITS
    bins : (S, B) number of rocks in each bin of energy, then of speed, then of height, without overflows (carries)
    ways : (S, 2) sums over the rocks of path lengths (in cell widths) and of their squares, times `ways.WAY_UNITS`;
        None if path lengths are not counted
    """

    cell: Any
    lines: CacheLines
    bins: Any
    ways: Any = None


class SlotTable(NamedTuple):
    """All memory of a tally over C cells: which cell has which slot, the slots, and the scales of the bins.

    slot : (C,) number of each cell's slot, -1 if no rock reached it; merges : how often bins were merged in pairs
    """

    slot: Any
    slots: Slots
    scales: Scales
    merges: int


class Ahead(NamedTuple):
    """Working memory for the next A visits that are added: their slots, values and bins.

    slot : (A,) slot of the cell; values : (A, 3) energy, speed and height, divided by `Scales.top`
    bits : (A, 3) the memory of `values`, read as whole numbers; bins : (A, 3) bin of each value, -1 for none
    """

    slot: Any
    values: Any
    bits: Any
    bins: Any


def empty_slots(room: int, bins: int, ways: bool = False) -> Slots:
    """Return empty slots for `room` cells with `bins` bins each.

    The system allocates the memory of a slot only when the slot is first used.

    ways : True to count path lengths as well
    """
    lengths = np.zeros((room, 2), dtype=np.int64) if ways else None
    return Slots(
        cell=np.empty(room, dtype=np.int32),
        lines=empty_lines(room),
        bins=np.zeros((room, bins), dtype=np.uint8),
        ways=lengths,
    )


def nothing_ahead() -> Ahead:
    """Return an empty `Ahead`, working memory of `fold_visits` for AHEAD visits."""
    values = np.empty((AHEAD, 3))
    return Ahead(
        slot=np.empty(AHEAD, dtype=np.int32),
        values=values,
        bits=values.view(np.int64),
        bins=np.empty((AHEAD, 3), dtype=np.int32),
    )


@loop
def number_cells(slot: Any, cells: Any, used: int, fresh: Any) -> int:
    """Give a slot (a row of counts) to each cell that has none yet, numbered from `used` on; return how many are new.

    slot : (C,) slot of each cell, -1 for none; cells : (N,) cells that need a slot; fresh : receives the cells with a
        new slot
    """
    new = 0
    for k in range(len(cells)):
        if slot[cells[k]] < 0:
            slot[cells[k]] = used + new
            fresh[new] = cells[k]
            new += 1
    return new


@loop
def fold_visits(table: SlotTable, visits: Visits, used: int, ahead: Ahead, full: Any) -> int:
    """Add visits (rocks in cells) to the counts of their cells; return the number of bins that overflowed.

    Each visited cell must have a slot.

    used : number of visits to add; full : receives the place of each bin that overflowed, its flat index in
        `Slots.bins`. A bin is one byte: at 256 it starts again at 0.
    ahead : working memory
    """
    slots, carried = table.slots, 0
    for first in range(0, used, AHEAD):
        count = min(AHEAD, used - first)
        _look_ahead(table, visits, first, count, ahead)
        for a in range(count):
            _add_to_line(slots.lines, ahead.slot[a], visits, first + a, ahead.values, a)
            s = ahead.slot[a]
            add_length(slots.ways, visits.way, s, first + a)
            for q in range(3):
                b = ahead.bins[a, q]
                if b < 0:
                    continue
                if slots.bins[s, b] == 255:
                    slots.bins[s, b] = 0
                    full[carried] = np.int64(s) * slots.bins.shape[1] + b
                    carried += 1
                else:
                    slots.bins[s, b] += 1
    return carried


@kernel
def _look_ahead(table: SlotTable, visits: Visits, first: int, count: int, ahead: Ahead) -> None:
    """Write the slots, values and bins of visits `first` to `first + count - 1` to `ahead`; fetch their counts.

    The memory of the counts is fetched into the processor's cache for many visits at once. This saves time, because the
    waiting times overlap.
    """
    slots, scales = table.slots, table.scales
    offsets = (0, scales.bins[0], scales.bins[0] + scales.bins[1])
    per_top = (1.0 / scales.top[0], 1.0 / scales.top[1], 1.0 / scales.top[2])
    for a in range(count):
        ahead.slot[a] = table.slot[visits.cell[first + a]]
        prefetch(slots.lines.long, ahead.slot[a], 0)
    for a in range(count):
        k = first + a
        speed2 = visits.most[k, SPEED2]
        ahead.values[a, 0] = 0.5 * visits.mass[k] * energy2_of(visits.energy2, visits, k) * per_top[0]
        ahead.values[a, 1] = math.sqrt(speed2) * per_top[1]
        ahead.values[a, 2] = visits.most[k, HEIGHT] * per_top[2]
        for q in range(3):
            b = -1
            if scales.bins[q] > 0:
                b = (offsets[q] + bin_of(ahead.bits[a, q], scales.bins[q], scales.per_octave)) >> table.merges
                prefetch(slots.bins, ahead.slot[a], b)
            ahead.bins[a, q] = b


@kernel
def _add_to_line(lines: CacheLines, s: int, visits: Visits, k: int, values: Any, a: int) -> None:
    """Add visit number k, the stay of one rock in one cell, to the counts of the cell in row (slot) s of `lines`.

    Row a of `values` (A, 3) is the visit's energy, speed and height, divided by `Scales.top`.
    """
    t, speed2 = np.float32(visits.times[k, FIRST]), visits.most[k, SPEED2]
    if lines.short[s, LINE_ROCKS] == 0 or t < lines.single[s, LINE_FIRST]:
        lines.single[s, LINE_FIRST] = t
    lines.short[s, LINE_ROCKS] += 1
    lines.short[s, LINE_DEPOSITS] += visits.counts[k, DEPOSITS]
    lines.long[s, LINE_PASSAGES] += visits.counts[k, PASSAGES]
    lines.long[s, LINE_IMPACTS] += visits.counts[k, IMPACTS]
    energy2 = energy2_of(visits.energy2, visits, k)
    most = (0.5 * visits.mass[k] * energy2, math.sqrt(speed2), visits.most[k, HEIGHT])
    for q in range(3):
        lines.single[s, LINE_MOST + q] = max(lines.single[s, LINE_MOST + q], np.float32(most[q]))
        lines.long[s, LINE_SUMS + q] += np.int64(values[a, q] * SUM_UNITS + 0.5)
