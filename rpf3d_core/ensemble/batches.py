"""Fly rocks in batches on several threads, so that memory stays small.

A run can be stopped between groups of batches. A thread flies a batch in parts that fit into its record, passes each
part to `watch`, and copies the records to keep. `flight_order.py` decides which rocks form a batch.
"""

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batch import (
    NOTHING,
    Batch,
    WrittenRecords,
    broken_of,
    count_from_release,
    in_order,
    some_of,
    with_ends,
    written_of,
)
from rpf3d_core.ensemble.broken import NONE_BROKEN, SOURCES, Broken, joined_broken
from rpf3d_core.ensemble.flight_order import batch_sizes, dealt
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.spin import largest_energies
from rpf3d_core.jit.cores import usable_cores
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
    needs_of,
    spins_of,
)
from rpf3d_core.simulation.launches import Starts
from rpf3d_core.simulation.record import Logbook, Record, empty_record
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import Outcome

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
"""Callback that starts the display of progress: called with the number of rocks, returns the `Advance` for the flights.

A `Progress` is called after the compilation and before the first flight.
"""
Watch = Callable[[Batch, Releases], FloatArray]
"""Callback that receives each flown batch and its releases, for example to count rocks for hazard maps.

The callback runs on the thread that flew the batch, and returns the largest height (N,) m of each rock above the
terrain.
"""


@dataclass(frozen=True)
class BatchControl:
    """Settings for flights in batches: threads, interruption and progress.

    Results do not depend on these settings, unless `stop` ends the run.

    threads : number of threads of the compiled engine; None for one per core
    stop : called between batches; after it returns True, the started groups are flown to their end and no new group
        starts
    advance : reports progress; called with the number of rocks that have flown since the previous call of `advance`
    """

    threads: int | None = None
    stop: Callable[[], bool] | None = None
    advance: Advance | None = None


UNCONTROLLED = BatchControl()
"""Settings of flights by default: one thread per core; never stopped; progress is not reported."""


@dataclass(frozen=True, eq=False)
class Keep:
    """Selects which records of R rocks stay in memory after the flight; later batches overwrite all other records.

    paths, impacts : (R,) flags of the rocks whose paths, and whose impacts, are kept
    record : False if the engine records no impacts and no paths at all
    """

    paths: NDArray[np.bool_]
    impacts: NDArray[np.bool_]
    record: bool = True


@dataclass(frozen=True, eq=False)
class Crew:
    """The data that all threads share while they fly R rocks: inputs, and arrays for the results.

    engine, flight, releases : the engine, the physics and the starts of the R rocks
    keep : selects the records to keep
    watch : None, or a function that is called with each flown batch and returns the largest height (m) of each rock
    finals, counts : results of the R rocks, with the columns of `Batch`; the threads fill in both
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

    flight : the physics; releases : of the R rocks; keep : selects the records in the returned batch
    watch : receives each flown batch with all records, on the thread that flew it; returns the largest heights (m)
    control : threads, interruption and progress
    """
    compiled = isinstance(engine, Compiled)
    workers = (control.threads or usable_cores()) if compiled else 1
    groups = dealt(releases, workers, *batch_sizes(releases, compiled))
    room = _room_for(len(releases.x), flight.models)
    crew = Crew(engine, flight, releases, keep, watch, *room, [])
    parts: list[WrittenRecords] = []
    for written in _flown_by(workers, 2 * workers if compiled else 1, crew, groups, control.stop):
        parts += written
        if control.advance:
            control.advance(sum(len(part.rows) for part in written))
    flown = _in_order(parts, crew.finals, crew.counts)
    return replace(flown, broken=joined_broken(crew.broken)) if crew.broken else flown


def _room_for(rocks: int, models: Models) -> tuple[FloatArray, IntArray]:
    """Return arrays for the final results of R rocks, to be filled in: finals and counts, as in `Crew`.

    The columns after `FINAL_COLUMNS`, for rocks that spin or have a shape, contain NaN until they are computed.
    """
    spins, bodies = spins_of(models), bodies_of(models)
    more = len(SPIN_FINALS if spins else ()) + len(BODY_FINALS if bodies else ())
    finals = np.empty((rocks, len(FINAL_COLUMNS) + more))
    finals[:, len(FINAL_COLUMNS) :] = np.nan
    return finals, np.empty((rocks, len(COUNT_COLUMNS + (BODY_COUNTS if bodies else ()))), dtype=np.int64)


