"""Fly one scene in parts, or many scenes and seeds, in several processes or on several machines.

The work is submitted to an executor. Any `concurrent.futures.Executor` works: a process pool on one machine,
`distributed.Client.get_executor()` or `mpi4py.futures.MPIPoolExecutor` on a cluster. A worker receives the scene, reads
the scene's files, and returns counts. So the files must have equal paths for all workers.
"""

import threading
import time
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, as_completed
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.joined import joined
from rpf3d_core.ensemble.stream import Stream, blocks_of, shown_of
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.partial import PackedTally, add_packed, add_packed_sources, packed_sources, packed_tallies
from rpf3d_core.results.earlier_results import read_summary
from rpf3d_core.results.findings import Run
from rpf3d_core.results.painting import Painting
from rpf3d_core.results.summary import summary
from rpf3d_core.runs.fly_scene import RunControl, finished_run
from rpf3d_core.runs.run import SHOWN, run_scene, simulate
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import scene_digest
from rpf3d_core.setup.choices import chosen_scene
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import (
    Prepared,
    check_releases,
    empty_tallies,
    empty_totals,
    prepare,
    releases_in_ranges,
)
from rpf3d_core.setup.rounds import Round, rounds_of_parts
from rpf3d_core.simulation.engines import Compiled

Flown = TypeVar("Flown")


@dataclass(frozen=True, eq=False)
class RunPart:
    """The results of a part of a scene's rocks, from one worker, to be merged with the other parts.

    digest : digest of the scene and of the files that the worker read
    totals, tallies, barriers : results of all rocks of the part
    flights : flights of only those rocks that are kept for pictures
    sources : `hazard.partial.PackedSources`, the counts for each source; None if the scene has one source
    """

    digest: str
    totals: Totals
    tallies: tuple[PackedTally, ...]
    flights: Flights
    barriers: Any = None
    sources: Any = None


class Finished(NamedTuple):
    """A finished run of `study`, with its summary.

    number : number of the run, counted from 0 over all pairs of scene and seed
    scene : file of the scene; summary : as in summary.json
    """

    number: int
    scene: Path
    seed: int
    summary: dict[str, Any]


class Resources(NamedTuple):
    """Memory and threads of a run in parts.

    shown : number of rocks to keep in memory for pictures, evenly spread over the parts; None for all
    threads : number of threads for each part, for the compiled engine
    """

    shown: int | None = SHOWN
    threads: int = 1


ONE_THREAD = Resources()
"""The default: as many rocks in memory as in a run on disk, and one thread for each part."""


