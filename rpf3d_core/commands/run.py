"""`rpf3d run`: fly the rocks of a scene and write the results."""

import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from rpf3d_core.commands.cost import rocks_within
from rpf3d_core.commands.options import EngineOption, RocksOption, SceneFile, number_of_rocks
from rpf3d_core.commands.progress import interruptible, progress
from rpf3d_core.commands.screen import GAP, end_interrupted, print_warnings, rocks_in_words, screen
from rpf3d_core.commands.stopwatch import RunTimes, words_of
from rpf3d_core.errors import InputError
from rpf3d_core.results.painting import painting

if TYPE_CHECKING:
    from rpf3d_core.results.findings import Run
    from rpf3d_core.scene.model import Scene
    from rpf3d_core.setup.choices import Rocks


def run(
    scene: SceneFile,
    out: Annotated[
        Path | None,
        typer.Option(help="Folder to write the results to.", show_default="out/, then the name of the scene file"),
    ] = None,
    rocks: RocksOption = None,
    engine: EngineOption = None,
    seed: Annotated[int | None, typer.Option(help="Seed of all random numbers, instead of the scene's.")] = None,
    accuracy: Annotated[
        float | None, typer.Option(help="Fly as many rocks as keep the error of the map under this; see `rpf3d cost`.")
    ] = None,
) -> None:
    """Fly the rocks of a scene and write their paths, speeds, heights, energies and deposits.

    Ctrl-C or SIGTERM while rocks fly stops the run; the rocks flown so far give a result that is marked as partial.
    """
    times, out = RunTimes(), out or Path("out") / scene.stem
    try:
        chosen, wanted = _chosen(scene, out, rocks, accuracy, times)
        # The second process that draws the pictures starts before this process imports anything large.
        with painting() as pictures, interruptible() as (stop, flying), progress() as (begin, writing):
            from rpf3d_core.runs.fly_scene import RunControl
            from rpf3d_core.runs.run import run_scene

            def start(number: int) -> Callable[[int], None]:
                flying(True)
                return begin(number)

            def write() -> None:
                flying(False)
                writing()

            control = RunControl(progress=start, stop=stop, writing=write, painting=pictures)
            result = run_scene(chosen, out, wanted, engine, seed, control)
    except KeyboardInterrupt:
        end_interrupted("nothing was written")
    _print_run(result, words_of(times.parts(result, pictures.waited_s, time.perf_counter())))
    screen.print(f"results in {out.resolve()}", soft_wrap=True)
    if (flown := result.totals.rocks) < (planned := result.planned):
        end_interrupted(f"{flown:,} of {rocks_in_words(planned)} have flown, and the result says that it is partial")


def _chosen(
    scene: Path, out: Path, rocks: str | None, accuracy: float | None, times: RunTimes
) -> "tuple[Path | Scene, Rocks]":
    """Return the scene to run, or its file, and the number of rocks, from --rocks or --accuracy.

    Raise InputError if both options are given. times : receives the time of the measurements for --accuracy
    """
    if accuracy is None:
        return scene, number_of_rocks(rocks)
    if rocks is not None:
        raise InputError("--rocks and --accuracy both say how many rocks fly; give one of them")
    began = time.perf_counter()
    try:
        return rocks_within(accuracy, scene, out)
    finally:
        times.measured_s = time.perf_counter() - began


def _print_run(result: "Run", times: str) -> None:
    """Print the summary of a run on the screen: results, warnings and wall times; times : from `stopwatch.words_of`."""
    from rpf3d_core.results.notes import warnings_of_run

    totals, flights = result.totals, result.flights
    _print_outcomes(result)
    _print_benches(result)
    _print_maps(result)
    _print_barriers(result)
    _print_open(result)
    print_warnings(warnings_of_run(result))
    rocks = rocks_in_words(totals.rocks - totals.pieces) + (
        f" and {totals.pieces:,} pieces of them" if totals.pieces else ""
    )
    screen.print(f"{rocks}, {totals.impacts:,} impacts, {flights.engine} engine: {times}", soft_wrap=True)
    if result.scene.method.stepping is not None:
        screen.print(f"method {result.scene.method.describe()}; `method: events` is exact", soft_wrap=True)
    if result.faults.closed_seams:
        screen.print(f"closed seams of the terrain: {result.faults.seams_in_words()}", soft_wrap=True)
    _print_convergence(result)


