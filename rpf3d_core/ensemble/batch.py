"""Rocks that have flown, with what was written down of them: chosen from, and put in order."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.broken import NONE_BROKEN, Broken
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.values import Outcome

Rocks = NDArray[np.bool_]
"""Which of some rocks."""


@dataclass(frozen=True, eq=False)
class Written:
    """What was written down of N rocks, one after another.

    rows : (N,) rows of the releases
    impacts : (I, 9), facets : (I,), pieces : (S, 10), modes : (S,) as of `simulation.record.Record`; where rocks spin
        impacts and pieces have two columns more
    first : (N + 1, 2) the first row of each rock in impacts and in pieces
    """

    rows: IntArray
    impacts: FloatArray
    facets: IntArray
    pieces: FloatArray
    modes: IntArray
    first: IntArray


@dataclass(frozen=True, eq=False)
class Batch(Written):
    """N rocks that have flown.

    finals : (N, 8) `simulation.engines.FINAL_COLUMNS`, where rocks spin (N, 10) with `SPIN_FINALS`
    counts : (N, 4) `COUNT_COLUMNS`
    broken : those of them that broke, where that has been gathered
    """

    finals: FloatArray
    counts: IntArray
    broken: Broken = NONE_BROKEN


def written_of(rows: IntArray) -> Written:
    """N rocks of which nothing was written down."""
    none = np.empty(0, dtype=np.int64)
    return Written(rows, np.empty((0, 9)), none, np.empty((0, 10)), none, np.zeros((len(rows) + 1, 2), dtype=np.int64))


def some_of(batch: Written, impacts: Rocks, paths: Rocks) -> Written:
    """Copies of the impacts of some of N rocks (N,), and of the paths of some (N,)."""
    if not impacts.any() and not paths.any():
        return written_of(batch.rows)
    lengths = np.diff(batch.first, axis=0)
    struck, moved = np.repeat(impacts, lengths[:, 0]), np.repeat(paths, lengths[:, 1])
    written = (batch.impacts[struck], batch.facets[struck], batch.pieces[moved], batch.modes[moved])
    return Written(batch.rows, *written, _firsts(lengths * np.stack([impacts, paths], axis=1)))


def only(batch: Batch, rocks: Rocks) -> Batch:
    """A batch of some of its N rocks (N,), with all that is held of these."""
    lengths = np.diff(batch.first, axis=0)
    struck, moved = np.repeat(rocks, lengths[:, 0]), np.repeat(rocks, lengths[:, 1])
    written = (batch.impacts[struck], batch.facets[struck], batch.pieces[moved], batch.modes[moved])
    return Batch(batch.rows[rocks], *written, _firsts(lengths[rocks]), batch.finals[rocks], batch.counts[rocks])


def joined_batches(batches: Sequence[Batch]) -> Batch:
    """At least one batch as one: the rocks of each after those of the one before."""
    lengths = np.concatenate([np.diff(batch.first, axis=0) for batch in batches])
    names = ("rows", "impacts", "facets", "pieces", "modes", "finals", "counts")
    columns: dict[str, Any] = {name: _stacked([getattr(batch, name) for batch in batches]) for name in names}
    return Batch(**columns, first=_firsts(lengths))


def with_ends(written: Written, finals: FloatArray, counts: IntArray) -> Batch:
    """What was written down of N rocks with how they ended, (N, 8) and (N, 4)."""
    return Batch(**vars(written), finals=finals, counts=counts)


def in_order(parts: Sequence[Written]) -> Written:
    """What was written down of all rocks of at least one part, in order of their rows."""
    rows = np.concatenate([part.rows for part in parts])
    if not any(len(part.facets) or len(part.modes) for part in parts):
        return written_of(np.sort(rows))
    lengths = np.concatenate([np.diff(part.first, axis=0) for part in parts])
    order = np.argsort(rows)  # each row is there once, so this need not be stable
    struck, moved = (_gathered(lengths[:, k], order) for k in range(2))
    impacts, pieces = (_stacked([getattr(part, name) for part in parts]) for name in ("impacts", "pieces"))
    facets, modes = (np.concatenate([getattr(part, name) for part in parts]) for name in ("facets", "modes"))
    written = (impacts[struck], facets[struck], pieces[moved], modes[moved])
    return Written(rows[order], *written, _firsts(lengths[order]))


def _stacked(arrays: Sequence[Any]) -> Any:
    """Arrays one after another; of those without rows, which have no spins, only as many columns as the others."""
    return np.concatenate([array for array in arrays if len(array)] or arrays[:1])


def _firsts(lengths: IntArray) -> IntArray:
    """The first row (N + 1, 2) of each rock from how many it has (N, 2)."""
    return np.concatenate([np.zeros((1, 2), dtype=np.int64), np.cumsum(lengths, axis=0)])


def _gathered(lengths: IntArray, order: IntArray) -> IntArray:
    """Indices that put runs of rows, of given lengths (N,), in another order (N,)."""
    if not lengths.any():
        return np.empty(0, dtype=np.int64)
    begins = (np.cumsum(lengths) - lengths)[order]
    ends = np.cumsum(lengths[order])
    within = np.arange(ends[-1]) - np.repeat(ends - lengths[order], lengths[order])
    return np.asarray(np.repeat(begins, lengths[order]) + within)


NOTHING = with_ends(written_of(np.empty(0, dtype=np.int64)), np.empty((0, 8)), np.empty((0, 4), dtype=np.int64))
"""A batch of no rocks."""


def broken_of(batch: Batch) -> Broken:
    """Those of some rocks that broke, from what was written down: its last impact, and the end of its path.

    `NONE_BROKEN` itself where none did.
    """
    which = np.flatnonzero(batch.counts[:, 0] == Outcome.FRAGMENTED)
    if not which.size:
        return NONE_BROKEN
    struck, end = batch.first[which + 1, 0] - 1, batch.first[which + 1, 1] - 1
    pieces = batch.pieces[end]
    return Broken(batch.rows[which], pieces[:, 0], pieces[:, 1:4], pieces[:, 4:7], batch.impacts[struck, 4:7])