def fly_parts(
    scene: Scene | str | Path,
    parts: int,
    executor: Executor,
    rocks: int | None = None,
    engine: str | None = None,
    seed: int | None = None,
    resources: Resources = ONE_THREAD,
) -> Run:
    """Fly the rocks of one scene in parts, each on a free worker of the executor, and merge the parts into one run.

    Parameters
    ----------
    parts : number of parts; it does not change totals and maps, not even in the last bit
    resources : number of rocks to keep in memory, and of threads
    scene, rocks, engine, seed : as in `run.simulate`

    Raises
    ------
    InputError
        As `run.simulate`; or the number of parts is below 1, the scene has `rocks: auto` or unknowns, or a worker read
        other files.
    """
    chosen = chosen_scene(scene, rocks, engine, seed)
    if chosen.rocks == "auto":
        raise InputError(f"{chosen.path}: `rocks: auto` cannot be flown in parts; say how many rocks")
    if chosen.has_unknowns:
        raise InputError(f"{chosen.path}: a scene with unknowns cannot be flown in parts; run it as a whole")
    if parts < 1:
        raise InputError(f"the number of parts is {parts}; it must be at least 1")
    rounds = rounds_of_parts([source.rocks for source in chosen.sources], parts)
    shown, threads = resources
    kept = None if shown is None else -(-shown // len(rounds))
    paths = -(-chosen.outputs.trajectories // len(rounds))
    with _all_or_none([executor.submit(fly_part, chosen, part, kept, paths, threads) for part in rounds]) as flying:
        prepared = prepare(chosen)  # the workers fly the parts at the same time
        return merged(prepared, [part.result() for part in flying])


def fly_part(scene: Scene, part: Round, shown: int | None, paths: int, threads: int) -> RunPart:
    """Fly a part of a scene's rocks in this process, and return the results; the workers of `fly_parts` call this.

    Parameters
    ----------
    part : for each source, the number of the first rock of the part, and the number after the last
    shown : number of rocks to keep in memory, None for all; paths : how many of these rocks also keep their path
    threads : number of threads for the compiled engine

    Raises
    ------
    InputError
        As `prepared.prepare`, or a rock starts under the ground or off the terrain.
    """
    digest = scene_digest(scene)
    prepared = _prepared(scene, digest)
    # VTK's search works in one thread only. The lock costs no time, because plain Python uses one thread at a time.
    with nullcontext() if isinstance(prepared.engine, Compiled) else _REFERENCE:
        return _flown(prepared, digest, part, shown, paths, threads)


def _flown(prepared: Prepared, digest: str, part: Round, shown: int | None, paths: int, threads: int) -> RunPart:
    """Fly a part of the rocks of a prepared scene, and return its results; arguments are as in `fly_part`.

    digest : of the scene and its files
    """
    for ranges in blocks_of(*part):
        check_releases(prepared, releases_in_ranges(prepared, ranges))
    totals, tallies = empty_totals(prepared), empty_tallies(prepared)
    compile_s = Precompiler().compile(prepared, tallies)
    stream = Stream(
        engine=prepared.engine, flight=prepared.flight, shown=shown_of(part.rocks, shown, paths), watch=tallies,
        sink=lambda deposits, _: totals.add(deposits), threads=threads,
    )  # fmt: skip
    began = time.perf_counter()
    stream.fly(releases_in_ranges(prepared, ranges) for ranges in blocks_of(*part))
    totals.dust = stream.dust
    flights = stream.flights(compile_s, time.perf_counter() - began)
    barriers = None if tallies.barriers is None else tallies.barriers.counts
    return RunPart(
        digest=digest, totals=replace(totals, position=None), tallies=packed_tallies(tallies), flights=flights,
        barriers=barriers, sources=packed_sources(tallies),
    )  # fmt: skip


def merged(prepared: Prepared, parts: Sequence[RunPart]) -> Run:
    """Merge the results of all parts of a scene's rocks, in any order, into one run.

    Raises
    ------
    InputError
        A part was flown with another scene or other files.
    """
    scene = prepared.scene
    check_files(scene, [part.digest for part in parts])
    tallies, totals = empty_tallies(prepared), empty_totals(prepared)
    for part in parts:
        add_packed(tallies, part.tallies)
        add_packed_sources(tallies, part.sources)
        totals.join(part.totals)
        if tallies.barriers is not None:
            tallies.barriers.join(part.barriers)
    flights = joined([part.flights for part in parts])
    return finished_run(prepared, tallies, totals, flights, totals.rocks - totals.pieces)


def check_files(scene: Scene, digests: Sequence[str]) -> None:
    """Raise InputError if a digest from another process differs from the digest of the scene and its files here.

    digests : of the same scene and its files, as other processes have read them
    """
    here = scene_digest(scene)
    if any(digest != here for digest in digests):
        raise InputError(f"{scene.path}: a worker has read other files than are here; all must see the same ones")


def study(
    scenes: Iterable[Scene | str | Path],
    executor: Executor,
    seeds: Sequence[int] | None = None,
    rocks: int | None = None,
    out: str | Path | None = None,
) -> Iterator[Finished]:
    """Fly many scenes, each with many seeds, on the workers of an executor; a worker flies one whole run at a time.

    Parameters
    ----------
    seeds : seeds for every scene; None for the seed in the scene
    rocks : number of rocks of each run; None for the numbers in the scene
    out : folder that every worker can write to. Each run writes a result folder into `out`, with a name made of the
        number of the run and the name of the scene file. Without `out`, a worker keeps all rocks of its run in memory,
        so give a folder for millions of rocks.

    Returns
    -------
    iterator of Finished
        Yields the runs in the order in which they finish. All runs are submitted before this function returns. If the
        caller closes or drops the iterator, runs that have not started are cancelled.

    Raises
    ------
    InputError
        A scene is refused: by this function, or by the iterator after a worker has tried to fly the scene. Or a worker
        has read other files than the caller.
    """
    each: Sequence[int | None] = [None] if seeds is None else seeds
    chosen = [chosen_scene(scene, rocks, None, seed) for scene in scenes for seed in each]
    digests = [scene_digest(scene) for scene in chosen]
    folders = [None if out is None else Path(out, f"{n:04d}_{scene.path.stem}") for n, scene in enumerate(chosen)]
    flying = {
        executor.submit(_summary_of, scene, digest, folder): number
        for number, (scene, digest, folder) in enumerate(zip(chosen, digests, folders, strict=True))
    }
    runs = _finished_runs(flying, chosen)
    next(runs)  # a generator that has not begun would cancel nothing when the caller closes or drops it
    return runs


def _finished_runs(flying: dict["Future[dict[str, Any]]", int], scenes: Sequence[Scene]) -> Iterator[Any]:
    """Yield None, then each finished run of `study`; cancel runs that have not started at the end.

    The first value, None, lets `study` start the generator: closing a generator that has not started
    would cancel no run.
    """
    with as_they_finish(flying) as finished:
        yield None
        for done, number in finished:
            scene = scenes[number]
            yield Finished(number=number, scene=scene.path, seed=scene.seed, summary=done.result())


@contextmanager
def as_they_finish(flying: "dict[Future[Flown], int]") -> "Iterator[Iterator[tuple[Future[Flown], int]]]":
    """Context manager: yield an iterator of (future, number), in the order in which the futures finish.

    When the `with` block ends, also after an error or Ctrl-C, work that has not started is cancelled.

    flying : number of each submitted future, such as the number of a run
    """
    with _all_or_none(list(flying)):
        yield ((done, flying[done]) for done in as_completed(flying))


def _summary_of(scene: Scene, digest: str, folder: Path | None) -> dict[str, Any]:
    """Fly a whole scene in this process, and return its summary.

    digest : of the scene and the files of the caller; folder : for the result, None to write nothing

    Raises
    ------
    InputError
        As `run_scene`; or the files that this process reads do not have the given digest.
    """
    check_files(scene, [digest])
    if folder is None:
        return summary(simulate(scene, threads=1))
    run_scene(scene, folder, control=RunControl(painting=Painting()), recording=False)  # no second process for pictures
    return read_summary(folder)


@contextmanager
def _all_or_none(flying: "list[Future[Flown]]") -> Iterator["list[Future[Flown]]"]:
    """Context manager: yield the given futures; at the end, also after an error, cancel work that has not begun."""
    try:
        yield flying
    finally:
        for one in flying:
            one.cancel()


def _prepared(scene: Scene, digest: str) -> Prepared:
    """Return the prepared scene; it is kept in memory for the next part of the same scene in this process."""
    with _PREPARING:
        if (scene.path, digest) not in _READY:
            _READY.clear()  # freed first, because two terrains may need too much memory
            _READY[scene.path, digest] = prepare(scene)
        return _READY[scene.path, digest]


_READY: dict[tuple[Path, str], Prepared] = {}
_PREPARING, _REFERENCE = threading.Lock(), threading.Lock()
