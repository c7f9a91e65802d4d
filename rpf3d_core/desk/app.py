"""The program behind the page of the desk: do what the user requests on the page, and show results and messages."""

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.desk.clicks import AREA, Drawing, area_of, source_of
from rpf3d_core.desk.coefficients import coefficient_of, drawn_elsewhere
from rpf3d_core.desk.page import NO_RESULTS, STILL, Actions, build_page
from rpf3d_core.desk.picking import place_on
from rpf3d_core.desk.runner import Listener, Runner, Written
from rpf3d_core.desk.scene_files import stamp_of
from rpf3d_core.desk.scene_state import SceneState, opened, saved, shown_path
from rpf3d_core.desk.scene_text import (
    AREAS,
    MATERIALS,
    SOURCES,
    free_name,
    with_item,
    with_value,
    without_item,
    without_value,
)
from rpf3d_core.desk.sending import Sender
from rpf3d_core.desk.shown import NO_RUN, SceneView
from rpf3d_core.desk.tables import bench_section, outcome_section, progress_words, run_notes, scene_section
from rpf3d_core.desk.whole_files import check_target
from rpf3d_core.errors import InputError
from rpf3d_core.formats.extras import library_of
from rpf3d_core.results.findings import Run
from rpf3d_core.setup.prepared import Prepared

REFUSAL, NOTE, GOOD = "refusal", "note", "good"
"""Kinds of messages on the page."""


