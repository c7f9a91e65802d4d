"""Read scenes, fly rocks and write reports in one thread, so that the server answers the page at the same time.

Terrain, search structure and compiled loops are kept in memory until the scene or one of its files changes.
"""

import queue
import shutil
import tempfile
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.desk.compiling import Compiling, prepared_for
from rpf3d_core.desk.scene_files import Stamp, check_unchanged, stamp_of
from rpf3d_core.desk.whole_files import whole_file
from rpf3d_core.errors import InputError
from rpf3d_core.results.findings import Run
from rpf3d_core.runs.fly_scene import RunControl
from rpf3d_core.runs.run import fly_into
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import scene_of_text
from rpf3d_core.setup.prepared import Prepared, engine_name
from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.simulation.engines import Reference
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.mesh.faults import FaultReport

FIRST = 16
"""Number of rocks after which the first results are shown."""
QUIETEST = 0.4
"""Shortest time (s) between two results that are shown, for slow browsers; the last result is always shown."""


FOLDER = "rpf3d-desk-"
"""Beginning of the names of the temporary folders with results."""
FLOWN = ("deposits.csv", "impacts.parquet")
"""Files that `fly_into` writes; `write_findings` writes all other files of a result."""
LATEST = 20.0
"""Longest time (s) that the desk, when it ends, waits for rocks that still fly."""


class Written(NamedTuple):
    """A scene as the user edits it: its text and the path of its file.

    Relative paths in the text start at the folder of this file.
    """

    text: str
    path: Path


class Listener(NamedTuple):
    """Functions that the thread of a `Runner` calls to report its work; the functions run in this thread.

    prepared : called when a scene is ready to fly; results : called with the results so far, and with True if no
        further results of this run follow
    report : called with the path of a written report; refused : called with the text of an error
    busy : called with a text on the current work, "" if there is none
    """

    prepared: Callable[[Written, Prepared], None]
    results: Callable[[Run, bool], None]
    report: Callable[[Path], None]
    refused: Callable[[str], None]
    busy: Callable[[str], None]


class ReadyScene(NamedTuple):
    """A scene that is ready to fly, as text and as data prepared for the reference engine.

    stamp : path, size and time of the last change of each file of the scene, taken before the files were read
    """

    written: Written
    stamp: Stamp
    prepared: Prepared


