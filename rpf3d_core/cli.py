"""The command line: `rpf3d run | check | pit | replay | compare | study`.

Bad input ends with one sentence on standard error and exit code 2, without a traceback; Ctrl-C with 130.
"""

import importlib.metadata
import json
import signal
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.table import Table
from rich.text import Text

from rpf3d_core.errors import InputError
from rpf3d_core.values import OUTCOME_SENTENCES, Outcome

if TYPE_CHECKING:  # the commands import what they need: `rpf3d --help` loads neither VTK nor numba
    from rpf3d_core.check import Check, Cost
    from rpf3d_core.choices import Rocks
    from rpf3d_core.io.scene_model import Scene
    from rpf3d_core.run import Run

app = typer.Typer(
    help="Rockfall trajectories over open-pit terrain.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
screen = Console(markup=False)  # names of zones, sources and folders may hold square brackets
complaints = Console(stderr=True, soft_wrap=True, highlight=False)

GAP = (0, 2, 0, 0)
"""Two blanks to the right of each column of a table."""
INTERRUPTED = 130
"""Exit code after Ctrl-C, as shells have it: 128 and the number of SIGINT."""

PIPE_WIDTH = 240
"""Columns of a table that goes to a file or another program."""

SceneFile = Annotated[Path, typer.Argument(help="A scene file (YAML).", show_default=False)]
RocksOption = Annotated[str | None, typer.Option(help="Rocks in total, or auto, instead of the scene's.")]
TargetOption = Annotated[float, typer.Option(help="What the total error (-) is to keep to, between 0 and 1.")]
EngineOption = Annotated[str | None, typer.Option(help="reference, compiled or auto, instead of the scene's.")]


def main() -> None:
    """Entry point of the `rpf3d` command."""
    try:
        app(standalone_mode=True)
    except InputError as fault:
        complaints.print(f"rpf3d: {fault}", style="bold red", markup=False)
        sys.exit(2)
    except SystemExit as end:
        # Typer turns Ctrl-C into a plain one: a command that has not said what it leaves behind.
        if end.code == INTERRUPTED and not isinstance(end, Interrupted):
            complaints.print("rpf3d: interrupted", markup=False)
        raise


class Interrupted(SystemExit):
    """The end of a command that was interrupted and has said what it leaves behind."""


def _end_interrupted(left: str) -> NoReturn:
    """Say what an interrupted command leaves behind, and end."""
    complaints.print(f"rpf3d: interrupted; {left}", markup=False)
    raise Interrupted(INTERRUPTED)


def _say_version(wanted: bool) -> None:
    """Print the version and end, where it is asked for."""
    if wanted:
        try:
            screen.print(f"rpf3d {importlib.metadata.version('rpf3d')}", highlight=False)
        except importlib.metadata.PackageNotFoundError:
            raise InputError("the version is not known, for rpf3d is not installed") from None
        raise typer.Exit


@app.callback()
def options(
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_say_version, is_eager=True)
    ] = False,
) -> None:
    """Rockfall trajectories over open-pit terrain."""


@app.command()
def run(
    scene: SceneFile,
    out: Annotated[Path, typer.Option(help="Folder to write the results to.", show_default=False)],
    rocks: RocksOption = None,
    engine: EngineOption = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers, instead of the scene's.")] = None,
    accuracy: Annotated[
        float | None, typer.Option(help="Fly as many rocks as keep the error of the map under this; see `rpf3d cost`.")
    ] = None,
) -> None:
    """Fly the rocks of a scene and write where they went, how fast, how high and how hard.

    Ctrl-C, or SIGTERM, while rocks fly ends with a result of what has flown, marked as partial.
    """
    from rpf3d_core.io.hazard_zones import zones_without_cells
    from rpf3d_core.io.scene_warnings import warnings_of
    from rpf3d_core.run import run_scene

    began: list[float] = []
    try:
        chosen, wanted = (scene, _number_of_rocks(rocks)) if accuracy is None else _within(accuracy, scene, out, rocks)
        with _interruptible() as (stop, flying), _progress() as (begin, writing):

            def start(number: int) -> Callable[[int], None]:
                flying(True)
                return begin(number)

            def write() -> None:
                flying(False)
                began.append(time.perf_counter())
                writing()

            result = run_scene(chosen, out, wanted, engine, seed, start, stop, write)
    except KeyboardInterrupt:
        _end_interrupted("nothing was written")
    _print_outcomes(result)
    _print_benches(result)
    _print_barriers(result)
    _print_warnings([*warnings_of(result.scene), *zones_without_cells(result.maps, result.scene.hazard)])
    flights = result.flights
    screen.print(
        f"{_rocks(result.totals.rocks)}, {result.totals.impacts:,} impacts, {flights.engine} engine: "
        f"read {result.read_s:.1f} s, index {result.index_s:.1f} s, compile {flights.compile_s:.1f} s, "
        f"fly {flights.fly_s:.2f} s, write {time.perf_counter() - began[0]:.1f} s",
        soft_wrap=True,
    )
    if result.scene.method.stepping is not None:
        screen.print(f"method {result.scene.method.describe()}; `method: events` is exact", soft_wrap=True)
    _print_convergence(result)
    screen.print(f"results in {out.resolve()}", soft_wrap=True)
    if result.totals.rocks < result.planned:
        _end_interrupted(
            f"{result.totals.rocks:,} of {_rocks(result.planned)} have flown, and the result says that it is partial"
        )


