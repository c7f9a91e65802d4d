"""Batches of flown rocks with their recorded impacts and paths: select, join and sort the rocks."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.broken import NONE_BROKEN, Broken
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.values import Outcome

Rocks = NDArray[np.bool_]
"""Flags (N,) that select some of N rocks: True for a selected rock."""


@dataclass(frozen=True, eq=False)
class WrittenRecords:
    """The recorded impacts and paths of N rocks, grouped by rock, without the rocks' final results.

    rows : (N,) row of each rock in the releases
    impacts : (I, 9) impacts, facets : (I,) facet of each impact; columns as in `simulation.record.Record`
    pieces : (S, 10) path segments, modes : (S,) mode of each path segment; columns as in `simulation.record.Record`
    Impacts and pieces have two more columns if rocks spin. For rocks with a shape, which always spin, 3 further columns
    follow in impacts, 8 in pieces.
    first : (N + 1, 2) the first row of each rock in impacts and in pieces; at the end, the numbers of rows I and S
    """

    rows: IntArray
    impacts: FloatArray
    facets: IntArray
    pieces: FloatArray
    modes: IntArray
    first: IntArray


@dataclass(frozen=True, eq=False)
class Batch(WrittenRecords):
    """N flown rocks: their records, their results at the end of the flight, and the rocks that broke.

    finals : (N, 8) columns `simulation.engines.FINAL_COLUMNS`; (N, 10) with `SPIN_FINALS` if rocks spin; (N, 15) with
        `BODY_FINALS` if rocks have a shape
    counts : (N, 4) columns `COUNT_COLUMNS`; (N, 5) with `BODY_COUNTS` if rocks have a shape
    broken : the broken rocks of the batch; `NONE_BROKEN` if broken rocks have not been gathered
    """

    finals: FloatArray
    counts: IntArray
    broken: Broken = NONE_BROKEN


def written_of(rows: IntArray) -> WrittenRecords:
    """Return a `WrittenRecords` of N rocks without impacts and paths, for rocks of which nothing is kept.

    rows : (N,) rows in the releases
    """
    none = np.empty(0, dtype=np.int64)
    return WrittenRecords(
        rows, np.empty((0, 9)), none, np.empty((0, 10)), none, np.zeros((len(rows) + 1, 2), dtype=np.int64)
    )


def some_of(batch: WrittenRecords, impacts: Rocks, paths: Rocks) -> WrittenRecords:
    """Return a copy of the records of N rocks that contains only the impacts and paths of flagged rocks.

    All N rocks stay in the copy, but a rock that is not flagged has no impacts, or no path, in the copy.
    impacts : (N,) True for a rock whose impacts are copied; paths : (N,) True for a rock whose path is copied
    """
    if not impacts.any() and not paths.any():
        return written_of(batch.rows)
    lengths = np.diff(batch.first, axis=0)
    struck, moved = np.repeat(impacts, lengths[:, 0]), np.repeat(paths, lengths[:, 1])
    written = (batch.impacts[struck], batch.facets[struck], batch.pieces[moved], batch.modes[moved])
    return WrittenRecords(batch.rows, *written, _firsts(lengths * np.stack([impacts, paths], axis=1)))


def only(batch: Batch, rocks: Rocks) -> Batch:
    """Return a batch of the flagged rocks only, with their records and results, for example to display these rocks.

    rocks : (N,) True for a rock to keep. In the result, `broken` is `NONE_BROKEN`.
    """
    lengths = np.diff(batch.first, axis=0)
    struck, moved = np.repeat(rocks, lengths[:, 0]), np.repeat(rocks, lengths[:, 1])
    written = (batch.impacts[struck], batch.facets[struck], batch.pieces[moved], batch.modes[moved])
    return Batch(batch.rows[rocks], *written, _firsts(lengths[rocks]), batch.finals[rocks], batch.counts[rocks])


def joined_batches(batches: Sequence[Batch]) -> Batch:
    """Return one or more batches joined into one; the rocks of each batch follow the rocks of the previous batch.

    In the result, `broken` is `NONE_BROKEN`.
    """
    lengths = np.concatenate([np.diff(batch.first, axis=0) for batch in batches])
    names = ("rows", "impacts", "facets", "pieces", "modes", "finals", "counts")
    columns: dict[str, Any] = {name: _stacked([getattr(batch, name) for batch in batches]) for name in names}
    return Batch(**columns, first=_firsts(lengths))


def with_ends(written: WrittenRecords, finals: FloatArray, counts: IntArray) -> Batch:
    """Return a `Batch` of N rocks, made of the rocks' records and the rocks' final results.

    written : the records; finals, counts : final results, with the columns of `Batch`
    """
    return Batch(**vars(written), finals=finals, counts=counts)


def in_order(parts: Sequence[WrittenRecords]) -> WrittenRecords:
    """Return the records of several parts joined into one, sorted by row in the releases.

    The rows of all parts are distinct; the rocks may have flown in any order.
    """
    rows = np.concatenate([part.rows for part in parts])
    if not any(len(part.facets) or len(part.modes) for part in parts):
        return written_of(_sorted_rows(rows))
    lengths = np.concatenate([np.diff(part.first, axis=0) for part in parts])
    order = np.argsort(rows)  # rows are distinct, so the sort need not be stable
    struck, moved = (_gathered(lengths[:, k], order) for k in range(2))
    impacts, pieces = (_stacked([getattr(part, name) for part in parts]) for name in ("impacts", "pieces"))
    facets, modes = (np.concatenate([getattr(part, name) for part in parts]) for name in ("facets", "modes"))
    written = (impacts[struck], facets[struck], pieces[moved], modes[moved])
    return WrittenRecords(rows[order], *written, _firsts(lengths[order]))


def _sorted_rows(rows: IntArray) -> IntArray:
    """Return distinct rows (N,) >= 0 in ascending order, faster than by sorting.

    Usually the rows are the numbers 0 to N - 1.
    """
    end = int(rows.max(initial=-1)) + 1
    if end == len(rows):
        return np.arange(end)
    present = np.zeros(end, dtype=np.bool_)
    present[rows] = True
    return np.flatnonzero(present)


def _stacked(arrays: Sequence[Any]) -> Any:
    """Join arrays with the records of rocks along their first axis, and return the joined array.

    Empty arrays are skipped, because they may lack the columns of spin or shape. If all are empty, the result is empty.
    """
    return np.concatenate([array for array in arrays if len(array)] or arrays[:1])


def _firsts(lengths: IntArray) -> IntArray:
    """Return the first row (N + 1, 2) of each of N rocks in impacts and in path segments, as in `WrittenRecords.first`.

    lengths : (N, 2) number of impacts and number of path segments of each rock
    """
    return np.concatenate([np.zeros((1, 2), dtype=np.int64), np.cumsum(lengths, axis=0)])


def _gathered(lengths: IntArray, order: IntArray) -> IntArray:
    """Return the row indices that bring recorded rows, which are grouped by rock, into a new order of the N rocks.

    lengths : (N,) number of rows of each rock; order : (N,) the rocks in their new order
    """
    if not lengths.any():
        return np.empty(0, dtype=np.int64)
    begins = (np.cumsum(lengths) - lengths)[order]
    ends = np.cumsum(lengths[order])
    within = np.arange(ends[-1]) - np.repeat(ends - lengths[order], lengths[order])
    return np.asarray(np.repeat(begins, lengths[order]) + within)


NOTHING = with_ends(written_of(np.empty(0, dtype=np.int64)), np.empty((0, 8)), np.empty((0, 4), dtype=np.int64))
"""A batch without rocks, the result of a run that was stopped before any rock had flown."""


def broken_of(batch: Batch) -> Broken:
    """Return the broken rocks of a batch, each with its state when it broke; fragments are made from this state.

    The state comes from the last impact of a rock and the end of its path. If no rock broke, the result is the object
    `NONE_BROKEN` itself, so callers compare with `is`.
    """
    which = np.flatnonzero(batch.counts[:, 0] == Outcome.FRAGMENTED)
    if not which.size:
        return NONE_BROKEN
    struck, end = batch.first[which + 1, 0] - 1, batch.first[which + 1, 1] - 1
    pieces = batch.pieces[end]
    return Broken(batch.rows[which], pieces[:, 0], pieces[:, 1:4], pieces[:, 4:7], batch.impacts[struck, 4:7])


def count_from_release(batch: Batch, t: FloatArray) -> None:
    """Change the times of a batch of N fragments in place, so that they count from the release of the unbroken rock.

    t : (N,) s, added to all times of each fragment: the time from the release of the rock to the start of the fragment
    """
    lengths = np.diff(batch.first, axis=0)
    batch.finals[:, 0] += t
    batch.impacts[:, 0] += np.repeat(t, lengths[:, 0])
    batch.pieces[:, 0] += np.repeat(t, lengths[:, 1])
