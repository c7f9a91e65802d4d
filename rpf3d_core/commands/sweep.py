"""`rpf3d sweep`: fly a scene with each combination of values of some keys, to compare designs."""

from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from rpf3d_core.commands.options import RocksOption, SceneFile, number_of_rocks
from rpf3d_core.commands.progress import progress
from rpf3d_core.commands.screen import end_interrupted, print_table, print_warnings, screen
from rpf3d_core.errors import InputError
from rpf3d_core.jit.cores import usable_cores

if TYPE_CHECKING:
    from rpf3d_core.sweep.sweep import Sweep

MOST_ROWS = 60
"""Largest number of rows of a printed table; sweep.csv has all rows."""

VaryOption = Annotated[
    list[str], typer.Option(help="KEY=V1,V2,... or KEY=FIRST:LAST:NUMBER; give the option once for each key.")
]
WorkersOption = Annotated[int | None, typer.Option(help="Cells that fly at the same time; one for each usable core.")]


def sweep(
    scene: SceneFile,
    vary: VaryOption,
    out: Annotated[Path, typer.Option(help="Folder of the sweep.", show_default=False)],
    rocks: RocksOption = None,
    workers: WorkersOption = None,
) -> None:
    """Fly a scene with each combination of values of some keys, and compare the designs side by side.

    Cells that have flown into the same folder do not fly again; after Ctrl-C, the same command continues the sweep.
    """
    from rpf3d_core.sweep.sweep import sweep as fly
    from rpf3d_core.sweep.varied import check_varied, varied_of

    asked = [varied_of(text) for text in vary]
    check_varied(asked)
    try:
        with progress("flying cells") as (begin, writing), _executor(workers) as executor:
            found = fly(
                scene, {one.key: one.values for one in asked}, out, executor, number_of_rocks(rocks),
                report=_counting(begin, writing),
            )  # fmt: skip
    except KeyboardInterrupt:
        end_interrupted(f"the cells that have flown are in {out}; the same command flies the others")
    _print_sweep(found)
    screen.print(f"results in {out.resolve()}", soft_wrap=True)


@contextmanager
def _executor(workers: int | None) -> Iterator[Executor]:
    """Yield a pool of processes; at the end of the `with` block, cells that have not started are cancelled.

    The pool starts a process only if a cell waits and no process is idle, so there are never more processes than cells.
    Raise an InputError if `workers` is below 1.

    workers : largest number of processes; None for one for each usable core
    """
    if workers is not None and workers < 1:
        raise InputError(f"--workers is {workers}; it must be at least 1")
    pool = ProcessPoolExecutor(workers or usable_cores(), mp_context=get_context("spawn"))
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


def _counting(begin: Callable[[int], Callable[[int], None]], writing: Callable[[], None]) -> Callable[[int, int], None]:
    """Return a function of (done, of) that shows the progress of a sweep in a progress bar.

    done : number of cells that have a result; of : number of all cells. The bar counts only the cells that had no
    result at the start. Without a terminal, for example in a log file, a line is printed for each cell instead.

    begin, writing : functions of the progress bar, from `progress`
    """
    advance: list[Callable[[int], None]] = []

    def report(done: int, of: int) -> None:
        if advance:
            advance[0](1)
            if not screen.is_terminal:
                screen.print(f"{done} of {of} cells have flown", soft_wrap=True)
        elif done < of:
            screen.print(f"{of} cells, of which {done} have flown before", soft_wrap=True)
            advance.append(begin(of - done))
        if done == of:
            writing()

    return report


def _print_sweep(found: "Sweep") -> None:
    """Print the tables of a sweep, notes on their intervals, and the warnings of the runs."""
    from rpf3d_core.sweep.tables import RUN_HEADER, SHARES_HEADER, notes_of, run_rows, share_rows
    from rpf3d_core.sweep.warnings import surer_cells, warnings_of_cells

    keys = tuple(one.key for one in found.varied)
    for header, rows in (
        ((*keys, *SHARES_HEADER), share_rows(found.cells, found.records)),
        ((*keys, *RUN_HEADER), run_rows(found.cells, found.records)),
    ):
        print_table(header, rows[:MOST_ROWS])
        if len(rows) > MOST_ROWS:
            screen.print(f"{len(rows) - MOST_ROWS:,} more rows are in sweep.csv", soft_wrap=True)
    for note in notes_of(found.cells, found.records):
        screen.print(note, soft_wrap=True)
    print_warnings(warnings_of_cells(found.cells, found.records))
    if sentences := surer_cells(found.cells, found.records):
        screen.print("less certain than it looks:", highlight=False)
    for sentence in sentences:
        screen.print(f"- {sentence}", highlight=False, soft_wrap=True)
