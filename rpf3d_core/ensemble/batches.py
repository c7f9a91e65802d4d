"""Fly rocks in batches on several threads, so that memory stays small and a run can be stopped between batches.

A batch is flown into a record of fixed size, examined and passed on.

A group of batches takes rocks from all parts of the releases and is flown as a whole. So when a run is interrupted, the
flown rocks represent all sources and all their places. The batches of a group start close to each other. The closer the
start points, the more often the needed facets are in the cache, on any thread.
"""

import math
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batch import (
    NOTHING,
    Batch,
    Written,
    broken_of,
    count_from_release,
    in_order,
    some_of,
    with_ends,
    written_of,
)
from rpf3d_core.ensemble.broken import NONE_BROKEN, SOURCES, Broken, joined_broken
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.spin import largest_energies
from rpf3d_core.materials.body_draws import DrawnBodyMaterials
from rpf3d_core.materials.draws import DrawnMaterials
from rpf3d_core.materials.library import Materials
from rpf3d_core.simulation.engines import (
    BODY_COUNTS,
    BODY_FINALS,
    COUNT_COLUMNS,
    FINAL_COLUMNS,
    SPIN_FINALS,
    Compiled,
    Engine,
    Models,
    bodies_of,
    spins_of,
)
from rpf3d_core.simulation.launches import Starts
from rpf3d_core.simulation.record import Logbook, Record, empty_record
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import Outcome

LARGEST_BATCH = 4096
"""Largest number of rocks that one thread of the compiled engine flies at once (a batch)."""
BATCHES_A_GROUP = 2
"""Number of batches in a group, if all have the largest size.

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
"""Largest and smallest number of rocks with a shape in a batch: each takes as long as some hundred points.

Groups are then short enough for an interrupt, and the threads share out even a few hundred rocks evenly.
"""
BATCHES_A_THREAD = 4
"""Least number of batches into which one thread's share of the remaining rocks is divided.

So no thread waits long for the last batch of another thread.
"""
ROOM = 16_384
"""Rows for path segments, and for impacts, in the record of a batch: 3 MB, which stay in the processor's cache."""


@dataclass(frozen=True)
class Flight:
    """The physics that all rocks of an ensemble share: materials, settings and models."""

    materials: Materials | DrawnMaterials | DrawnBodyMaterials
    settings: Settings
    models: Models


Advance = Callable[[int], None]
"""Callback for the progress of a run: called with the number of rocks flown since the last call."""
Progress = Callable[[int], Advance]
"""Callback that starts the display of progress: called with the number of rocks, returns the callback for the flights.

It is called after the compilation and before the first flight.
"""
Watch = Callable[[Batch, Releases], FloatArray]
"""Callback that examines each flown batch, with its releases, as for hazard maps.

It runs on the thread that flew the batch, and returns the largest height of each rock above the terrain (N,) m.
"""


@dataclass(frozen=True)
class BatchControl:
    """Settings for flights in batches: threads, interruption and progress.

    Results do not depend on these settings, unless `stop` ends the run.

    threads : number of threads of the compiled engine; None for one per core
    stop : called between batches; after it returns True, the started groups are flown to their end and no new one
        starts
    advance : called with the number of rocks flown since the last call
    """

    threads: int | None = None
    stop: Callable[[], bool] | None = None
    advance: Advance | None = None


UNCONTROLLED = BatchControl()
"""Settings of flights by default: one thread per core; never stopped; progress is not reported."""


@dataclass(frozen=True, eq=False)
class Keep:
    """Selects the records of R rocks to keep in memory after their batch has been examined.

    paths, impacts : (R,) flags of the rocks whose paths, and whose impacts, are kept
    record : False if the engine records no impacts and no paths at all
    """

    paths: NDArray[np.bool_]
    impacts: NDArray[np.bool_]
    record: bool = True


@dataclass(frozen=True, eq=False)
class Crew:
    """Data that all threads share while they fly R rocks: inputs, and arrays for the results.

    finals : (R, 8), or (R, 10) if rocks spin; counts : (R, 4); the threads fill in both
    broken : list to which the threads add one entry for each batch in which rocks broke
    """

    engine: Engine
    flight: Flight
    releases: Releases
    keep: Keep
    watch: Watch | None
    finals: FloatArray
    counts: IntArray
    broken: list[Broken]


