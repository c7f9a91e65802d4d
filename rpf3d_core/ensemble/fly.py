"""Fly an ensemble and keep all its results in memory."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from rpf3d_core.ensemble.batch import NOTHING, Batch, joined_batches
from rpf3d_core.ensemble.batches import BatchControl, Flight, Keep, Watch, fly_batches
from rpf3d_core.ensemble.flights import Deposits, Flights, FloatArray, Impacts, IntArray, Paths
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.spin import has_poses
from rpf3d_core.simulation.engines import FINAL_COLUMNS, SPIN_FINALS, Engine, precompile_flights
from rpf3d_core.simulation.record import IMPACT_COLUMNS, POSE

REFERENCE_ROCKS = 200
"""Largest number of rocks for which `auto` selects the reference engine: the compiled engine must first compile."""
REFERENCE_SPHERES = 40
"""Largest number of rocks for which `auto` selects the reference engine, if rocks are spheres or bodies, not points.

A sphere takes about 0.5 s in plain Python (demo pit, rolling friction 0.3).
"""


def choose_engine(name: str, rocks: int, compiled: bool, sized: bool = False) -> str:
    """Return the name of the engine to use: `name` itself or, for `auto`, the engine that should finish first.

    Both engines give the same result. For `auto`, few rocks fly with the reference engine, because the compiled engine
    must first compile.

    rocks : number of rocks to fly; compiled : True if numba is installed
    sized : True if rocks touch the ground as spheres or bodies, not as points
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
    threads: int | None = None,
    watch: Watch | None = None,
) -> Flights:
    """Fly R rocks and return their deposits, impacts and paths, all in memory.

    Fragments of rocks that break do not fly (`stream.Stream` also flies fragments).

    Parameters
    ----------
    engine : engine with its index over the terrain (`engine_of`)
    flight : materials, settings and models
    releases : R rocks
    record : True to keep impacts and paths; False gives deposits only
    paths : number of rocks, evenly spread over all rocks, whose paths are kept; None for all
    threads : number of threads of the compiled engine; None for one per core
    watch : called with each batch on the thread that flew it; returns the largest height (m) of each rock above the
        terrain. Without `watch`, these heights are NaN

    Returns
    -------
    Flights
        The result does not depend on the engine, the number of threads or the batch size, not even in the last bit.
    """
    began = time.perf_counter()
    precompile_flights(engine, flight.models, flight.materials, flight.settings)
    compile_s, rocks = time.perf_counter() - began, len(releases.x)
    with_paths = np.zeros(rocks, dtype=bool)
    with_paths[spread_over(rocks, rocks if paths is None else paths)] = True
    keep = Keep(paths=with_paths, impacts=np.full(rocks, record), record=record)
    began = time.perf_counter()
    batch = fly_batches(engine, flight, releases, keep, watch, BatchControl(threads=threads))
    return flights_of([batch], releases, engine.name, compile_s, time.perf_counter() - began)


def spread_over(rocks: int, some: int) -> IntArray:
    """Return at most `some` of the row numbers 0 to `rocks` - 1, (N,), ascending and evenly spread, for display."""
    rows = np.linspace(0, rocks - 1, min(some, rocks)).astype(np.int64)
    return rows[np.diff(rows, prepend=-1) > 0]


def flights_of(
    batches: Sequence[Batch], releases: Releases, engine: str, compile_s: float = 0.0, fly_s: float = 0.0
) -> Flights:
    """Return the deposits, impacts and paths of the rocks in some batches as a `Flights`.

    batches : their rocks, one batch after another, are in the order of `releases`; releases : of these rocks
    engine : name of the engine; compile_s, fly_s : wall seconds
    """
    batch = batches[0] if len(batches) == 1 else joined_batches([NOTHING, *batches])
    return Flights(
        deposits_of(batch.finals, batch.counts, releases), impacts_of(batch), _paths(batch), engine, compile_s, fly_s
    )


def deposits_of(finals: FloatArray, counts: IntArray, releases: Releases) -> Deposits:
    """Return the deposits of R rocks from the engine's results: finals and counts, with the columns of `Batch`."""
    speed, energies = finals[:, 5], dict(zip(SPIN_FINALS, finals[:, len(FINAL_COLUMNS) :].T, strict=False))
    pose = len(FINAL_COLUMNS) + len(SPIN_FINALS)
    shapes: dict[str, Any] = {}
    if finals.shape[1] > pose:
        shapes = {"pose": finals[:, pose : pose + 4], "lift": finals[:, pose + 4], "why": counts[:, 4]}
        shapes["shape"] = releases.shape
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
        **shapes,
    )


def impacts_of(batch: Batch) -> Impacts:
    """Return the table of impacts of a batch; row numbers count the rocks of the batch from 0."""
    rows = batch.impacts
    owner = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 0]))
    more = rows[:, IMPACT_COLUMNS:].T  # two columns if rocks spin, three more if they have a shape, else none
    return Impacts(owner, rows[:, 0], rows[:, 1:4], batch.facets, rows[:, 4:7], rows[:, 7], rows[:, 8], *more)


def _paths(batch: Batch) -> Paths:
    """Return the table of path events of a batch; row numbers count the rocks of the batch from 0."""
    rows = batch.pieces
    owner = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 1]))
    pose: dict[str, Any] = {"q": rows[:, POSE : POSE + 4], "w": rows[:, POSE + 4 : POSE + 7]} if has_poses(rows) else {}
    return Paths(owner, rows[:, 0], rows[:, 1:4], rows[:, 4:7], rows[:, 7:10], batch.modes, **pose)