@app.command()
def check(scene: SceneFile, rocks: RocksOption = None, engine: EngineOption = None) -> None:
    """Report the faults of a scene's terrain, where its sources are, and what running it will cost and take."""
    from rpf3d_core.check import check_scene
    from rpf3d_core.choices import chosen_scene

    report = check_scene(chosen_scene(scene, _number_of_rocks(rocks), engine, None))
    _print_check(report)
    _print_warnings(report.warnings)
    if report.cost and report.cost.unresolved:
        screen.print(
            f"{report.cost.unresolved} of {report.cost.pilot} pilot rocks ended unresolved_contact: "
            "name `ground: sliding`, or raise stop_speed",
            soft_wrap=True,
        )
    if not report.fit:
        raise InputError(f"{scene}: some rocks do not start above the ground; see the sources above")


@app.command()
def cost(
    scene: SceneFile,
    out: Annotated[Path, typer.Option(help="Folder to write the price list to.", show_default=False)],
    target: TargetOption = 0.05,
) -> None:
    """Measure what accuracy costs on a scene: errors of fixed steps, of the terrain and of the number of rocks."""
    from rpf3d_core.accuracy.command import measured
    from rpf3d_core.accuracy.tables import NOTE, findings, tables

    try:
        with screen.status("measuring") as status:
            prices = measured(scene, out, target, status.update)
    except KeyboardInterrupt:
        _end_interrupted("nothing was written")
    for header, rows in tables(prices):
        _print_table(header, rows)
    screen.print(NOTE, style="dim", highlight=False)
    for line in findings(prices, target):
        screen.print(line, soft_wrap=True)
    screen.print(f"price list in {out.resolve()}", soft_wrap=True)


def _within(accuracy: float, scene: Path, out: Path, rocks: str | None) -> tuple["Scene", int]:
    """The scene by events, and the number of rocks that an accuracy takes; tells what else there is to choose."""
    from rpf3d_core.accuracy.choice import exact_run
    from rpf3d_core.accuracy.command import kept_or_measured
    from rpf3d_core.accuracy.tables import findings

    if rocks is not None:
        raise InputError("--rocks and --accuracy both say how many rocks fly; give one of them")
    with screen.status("measuring") as status:
        prices = kept_or_measured(scene, out, accuracy, status.update)
    for line in findings(prices, accuracy):
        screen.print(line, soft_wrap=True)
    return exact_run(scene, prices, accuracy)


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


def _number_of_rocks(text: str | None) -> "Rocks":
    """What --rocks says."""
    if text is None:
        return None
    if text == "auto":
        return "auto"
    try:
        return int(text)
    except ValueError:
        raise InputError(f"--rocks is {text!r}; it must be a whole number of at least 1, or auto") from None