def _print_outcomes(run: "Run") -> None:
    """Print the number of rocks of each outcome, with intervals, and the materials with the default friction angle."""
    from rpf3d_core.results.outcomes import HEADER, outcome_rows
    from rpf3d_core.scene.zone_materials import without_friction, words_on_friction

    table = Table(*HEADER, box=None, padding=GAP, pad_edge=False)
    for row in outcome_rows(run):
        table.add_row(*row)
    screen.print(table)
    if assumed := without_friction(run.scene, run.terrain.zones):
        screen.print(words_on_friction(assumed), highlight=False, soft_wrap=True)


def _print_benches(run: "Run") -> None:
    """Print the bench table: the shares of rocks that reached each zone and area of interest, and stopped there."""
    from rpf3d_core.hazard.benches import left_out, notes_below, text_header, text_rows
    from rpf3d_core.hazard.by_source.each_source import worst_benches

    benches = worst_benches(run.terrain, run.maps)
    table = Table(*text_header(benches), box=None, padding=GAP, pad_edge=False)
    rows = list(text_rows(benches))
    for row in rows:
        table.add_row(*row)
    if table.row_count:
        screen.print(table)
        if more := left_out(benches):
            file = "benches" if run.maps.sources is None else "sources"
            screen.print(f"{more} more in hazard/{file}.csv", style="dim", highlight=False)
        screen.print(";\n".join(notes_below(run.maps, rows)), style="dim", highlight=False)


def _print_maps(run: "Run") -> None:
    """Print the cell size of the hazard maps and their largest values, as one line."""
    from rpf3d_core.results.hazard_files.sentences import words_on_maps

    screen.print(words_on_maps(run.maps), style="dim", highlight=False, soft_wrap=True)


def _print_barriers(run: "Run") -> None:
    """Print the figures of each barrier (rocks caught, broken through, flown over), if the scene has barriers."""
    if not run.maps.barriers:
        return
    from rpf3d_core.results.hazard_files.barriers_text import notes_below, text_header, text_rows

    table = Table(*text_header(run.maps), box=None, padding=GAP, pad_edge=False)
    for row in text_rows(run.maps):
        table.add_row(*row)
    screen.print(table)
    screen.print(";\n".join(notes_below(run.maps)), style="dim", highlight=False)


def _print_open(run: "Run") -> None:
    """Print the reasons why the result of a run may look more certain than it is, one line each."""
    from rpf3d_core.results.overconfidence import surer_than_it_may_be

    if sentences := surer_than_it_may_be(run):
        screen.print("less certain than it looks:", highlight=False)
    for sentence in sentences:
        screen.print(f"- {sentence}", highlight=False, soft_wrap=True)


def _print_convergence(run: "Run") -> None:
    """Print whether `rocks: auto` flew enough rocks for its target; nothing for a fixed number of rocks."""
    from rpf3d_core.hazard.convergence import is_enough, p95_change

    if not run.steps:
        return
    target, change = run.scene.target, p95_change(run.steps)
    enough = is_enough(run.steps, target.half_width, target.p95_energy)
    together = "" if run.maps.sources is None else "; shares are of the rocks of all sources together"
    screen.print(
        f"target {'reached' if enough else 'NOT reached'}: half-width of the sampling intervals of shares "
        f"{run.steps[-1].half_width:.3g} (target {target.half_width:g}), change of p95 energies "
        f"{'not known yet' if change is None else f'{change:.3g}'} (target {target.p95_energy:g})"
        + together
        + ("; more rocks do not narrow what the unknowns leave open" if run.maps.sets else ""),
        soft_wrap=True,
    )