def fly_batches(
    engine: Engine,
    flight: Flight,
    releases: Releases,
    keep: Keep,
    watch: Watch | None = None,
    control: BatchControl = UNCONTROLLED,
) -> Batch:
    """Fly R rocks in batches, on several threads if the engine allows; return the rocks that flew, sorted by row.

    keep : selects the records in the returned batch; `watch` receives all records
    """
    compiled = isinstance(engine, Compiled)
    workers = (control.threads or os.cpu_count() or 1) if compiled else 1
    groups = _dealt(releases, workers, *_batch_sizes(releases, compiled))
    room = _room_for(len(releases.x), flight.models)
    crew = Crew(engine, flight, releases, keep, watch, *room, [])
    parts: list[Written] = []
    for written in _flown_by(workers, 2 * workers if compiled else 1, crew, groups, control.stop):
        parts += written
        if control.advance:
            control.advance(sum(len(part.rows) for part in written))
    flown = _in_order(parts, crew.finals, crew.counts)
    return replace(flown, broken=joined_broken(crew.broken)) if crew.broken else flown


def _batch_sizes(releases: Releases, compiled: bool) -> tuple[int, int]:
    """Return the largest and the smallest number of rocks in a batch."""
    if not compiled:
        return REFERENCE_BATCH, REFERENCE_BATCH
    return BODY_BATCHES if releases.shape is not None else (LARGEST_BATCH, SMALLEST_BATCH)


def _room_for(rocks: int, models: Models) -> tuple[FloatArray, IntArray]:
    """Return empty arrays for the final results of R rocks: finals and counts.

    Energy columns of spin hold NaN until they are computed.
    """
    spins, bodies = spins_of(models), bodies_of(models)
    more = len(SPIN_FINALS if spins else ()) + len(BODY_FINALS if bodies else ())
    finals = np.empty((rocks, len(FINAL_COLUMNS) + more))
    finals[:, len(FINAL_COLUMNS) :] = np.nan
    return finals, np.empty((rocks, len(COUNT_COLUMNS + (BODY_COUNTS if bodies else ()))), dtype=np.int64)


def _flown_by(
    workers: int, at_hand: int, crew: Crew, groups: Iterator[list[IntArray]], stop: Callable[[], bool] | None
) -> Iterator[list[Written]]:
    """Fly the batches on several threads; yield the records to keep of each batch, in the order of the batches.

    A new group starts as soon as fewer than `at_hand` batches are flying or waiting.
    """
    running: deque[Future[list[Written]]] = deque()
    with ThreadPoolExecutor(workers) as pool:
        group: list[IntArray] | None = next(groups, None)
        while group or running:
            while group and len(running) < at_hand:
                running += [pool.submit(_fly_rows, crew, rows) for rows in group]
                group = next(groups, None)
            yield running.popleft().result()
            if stop is not None and stop():
                group = None


def _in_order(parts: Sequence[Written], finals: FloatArray, counts: IntArray) -> Batch:
    """Return the rocks of all parts as one batch, sorted by row, for any order in which they flew.

    finals (R, 8), counts (R, 4) : results of all R rocks
    """
    if not parts:
        return NOTHING
    written = in_order(parts)
    if len(written.rows) == len(finals):
        return with_ends(written, finals, counts)
    return with_ends(written, finals[written.rows], counts[written.rows])


def flight_order(releases: Releases, workers: int, largest: int) -> Iterator[IntArray]:
    """Yield the rows (N,) of the rocks in each batch, in the order in which the batches fly.

    A batch has at most `largest` rows.
    """
    return (rows for group in _dealt(releases, workers, largest) for rows in group)