class Runner:
    """A thread that does its tasks one after another: prepare a scene, fly its rocks, write a report."""

    def __init__(self, listener: Listener) -> None:
        """Start the thread; listener : receives the results and messages."""
        self._listener = listener
        self._tasks: queue.SimpleQueue[Callable[[], object] | None] = queue.SimpleQueue()
        self._stop = threading.Event()
        self._ground: tuple[Any, tuple[Terrain, FaultReport]] | None = None
        self._ready: ReadyScene | None = None
        self._compiled: Compiling | None = None
        self._flown: tuple[ReadyScene, Run] | None = None
        self._folder: Path | None = None
        self._numbers = count()
        self._asked = next(self._numbers)
        self._thread = threading.Thread(target=self._work, name="desk", daemon=True)
        self._thread.start()

    def prepare(self, written: Written) -> None:
        """Request the preparation of a scene and the compilation of its loops, so that its rocks can fly without delay.

        Earlier requests to prepare a scene are dropped if the thread has not started to work on them.
        """
        self._asked = number = next(self._numbers)
        self._tasks.put(lambda: self._prepare(written) if number == self._asked else None)

    def fly(self, written: Written) -> None:
        """Request the flight of a scene's rocks; the listener receives results during the flight.

        Requests to prepare a scene are dropped if the thread has not started to work on them.
        """
        self._stop.clear()
        self._asked = next(self._numbers)
        self._tasks.put(lambda: self._fly(written))

    def write_report(self, written: Written, path: Path) -> None:
        """Request the report of the last run.

        The request is refused if the last run was not of this scene, or if a file of the scene has changed since.

        written : the scene; path : HTML file to write
        """
        self._tasks.put(lambda: self._report(written, path))

    def move(self, written: Written, path: Path) -> None:
        """Request that the last run counts as a run of another scene file; call this when the scene was saved there.

        written : the scene as it was before; the request is ignored if the last run was of another scene
        path : the other file; it must have the same text and read the same files
        """
        self._tasks.put(lambda: self._move(written, path))

    def stop_flying(self) -> None:
        """Start no further rocks; the rocks flown so far are the result."""
        self._stop.set()

    def close(self) -> None:
        """Stop the rocks and the compiler, end the thread, and delete the folder of results.

        The call waits at most LATEST (20 s) for the end of the thread.
        """
        self._stop.set()
        self._tasks.put(None)
        self._thread.join(LATEST)
        if self._compiled is not None:
            self._compiled.cancel()
        self._forget()

    def _work(self) -> None:
        """Do the tasks in order until `close`; report their errors to the listener."""
        while (task := self._tasks.get()) is not None:
            try:
                task()
            except InputError as fault:
                self._listener.refused(str(fault))
            except Exception as fault:
                self._listener.refused(f"internal error of rpf3d: {type(fault).__name__}: {fault}")
            self._listener.busy("")

    def _prepare(self, written: Written) -> ReadyScene:
        """Return a scene prepared for the reference engine; the previous data if text and files are unchanged.

        A newly prepared scene is kept. Its loops start to compile, and the listener is informed.
        """
        kept = self._ready
        if kept is not None and kept.written == written and kept.stamp == stamp_of(kept.prepared.scene):
            return kept
        self._listener.busy("reading the terrain")
        scene = scene_of_text(written.text, written.path)
        stamp = stamp_of(scene)
        ground = self._ground_of(scene, stamp)
        ready = ReadyScene(written=written, stamp=stamp, prepared=prepared_for(scene, Reference.name, ground))
        self._ready = ready
        self._compile(scene, written.text, ground)
        self._listener.prepared(written, ready.prepared)
        return ready

    def _compile(self, scene: Scene, text: str, ground: tuple[Terrain, FaultReport]) -> None:
        """Start to compile the loops of a scene in another thread, unless the scene names the reference engine.

        The compilation for the previous scene is cancelled. text : text of the scene
        """
        if self._compiled is not None:
            self._compiled.cancel()
        self._compiled = None if scene.engine == Reference.name else Compiling(scene, text, ground)

    def _ground_of(self, scene: Scene, stamp: Stamp) -> tuple[Terrain, FaultReport]:
        """Return the terrain of a scene and the faults of its mesh.

        The terrain is read again only if the scene's terrain, its zones or one of its files has changed.

        stamp : state of the scene's files, from `stamp_of`
        """
        key = scene.terrain, scene.zones, stamp
        if self._ground is None or self._ground[0] != key:
            self._ground = key, read_terrain(scene)
        return self._ground[1]

    def _fly(self, written: Written) -> None:
        """Fly the rocks of a scene and write their results to a temporary folder.

        While the loops are not compiled, the reference engine flies. If the loops are ready before the last
        rock has flown, the compiled engine flies all rocks again; the results are equal to the last bit.
        """
        ready = self._prepare(written)
        prepared, compiling = ready.prepared, self._compiled
        self._listener.busy("flying")
        run = None
        if compiling is not None and compiling.done() is None and engine_name(prepared.scene) != Reference.name:
            self._listener.busy("compiling for the first run; meanwhile, the reference engine flies")
            run = self._flown_before(compiling, prepared)
            self._listener.busy("flying")
        if run is None:
            compiled = None if compiling is None else compiling.done()
            run = self._into_folder(compiled or prepared, self._stop.is_set)
        self._flown = ready, run
        self._listener.results(run, True)

    def _flown_before(self, compiling: Compiling, prepared: Prepared) -> Run | None:
        """Fly the rocks of a scene with the reference engine until the compiled engine is ready.

        Return the run if all rocks have flown before that time, or if the user stopped the flight; otherwise None.
        """
        run = self._into_folder(prepared, lambda: self._stop.is_set() or compiling.done() is not None)
        is_whole = self._stop.is_set() or compiling.done() is None or run.totals.rocks == run.planned
        return run if is_whole else None

    def _into_folder(self, prepared: Prepared, stop: Callable[[], bool]) -> Run:
        """Fly the rocks of a scene until `stop` returns True, and write their results to a new temporary folder.

        The results of the previous run are deleted first. The listener receives results during the flight.
        """
        self._forget()
        self._folder = Path(tempfile.mkdtemp(prefix=FOLDER))
        control = RunControl(
            first=FIRST, stop=stop, after_round=_not_too_often(self._listener.results), checks_in_turn=True
        )
        return fly_into(self._folder, prepared, control)

    def _report(self, written: Written, path: Path) -> None:
        """Write the report of the last run; refuse it if the scene or one of its files has changed since the run."""
        from rpf3d_core.report.report import check_is_html, write_report
        from rpf3d_core.results.folder import SUMMARY, write_findings
        from rpf3d_core.runs.critical_path import with_critical_path

        if self._flown is None or self._flown[0].written != written or self._folder is None:
            raise InputError("the rocks of this scene have not flown; press Run, then Report")
        check_is_html(path)
        ready, run = self._flown
        scene, summary = ready.prepared.scene, self._folder / SUMMARY
        check_unchanged(scene, ready.stamp)
        self._listener.busy("writing the report")
        if not summary.is_file():
            write_findings(self._folder, with_critical_path(run))
        try:
            with whole_file(path) as part:
                write_report(self._folder, part)
                check_unchanged(scene, ready.stamp)
        except InputError:
            summary.unlink()  # the digest in this file may be that of changed files
            raise
        self._listener.report(path)

    def _move(self, written: Written, path: Path) -> None:
        """Replace the scene file of the last run, and delete the files that an earlier report of this run needed.

        Nothing happens if the last run was of another scene. Data prepared for a next run still belong to the earlier
        file, so the next run prepares the scene again.
        """
        if self._flown is None or self._flown[0].written != written or self._folder is None:
            return
        ready, run = self._flown
        moved = written._replace(path=path)
        scene = scene_of_text(moved.text, path)
        self._flown = (
            ready._replace(written=moved, prepared=replace(ready.prepared, scene=scene)),
            replace(run, prepared=replace(run.prepared, scene=scene)),
        )
        for file in self._folder.iterdir():
            if file.is_dir():
                shutil.rmtree(file, ignore_errors=True)
            elif file.name not in FLOWN:
                file.unlink()

    def _forget(self) -> None:
        """Delete the results of the last run."""
        self._flown = None
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)
            self._folder = None


def _not_too_often(show: Callable[[Run, bool], None]) -> Callable[[Run], None]:
    """Return a function that shows a result, unless it showed another result less than QUIETEST seconds ago."""
    last = -QUIETEST

    def shown(run: Run) -> None:
        nonlocal last
        if time.monotonic() - last >= QUIETEST:
            show(run, False)
            last = time.monotonic()

    return shown
