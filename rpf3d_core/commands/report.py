"""`rpf3d report`: write the report of a run as one HTML file and as PDF."""

from pathlib import Path
from typing import Annotated

import typer

from rpf3d_core.commands.screen import screen


def report(
    run: Annotated[Path, typer.Argument(help="The folder of a result.", show_default=False)],
    out: Annotated[Path, typer.Option(help="HTML file to write.", show_default=False)],
    pdf: Annotated[Path | None, typer.Option(help="PDF file to write as well.", show_default=False)] = None,
    site: Annotated[str, typer.Option(help="Name of the site; that of the scene.", show_default=False)] = "",
) -> None:
    """Write a report of a result: warnings, 3D view, map, section, retention, distances, fences, inputs, limits."""
    from rpf3d_core.report.report import write_report

    with screen.status("writing the report"):
        write_report(run, out, pdf, site)
    for path in filter(None, (out, pdf)):
        screen.print(f"report in {path.resolve()}", soft_wrap=True)