def _dealt(
    releases: Releases, workers: int, largest: int, smallest: int = SMALLEST_BATCH
) -> Iterator[list[IntArray]]:
    """Yield the batches of each group of rocks, as arrays of rows; each group holds rocks of all sources and places.

    The rows of a group are consecutive steps of the golden section: any number of such steps is spread evenly.
    """
    rocks = len(releases.x)
    spread, groups = np.arange(rocks) * _golden_step(rocks) % max(rocks, 1), -(-rocks // (BATCHES_A_GROUP * largest))
    for g in range(groups):
        begin, end = g * rocks // groups, (g + 1) * rocks // groups
        yield list(_batches(side_by_side(releases, spread[begin:end]), rocks - begin, workers, largest, smallest))


def _batches(rows: IntArray, left: int, workers: int, largest: int, smallest: int) -> Iterator[IntArray]:
    """Yield the batches of one group, smaller and smaller as fewer rocks remain, so that all threads end together.

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
    """Return the step from one rock's row to the next in a group, which spreads the rows of each group evenly.

    The step reaches each of R rows once, modulo R.

    A step of n rows is not suitable: if a source assigns its rocks to n points in turn, a group would hold the rocks of
    one point only.
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
    if np.ptp(x) > np.ptp(y):
        x, y = y, x
    width = np.ptp(x) / max(STRIPS * np.sqrt(len(rows)), 1.0)
    strip = np.floor((x - x.min()) / width) if width > 0.0 else 0.0
    across = max(np.ptp(y), width)  # one key for strip and place sorts five times as fast as two
    return rows[np.argsort(strip + (y - y.min()) / (2.0 * across) if across > 0.0 else x)]


def _fly_rows(crew: Crew, rows: IntArray) -> list[Written]:
    """Fly the rocks in some rows of the releases, in parts that fit into the record; return the records to keep."""
    releases, keep = crew.releases, crew.keep
    x, v = releases.x.take(rows, axis=0), releases.v.take(rows, axis=0)  # take() is four times as fast as indexing
    columns = {name: getattr(releases, name).take(rows) for name in ("source", "rock", "mass", "radius")}
    columns["source"] = columns["source"] + SOURCES * releases.piece.take(rows)  # key of the draws
    if releases.shape is not None and releases.pose is not None:
        columns |= {"shape": releases.shape[rows], "pose": releases.pose[rows]}
    models = crew.flight.models
    kind = (spins_of(models), bodies_of(models))
    finals, counts = _room_for(len(rows), models)
    first = np.zeros((len(rows) + 1, 2), dtype=np.int64)
    flight = (models, crew.flight.materials, crew.flight.settings, Starts(x=x, v=v, **columns))
    record, begin, parts = empty_record(*(2 * (ROOM if keep.record else 0,)), *kind), 0, []
    while begin < len(rows):
        first[begin] = 0
        logbook = Logbook(record=record, first=first, finals=finals, counts=counts)
        end = crew.engine.follow(*flight, logbook, begin)
        if end == begin:
            record = empty_record(2 * len(record.facets), 2 * len(record.modes), *kind)
            continue
        some = slice(begin, end)
        parts.append(_look_at(crew, _batch(rows[some], finals[some], counts[some], record, first[begin : end + 1])))
        begin = end
    crew.finals[rows], crew.counts[rows] = finals, counts
    return parts


def _look_at(crew: Crew, flown: Batch) -> Written:
    """Pass a flown batch to the callback `watch` and collect the rocks that broke.

    Return copies of the records to keep.

    Copies are needed because the next rocks overwrite the record. The path of a rock that failed may hold invalid
    numbers, which cannot be drawn, so it is not kept.
    """
    if crew.keep.record and crew.releases.piece[flown.rows].any():
        count_from_release(flown, crew.releases.t[flown.rows])
    if crew.watch:
        flown.finals[:, 6] = crew.watch(flown, crew.releases)
    if not crew.keep.record:
        return written_of(flown.rows)
    if spins_of(crew.flight.models):
        mass, radius = crew.releases.mass[flown.rows], crew.releases.radius[flown.rows]
        flown.finals[:, len(FINAL_COLUMNS) : len(FINAL_COLUMNS) + len(SPIN_FINALS)] = largest_energies(
            flown, mass, radius
        )
    broken = broken_of(flown)
    if broken is not NONE_BROKEN:
        crew.broken.append(broken)
    drawable = flown.counts[:, 0] != Outcome.FAILED
    return some_of(flown, crew.keep.impacts[flown.rows], crew.keep.paths[flown.rows] & drawable)


def _batch(rows: IntArray, finals: FloatArray, counts: IntArray, record: Record, first: IntArray) -> Batch:
    """Return flown rocks as a batch that shares the memory of the engine's record, without copies."""
    impacts, pieces = (slice(0, n) for n in first[-1])
    written = (record.impacts[impacts], record.facets[impacts], record.pieces[pieces], record.modes[pieces])
    return Batch(rows, *written, first, finals, counts)
