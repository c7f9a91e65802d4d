"""Fly an ensemble and keep all that came of it, in memory."""

import time
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batch import NOTHING, Batch, joined_batches
from rpf3d_core.ensemble.batches import Flight, Keep, Watch, fly_batches
from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray, Impacts, IntArray, Paths
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.simulation.engines import FINAL_COLUMNS, SPIN_FINALS, Engine, warm
from rpf3d_core.simulation.record import IMPACT_COLUMNS

REFERENCE_ROCKS = 200
"""Up to this many rocks `auto` takes the reference engine: it is done before the other has been compiled."""
REFERENCE_SPHERES = 40
"""The same where rocks have a size: one takes about 0.5 s in plain Python (demo pit, rolling friction 0.3)."""

Progress = Callable[[int], Callable[[int], None]]
"""Called with the number of rocks before the first flies, once everything is compiled; what it returns is called with
the number of rocks flown since the last call."""


def choose_engine(name: str, rocks: int, compiled: bool, sized: bool = False) -> str:
    """The engine to use where a scene says `auto`: the answer is the same, so the one that is done first.

    compiled : whether numba is there; sized : whether rocks touch the ground as spheres of their size
    """
    if name != "auto":
        return name
    most = REFERENCE_SPHERES if sized else REFERENCE_ROCKS
    return "compiled" if compiled and rocks > most else "reference"


def fly_ensemble(
    engine: Engine,
    flight: Flight,
    releases: Releases,
    record: bool = True,
    paths: int | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
    watch: Watch | None = None,
) -> Flights:
    """Follow R rocks to their outcomes.

    Parameters
    ----------
    engine : with its index over the terrain built (`engine_of`)
    flight : materials, settings and models
    releases : R rocks
    record : whether to write down impacts and paths; without it only deposits
    paths : of how many rocks, evenly spread over all, to keep the path; None for all
    progress : called when rocks begin to fly, and then as batches are done
    threads : for the compiled engine; None for one a core
    watch : looks at each batch on the thread that flew it, and tells heights; without it they are not known (NaN)

    Returns
    -------
    Flights
        The same bits whatever the engine, the number of threads and the size of batches.
    """
    compile_s = warm(engine, flight.models, flight.materials, flight.settings)
    rocks = len(releases.x)
    keep = Keep(spread_over(rocks, paths), np.full(rocks, record), record)
    began = time.perf_counter()
    advance = progress(rocks) if progress else None
    batch = fly_batches(engine, flight, releases, keep, watch, threads, advance=advance)
    return flights_of([batch], releases, engine.name, compile_s, time.perf_counter() - began)


def spread_over(rocks: int, some: int | None) -> NDArray[np.bool_]:
    """Which of R rocks are among `some` (None: all) that are evenly spread over them: (R,)."""
    kept = np.ones(rocks, dtype=bool)
    if some is not None and some < rocks:
        kept[:] = False
        kept[np.linspace(0, rocks - 1, some).astype(int)] = True
    return kept


def flights_of(
    batches: Sequence[Batch], releases: Releases, engine: str, compile_s: float = 0.0, fly_s: float = 0.0
) -> Flights:
    """The flights of batches that, one after the other, are all rocks of the releases, in order of the releases."""
    batch = batches[0] if len(batches) == 1 else joined_batches([NOTHING, *batches])
    return Flights(
        deposits_of(batch.finals, batch.counts, releases), impacts_of(batch), _paths(batch), engine, compile_s, fly_s
    )


def deposits_of(finals: FloatArray, counts: IntArray, releases: Releases) -> Deposits:
    """Deposits from the rows of the engine, (R, 8) or where rocks spin (R, 10), and (R, 4)."""
    speed, energies = finals[:, 5], dict(zip(SPIN_FINALS, finals[:, len(FINAL_COLUMNS) :].T, strict=False))
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
        max_height=finals[:, 6],
        ground_speed=finals[:, 7],
        mass=releases.mass,
        piece=releases.piece,
        **energies,
    )


def impacts_of(batch: Batch) -> Impacts:
    """The impacts of a batch; rows count its rocks from 0."""
    rows = batch.impacts
    owner = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 0]))
    spins = rows[:, IMPACT_COLUMNS:].T  # two columns where rocks spin, else none
    return Impacts(owner, rows[:, 0], rows[:, 1:4], batch.facets, rows[:, 4:7], rows[:, 7], rows[:, 8], *spins)


def _paths(batch: Batch) -> Paths:
    """The paths of a batch; rows count its rocks from 0."""
    rows = batch.pieces
    owner = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 1]))
    return Paths(owner, rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7:10], batch.modes)
