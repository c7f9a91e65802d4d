"""`rpf3d replay`: open the recording of a run in the viewer, or serve it to a browser of this machine."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.progress import interruptible
from rpf3d_core.commands.screen import end_interrupted, screen


def replay(
    run: Annotated[
        Path, typer.Argument(help="The folder that `rpf3d run --out` wrote, or a recording (.rrd).", show_default=False)
    ],
    web: Annotated[bool, typer.Option("--web", help="Serve it to a browser on this machine, until Ctrl-C.")] = False,
    port: Annotated[int, typer.Option(help="Port for --web; 0 for any free port.", min=0, max=65535)] = 0,
) -> None:
    """Open the recording of a run in the rerun viewer; only this machine can reach the viewer."""
    from rpf3d_core.recordings.replay import replay as open_viewer

    if web:
        _serve(run, port)
    else:
        open_viewer(run)


def _serve(run: Path, port: int) -> None:
    """Serve a recording with the web viewer until Ctrl-C or SIGTERM."""
    from rpf3d_core.recordings.replay import recording_of
    from rpf3d_core.recordings.viewer_pages import viewer_pages
    from rpf3d_core.recordings.web_replay import WebReplay

    recording = recording_of(run)
    try:
        with interruptible(), WebReplay(recording, viewer_pages(), port) as server:
            screen.print(f"open {server.address}\nonly browsers on this machine reach it; Ctrl-C ends it",
                         highlight=False, soft_wrap=True)  # fmt: skip
            server.serve_forever()
    except KeyboardInterrupt:
        end_interrupted("the recording is no longer served")
