"""Build the page of the desk: the panel for editing, the view, and the results below the view."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.desk.clicks import AREA, LINE, POINTS
from rpf3d_core.desk.shapes import ENERGY, REACH
from rpf3d_core.formats.extras import library_of

STYLE = Path(__file__).with_name("style.css")
NEEDS = "the desk needs"
TOOLS = ((POINTS, "Points"), (LINE, "Crest line"), (AREA, "Area of interest"))
LAYERS = ((REACH, "reach"), (ENERGY, "p95 energy"), ("", "none"))
STILL = 5.0
"""Largest distance (pixels) that the mouse may move during a click; a longer movement turns the view."""
NO_RESULTS = {
    "legend": {}, "progress": "", "benches": {"header": [], "rows": [], "notes": []},
    "outcomes": {"header": [], "rows": []}, "notes": [], "has_run": False,
}  # fmt: skip
"""Values of the page that show results, by name, as they are while there are no results."""
START = {
    "name": "", "path": "", "unsaved": False, "busy": "", "flying": False, "ready": False, "messages": [],
    "sources": [], "areas": [], "materials": [], "rock": "", "listed": 0, "kind": "", "clicks": 0, "new_name": "",
    "new_rocks": 200, "new_height": 0.5, "save_path": "", "save_over": False, "report_path": "", "report_over": False,
    "layer": REACH,
    **NO_RESULTS, "open_path": "", "new_terrain": "", "new_folder": "", "moved": 0, "pressed": [0, 0],
}  # fmt: skip
"""All values of the page, by name, as they are when the page is opened."""


class Actions(NamedTuple):
    """Functions that the buttons and inputs of the page call.

    choose : start a drawing, by kind; click : add a place, from the event of vtk.js; undo_click : remove the last place
    finish : add the drawing to the scene; cancel : discard the drawing; remove : remove a source or area, by key
        of its list and by name
    edit : change a coefficient, by material, key and text; undo : undo the last edit
    run, stop : start and stop the rocks; save, report : write the scene or the report
    show_layer : show a hazard map, by kind; look : turn the camera to the sources or the whole terrain
    open : open a scene; create : write a scene for a terrain file
    """

    choose: Callable[[str], None]
    click: Callable[..., None]
    undo_click: Callable[[], None]
    finish: Callable[[], None]
    cancel: Callable[[], None]
    remove: Callable[[str, str], None]
    edit: Callable[[str, str, str], None]
    undo: Callable[[], None]
    run: Callable[[], None]
    stop: Callable[[], None]
    save: Callable[[], None]
    report: Callable[[], None]
    show_layer: Callable[[str], None]
    look: Callable[[str], None]
    open: Callable[[], None]
    create: Callable[[], None]


def build_page(server: Any, window: Any, actions: Actions, drawn: Callable[[float], None]) -> Any:
    """Build the page of a trame server, and return the widget that shows the VTK window in the browser.

    drawn : called whenever the browser has taken over a state of the window, also when a page is loaded, with a number
        larger than that of the state (`VtkWindow.next_number`)
    """
    html = library_of("desk", "trame.widgets.html", NEEDS)
    client = library_of("desk", "trame.widgets.client", NEEDS)
    layouts = library_of("desk", "trame.ui.html", NEEDS)
    server.state.update(START)
    server.state.trame__title = "rpf3d desk"
    with layouts.DivLayout(server) as layout:
        client.Style(STYLE.read_text(encoding="utf-8"))
        layout.root.classes = "desk"
        with html.Div(classes="panel"):
            _head(html, actions)
            with html.Div(v_if="name"):
                _run_part(html, actions)
                _drawing_part(html, actions)
                _lists(html, actions)
                _materials(html, actions)
                _files(html, actions)
            with html.Div(v_else=True):
                _start_part(html, actions)
        view = _view(html, window, actions, drawn)
        _results(html)
    return view


def _head(html: Any, actions: Actions) -> None:
    """Add the head of the panel: name of the scene, current work of the desk, and messages."""
    html.H1("{{ name || 'rpf3d desk' }}")
    html.Div("{{ path }} {{ unsaved ? '(changed, not saved)' : '' }}", classes="quiet path")
    html.Div("{{ busy ? busy + ' ...' : '' }}", classes="busy", id="busy")
    with html.Div(classes="messages", id="messages"):
        html.Div("{{ m.text }}", v_for="(m, i) in messages", key="i", classes=("'message ' + m.kind",))


def _run_part(html: Any, actions: Actions) -> None:
    with html.Div(classes="row"):
        html.Button("Run", id="run", classes="main", click=actions.run, disabled=("!ready || flying || !!kind",),
                    title=("kind ? 'first add or cancel the drawing' : ''",))  # fmt: skip
        html.Button("Stop", id="stop", click=actions.stop, disabled=("!flying",))
        html.Button("Undo edit", id="undo", click=actions.undo, disabled=("!unsaved || flying",))
    with html.Div(classes="row"):
        html.Span("Map:", classes="quiet")
        for layer, words in LAYERS:
            html.Button(words, id=f"layer_{layer or 'none'}", classes=(f"layer === '{layer}' ? 'on' : ''",),
                        click=lambda layer=layer: actions.show_layer(layer))  # fmt: skip
    with html.Div(classes="row"):
        html.Span("View:", classes="quiet")
        html.Button("all", id="look_all", click=lambda: actions.look("all"))
        html.Button("sources", id="look_sources", click=lambda: actions.look("sources"))


def _drawing_part(html: Any, actions: Actions) -> None:
    """Add the tools to draw sources and areas by clicks in the view."""
    html.H2("Place sources and areas")
    with html.Div(classes="row"):
        for kind, words in TOOLS:
            html.Button(words, id=f"tool_{kind}", classes=(f"kind === '{kind}' ? 'on' : ''",),
                        disabled=("flying || !ready",), click=lambda kind=kind: actions.choose(kind))  # fmt: skip
    with html.Div(v_if="kind"):
        with html.Div(classes="row"):
            html.Label("name")
            html.Input(type="text", v_model="new_name", classes="grow", id="new_name")
        with html.Div(classes="row", v_if=f"kind !== '{AREA}'"):
            html.Label("rocks")
            html.Input(type="number", v_model_number="new_rocks", min="1", classes="grow", id="new_rocks")
        with html.Div(classes="row", v_if=f"kind !== '{AREA}'"):
            html.Label("above ground (m)")
            html.Input(type="number", v_model_number="new_height", min="0", step="0.1", classes="grow")
        with html.Div(classes="row"):
            html.Button("Add ({{ clicks }} {{ clicks === 1 ? 'point' : 'points' }})", id="finish", classes="main",
                        click=actions.finish)  # fmt: skip
            html.Button("Undo click", click=actions.undo_click, disabled=("!clicks",))
            html.Button("Cancel", click=actions.cancel)


def _lists(html: Any, actions: Actions) -> None:
    """Add the lists of sources and areas, each with a button that removes an item."""
    html.H2("Sources")
    with html.Div(v_for="each in sources", key="each.name", classes="row"):
        html.Span("{{ each.name }}", classes="grow")
        html.Span("{{ each.rocks.toLocaleString('en') }} rocks, {{ each.kind }}", classes="quiet")
        _remove(html, actions, "sources")
    html.H2("Areas of interest", v_if="areas.length")
    with html.Div(v_for="each in areas", key="each.name", classes="row"):
        html.Span("{{ each.name }}", classes="grow")
        _remove(html, actions, "areas_of_interest")


def _remove(html: Any, actions: Actions, key: str) -> None:
    html.Button("remove", classes="small", disabled=("flying",), click=(actions.remove, f"['{key}', each.name]"))


def _materials(html: Any, actions: Actions) -> None:
    """Add the coefficients of all materials, each in a field."""
    html.H2("Materials")
    html.Div("Type a number, a range such as 0.3 to 0.5 if the value is unknown, or a distribution. An empty field "
             "has the range of the material's library entry, or else the default.", classes="quiet")  # fmt: skip
    # Without v-memo, each change of the page would reset a field while the user types into it. v-memo must be on the
    # outer loop: inside it, Vue keeps one cache for all materials, and shows the rows of one material for another.
    with html.Div(v_for="each in materials", key="each.name", classes="material",
                  raw_attrs=['v-memo="[listed, flying]"']):  # fmt: skip
        html.Div("{{ each.name }}", style="font-weight: 600; margin-top: 6px")
        with html.Div(v_for="value in each.values", key="value.key", classes="row"):
            html.Label("{{ value.key }}", classes="quiet")
            html.Input(type="text", classes="grow", value=("value.text",), disabled=("flying || !!value.fixed",),
                       raw_attrs=[':data-key="each.name + \'.\' + value.key"'],
                       change=(actions.edit, "[each.name, value.key, $event.target.value]"))  # fmt: skip
            html.Div("{{ value.fixed }}", v_if="value.fixed", classes="quiet")
    html.Div("{{ rock }}. To change other values, edit the file.", classes="quiet")


def _files(html: Any, actions: Actions) -> None:
    """Add the fields and buttons to save the scene and to write the report."""
    html.H2("Save the scene")
    _file_row(html, "Save", "save_path", "save_over", actions.save, "flying")
    html.H2("Report")
    html.Div("Run and save the scene before you write its report, in any order.", classes="quiet")
    _file_row(html, "Report", "report_path", "report_over", actions.report, "flying || !has_run")


def _file_row(html: Any, words: str, path: str, over: str, action: Callable[[], None], disabled: str) -> None:
    with html.Div(classes="row"):
        html.Input(type="text", v_model=path, classes="grow", id=path)
        html.Button(words, id=words.lower(), click=action, disabled=(disabled,))
    with html.Div(classes="row quiet"):
        html.Input(type="checkbox", v_model=over, id=over)
        html.Span("replace the file if it exists")


def _start_part(html: Any, actions: Actions) -> None:
    """Add the fields of the page without a scene: open a scene file, or write a scene for a terrain file."""
    html.H2("Open a scene")
    with html.Div(classes="row"):
        html.Input(type="text", v_model="open_path", classes="grow", id="open_path", placeholder="scene.yaml")
        html.Button("Open", id="open", classes="main", click=actions.open)
    html.H2("New scene for a terrain file")
    with html.Div(classes="row"):
        html.Label("terrain file")
        html.Input(type="text", v_model="new_terrain", classes="grow", id="new_terrain", placeholder="pit.dxf")
    with html.Div(classes="row"):
        html.Label("new folder")
        html.Input(type="text", v_model="new_folder", classes="grow", id="new_folder", placeholder="site")
        html.Button("Create", id="create", classes="main", click=actions.create)
    html.Div("Paths are on this machine, relative to the folder in which the desk was started. `rpf3d new` has more "
             "options, such as units and axes.", classes="quiet")  # fmt: skip


def _view(html: Any, window: Any, actions: Actions, drawn: Callable[[float], None]) -> Any:
    """Add the view of the VTK window, in which a click without a drag adds a place to the drawing; return the view.

    drawn : as in `build_page`
    """
    vtk = library_of("desk", "trame.widgets.vtk", NEEDS)
    watch = [
        '@pointerdown.capture="pressed = [$event.clientX, $event.clientY]"',
        '@pointerup.capture="moved = Math.hypot($event.clientX - pressed[0], $event.clientY - pressed[1])"',
    ]
    with html.Div(classes=("'view' + (kind ? ' aiming' : '')",), raw_attrs=watch, id="view"):
        view = vtk.VtkLocalView(
            window.render_window, ref="view", style="position: absolute; inset: 0",
            picking_modes=("kind ? ['click'] : []",), click=(actions.click, "[$event, moved]"),
            view_state_change=(drawn, "[$event.mtime]"),
        )  # fmt: skip
        with html.Div(classes="hint", v_if="kind"):
            html.Span("Click on the terrain to add points: {{ clicks }} so far. Drag to turn the view.")
        with html.Div(classes="legend", v_if="legend.title", id="legend"):
            html.Div("{{ legend.title }} ({{ legend.unit }})")
            html.Div(classes="ramp")
            with html.Div(classes="ends"):
                html.Span("0")
                html.Span("{{ legend.largest }}")
            with html.Div(v_if="legend.few"):
                html.Span(classes="few")
                html.Span("{{ legend.few }}")
            html.Div("{{ legend.caption }}", classes="quiet")
    return view


def _results(html: Any) -> None:
    """Add the part of the page with the results of the rocks flown so far; it is hidden without results."""
    with html.Div(classes="results", id="results", v_if="progress"):
        html.Div("{{ progress }}", id="progress")
        _table(html, "outcomes")
        _table(html, "benches")
        html.Div("{{ note }}", v_for="(note, i) in benches.notes", key="i", classes="quiet")
        html.Div("{{ note }}", v_for="(note, i) in notes", key="'n' + i", classes="message note")


def _table(html: Any, name: str) -> None:
    """Add a table to the page.

    name : id of the table, and name of the page's value with the `header` (texts) and the `rows` (lists of texts)
    """
    with html.Table(id=name):
        with html.Thead(), html.Tr():
            html.Th("{{ cell }}", v_for=f"cell in {name}.header", key="cell")
        with html.Tbody(), html.Tr(v_for=f"(row, i) in {name}.rows", key="i"):
            html.Td("{{ cell }}", v_for="(cell, j) in row", key="j")
