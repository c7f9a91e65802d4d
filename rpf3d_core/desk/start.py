"""Start the desk: check its libraries, serve it until Ctrl-C, and delete its temporary files."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

from rpf3d_core.desk.server import new_gate, open_browser, opening_page, serve
from rpf3d_core.formats.extras import library_of

LIBRARIES = ("trame.app", "trame.widgets.vtk", "aiohttp.web", "ruamel.yaml")
"""Modules of the libraries that the optional dependency `desk` of rpf3d installs."""


def run_desk(scene: Path | None, port: int, browser: bool, say: Callable[[str], None]) -> None:
    """Serve the desk until it is interrupted.

    scene : file to open, or None; port : 0 for any free port; browser : True to open the user's browser
    say : function that prints a text for the user

    Raises
    ------
    InputError
        The optional dependency `desk` is not installed, the scene is refused, or the port cannot be used.
    """
    for module in LIBRARIES:
        library_of("desk", module, "the desk needs")
    from rpf3d_core.desk.app import Desk  # this module needs the libraries

    gate = new_gate(port)
    desk = Desk()
    try:
        if scene is not None:
            desk.open(scene)

        def ready() -> None:
            desk.connected()
            say(f"desk on {gate.address}\nonly browsers on this machine reach it; Ctrl-C ends it")
            if page is not None:
                open_browser(page)

        with opening_page(gate.address) if browser else nullcontext() as page:
            serve(desk.server, gate, ready)
    finally:
        desk.close()
