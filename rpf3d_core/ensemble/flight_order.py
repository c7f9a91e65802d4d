"""Choose the order in which rocks fly: groups with rocks of all sources, in batches of rocks that start close together.

A group is flown as a whole. So when a run is interrupted, the flown rocks represent all sources and all their places.
The closer the start points of a batch, the more often the needed facets are in the cache, on any thread.
"""

import math
from collections.abc import Iterator

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases

LARGEST_BATCH = 4096
"""Largest number of rocks in a batch of the compiled engine; one thread flies a batch."""
BATCHES_A_GROUP = 2
"""Number of batches in a group of rocks, if all batches have the largest size.

Long falls take 1.6 times as long in groups of 512 rocks as in groups of 4096, and 10 % less in groups of 8192 than in
groups of 4096. But after an interrupt, a group is still flown to its end, so groups must not be too large.
"""
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
"""Ratio of the golden section (-), which spreads the rocks of each group evenly."""
STRIPS = 0.25
"""Number of strips into which the start places of R rocks are sorted, divided by the square root of R.

Consecutive rocks then start close to each other and need the same facets, which are still in the cache.
"""
REFERENCE_BATCH = 4
"""Largest number of rocks in a batch of the reference engine.

After an interrupt, two batches are still flown to their end, which takes about 0.3 s.
"""
SMALLEST_BATCH = 512
"""Smallest number of rocks in a batch of the compiled engine, except for the last batch of a group.

Starting a batch of this size takes about 1 % of the time of flying it.
"""
BODY_BATCHES = 256, 8
"""Largest and smallest number of rocks in a batch if rocks have a shape: such a rock takes some hundred times as long.

After an interrupt, a group is then soon flown to its end, and even a few hundred rocks are divided evenly among the
threads.
"""
BATCHES_A_THREAD = 4
"""Least number of batches into which one thread's share of the remaining rocks is divided.

So no thread waits long for the last batch of another thread.
"""


def batch_sizes(releases: Releases, compiled: bool) -> tuple[int, int]:
    """Return the largest and the smallest number of rocks in a batch.

    compiled : True for the compiled engine, False for the reference engine
    """
    if not compiled:
        return REFERENCE_BATCH, REFERENCE_BATCH
    return BODY_BATCHES if releases.shape is not None else (LARGEST_BATCH, SMALLEST_BATCH)


def flight_order(releases: Releases, workers: int, largest: int) -> Iterator[IntArray]:
    """Yield the rows (N,) of the rocks in each batch, in the order in which the batches fly.

    largest : largest number of rows of a batch; workers : number of threads
    """
    return (rows for group in dealt(releases, workers, largest) for rows in group)


def dealt(releases: Releases, workers: int, largest: int, smallest: int = SMALLEST_BATCH) -> Iterator[list[IntArray]]:
    """Yield the batches of each group of rocks, as arrays of rows; each group has rocks of all sources and places.

    The multiples of `_golden_step`, modulo the number of rocks, contain each row once. A group is a run of consecutive
    multiples; the rows of any such run are spread evenly over all rows.

    workers : number of threads
    largest, smallest : limits for the number of rocks of a batch; only the last batch of a group may be smaller
    """
    rocks = len(releases.x)
    spread, groups = np.arange(rocks) * _golden_step(rocks) % max(rocks, 1), -(-rocks // (BATCHES_A_GROUP * largest))
    for g in range(groups):
        begin, end = g * rocks // groups, (g + 1) * rocks // groups
        yield list(_batches(side_by_side(releases, spread[begin:end]), rocks - begin, workers, largest, smallest))


def _batches(rows: IntArray, left: int, workers: int, largest: int, smallest: int) -> Iterator[IntArray]:
    """Yield the batches of one group, smaller and smaller as fewer rocks remain, so that all threads end together.

    rows : (N,) rows of the group; left : number of rocks of the run that have not flown yet, including this group
    workers : number of threads; largest, smallest : as in `dealt`

    Sources
    -------
    Polychronopoulos & Kuck 1987, IEEE Trans. Comput. C-36:1425-1439: guided self-scheduling.
    """
    shares = workers * BATCHES_A_THREAD if workers > 1 else 1
    while len(rows):
        size = min(max(-(-left // shares), smallest), largest)
        yield rows[:size]
        rows, left = rows[size:], left - size


def _golden_step(rocks: int) -> int:
    """Return a step s that brings R rows into the order 0, s, 2 s, ... modulo R, which contains each row once.

    The step is about R times the ratio of the golden section, so any part of this order is spread evenly over the rows.
    A step that does not depend on R is not suitable: if it equals the number of points to which a source assigns its
    rocks in turn, a group would contain the rocks of one point only.

    rocks : R
    """
    step = max(round(GOLDEN * rocks), 1)
    while math.gcd(step, rocks) > 1:
        step += 1
    return step


def side_by_side(releases: Releases, rows: IntArray) -> IntArray:
    """Return the rows (N,) of rocks in a new order, in which consecutive rocks start near each other.

    Such rocks need the same facets, which are still in the processor's cache.
    """
    x, y = releases.x.take(rows, axis=0)[:, :2].T
    narrow, wide = (x, *_extent(x)), (y, *_extent(y))
    if narrow[2] > wide[2]:
        narrow, wide = wide, narrow
    (x, x_min, x_size), (y, y_min, y_size) = narrow, wide  # x is now the direction of the smaller extent
    width = x_size / max(STRIPS * math.sqrt(len(rows)), 1.0)
    strip = np.floor((x - x_min) / width) if width > 0.0 else 0.0
    across = max(y_size, width)  # one key for strip and place sorts five times as fast as two
    return rows[np.argsort(strip + (y - y_min) / (2.0 * across) if across > 0.0 else x)]


def _extent(values: FloatArray) -> tuple[float, float]:
    """Return the smallest of some values (N,), N > 0, and the difference between the largest and the smallest."""
    least = values.min()
    return least, values.max() - least
