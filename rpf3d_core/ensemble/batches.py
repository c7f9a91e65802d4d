"""Fly rocks in batches over threads: each into room of a fixed size, looked at, and handed on.

A group takes rocks from all over the releases, and takes off as a whole, so whatever has flown when a run is
interrupted stands for all: no source and no place comes first. Its batches lie side by side: the more rocks of a group
start close together, the more often what they look at is in the cache, whichever thread flies them.
"""

import math
import os
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batch import NOTHING, Batch, Written, broken_of, in_order, some_of, with_ends, written_of
from rpf3d_core.ensemble.broken import NONE_BROKEN, SOURCES, Broken, joined_broken
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.spin import largest_energies
from rpf3d_core.materials.draws import DrawnMaterials
from rpf3d_core.materials.library import Materials
from rpf3d_core.simulation.engines import FINAL_COLUMNS, SPIN_FINALS, Compiled, Engine, Models, Starts, spins_of
from rpf3d_core.simulation.record import Record, empty_record
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import Outcome

LARGEST_BATCH = 4096
"""Rocks in a batch at most."""
BATCHES_A_GROUP = 2
"""Of the largest size. Long falls take 1.6 times as long in groups of 512 rocks as in groups of 4096, and another tenth
less in groups of 8192; but all of a group are flown to their end when the user interrupts."""
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
STRIPS = 0.25
"""Strips across the places of R rocks, over the square root of R: rocks that fly one after another start side by side
and look at the same facets, which are then in the cache."""
REFERENCE_BATCH = 4
"""As LARGEST_BATCH, for the reference engine: two are flown to their end when the user interrupts, in about 0.3 s."""
SMALLEST_BATCH = 512
"""But for the last of a group. What it costs to begin one is then a hundredth of flying it."""
BATCHES_A_THREAD = 4
"""A batch is at most this share of what is left for each thread, so that no thread waits long for the last one."""
ROOM = 16_384
"""Pieces of path, and impacts, that are written down before they are looked at: 3 MB, which stay in the cache."""


@dataclass(frozen=True)
class Flight:
    """What flies: the physics, shared by every rock of an ensemble."""

    materials: Materials | DrawnMaterials
    settings: Settings
    models: Models


Advance = Callable[[int], None]
"""Told the number of rocks flown since the last call."""
Watch = Callable[[Batch, Releases], FloatArray]
"""Looks at a batch, on the thread that flew it, and tells each rock's largest height above the terrain (N,) m."""


@dataclass(frozen=True, eq=False)
class Keep:
    """What is handed on of a batch: paths and impacts (R,), of which rocks; `record` False: nothing is written down."""

    paths: NDArray[np.bool_]
    impacts: NDArray[np.bool_]
    record: bool = True