class Desk:
    """The desk of one user: edited scene, drawing of a new source or area, page, and thread that simulates rocks."""

    def __init__(self) -> None:
        """Build the page without a scene, and start the thread that simulates rocks."""
        self.server: Any = library_of("desk", "trame.app", "the desk needs").get_server("rpf3d", client_type="vue3")
        self.shown = SceneView()
        self.scene: SceneState | None = None
        self.drawing = Drawing()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._waiting: list[Callable[[], None]] = []
        self._connecting = threading.Lock()
        self._refused_edit = ""
        self._flying: Written | None = None
        self.runner = Runner(Listener(
            prepared=lambda written, prepared: self._later(lambda: self._prepared(written, prepared)),
            results=self._results, report=lambda path: self._later(lambda: self._reported(path)),
            refused=lambda text: self._later(lambda: self._refused(text)),
            busy=lambda text: self._later(lambda: self._busy(text)),
        ))  # fmt: skip
        self._camera_turned = False
        self.sender = Sender(self._send_view, self._do)
        self.view = build_page(self.server, self.shown.window, self._actions(), self.sender.drawn)

    @property
    def state(self) -> Any:
        """The values that the page shows; the browser receives each change."""
        return self.server.state

    def connected(self) -> None:
        """Do the work that waited for the server; call this once, in the server's thread, when browsers can connect."""
        with self._connecting:
            self._loop = asyncio.get_event_loop()
            self.sender.connected(self._loop)
            waiting, self._waiting = self._waiting, []
        for work in waiting:
            self._do(work)

    def open(self, path: Path) -> None:
        """Open a scene file on the page, in place of the scene that was open, and request the preparation of the scene.

        Errors are as in `read_scene`.
        """
        self._take(opened(path))
        assert self.scene is not None
        self.state.save_path = shown_path(self.scene.default_path)
        self.state.report_path = shown_path(self.scene.report_path)

    def close(self) -> None:
        """Stop the simulation, end its thread, and delete the temporary folder with the results."""
        self.runner.close()

    def _actions(self) -> Actions:
        """Return the functions that the page calls; an InputError becomes a message on the page."""
        return Actions(**{
            name: self._with_message(getattr(self, f"_{name}")) for name in Actions._fields
        })  # fmt: skip

    def _with_message(self, action: Callable[..., None]) -> Callable[..., None]:
        """Return an action that shows the text of an InputError on the page instead of raising the error."""

        def shown_on_page(*values: Any, **_: Any) -> None:
            self.state.messages = []
            try:
                action(*values)
            except InputError as fault:
                self._refused(str(fault))

        return shown_on_page

    # What the user does

    def _choose(self, kind: str) -> None:
        self.drawing = Drawing(kind)
        taken = [*self.state.sources, *self.state.areas]
        stem = "area" if kind == AREA else "source"
        self.state.new_name = free_name([each["name"] for each in taken], stem)
        self._drawn()

    def _click(self, event: Any, moved: float = 0.0) -> None:
        """Add the clicked place on the terrain to the drawing; ignore the click event at the end of a drag.

        A note on the page informs the user if the click missed the terrain.

        event : click event of the view, with the two ends of the `ray` below the pointer; None if no object was hit
        moved : distance (pixels) that the pointer moved since it was pressed
        """
        if not self.drawing.kind or moved > STILL or self.shown.terrain is None:
            return
        ray = np.array(event["ray"], dtype=float) if event else None
        place = None if ray is None else place_on(self.shown.terrain, ray[0], ray[1])
        if place is None:
            self._say(NOTE, "the click missed the terrain; click on the terrain")
            return
        self.drawing = self.drawing.clicked(place)
        self._drawn()

    def _undo_click(self) -> None:
        self.drawing = self.drawing.undone()
        self._drawn()

    def _cancel(self) -> None:
        self.drawing = Drawing()
        self._drawn()

    def _finish(self) -> None:
        """Add the drawn source or area to the scene."""
        frame, name = self._terrain().frame, str(self.state.new_name)
        if self.drawing.kind == AREA:
            key, item = AREAS, area_of(self.drawing, frame, name)
        else:
            rocks, height = self.state.new_rocks, self.state.new_height
            key, item = SOURCES, source_of(self.drawing, frame, name, rocks, height)
        self._edited(lambda text: with_item(text, key, item))
        self._cancel()

    def _remove(self, key: str, name: str) -> None:
        self._edited(lambda text: without_item(text, key, name))

    def _edit(self, material: str, key: str, typed: str) -> None:
        """Change a coefficient of a material; an empty text removes the key, so that its default is used."""
        path = (MATERIALS, material, key)
        try:
            self._edited(lambda text: self._with_coefficient(text, path, typed))
        except InputError:
            self._list_scene()  # the field shows the current value again
            raise

    def _with_coefficient(self, text: str, path: tuple[str, str, str], typed: str) -> str:
        """Return the text of the scene with a changed coefficient.

        path : keys of the coefficient; typed : its new value as the user types it, "" to remove the key
        """
        scene = self._opened()
        why = drawn_elsewhere(scene.scene, scene.values).get(path)
        if why is not None:
            raise InputError(f"`{'.'.join(path)}` is {why}")
        return with_value(text, path, coefficient_of(typed)) if typed.strip() else without_value(text, path)

    def _undo(self) -> None:
        self._take(self._opened().undone())

    def _run(self) -> None:
        """Simulate the rocks; if the last edit was refused, raise an InputError with the reason instead, but only once.

        A click on Run also ends the edit of a field, so the user has perhaps not seen the refusal.
        """
        refused, self._refused_edit = self._refused_edit, ""
        if refused:
            raise InputError(
                f"{refused}; this edit was refused, so no rock has flown: press Run again to fly without the edit"
            )
        self._flying = self._opened().written
        self.state.flying, self.state.has_run = True, False
        self.runner.fly(self._flying)

    def _stop(self) -> None:
        self.runner.stop_flying()

    def _save(self) -> None:
        """Save the scene in the file that the page names.

        The last run then counts as a run of this file, so that its report can be written. But if the paths in the scene
        lead to other files from the new folder, the user must run the scene again before a report.
        """
        before = self._opened()
        self.scene = after = saved(before, Path(self.state.save_path), bool(self.state.save_over))
        had_run, is_same = self.state.has_run, stamp_of(before.scene) == stamp_of(after.scene)
        if had_run and is_same:
            self.runner.move(before.written, after.path)
            self._flying = after.written
        self.state.report_path, self.state.has_run = shown_path(after.report_path), had_run and is_same
        self._list_scene()
        self._say(GOOD, f"scene saved in {after.path}")
        if had_run and not is_same:
            self._say(NOTE, "the paths of the saved scene lead to other files than those of the last run: press Run "
                      "before Report")  # fmt: skip
        if not self.state.ready:
            self.runner.prepare(after.written)  # `_prepared` ignores the data for the earlier file

    def _report(self) -> None:
        scene, path = self._opened(), Path(self.state.report_path).resolve()
        if scene.unsaved:
            raise InputError("save the scene first, because a report names the scene file of its run")
        check_target(path, bool(self.state.report_over))
        self.runner.write_report(scene.written, path)

    def _show_layer(self, layer: str) -> None:
        self.state.layer = layer
        self.state.legend = self.shown.drape(layer)
        self.sender.update()

    def _look(self, where: str) -> None:
        self.shown.look(where)
        self.view.push_camera()

    def _open(self) -> None:
        self.open(Path(str(self.state.open_path)))

    def _create(self) -> None:
        """Write a scene for a terrain file, as `rpf3d new` does, and open it."""
        from rpf3d_core.imports.new_scene import FileChoice, write_new_scene

        written = write_new_scene(Path(self.state.new_folder), Path(self.state.new_terrain), FileChoice())
        self.open(written.path)
        for sentence in written.warnings:
            self._say(NOTE, sentence)

    # Messages from the simulating thread

    def _prepared(self, written: Written, prepared: Prepared) -> None:
        """Show terrain, sources, areas and warnings of a prepared scene, unless the user has edited the scene since."""
        if self.scene is None or written != self.scene.written:
            return
        self._camera_turned = self.shown.show_scene(prepared) or self._camera_turned
        self.state.ready = True
        for sentence in (*prepared.placing, *prepared.faults.remarks, *prepared.doubts):
            self._say(NOTE, sentence)
        self.sender.update()

    def _results(self, run: Run, last: bool) -> None:
        """Show results on the page; last : True if no further results of this run follow.

        Tables and shapes for the page are made in the simulating thread, because the run changes its results later.
        """
        shown = self.shown.laid_out(run)
        values = {
            "benches": bench_section(run), "outcomes": outcome_section(run), "progress": progress_words(run, last),
            "notes": run_notes(run),
        }  # fmt: skip

        def show() -> None:
            if self._opened().written != self._flying:
                self.state.flying = self.state.flying and not last
                return  # results of another scene
            self.state.update({**values, "flying": not last, "has_run": last})
            self.shown.show_run(shown)
            self.state.legend = self.shown.drape(self.state.layer)
            self.sender.update()

        self._later(show)

    def _reported(self, path: Path) -> None:
        self._say(GOOD, f"report saved in {path}")

    def _refused(self, text: str) -> None:
        self.state.flying = False
        self._say(REFUSAL, text)

    def _busy(self, text: str) -> None:
        self.state.busy = text

    # The scene on the page

    def _send_view(self) -> int:
        """Send the view to the browser, with its camera if a new terrain has turned it; return the view's number."""
        number = self.shown.window.next_number()
        self.view.update()
        if self._camera_turned:
            self.view.push_camera()
        self._camera_turned = False
        return number

    def _opened(self) -> SceneState:
        if self.scene is None:
            raise InputError("open a scene first")
        return self.scene

    def _terrain(self) -> Any:
        if self.shown.terrain is None:
            raise InputError("the terrain has not been read yet")
        return self.shown.terrain

    def _edited(self, edit: Callable[[str], str]) -> None:
        """Edit the scene. If the edit is refused, store the reason, so that `_run` shows the reason once.

        edit : function that takes the text of the scene and returns the changed text
        """
        try:
            self._take(self._opened().edited(edit))
        except InputError as fault:
            self._refused_edit = str(fault)
            raise

    def _take(self, scene: SceneState) -> None:
        """Replace the edited scene: clear the results of the previous scene, and prepare the new scene."""
        self.scene, self._refused_edit = scene, ""
        self.state.update(NO_RESULTS)
        self.shown.show_run(NO_RUN)
        self.shown.drape("")
        self.sender.update()
        self._list_scene()
        self.runner.prepare(scene.written)

    def _list_scene(self) -> None:
        """Show name, sources, areas and materials of the scene."""
        scene = self._opened()
        section = scene_section(scene.scene, scene.values)
        self.state.update({
            **section, "name": scene.path.stem, "path": shown_path(scene.path), "unsaved": scene.unsaved,
            "listed": self.state.listed + 1,  # lets the fields of materials show their values
        })  # fmt: skip

    def _drawn(self) -> None:
        """Show the drawing of the new source or area."""
        self.state.kind, self.state.clicks = self.drawing.kind, len(self.drawing.points)
        self.shown.show_drawing(self.drawing)
        self.sender.update()

    def _say(self, kind: str, text: str) -> None:
        """Show a message on the page, unless the page already shows it; kind : REFUSAL, NOTE or GOOD."""
        if (message := {"kind": kind, "text": text}) not in self.state.messages:
            self.state.messages = [*self.state.messages, message]

    def _later(self, work: Callable[[], None]) -> None:
        """Let the server's thread call the function `work`: soon or, if no browser can connect yet, in `connected`.

        Any thread may call this method.
        """
        with self._connecting:
            if self._loop is None:
                self._waiting.append(work)
            else:
                self._loop.call_soon_threadsafe(self._do, work)

    def _do(self, work: Callable[[], None]) -> None:
        """Call the function `work`, and send the values of the page that `work` changes to the browser."""
        with self.state:
            work()

