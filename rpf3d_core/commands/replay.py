"""`rpf3d replay`: open the recording of a run in the viewer."""

from pathlib import Path
from typing import Annotated

import typer


def replay(
    folder: Annotated[Path, typer.Argument(help="The folder that `rpf3d run --out` wrote.", show_default=False)],
) -> None:
    """Open a run's recording in the rerun viewer."""
    from rpf3d_core.recordings.replay import replay as open_viewer

    open_viewer(folder)