@dataclass(frozen=True, eq=False)
class Crew:
    """What each thread needs to fly some of R rocks, and where it writes how they end.

    finals (R, 8), where rocks spin (R, 10), and counts (R, 4) : filled in
    broken : a part is added of each batch that had rocks which broke
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
    threads: int | None = None,
    stop: Callable[[], bool] | None = None,
    advance: Advance | None = None,
) -> Batch:
    """Fly R rocks, batch after batch, on threads where the engine allows; all that have flown, in order of their rows.

    Parameters
    ----------
    keep : what is handed on; `watch` sees everything that was written down
    threads : for the compiled engine; None for one a core
    stop : asked between batches; once it says True, what flies comes to its end and nothing more takes off
    advance : told of progress
    """
    compiled = isinstance(engine, Compiled)
    workers = (threads or os.cpu_count() or 1) if compiled else 1
    groups = _dealt(releases, workers, LARGEST_BATCH if compiled else REFERENCE_BATCH)
    room = _room_for(len(releases.x), spins_of(flight.models))
    crew = Crew(engine, flight, releases, keep, watch, *room, [])
    parts: list[Written] = []
    for written in _flown_by(workers, 2 * workers if compiled else 1, crew, groups, stop):
        parts += written
        if advance:
            advance(sum(len(part.rows) for part in written))
    flown = _in_order(parts, crew.finals, crew.counts)
    return replace(flown, broken=joined_broken(crew.broken)) if crew.broken else flown


def _room_for(rocks: int, spins: bool) -> tuple[FloatArray, IntArray]:
    """Room for how R rocks end, and for their energies where they spin."""
    more = len(SPIN_FINALS) if spins else 0
    finals = np.empty((rocks, len(FINAL_COLUMNS) + more))
    finals[:, len(FINAL_COLUMNS) :] = np.nan
    return finals, np.empty((rocks, 4), dtype=np.int64)


def _flown_by(
    workers: int, at_hand: int, crew: Crew, groups: Iterator[list[IntArray]], stop: Callable[[], bool] | None
) -> Iterator[list[Written]]:
    """What was written down of each batch, in their order; a group takes off where fewer than `at_hand` wait."""
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
    """The rocks of some parts, of all whose ends there is room for (R, 8) and (R, 4)."""
    if not parts:
        return NOTHING
    written = in_order(parts)
    if len(written.rows) == len(finals):
        return with_ends(written, finals, counts)
    return with_ends(written, finals[written.rows], counts[written.rows])


def flight_order(releases: Releases, workers: int, largest: int) -> Iterator[IntArray]:
    """The rows (N,) of the releases that each batch flies, in the order in which it does; at most `largest` a batch."""
    return (rows for group in _dealt(releases, workers, largest) for rows in group)


def _dealt(releases: Releases, workers: int, largest: int) -> Iterator[list[IntArray]]:
    """The batches of each group: stretches of steps of the golden section are spread evenly, whatever their length."""
    rocks = len(releases.x)
    spread, groups = np.arange(rocks) * _golden_step(rocks) % max(rocks, 1), -(-rocks // (BATCHES_A_GROUP * largest))
    for g in range(groups):
        begin, end = g * rocks // groups, (g + 1) * rocks // groups
        yield list(_batches(side_by_side(releases, spread[begin:end]), rocks - begin, workers, largest))


def _batches(rows: IntArray, left: int, workers: int, largest: int) -> Iterator[IntArray]:
    """The batches of one group, at most a share of all rocks that are left, so that all threads end at the same time.

    Sources
    -------
    Polychronopoulos & Kuck 1987, IEEE Trans. Comput. C-36:1425-1439: guided self-scheduling.
    """
    shares = workers * BATCHES_A_THREAD if workers > 1 else 1
    while len(rows):
        size = min(max(-(-left // shares), SMALLEST_BATCH), largest)
        yield rows[:size]
        rows, left = rows[size:], left - size


def _golden_step(rocks: int) -> int:
    """A step through R rows, round and round, that comes to each once and leaves no gap for long.

    Every n-th row would not do: where rocks are dealt to n places in turn, a group would have those of one place.
    """
    step = max(round(GOLDEN * rocks), 1)
    while math.gcd(step, rocks) > 1:
        step += 1
    return step


def side_by_side(releases: Releases, rows: IntArray) -> IntArray:
    """Rows (N,) of releases in an order in which those that follow each other start near each other, in strips."""
    x, y = releases.x.take(rows, axis=0)[:, :2].T
    if np.ptp(x) > np.ptp(y):
        x, y = y, x
    width = np.ptp(x) / max(STRIPS * np.sqrt(len(rows)), 1.0)
    strip = np.floor((x - x.min()) / width) if width > 0.0 else 0.0
    across = max(np.ptp(y), width)  # one number for the strip and the place in it: sorted five times as fast as two
    return rows[np.argsort(strip + (y - y.min()) / (2.0 * across) if across > 0.0 else x)]


def _fly_rows(crew: Crew, rows: IntArray) -> list[Written]:
    """Fly some rocks: as many as there is room to write down, then the next."""
    releases, keep = crew.releases, crew.keep
    x, v = releases.x.take(rows, axis=0), releases.v.take(rows, axis=0)  # four times as fast as an index
    starts = Starts(x, v, *(getattr(releases, name).take(rows) for name in ("source", "rock", "mass", "radius")))
    starts = starts._replace(source=starts.source + SOURCES * releases.piece.take(rows))  # for its draws
    spins = spins_of(crew.flight.models)
    finals, counts = _room_for(len(rows), spins)
    first = np.zeros((len(rows) + 1, 2), dtype=np.int64)
    physics = (crew.flight.models, crew.flight.materials, crew.flight.settings, starts)
    record, begin, parts = empty_record(*(2 * (ROOM if keep.record else 0,)), spins), 0, []
    while begin < len(rows):
        first[begin] = 0
        end = crew.engine.follow(*physics, record, first, begin, finals, counts)
        if end == begin:
            record = empty_record(2 * len(record.facets), 2 * len(record.modes), spins)
            continue
        some = slice(begin, end)
        parts.append(_look_at(crew, _batch(rows[some], finals[some], counts[some], record, first[begin : end + 1])))
        begin = end
    crew.finals[rows], crew.counts[rows] = finals, counts
    return parts


def _look_at(crew: Crew, flown: Batch) -> Written:
    """Show a batch to who watches; copies of what is handed on, for the next rocks write over the record.

    The path of a rock that failed may hold anything, so it is not handed on: nothing could draw it.
    """
    if crew.keep.record and crew.releases.piece[flown.rows].any():
        _count_from_release(flown, crew.releases.t[flown.rows])
    if crew.watch:
        flown.finals[:, 6] = crew.watch(flown, crew.releases)
    if not crew.keep.record:
        return written_of(flown.rows)
    if spins_of(crew.flight.models):
        mass, radius = crew.releases.mass[flown.rows], crew.releases.radius[flown.rows]
        flown.finals[:, len(FINAL_COLUMNS) :] = largest_energies(flown, mass, radius)
    broken = broken_of(flown)
    if broken is not NONE_BROKEN:
        crew.broken.append(broken)
    drawable = flown.counts[:, 0] != Outcome.FAILED
    return some_of(flown, crew.keep.impacts[flown.rows], crew.keep.paths[flown.rows] & drawable)


def _batch(rows: IntArray, finals: FloatArray, counts: IntArray, record: Record, first: IntArray) -> Batch:
    """A batch that looks into the record."""
    impacts, pieces = (slice(0, n) for n in first[-1])
    written = (record.impacts[impacts], record.facets[impacts], record.pieces[pieces], record.modes[pieces])
    return Batch(rows, *written, first, finals, counts)


def _count_from_release(batch: Batch, t: FloatArray) -> None:
    """Add to all times of N pieces those at which their flights began, t (N,) s."""
    lengths = np.diff(batch.first, axis=0)
    batch.finals[:, 0] += t
    batch.impacts[:, 0] += np.repeat(t, lengths[:, 0])
    batch.pieces[:, 0] += np.repeat(t, lengths[:, 1])
