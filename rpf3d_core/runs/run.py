"""Run a scene as `rpf3d run` does: read the scene, fly the rocks, count the rocks and write the result."""

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from pathlib import Path
from typing import Any

from rpf3d_core.ensemble.batches import Progress
from rpf3d_core.ensemble.stream import Sink
from rpf3d_core.errors import InputError
from rpf3d_core.results.findings import Run
from rpf3d_core.results.folder import result_folder, write_all_tables, write_findings
from rpf3d_core.results.painting import Painting, painting
from rpf3d_core.results.tables import open_tables
from rpf3d_core.runs.critical_path import fly_one, with_critical_path
from rpf3d_core.runs.fly_scene import UNCONTROLLED, RunControl, fly_scene
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.choices import Rocks, chosen_scene
from rpf3d_core.setup.precompiler import Precompiler, precompiler_of
from rpf3d_core.setup.prepared import (
    Prepared,
    prepare,
)
from rpf3d_core.simulation.engines import spins_of
from rpf3d_core.terrain.facets import Terrain

SHOWN = 10_000
"""Number of rocks that `run_scene` keeps in memory for the pictures; the tables on disk contain all rocks."""


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
    rocks : total number, divided among the sources in proportion, or "auto"; None for the numbers in the scene
    engine : "reference", "compiled" or "auto"; None for the engine in the scene
    seed : seed of all random draws; None for the seed in the scene
    progress : function that reports progress; see `ensemble.batches.Progress`
    threads : number of threads for the compiled engine; None for one thread for each core

    Raises
    ------
    InputError
        The scene, one of its files or a source is refused; the message names the fault and states what would be right.
    """
    chosen = chosen_scene(scene, rocks, engine, seed)
    with precompiler_of(chosen) as precompiler:
        prepared = prepare(chosen, precompiler.before_index)
        return fly_scene(prepared, precompiler, None, control=RunControl(progress=progress, threads=threads))


def run_scene(
    scene: Scene | str | Path,
    folder: str | Path,
    rocks: Rocks = None,
    engine: str | None = None,
    seed: int | None = None,
    control: RunControl = UNCONTROLLED,
    recording: bool = True,
) -> Run:
    """Fly all rocks of a scene, and write the result into a folder.

    The tables are written while the rocks fly, so a run of many rocks needs no more memory than a run of few.

    Parameters
    ----------
    folder : path of a new or empty folder, or of an earlier result, which is replaced at the end
    control : progress reports, stop and threads; after a stop, the result contains the rocks flown so far and is marked
        as partial
    recording : False to write no run.rrd, even if the scene asks for it
    scene, rocks, engine, seed : as in `simulate`

    Raises
    ------
    InputError
        As `simulate`; or the folder contains other files than a result, or cannot be written to.
    """
    chosen = chosen_scene(scene, rocks, engine, seed)
    with result_folder(folder) as part, _painting(chosen, control) as drawn, precompiler_of(chosen) as precompiler:

        def before_index(terrain: Terrain) -> None:
            drawn.begin(terrain)
            precompiler.before_index()

        prepared = prepare(chosen, before_index)
        with _tables(part, prepared) as sink:
            run = fly_scene(prepared, precompiler, SHOWN, sink, control)
        if control.writing:
            control.writing()
        run = with_critical_path(run, control.threads)
        write_findings(part, run, _recorder(run) if recording and run.scene.outputs.recording else None, drawn)
    return run


@contextmanager
def _painting(scene: Scene, control: RunControl) -> Iterator[Painting]:
    """Yield the object that draws the pictures of a run: `control.painting`, or a new object if this is None.

    The second process that draws, if there is one, ends at once if the scene asks for no pictures. Otherwise it ends
    with the `with` block, so no process writes into a folder that is deleted after an error.
    """
    with painting(control.threads) if control.painting is None else nullcontext(control.painting) as drawn:
        try:
            if not scene.outputs.pictures:
                drawn.end()
            yield drawn
        finally:
            drawn.end()


def fly_into(folder: Path, prepared: Prepared, control: RunControl = UNCONTROLLED) -> Run:
    """Fly the rocks of a prepared scene, and write deposits.csv and impacts.parquet into an existing folder.

    `results.folder.write_findings` adds the other files of a result. After `control.stop`, the result contains the
    rocks flown so far.

    Raises
    ------
    InputError
        A rock starts under the ground or off the terrain.
    """
    with _tables(folder, prepared) as sink:
        return fly_scene(prepared, Precompiler(), SHOWN, sink, control)


def replay(
    scene: Scene | str | Path, source: str | int, rock: int, engine: str = "reference", seed: int | None = None,
    rocks: Rocks = None,
) -> Run:
    """Fly one rock of a scene again, for example to inspect it; its path is bit for bit the same as in the whole run.

    Parameters
    ----------
    scene, engine, seed : as in `simulate`
    source : name of the rock's source, or its index in the scene's list, from 0
    rock : number of the rock in its source, from 0
    rocks : number of rocks of the whole run, as in `simulate`; None for that of the scene

    Raises
    ------
    InputError
        As `simulate`; or there is no such source, or the source has no rock of this number.
    """
    chosen = chosen_scene(scene, rocks, engine, seed)
    names = [spec.name for spec in chosen.sources]
    place = names.index(source) if source in names else source
    if not isinstance(place, int) or not 0 <= place < len(names):
        raise InputError(f"{chosen.path}: there is no source {source!r}; the sources are {', '.join(names)}")
    last = (chosen.target.most_rocks if chosen.rocks == "auto" else chosen.sources[place].rocks) - 1
    if not 0 <= rock <= last:
        more = "" if rock < 0 or chosen.rocks == "auto" else "; if more rocks have flown, give their number as `rocks`"
        raise InputError(
            f"{chosen.path}: the rock is {rock}; the rocks of source {names[place]!r} are numbered from 0 to "
            f"{last}{more}"
        )
    return fly_one(prepare(chosen), place, rock)


def write_run(run: Run, folder: str | Path, recording: bool = True) -> Path:
    """Write all files of a run (docs/reference/outputs.md) into a folder, and return its absolute path.

    recording : False to write no run.rrd, even if the scene asks for it

    Raises
    ------
    InputError
        The folder contains other files than a result, or cannot be written to.
    """
    run = with_critical_path(run)
    with result_folder(folder) as part:
        write_all_tables(part, run)
        write_findings(part, run, _recorder(run) if recording and run.scene.outputs.recording else None)
    return Path(folder).resolve()


def _tables(folder: Path, prepared: Prepared) -> AbstractContextManager[Sink]:
    """Return a context manager that opens the tables of deposits and impacts, which are written while the rocks fly."""
    scene = prepared.scene
    sources, density = [source.name for source in scene.sources], scene.rock.density
    return open_tables(
        folder, sources, prepared.terrain, density, impacts=scene.outputs.impacts, obstacles=prepared.obstacles,
        spins=spins_of(prepared.flight.models),
    )  # fmt: skip


def _recorder(run: Run) -> Callable[[Path, dict[str, Any]], None]:
    """Return the function that writes the recording of a run; its arguments are the path and the run's summary."""
    from rpf3d_core.recordings.log import RecordedGround, write_recording  # only recordings need rerun

    def write(path: Path, facts: dict[str, Any]) -> None:
        ground = RecordedGround(run.terrain, obstacles=run.obstacles, areas=run.prepared.outlines)
        write_recording(path, run.scene, ground, run.flights, facts, run.maps)

    return write
