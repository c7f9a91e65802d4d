"""The command line: `rpf3d run | check | pit | replay`.

Bad input ends with one sentence on standard error and exit code 2, without a traceback; Ctrl-C with 130.
"""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from rpf3d_core.errors import InputError
from rpf3d_core.values import DEPOSITED, OUTCOME_SENTENCES, Outcome

if TYPE_CHECKING:  # the commands import what they need: `rpf3d --help` loads neither VTK nor numba
    from rpf3d_core.check import Cost
    from rpf3d_core.run import Run

app = typer.Typer(
    help="Rockfall trajectories over open-pit terrain.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
screen = Console(markup=False)  # names of zones, sources and folders may hold square brackets
complaints = Console(stderr=True, soft_wrap=True, highlight=False)

INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 and the number of SIGINT."""

ZONES_SHOWN = 8
"""The zones that hold most rocks, in the table on the screen; summary.json has all."""

SceneFile = Annotated[Path, typer.Argument(help="A scene file (YAML).", show_default=False)]


def main() -> None:
    """Entry point of the `rpf3d` command."""
    try:
        app(standalone_mode=True)
    except InputError as fault:
        complaints.print(f"rpf3d: {fault}", style="bold red", markup=False)
        sys.exit(2)
    except SystemExit as end:
        if end.code == INTERRUPTED:  # typer turns Ctrl-C into this
            complaints.print("rpf3d: interrupted; nothing was written", markup=False)
        raise


@app.command()
def run(
    scene: SceneFile,
    out: Annotated[Path, typer.Option(help="Folder to write the results to.", show_default=False)],
    rocks: Annotated[int | None, typer.Option(help="Rocks in total, instead of the scene's.")] = None,
    engine: Annotated[str | None, typer.Option(help="reference, compiled or auto, instead of the scene's.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers, instead of the scene's.")] = None,
) -> None:
    """Fly the rocks of a scene and write where they went, how fast, how high and how hard."""
    from rpf3d_core.io.results import check_folder
    from rpf3d_core.run import simulate, write_run

    check_folder(out)  # before minutes of work, not after
    with _progress() as begin:
        result = simulate(scene, rocks, engine, seed, begin)
    written = time.perf_counter()
    with screen.status("writing results"):
        folder = write_run(result, out)
    flights = result.flights
    _print_outcomes(result)
    screen.print(
        f"{_rocks(len(flights.deposits.t))}, {len(flights.impacts.t):,} impacts, {flights.engine} engine: "
        f"read {result.read_s:.1f} s, index {result.index_s:.1f} s, compile {flights.compile_s:.1f} s, "
        f"fly {flights.fly_s:.2f} s, write {time.perf_counter() - written:.1f} s",
        soft_wrap=True,
    )
    screen.print(f"results in {folder}", soft_wrap=True)


@app.command()
def check(scene: SceneFile) -> None:
    """Report the faults of a scene's terrain, where its sources are, and what running it will cost."""
    from rpf3d_core.check import check_scene
    from rpf3d_core.io.scene import read_scene

    report = check_scene(read_scene(scene))
    lines = [line.split("  ", 1) for line in report.faults.describe()]
    lines += [[f"source {source.name}", source.describe()] for source in report.sources]
    named = report.scene
    lines += [["effects", ", ".join(named.effects) or "none named"]]
    lines += [["models", f"rebound {named.rebound}, ground {named.ground}, stop_speed {named.stop_speed:g} m/s"]]
    if report.cost:
        lines += [["cost", _describe_cost(report.cost)]]
    table = Table.grid(padding=(0, 2))
    for name, text in lines:
        table.add_row(name, text.strip())
    screen.print(table)
    if report.cost and report.cost.unresolved:
        screen.print(
            f"{report.cost.unresolved} of {report.cost.pilot} pilot rocks ended unresolved_contact: "
            "name `ground: sliding`, or raise stop_speed",
            soft_wrap=True,
        )
    if not report.fit:
        raise InputError(f"{scene}: some rocks do not start above the ground; see the sources above")


@app.command()
def pit(
    out: Annotated[Path, typer.Argument(help="File to write: .vtp (keeps the zones), .stl, .ply or .obj.")],
    triangles: Annotated[int, typer.Option(help="How many triangles, within 3 %.")] = 150_000,
    seed: Annotated[int, typer.Option(help="Seed of roughness, spills and relief.")] = 1,
) -> None:
    """Write a synthetic open pit after the thesis' Arturo mine."""
    from rpf3d_core.io.mesh_writer import check_mesh_path, write_mesh
    from rpf3d_core.terrain.pit import Pit, pit_terrain

    check_mesh_path(out)  # before the digging, not after
    terrain = pit_terrain(Pit(triangles=triangles, seed=seed))
    write_mesh(out, terrain)
    screen.print(f"{len(terrain.triangles):,} triangles in {out}", soft_wrap=True)


@app.command()
def replay(
    folder: Annotated[Path, typer.Argument(help="The folder that `rpf3d run --out` wrote.", show_default=False)],
) -> None:
    """Open a run's recording in the rerun viewer."""
    from rpf3d_core.recordings.replay import replay as open_viewer

    open_viewer(folder)


@contextmanager
def _progress() -> Iterator[Callable[[int], Callable[[int], None]]]:
    """A progress bar that begins with the number of rocks, and is told how many were flown since."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal) as bar:
        reading = bar.add_task("preparing: terrain, index, compiling on the first run", total=None)

        def begin(rocks: int) -> Callable[[int], None]:
            bar.remove_task(reading)
            task = bar.add_task("flying rocks", total=rocks)
            return lambda done: bar.advance(task, done)

        yield begin


def _print_outcomes(run: "Run") -> None:
    """A table of outcomes, each with its sentence, and of the zones where most rocks lie."""
    deposits, zones = run.flights.deposits, run.terrain.zones
    table = Table("outcome", "rocks", "share", "meaning", box=None, padding=(0, 2))
    for outcome in Outcome:
        rocks = int((deposits.outcome == outcome).sum())
        if rocks:
            share = f"{100 * rocks / len(deposits.t):.1f} %"
            table.add_row(outcome.name.lower(), f"{rocks:,}", share, OUTCOME_SENTENCES[outcome])
    screen.print(table)
    lying = np.isin(deposits.outcome, DEPOSITED) & (deposits.facet >= 0)
    counts = np.bincount(run.terrain.zone[deposits.facet[lying]], minlength=len(zones))
    order = [i for i in np.argsort(-counts, kind="stable")[:ZONES_SHOWN] if counts[i]]
    if order:
        shares = ", ".join(f"{zones[i]} {100 * counts[i] / len(deposits.t):.1f} %" for i in order)
        screen.print(f"rocks came to rest in: {shares}", soft_wrap=True)


def _describe_cost(cost: "Cost") -> str:
    """What a run will take, in one line."""
    seconds = "less than 0.1 s" if cost.fly_s < 0.1 else f"about {cost.fly_s:.2g} s"
    fly = f"{seconds} to fly {_rocks(cost.rocks)} with the {cost.engine} engine"
    compiling = f", and up to {cost.compile_s:.0f} s to compile on the first run" if cost.compile_s else ""
    return f"{fly}{compiling} (from a pilot of {_rocks(cost.pilot)}: {cost.impacts:.1f} impacts each)"


def _rocks(number: int) -> str:
    """So many rocks, or one."""
    return f"{number:,} {'rock' if number == 1 else 'rocks'}"


if __name__ == "__main__":
    main()
