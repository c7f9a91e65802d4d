"""Run a scene: read it, release and fly its rocks, count, write the result. The Python functions of `rpf3d run`."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.batches import Progress
from rpf3d_core.ensemble.flights import Deposits, Flights, Impacts
from rpf3d_core.ensemble.stream import Shown, Sink, Stream, blocks_of, shown_of, warm_pieces
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.convergence import Step, is_enough, step_of
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.walks.visiting import visit_all
from rpf3d_core.jit.background import ALONE, BackgroundCompiler, compiling_beside
from rpf3d_core.results.findings import Findings
from rpf3d_core.results.folder import result_folder, write_all_tables, write_findings
from rpf3d_core.results.tables import open_tables
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.choices import Rocks, Round, chosen_scene, rounds_of
from rpf3d_core.setup.prepared import (
    Prepared,
    check_releases,
    empty_tallies,
    empty_totals,
    engine_name,
    places_of,
    prepare,
    releases_in_ranges,
)
from rpf3d_core.simulation.engines import (
    Compiled,
    precompile_ground_below,
    precompile_index,
    spins_of,
    warm,
    warm_flights,
)
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.values import Outcome

Stop = Callable[[], bool]
"""Function that is called while rocks fly; True stops the run."""

SHOWN = 10_000
"""Rocks that a run on disk keeps in memory for the pictures. The tables on disk hold all rocks."""


@dataclass(frozen=True, eq=False)
class Run:
    """A scene, its terrain, and the results of its rocks.

    flights : of all rocks or, if the run was written to disk, of the rocks that are shown
    totals, maps : of all rocks; planned : rocks that should fly, more than `totals.rocks` if the run was interrupted
    steps : convergence after each doubling if the scene says `rocks: auto`, else empty
    read_s : wall seconds to read and check the terrain; index_s : wall seconds to build the engine's index over it
    began : `time.perf_counter()` at the start of the run; obstacles : barriers and trees of the scene
    """

    scene: Scene
    terrain: Terrain
    faults: FaultReport
    flights: Flights
    totals: Totals
    maps: HazardMaps
    planned: int
    steps: tuple[Step, ...]
    read_s: float
    index_s: float
    began: float
    obstacles: Obstacles = NO_OBSTACLES


def simulate(
    scene: Scene | str | Path,
    rocks: Rocks = None,
    engine: str | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
    threads: int | None = None,
) -> Run:
    """Fly all rocks of a scene and keep all results in memory.

    Parameters
    ----------
    scene : a scene, or the path of its file
    rocks : total number, dealt to the sources in proportion, or "auto"; None for the scene's own numbers
    engine : "reference", "compiled" or "auto"; None for the scene's own
    seed : of all random draws; None for the scene's own
    progress : as `ensemble.batches.Progress`
    threads : number for the compiled engine; None for one thread a core

    Raises
    ------
    InputError
        The scene, one of its files or a source is refused; the message names it and says what would be right.
    """
    chosen = chosen_scene(scene, rocks, engine, seed)
    with _second_compiler(chosen) as beside:
        prepared = prepare(chosen, lambda: beside.wait(precompile_index))
        return _fly(prepared, None, progress=progress, threads=threads, beside=beside)


def run_scene(
    scene: Scene | str | Path,
    folder: str | Path,
    rocks: Rocks = None,
    engine: str | None = None,
    seed: int | None = None,
    progress: Progress | None = None,
    stop: Stop | None = None,
    writing: Callable[[], None] | None = None,
    recording: bool = True,
) -> Run:
    """Fly all rocks of a scene and write the result into a folder: any number of rocks, in bounded memory.

    The tables are written while the rocks fly.

    Parameters
    ----------
    folder : new, empty, or an earlier result, which is replaced at the end
    stop : called while rocks fly; after it returns True the rocks flown so far are written, marked as partial
    writing : called after the last rock has flown, before the remaining files are written
    recording : False to write no run.rrd, whatever the scene says
    scene, rocks, engine, seed, progress : as `simulate`

    Raises
    ------
    InputError
        As `simulate`; or the folder holds other files than a result, or cannot be written to.
    """
    chosen = chosen_scene(scene, rocks, engine, seed)
    with result_folder(folder) as part, _second_compiler(chosen) as beside:
        prepared = prepare(chosen, lambda: beside.wait(precompile_index))
        terrain, outputs = prepared.terrain, prepared.scene.outputs
        sources = [source.name for source in prepared.scene.sources]
        with open_tables(
            part,
            sources,
            terrain,
            prepared.scene.rock.density,
            outputs.impacts,
            prepared.obstacles,
            spins_of(prepared.flight.models),
        ) as sink:
            run = _fly(prepared, SHOWN, sink, progress, stop, beside=beside)
        if writing:
            writing()
        write_findings(part, findings_of(run), _recorder(run) if recording and outputs.recording else None)
    return run


def replay(
    scene: Scene | str | Path, source: str | int, rock: int, engine: str = "reference", seed: int | None = None
) -> Run:
    """Fly one rock of a scene again; its path is bit for bit the same as in a run of all rocks.

    Parameters
    ----------
    scene, engine, seed : as `simulate`
    source : name of the rock's source, or its index in the scene's list, from 0
    rock : number of the rock in its source, from 0

    Raises
    ------
    InputError
        As `simulate`, or there is no such source or rock.
    """
    chosen = chosen_scene(scene, None, engine, seed)
    names = [spec.name for spec in chosen.sources]
    place = names.index(source) if source in names else source
    if not isinstance(place, int) or not 0 <= place < len(names):
        raise InputError(f"{chosen.path}: there is no source {source!r}; the sources are {', '.join(names)}")
    if rock < 0:
        raise InputError(f"{chosen.path}: the rock is {rock}; rocks are numbered from 0")
    first = [rock if i == place else 0 for i in range(len(names))]
    return _fly(prepare(chosen), None, rounds=[(first, [n + (i == place) for i, n in enumerate(first)])])


def write_run(run: Run, folder: str | Path, recording: bool = True) -> Path:
    """Write all files of a result (docs/reference/outputs.md) and return the absolute path of the folder.

    recording : False to write no run.rrd, whatever the scene says

    Raises
    ------
    InputError
        The folder holds other files than a result, or cannot be written to.
    """
    with result_folder(folder) as part:
        write_all_tables(part, findings_of(run))
        write_findings(part, findings_of(run), _recorder(run) if recording and run.scene.outputs.recording else None)
    return Path(folder).resolve()


def findings_of(run: Run) -> Findings:
    """Return the findings of a run, from which the files of a result are written; its wall time ends here."""
    timings = {"read_s": run.read_s, "index_s": run.index_s, "wall_s": time.perf_counter() - run.began}
    return Findings(
        run.scene, run.terrain, run.faults, run.flights, run.totals, run.maps, run.planned, run.steps, timings,
        run.obstacles,
    )  # fmt: skip


def _fly(
    prepared: Prepared,
    shown: int | None,
    sink: Sink | None = None,
    progress: Progress | None = None,
    stop: Stop | None = None,
    threads: int | None = None,
    rounds: Sequence[Round] | None = None,
    beside: BackgroundCompiler = ALONE,
) -> Run:
    """Fly a prepared scene round by round until all rocks have flown, the target is met, or `stop` returns True.

    shown : number of rocks to keep in memory, None for all; sink : takes the deposits and impacts of each block
    rounds : ranges of rocks to fly instead of the scene's own; beside : the process that compiles in parallel
    """
    scene, flight = prepared.scene, prepared.flight
    tallies, totals = empty_tallies(prepared), empty_totals(prepared)
    plan = list(rounds_of(scene, places_of(prepared))) if rounds is None else list(rounds)
    compile_s = _checked_and_compiled(prepared, tallies, plan[0], beside)
    # A run in memory keeps the impacts of all rocks. A run on disk needs them only for impacts.parquet.
    impacts = scene.outputs.impacts or shown is None
    kept, take = _shown(scene, plan, shown), _both(totals, sink)
    stream = Stream(prepared.engine, flight, kept, tallies, take, stop, threads, impacts=impacts)
    steps: list[Step] = []
    began, planned = time.perf_counter(), 0
    for first, last in plan:
        planned = sum(last)
        if steps:
            _check_all(prepared, (first, last))
        stream.advance = progress(sum(last) - sum(first)) if progress else None
        if not stream.fly(releases_in_ranges(prepared, ranges) for ranges in blocks_of(first, last)):
            break
        if scene.rocks == "auto":
            steps.append(step_of(tallies.places(totals.rocks, prepared.area_names), prepared.terrain.zones))
            if is_enough(steps, scene.target.half_width, scene.target.p95_energy):
                break
    totals.dust = stream.dust
    flights = stream.flights(compile_s, time.perf_counter() - began)
    maps = tallies.maps(totals.rocks, prepared.area_names, totals.outcomes[Outcome.LOST_TO_HOLE])
    return Run(
        scene, prepared.terrain, prepared.faults, flights, totals, maps, planned + totals.pieces, tuple(steps),
        prepared.read_s, prepared.index_s, prepared.began, prepared.obstacles,
    )  # fmt: skip


def _checked_and_compiled(prepared: Prepared, tallies: Tallies, rocks: Round, beside: BackgroundCompiler) -> float:
    """Check the releases of the first round and compile the loops that the cache lacks; return the compile time (s).

    The check needs the loop for the ground below a rock. While the second process still compiles that loop, the loops
    of flights are compiled here.
    """
    beside.compile(*tallies.loops())
    flight = prepared.flight
    flying = prepared.engine, flight.models, flight.materials, flight.settings
    before = 0.0 if beside.has_done(precompile_ground_below) else warm_flights(*flying)
    beside.wait(precompile_ground_below)
    _check_all(prepared, rocks)
    return before + warm(*flying) + warm_pieces(prepared.engine, flight) + tallies.warm(beside.wait)


@contextmanager
def _second_compiler(scene: Scene) -> Iterator[BackgroundCompiler]:
    """Yield a second process that compiles the loops that take longest, if the scene needs the compiled engine.

    Their types are known only after the scene is prepared. Until then the process compiles loops that have the same
    types in all scenes.
    """
    with compiling_beside(*([visit_all] if engine_name(scene) == Compiled.name else [])) as beside:
        beside.call(precompile_index, precompile_ground_below)
        yield beside


def _check_all(prepared: Prepared, rocks: Round) -> None:
    """Refuse sources with a rock under the ground or off the terrain; called before the first rock of a round flies."""
    for ranges in blocks_of(*rocks):
        check_releases(prepared, releases_in_ranges(prepared, ranges))


def _shown(scene: Scene, plan: Sequence[Round], shown: int | None) -> Shown:
    """Return the rocks of the first round to keep in memory: all if `shown` is None, else an even selection.

    With `rocks: auto` the number of rocks of later rounds is unknown.
    """
    first, last = plan[0]
    return shown_of(sum(last) - sum(first), shown, scene.outputs.trajectories)


def _both(totals: Totals, sink: Sink | None) -> Sink:
    """Return a sink that adds each block to the totals and passes the block on to another sink."""

    def take(deposits: Deposits, impacts: Impacts) -> None:
        totals.add(deposits)
        if sink:
            sink(deposits, impacts)

    return take


def _recorder(run: Run) -> Callable[[Path, dict[str, Any]], None]:
    """Return a function of (path, summary) that writes the recording of a run."""
    from rpf3d_core.recordings.log import write_recording  # imported here, because only recordings need rerun

    return lambda path, facts: write_recording(
        path, run.scene, run.terrain, run.flights, facts, run.maps, run.obstacles
    )  # fmt: skip
