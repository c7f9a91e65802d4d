"""`rpf3d report`: write the report of a run as one HTML file and as PDF."""

from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperCommand

from rpf3d_core.commands.screen import screen


def report(
    run: Annotated[Path, typer.Argument(help="The folder of a result.", show_default=False)],
    out: Annotated[Path, typer.Option(help="HTML file to write.", show_default=False)],
    pdf: Annotated[
        Path | None,
        typer.Option(help="Write a PDF file as well; without a path, next to the HTML file.", show_default=False),
    ] = None,
    site: Annotated[str, typer.Option(help="Name of the site; default: that of the scene.", show_default=False)] = "",
) -> None:
    """Write the report of a result: warnings, 3D view, map, section, retention, distances, fences, inputs, limits."""
    from rpf3d_core.report.report import write_report

    with screen.status("writing the report"):
        write_report(run, out, pdf, site)
    for path in filter(None, (out, pdf)):
        screen.print(f"report in {path.resolve()}", soft_wrap=True)


class ReportCommand(TyperCommand):
    """The command `rpf3d report`, whose option `--pdf` may be given without a path, which typer does not support."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments of the command, after `--pdf` without a path has received the path of the HTML file.

        The path has the suffix `.pdf`. At the end, and before another option, `--pdf` has no path.
        """
        return super().parse_args(ctx, _with_path_of_pdf(args))


def _with_path_of_pdf(args: list[str]) -> list[str]:
    """Return the arguments of `rpf3d report`, with a path after `--pdf` if there is none and `--out` names a file."""
    out = [value for option, value in pairwise(args) if option == "--out"]
    out += [each.removeprefix("--out=") for each in args if each.startswith("--out=")]
    following = [*args[1:], "-"]
    if not out or not any(arg == "--pdf" and after.startswith("-") for arg, after in zip(args, following, strict=True)):
        return args
    at = args.index("--pdf")
    return [*args[: at + 1], str(Path(out[-1]).with_suffix(".pdf")), *args[at + 1 :]]