def _flown_by(
    workers: int, at_hand: int, crew: Crew, groups: Iterator[list[IntArray]], stop: Callable[[], bool] | None
) -> Iterator[list[WrittenRecords]]:
    """Fly batches on several threads, one batch on each; yield the kept records of each batch, in the batches' order.

    A new group starts as soon as fewer than `at_hand` batches are flying or waiting, until `stop` returns True. A
    single batch flies on the calling thread, because starting a thread takes longer than flying a few rocks.

    workers : number of threads; groups : yields the batches of each group, as rows (N,) of the releases
    """
    running: deque[Future[list[WrittenRecords]]] = deque()
    group, following = next(groups, None), next(groups, None)
    if group is not None and following is None and len(group) == 1:
        yield _fly_rows(crew, group[0])
        return
    with ThreadPoolExecutor(workers) as pool:
        while group or running:
            while group and len(running) < at_hand:
                running += [pool.submit(_fly_rows, crew, rows) for rows in group]
                group, following = following, next(groups, None)
            yield running.popleft().result()
            if stop is not None and stop():
                group = None


def _in_order(parts: Sequence[WrittenRecords], finals: FloatArray, counts: IntArray) -> Batch:
    """Return the rocks of all parts as one batch, sorted by row; the rocks may have flown in any order.

    finals, counts : results of all R rocks of the run, as in `Crew`; the result has no rows for rocks that did not fly
    """
    if not parts:
        return NOTHING
    written = in_order(parts)
    if len(written.rows) == len(finals):
        return with_ends(written, finals, counts)
    return with_ends(written, finals[written.rows], counts[written.rows])


def _fly_rows(crew: Crew, rows: IntArray) -> list[WrittenRecords]:
    """Fly the rocks in some rows of the releases; return the records to keep, one entry for each part of the rocks.

    The rocks fly in parts, because the record of the engine has a fixed size.
    """
    keep = crew.keep
    models = crew.flight.models
    kind = (spins_of(models), bodies_of(models))
    finals, counts = _room_for(len(rows), models)
    first = np.zeros((len(rows) + 1, 2), dtype=np.int64)
    flight = (models, crew.flight.materials, crew.flight.settings, _starts(crew, rows))
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
    _whole_rows(crew.finals)[rows], _whole_rows(crew.counts)[rows] = _whole_rows(finals), _whole_rows(counts)
    return parts


def _starts(crew: Crew, rows: IntArray) -> Starts:
    """Return the rocks in some rows of the releases as an engine reads them, with only the data that the scene needs.

    The source number of a fragment differs from that of its rock, so that a fragment has random numbers of its own.
    """
    releases, flight = crew.releases, crew.flight
    needed = needs_of(flight.models, flight.materials)
    return Starts(
        x=releases.x.take(rows, axis=0),  # take() is four times as fast as indexing
        v=releases.v.take(rows, axis=0),
        source=releases.source.take(rows) + SOURCES * releases.piece.take(rows) if needed.keys else None,
        rock=releases.rock.take(rows) if needed.keys else None,
        mass=releases.mass.take(rows) if needed.sizes else None,
        radius=releases.radius.take(rows) if needed.sizes else None,
        shape=None if releases.shape is None else releases.shape[rows],
        pose=None if releases.pose is None else releases.pose[rows],
    )


def _whole_rows(table: NDArray[Any]) -> NDArray[np.void]:
    """Return a view (R,) of a table (R, C) with one item per row: numpy copies such items faster than rows."""
    row = np.dtype((np.void, table.shape[1] * table.itemsize))
    return table.view(row)[:, 0]


def _look_at(crew: Crew, flown: Batch) -> WrittenRecords:
    """Pass a flown batch to `crew.watch`, collect its broken rocks, and return copies of the records to keep.

    The batch is also completed in place. With a watch, the final results get the largest heights. With recorded paths,
    the final results of spinning rocks get the largest energies, and times of fragments count from the release of the
    whole rock. Without recorded paths (`Keep.record` is False), broken rocks are not collected.

    The records must be copied, because the next rocks overwrite the memory. The path of a failed rock is not kept: the
    path may contain invalid numbers, and then cannot be drawn.
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
    """Return flown rocks as a batch whose arrays share the memory of the engine's record.

    rows, first : as in `WrittenRecords`; finals, counts : as in `Batch`; record : the record that the engine has filled
    """
    impacts, pieces = (slice(0, n) for n in first[-1])
    written = (record.impacts[impacts], record.facets[impacts], record.pieces[pieces], record.modes[pieces])
    return Batch(rows, *written, first, finals, counts)
