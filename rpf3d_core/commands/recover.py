"""`rpf3d recover`: repair an incomplete recording, for example after a full disk, so that the viewer can open it."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.screen import screen


def recover(
    recording: Annotated[Path, typer.Argument(help="A .rrd that was cut off, by a kill or by a full disk.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="File to write; default: FILE.recovered.rrd.")
    ] = None,
) -> None:
    """Repair a recording that was cut off; the original file stays unchanged."""
    from rpf3d_core.recordings.content import repair

    repaired = out or recording.with_name(f"{recording.stem}.recovered.rrd")
    content = repair(recording, repaired)
    rows = sum(count for entity, count in content.rows.items() if not entity.startswith("/__"))
    until = f", until {content.until}" if content.until else ""
    screen.print(f"{repaired} verifies: {rows} rows of {len(content.rows)} entities saved{until}", highlight=False)
