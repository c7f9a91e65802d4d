"""The command `rpf3d`, with its subcommands `run`, `check`, `cost` and the others that `rpf3d --help` lists.

Bad input ends with one sentence on standard error and exit code 2, without a traceback. Ctrl-C ends with exit code 130.
Each command imports its modules when it runs, so `rpf3d --help` loads neither VTK nor numba.
"""

import importlib.metadata
import sys
from typing import Annotated

import typer

from rpf3d_core.commands.audit import audit
from rpf3d_core.commands.calibrate import calibrate
from rpf3d_core.commands.check import check
from rpf3d_core.commands.compare import compare
from rpf3d_core.commands.cost import cost
from rpf3d_core.commands.desk import desk
from rpf3d_core.commands.effects import effects
from rpf3d_core.commands.imports import app as imports
from rpf3d_core.commands.materials import materials
from rpf3d_core.commands.new import new
from rpf3d_core.commands.pit import pit
from rpf3d_core.commands.recover import recover
from rpf3d_core.commands.replay import replay
from rpf3d_core.commands.report import ReportCommand, report
from rpf3d_core.commands.run import run
from rpf3d_core.commands.schema import schema
from rpf3d_core.commands.screen import INTERRUPTED, CommandInterrupted, complaints, screen
from rpf3d_core.commands.sensitivity import sensitivity
from rpf3d_core.commands.study import study
from rpf3d_core.commands.sweep import sweep
from rpf3d_core.errors import InputError
from rpf3d_core.jit.garbage import collect_less_often

COMMANDS = (
    new, desk, run, check, sweep, calibrate, sensitivity, cost, effects, materials, pit, schema, report, replay,
    compare, study, audit, recover,
)  # fmt: skip
"""The commands in the order of `rpf3d --help`."""
FURTHER = "rpf3d.commands"
"""Name of the group of entry points through which other packages, such as `rpf3d_ros`, add subcommands."""

app = typer.Typer(
    help="Rockfall trajectories over open-pit terrain.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
for command in COMMANDS:
    app.command(cls=ReportCommand if command is report else None)(command)
for entry in importlib.metadata.entry_points(group=FURTHER):
    app.command(entry.name)(entry.load())
app.add_typer(imports, name="import")


def main() -> None:
    """Run the command `rpf3d` with the arguments that the user typed."""
    collect_less_often()
    try:
        app(standalone_mode=True)
    except InputError as fault:
        complaints.print(f"rpf3d: {fault}", style="bold red", markup=False)
        sys.exit(2)
    except SystemExit as end:
        # Typer turns Ctrl-C into a plain SystemExit, unless the command has already reported which files it leaves.
        if end.code == INTERRUPTED and not isinstance(end, CommandInterrupted):
            complaints.print("rpf3d: interrupted", markup=False)
        raise


def _say_version(wanted: bool) -> None:
    """Print the version and exit if the user gave `--version` (`wanted` is true).

    Raises InputError if rpf3d is not installed, so that its version is unknown.
    """
    if wanted:
        try:
            screen.print(f"rpf3d {importlib.metadata.version('rpf3d')}", highlight=False)
        except importlib.metadata.PackageNotFoundError:
            raise InputError("the version is unknown, because rpf3d is not installed") from None
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_say_version, is_eager=True)
    ] = False,
) -> None:
    """Rockfall trajectories over open-pit terrain."""


if __name__ == "__main__":
    main()
