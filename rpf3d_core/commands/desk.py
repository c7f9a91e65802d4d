"""`rpf3d desk`: edit a scene in a browser on this machine, fly its rocks and write a report."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.progress import interruptible
from rpf3d_core.commands.screen import end_interrupted, screen


def desk(
    scene: Annotated[Path | None, typer.Argument(help="A scene file (YAML).", show_default=False)] = None,
    port: Annotated[int, typer.Option(help="Port on 127.0.0.1; 0 for any free port.", min=0, max=65535)] = 0,
    browser: Annotated[bool, typer.Option("--open/--no-open", help="Open the address in the browser.")] = True,
) -> None:
    """Open a scene in the browser: place sources, edit materials, fly rocks, read the results, write a report."""
    from rpf3d_core.desk.start import run_desk

    try:
        with interruptible():
            run_desk(scene, port, browser, lambda text: screen.print(text, highlight=False, soft_wrap=True))
    except KeyboardInterrupt:
        pass
    end_interrupted("the desk is closed")
