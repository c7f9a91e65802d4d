"""Fly an ensemble: batches of rocks over threads, counted first, then written down."""

import os
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray, Impacts, IntArray, Paths
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.materials.draws import DrawnMaterials
from rpf3d_core.materials.library import Materials
from rpf3d_core.simulation.engines import Compiled, Engine, Models, warm
from rpf3d_core.simulation.record import empty_record
from rpf3d_core.simulation.settings import Settings

LARGEST_BATCH = 4096
"""Rocks in a batch at most: what a batch writes down stays in the tens of megabytes."""
REFERENCE_BATCH = 16
"""The same for the reference engine: a batch is flown to its end when the user interrupts, in about 0.3 s."""
BATCHES_A_THREAD = 8
"""Batches for each thread at least, so that no thread waits long for the last one."""
REFERENCE_ROCKS = 200
"""Up to this many rocks `auto` takes the reference engine: it is done before the other has been compiled."""

Progress = Callable[[int], Callable[[int], None]]
"""Called with the number of rocks before the first flies, once everything is compiled; what it returns is called with
the number of rocks flown since the last call."""


@dataclass(frozen=True)
class Flight:
    """What flies: the physics, shared by every rock of an ensemble."""

    materials: Materials | DrawnMaterials
    settings: Settings
    models: Models


class _Batch(NamedTuple):
    """Rows of one batch: finals (N, 8), counts (N, 4), impacts (I, 9), facets (I,), pieces (S, 10), modes (S,)."""

    finals: FloatArray
    counts: IntArray
    impacts: FloatArray
    facets: IntArray
    pieces: FloatArray
    modes: IntArray
    kept: IntArray


def choose_engine(name: str, rocks: int, compiled: bool) -> str:
    """The engine to use where a scene says `auto`: the answer is the same, so the one that is done first.

    compiled : whether numba is there
    """
    if name != "auto":
        return name
    return "compiled" if compiled and rocks > REFERENCE_ROCKS else "reference"


def fly_ensemble(
    engine: Engine,
    flight: Flight,
    releases: Releases,
    record: bool = True,
    paths: int | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Flights:
    """Follow R rocks to their outcomes.

    Parameters
    ----------
    engine : with its index over the terrain built (`engine_of`)
    flight : materials, settings and models
    releases : R rocks
    record : whether to write down impacts, paths and heights; without it only deposits
    paths : of how many rocks, evenly spread over all, to keep the path; None for all
    progress : called when rocks begin to fly, and then as batches are done
    threads : for the compiled engine; None for one a core

    Returns
    -------
    Flights
        The same bits whatever the engine, the number of threads and the size of batches.
    """
    compile_s = warm(engine, flight.models, flight.materials, flight.settings)
    kept = _spread_over(len(releases.x), paths)
    began = time.perf_counter()
    advance = progress(len(releases.x)) if progress else None
    batches = list(_fly_batches(engine, flight, releases, record, kept, advance, threads))
    fly_s = time.perf_counter() - began
    joined = _Batch(*(np.concatenate(columns) for columns in zip(*batches, strict=True)))
    return Flights(
        _deposits(joined, releases, record), _impacts(joined), _paths(joined), engine.name, compile_s, fly_s
    )


def _spread_over(rocks: int, paths: int | None) -> NDArray[np.bool_]:
    """Which of R rocks keep their path: (R,)."""
    kept = np.ones(rocks, dtype=bool)
    if paths is not None and paths < rocks:
        kept[:] = False
        kept[np.linspace(0, rocks - 1, paths).astype(int)] = True
    return kept


def _fly_batches(
    engine: Engine, flight: Flight, releases: Releases, record: bool, kept: NDArray[np.bool_],
    advance: Callable[[int], None] | None, threads: int | None,
) -> Iterator[_Batch]:  # fmt: skip
    """Fly batch after batch, in order; on threads where the engine lets go of the interpreter's lock."""
    rocks = len(releases.x)
    workers = (threads or os.cpu_count() or 1) if isinstance(engine, Compiled) else 1
    largest = LARGEST_BATCH if isinstance(engine, Compiled) else REFERENCE_BATCH
    size = max(1, min(largest, -(-rocks // (workers * BATCHES_A_THREAD))))
    spans = [slice(i, min(i + size, rocks)) for i in range(0, rocks, size)] or [slice(0, 0)]
    with ThreadPoolExecutor(workers) as pool:
        for batch in pool.map(lambda span: _fly_batch(engine, flight, releases, span, record, kept), spans):
            if advance:
                advance(len(batch.finals))
            yield batch


def _fly_batch(
    engine: Engine, flight: Flight, releases: Releases, span: slice, record: bool, kept: NDArray[np.bool_]
) -> _Batch:
    """Fly one batch: without a record to count, then again to write down just as much as there is."""
    x, v = np.ascontiguousarray(releases.x[span]), np.ascontiguousarray(releases.v[span])
    finals, counts = np.empty((len(x), 8)), np.empty((len(x), 4), dtype=np.int64)
    rows = np.zeros((len(x), 2), dtype=np.int64)
    source, rock = np.ascontiguousarray(releases.source[span]), np.ascontiguousarray(releases.rock[span])
    physics = (flight.models, flight.materials, flight.settings, x, v, source, rock)
    nothing = empty_record(0, 0)
    engine.follow(*physics, nothing, rows, finals, counts)
    if not record:
        return _Batch(finals, counts, *nothing[:4], np.empty(0, dtype=np.int64))
    lengths = counts[:, 2:] + (0, 1)  # a path has one row more than pieces: its end
    rows[1:] = np.cumsum(lengths, axis=0)[:-1]
    written = empty_record(*lengths.sum(axis=0))
    engine.follow(*physics, written, rows, finals, counts)
    keep = np.flatnonzero(np.repeat(kept[span], lengths[:, 1]))
    owner = np.repeat(np.arange(len(x)) + span.start, lengths[:, 1])[keep]
    return _Batch(finals, counts, written.impacts, written.facets, written.pieces[keep], written.modes[keep], owner)


def _deposits(batch: _Batch, releases: Releases, record: bool) -> Deposits:
    """Deposits from the rows of all rocks."""
    finals, counts = batch.finals, batch.counts
    speed = finals[:, 5]
    return Deposits(
        source=releases.source,
        rock=releases.rock,
        outcome=counts[:, 0],
        facet=counts[:, 1],
        release=releases.x,
        x=finals[:, 1:4],
        t=finals[:, 0],
        path=finals[:, 4],
        impacts=counts[:, 2],
        max_speed=speed,
        max_energy=0.5 * releases.mass * speed**2,
        max_height=finals[:, 6] if record else np.full(len(finals), np.nan),
        ground_speed=finals[:, 7],
        mass=releases.mass,
    )


def _impacts(batch: _Batch) -> Impacts:
    """Impacts from the rows of all rocks."""
    rows = batch.impacts
    owner = np.repeat(np.arange(len(batch.counts)), batch.counts[:, 2] if len(rows) else 0)
    return Impacts(owner, rows[:, 0], rows[:, 1:4], batch.facets, rows[:, 4:7], rows[:, 7], rows[:, 8])


def _paths(batch: _Batch) -> Paths:
    """Paths from the rows that were kept."""
    rows = batch.pieces
    return Paths(batch.kept, rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7:10], batch.modes)