@contextmanager
def _progress() -> Iterator[tuple[Callable[[int], Callable[[int], None]], Callable[[], None]]]:
    """A progress bar: a function that begins with a number of rocks, and one that says that results are written.

    The first returns a function to be told how many were flown since; each further call of it adds rocks.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn())
    with Progress(*columns, console=screen, transient=True, disable=not screen.is_terminal) as bar:
        task = bar.add_task("preparing: terrain, index, compiled code", total=None)
        total = 0

        def begin(rocks: int) -> Callable[[int], None]:
            nonlocal total, task
            if not total:
                bar.remove_task(task)
                task = bar.add_task("flying rocks", total=rocks)
            total += rocks
            bar.update(task, total=total)
            return lambda done: bar.advance(task, done)

        def writing() -> None:
            bar.remove_task(task)
            bar.add_task("writing results", total=None)

        yield begin, writing


class _Rate(ProgressColumn):
    """Rocks a second."""

    def render(self, task: Task) -> Text:
        """The rate of the last seconds, nothing before there is one."""
        return Text(f"{task.speed:,.0f} rocks/s" if task.speed and task.total else "")


@contextmanager
def _interruptible() -> Iterator[tuple[Callable[[], bool], Callable[[bool], None]]]:
    """Whether Ctrl-C or SIGTERM came while rocks flew, and a function to be told when they begin and end to fly.

    At any other time, and the second time, either ends the program at once.
    """
    flying, asked = False, False

    def on_signal(number: int, _: object) -> None:
        nonlocal asked
        if not flying or asked:
            raise KeyboardInterrupt
        asked = True

    def told(now: bool) -> None:
        nonlocal flying
        flying = now

    handled = [number for number in (signal.SIGINT, signal.SIGTERM) if signal.getsignal(number) != signal.SIG_IGN]
    before = {number: signal.signal(number, on_signal) for number in handled}
    try:
        yield lambda: asked, told
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _print_check(report: "Check") -> None:
    """What was found out about a scene, a line each."""
    named = report.scene
    lines = [line.split("  ", 1) for line in report.faults.describe()]
    lines += [[f"source {source.name}", source.describe()] for source in report.sources]
    lines += [["rocks", report.rocks.describe()]]
    lines += [["effects", ", ".join(named.effects.named) or "none named"]]
    models = f"rebound {named.rebound.name}, ground {named.ground.name}, stop_speed {named.stop_speed:g} m/s"
    lines += [["models", f"{models}, method {named.method.describe()}"]]
    lines += [["hazard maps", report.maps.describe()]]
    if report.cost:
        lines += [["cost", _describe_cost(report.cost)]]
    table = Table.grid(padding=(0, 2))
    for name, text in lines:
        table.add_row(name, text.strip())
    screen.print(table)


def _print_warnings(sentences: Iterable[str]) -> None:
    """What a user should know and has not asked for, a line each."""
    for sentence in sentences:
        complaints.print(f"rpf3d: note: {sentence}", markup=False)


def _print_outcomes(run: "Run") -> None:
    """A table of outcomes, each with its sentence."""
    table = Table("outcome", "rocks", "share", "meaning", box=None, padding=GAP, pad_edge=False)
    for outcome in Outcome:
        if rocks := run.totals.outcomes[outcome]:
            share = f"{100 * rocks / run.totals.rocks:.1f} %"
            table.add_row(outcome.name.lower(), f"{rocks:,}", share, OUTCOME_SENTENCES[outcome])
    screen.print(table)


def _print_benches(run: "Run") -> None:
    """The bench table: of each zone and area of interest, how many rocks reached it and how many it held."""
    from rpf3d_core.hazard.benches import TEXT_HEADER, TEXT_NOTE, bench_table, left_out, text_rows

    benches = bench_table(run.terrain, run.maps)
    table = Table(*TEXT_HEADER, box=None, padding=GAP, pad_edge=False)
    for row in text_rows(benches):
        table.add_row(*row)
    if table.row_count:
        screen.print(table)
        if more := left_out(benches):
            screen.print(f"{more} more in hazard/benches.csv", style="dim", highlight=False)
        screen.print(TEXT_NOTE, style="dim", highlight=False)


def _print_barriers(run: "Run") -> None:
    """What rocks did at each barrier, where the scene names some."""
    if not run.maps.barriers:
        return
    from rpf3d_core.io.hazard_barriers import TEXT_HEADER, TEXT_NOTE, text_rows

    table = Table(*TEXT_HEADER, box=None, padding=GAP, pad_edge=False)
    for row in text_rows(run.maps.barriers):
        table.add_row(*row)
    screen.print(table)
    screen.print(TEXT_NOTE, style="dim", highlight=False)


def _print_convergence(run: "Run") -> None:
    """Where the number of rocks was left open: what was reached."""
    from rpf3d_core.hazard.convergence import is_enough, p95_change

    if not run.steps:
        return
    target, change = run.scene.target, p95_change(run.steps)
    enough = is_enough(run.steps, target.half_width, target.p95_energy)
    screen.print(
        f"target {'reached' if enough else 'NOT reached'}: half-width of shares {run.steps[-1].half_width:.3g} "
        f"(target {target.half_width:g}), change of p95 energies "
        f"{'not known yet' if change is None else f'{change:.3g}'} (target {target.p95_energy:g})",
        soft_wrap=True,
    )


def _describe_cost(cost: "Cost") -> str:
    """What a run will take, in one line."""
    seconds = "less than 0.1 s" if cost.fly_s < 0.1 else f"about {float(f'{cost.fly_s:.2g}'):,.12g} s"
    fly = f"{seconds} to fly {'at most ' if cost.auto else ''}{_rocks(cost.rocks)} with the {cost.engine} engine"
    compiling = f", and up to {cost.compile_s:.0f} s to compile, the first time" if cost.compile_s else ""
    return f"{fly}{compiling} (from a pilot of {_rocks(cost.pilot)}: {cost.impacts:.1f} impacts each)"


def _rocks(number: int) -> str:
    """So many rocks, or one."""
    return f"{number:,} {'rock' if number == 1 else 'rocks'}"


@app.command()
def compare(
    run_a: Annotated[Path, typer.Argument(help="The folder of a result, A.", show_default=False)],
    run_b: Annotated[Path, typer.Argument(help="The folder of another, B.", show_default=False)],
    as_json: Annotated[bool, typer.Option("--json", help="Print JSON instead of tables.")] = False,
) -> None:
    """Compare two results: shares of each zone and area side by side, and which differences are significant."""
    from rpf3d_core.compare import compare_runs, comparison_section
    from rpf3d_core.compare_tables import ENERGIES_HEADER, SHARES_HEADER, energy_rows, lines_of, share_rows

    comparison = compare_runs(run_a, run_b)
    if as_json:
        print(json.dumps(comparison_section(comparison), indent=2, allow_nan=False))
        return
    for line in lines_of(comparison):
        screen.print(line, soft_wrap=True)
    for header, rows in ((SHARES_HEADER, share_rows(comparison)), (ENERGIES_HEADER, energy_rows(comparison))):
        _print_table(header, rows)


@app.command()
def study(
    name: Annotated[str, typer.Argument(help="resolution or localised.", show_default=False)],
    out: Annotated[Path, typer.Option(help="Folder to write the runs and the comparison to.", show_default=False)],
    rocks: Annotated[int | None, typer.Option(help="Rocks of each run, instead of the scenes' 100,000.")] = None,
) -> None:
    """Make one of the thesis' studies: resolution of the terrain, or localised coefficients of restitution."""
    from rpf3d_core.run import run_scene
    from rpf3d_core.thesis import runs_of, study_named
    from rpf3d_core.thesis_report import finding_header, finding_rows, report_of, verdict_of, write_report

    chosen = study_named(name)
    runs = runs_of(chosen, out)
    for done, (scene, folder) in enumerate(runs):
        try:
            with _progress() as (begin, writing):
                result = run_scene(scene, folder, rocks, progress=begin, writing=writing)
        except KeyboardInterrupt:
            _end_interrupted(f"{done} of {len(runs)} runs are whole, and there is no comparison")
        screen.print(f"{scene.stem}: {_rocks(result.totals.rocks)} in {folder.resolve()}", soft_wrap=True)
    report = report_of(chosen, [folder for _, folder in runs])
    write_report(report, out)
    screen.print(chosen.title, soft_wrap=True)
    _print_table(finding_header(report), finding_rows(report))
    screen.print(verdict_of(report), soft_wrap=True)
    screen.print(f"comparison in {(out / 'comparison.md').resolve()}", soft_wrap=True)


def _print_table(header: Sequence[str], rows: Iterable[tuple[str, ...]]) -> None:
    """A table without lines."""
    table = Table(*header, box=None, padding=(0, 2, 0, 0))
    for row in rows:
        table.add_row(*row)
    # A pipe has no width; tables that are read on there are not folded.
    (screen if screen.is_terminal else Console(markup=False, width=PIPE_WIDTH)).print(table)


if __name__ == "__main__":
    main()
