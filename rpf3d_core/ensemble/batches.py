"""Fly rocks in batches over threads: each into room of a fixed size, looked at, and handed on.

A batch takes rocks from all over the releases, so whatever has flown when a run is interrupted stands for all: no
source and no place comes first.
"""

import math
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.broken import NONE_BROKEN, SOURCES, Broken, broken_of
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.draws import DrawnMaterials
from rpf3d_core.materials.library import Materials
from rpf3d_core.simulation.engines import Compiled, Engine, Models, Starts
from rpf3d_core.simulation.record import Record, empty_record
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import Outcome

LARGEST_BATCH = 4096
"""Rocks in a batch at most."""
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
STRIPS = 0.25
"""Strips across the places of R rocks, over the square root of R: rocks that fly one after another start side by side
and look at the same facets, which are then in the cache."""
REFERENCE_BATCH = 16
"""The same for the reference engine: a batch is flown to its end when the user interrupts, in about 0.3 s."""
BATCHES_A_THREAD = 8
"""Batches for each thread at least, so that no thread waits long for the last one."""
ROOM = 16_384
"""Pieces of path, and impacts, that are written down before they are looked at: 3 MB, which stay in the cache."""


@dataclass(frozen=True)
class Flight:
    """What flies: the physics, shared by every rock of an ensemble."""

    materials: Materials | DrawnMaterials
    settings: Settings
    models: Models


@dataclass(frozen=True, eq=False)
class Batch:
    """N rocks that have flown, with what was written down of them.

    rows : (N,) rows of the releases, in the order in which they flew
    finals : (N, 8) `simulation.engines.FINAL_COLUMNS`; counts : (N, 4) `COUNT_COLUMNS`
    impacts : (I, 9), facets : (I,), pieces : (S, 10), modes : (S,) as of `simulation.record.Record`
    first : (N + 1, 2) the first row of each rock in impacts and in pieces
    broken : those of them that broke
    """

    rows: IntArray
    finals: FloatArray
    counts: IntArray
    impacts: FloatArray
    facets: IntArray
    pieces: FloatArray
    modes: IntArray
    first: IntArray
    broken: Broken = field(default_factory=lambda: NONE_BROKEN)


def _nothing() -> Batch:
    """A batch of no rocks."""
    none = np.empty(0, dtype=np.int64)
    counts = np.empty((0, 4), dtype=np.int64)
    written = (np.empty((0, 9)), none, np.empty((0, 10)), none)
    return Batch(none, np.empty((0, 8)), counts, *written, _firsts(counts[:, 2:]))


Watch = Callable[[Batch, Releases], FloatArray]
"""Looks at a batch, on the thread that flew it, and tells each rock's largest height above the terrain (N,) m."""


@dataclass(frozen=True, eq=False)
class Keep:
    """What is handed on of a batch: paths and impacts (R,), of which rocks; `record` False: nothing is written down."""

    paths: NDArray[np.bool_]
    impacts: NDArray[np.bool_]
    record: bool = True


def fly_batches(
    engine: Engine,
    flight: Flight,
    releases: Releases,
    keep: Keep,
    watch: Watch | None = None,
    threads: int | None = None,
    stop: Callable[[], bool] | None = None,
) -> Iterator[Batch]:
    """Fly R rocks, batch after batch; on threads where the engine allows.

    Parameters
    ----------
    keep : what the batches hold in the end; `watch` sees everything that was written down
    threads : for the compiled engine; None for one a core
    stop : asked between batches; once it says True, what flies comes to its end and nothing more takes off
    """
    workers = (threads or os.cpu_count() or 1) if isinstance(engine, Compiled) else 1
    shares = flight_order(releases, workers, LARGEST_BATCH if isinstance(engine, Compiled) else REFERENCE_BATCH)
    running: deque[Future[list[Batch]]] = deque()
    with ThreadPoolExecutor(workers) as pool:

        def start(number: int) -> None:
            for rows in islice(shares, number):
                running.append(pool.submit(_fly_rows, engine, flight, releases, rows, keep, watch))

        start(2 * workers)
        while running:
            yield from running.popleft().result()
            if stop is None or not stop():
                start(1)


def flight_order(releases: Releases, workers: int, largest: int) -> Iterator[IntArray]:
    """The rows (N,) of the releases that each batch flies, in the order in which it does; at most `largest` a batch."""
    rocks = len(releases.x)
    size = max(1, min(largest, -(-rocks // (workers * BATCHES_A_THREAD))))
    batches = -(-rocks // size)
    spread = np.arange(rocks) * _golden_step(rocks) % max(rocks, 1)
    return (side_by_side(releases, spread[k::batches]) for k in range(batches))


def _golden_step(rocks: int) -> int:
    """A step through R rows, round and round, that comes to each once and leaves no gap for long.

    Every n-th row would not do: where rocks are dealt to n places in turn, a batch would have those of one place.
    """
    step = max(round(GOLDEN * rocks), 1)
    while math.gcd(step, rocks) > 1:
        step += 1
    return step


def side_by_side(releases: Releases, rows: IntArray) -> IntArray:
    """Rows (N,) of releases in an order in which those that follow each other start near each other, in strips."""
    x, y = releases.x[rows, 0], releases.x[rows, 1]
    if np.ptp(x) > np.ptp(y):
        x, y = y, x
    width = np.ptp(x) / max(STRIPS * np.sqrt(len(rows)), 1.0)
    strip = np.floor((x - x.min()) / width) if width > 0.0 else np.zeros(len(rows))
    return rows[np.lexsort((y, strip))]


def _fly_rows(
    engine: Engine, flight: Flight, releases: Releases, rows: IntArray, keep: Keep, watch: Watch | None
) -> list[Batch]:
    """Fly some rocks: as many as there is room to write down, then the next."""
    starts = Starts(*(getattr(releases, name)[rows] for name in Starts._fields))
    starts = starts._replace(source=starts.source + SOURCES * releases.piece[rows])  # for its draws
    finals, counts = np.empty((len(rows), 8)), np.empty((len(rows), 4), dtype=np.int64)
    first = np.zeros((len(rows) + 1, 2), dtype=np.int64)
    physics = (flight.models, flight.materials, flight.settings, starts)
    record, begin, batches = empty_record(*(2 * (ROOM if keep.record else 0,))), 0, []
    while begin < len(rows):
        first[begin] = 0
        end = engine.follow(*physics, record, first, begin, finals, counts)
        if end == begin:
            record = empty_record(2 * len(record.facets), 2 * len(record.modes))
            continue
        some = slice(begin, end)
        flown = _batch(rows[some], finals[some], counts[some], record, first[begin : end + 1])
        if keep.record and releases.piece[flown.rows].any():
            _count_from_release(flown, releases.t[flown.rows])
        if watch:
            flown.finals[:, 6] = watch(flown, releases)
        broken = broken_of(flown.rows, flown.counts, record, flown.first) if keep.record else NONE_BROKEN
        batches.append(replace(_kept(flown, keep), broken=broken))
        begin = end
    return batches


def _batch(rows: IntArray, finals: FloatArray, counts: IntArray, record: Record, first: IntArray) -> Batch:
    """A batch that looks into the record."""
    impacts, pieces = (slice(0, n) for n in first[-1])
    written = (record.impacts[impacts], record.facets[impacts], record.pieces[pieces], record.modes[pieces])
    return Batch(rows, finals, counts, *written, first)


def _count_from_release(batch: Batch, t: FloatArray) -> None:
    """Add to all times of N pieces those at which their flights began, t (N,) s."""
    lengths = np.diff(batch.first, axis=0)
    batch.finals[:, 0] += t
    batch.impacts[:, 0] += np.repeat(t, lengths[:, 0])
    batch.pieces[:, 0] += np.repeat(t, lengths[:, 1])


def _kept(batch: Batch, keep: Keep) -> Batch:
    """A batch with copies of what is handed on, for the record is written over by the next rocks.

    The path of a rock that failed may hold anything, so it is not handed on: nothing could draw it.
    """
    drawable = batch.counts[:, 0] != Outcome.FAILED
    return some_of(batch, keep.impacts[batch.rows], keep.paths[batch.rows] & drawable)


def some_of(batch: Batch, impacts: NDArray[np.bool_], paths: NDArray[np.bool_]) -> Batch:
    """A batch with the impacts of some of its N rocks (N,), and the paths of some (N,)."""
    lengths = np.diff(batch.first, axis=0)
    struck, moved = np.repeat(impacts, lengths[:, 0]), np.repeat(paths, lengths[:, 1])
    written = (batch.impacts[struck], batch.facets[struck], batch.pieces[moved], batch.modes[moved])
    first = _firsts(lengths * np.stack([impacts, paths], axis=1))
    return Batch(batch.rows, batch.finals, batch.counts, *written, first)


def only(batch: Batch, rocks: NDArray[np.bool_]) -> Batch:
    """A batch of some of its N rocks (N,), with all that is held of these."""
    lengths = np.diff(batch.first, axis=0)
    struck, moved = np.repeat(rocks, lengths[:, 0]), np.repeat(rocks, lengths[:, 1])
    written = (batch.impacts[struck], batch.facets[struck], batch.pieces[moved], batch.modes[moved])
    return Batch(batch.rows[rocks], batch.finals[rocks], batch.counts[rocks], *written, _firsts(lengths[rocks]))


def in_order(batches: Sequence[Batch]) -> Batch:
    """All rocks of at least one batch as one, in order of their rows."""
    rows = np.concatenate([batch.rows for batch in batches])
    lengths = np.concatenate([np.diff(batch.first, axis=0) for batch in batches])
    order = np.argsort(rows)  # each row is there once, so this need not be stable
    struck, moved = (_gathered(lengths[:, k], order) for k in range(2))
    impacts, pieces = (np.concatenate([getattr(batch, name) for batch in batches]) for name in ("impacts", "pieces"))
    facets, modes = (np.concatenate([getattr(batch, name) for batch in batches]) for name in ("facets", "modes"))
    finals, counts = (np.concatenate([getattr(batch, name) for batch in batches]) for name in ("finals", "counts"))
    written = (impacts[struck], facets[struck], pieces[moved], modes[moved])
    return Batch(rows[order], finals[order], counts[order], *written, _firsts(lengths[order]))


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


NOTHING = _nothing()
