"""Simulate the cells of a sweep on an executor, and store their results, so that no cell is simulated twice.

The record of a cell is next to its result folder. It contains the digest of the cell's scene and files, and the
versions of the packages that affect a result. A cell with a result and a record of the same digest and versions is not
simulated again: an interrupted sweep continues, and a sweep with more values simulates the new cells only.
"""

import json
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.results.folder import SUMMARY, check_folder
from rpf3d_core.results.notes import warnings_of_run
from rpf3d_core.results.overconfidence import surer_than_it_may_be
from rpf3d_core.results.summary import plain, versions
from rpf3d_core.runs.fly_scene import RunControl
from rpf3d_core.runs.parallel import as_they_finish, check_files
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import scene_digest
from rpf3d_core.sweep.cells import Cell
from rpf3d_core.sweep.figures import Figure, figures_of

CELLS = "cells"
"""Name of the folder of all cells in the folder of a sweep."""


class CellRecord(NamedTuple):
    """The results of the run of one cell of a sweep.

    digest : of scene and files; versions : of the packages that affect a result; rocks : number of rocks that flew
    sets : number of parameter sets that flew, None without unknowns
    warnings : warnings of `rpf3d run`; surer : reasons why the results look more certain than they are
    """

    digest: str
    versions: Mapping[str, str | None]
    rocks: int
    sets: int | None
    warnings: tuple[str, ...]
    surer: tuple[str, ...]
    figures: tuple[Figure, ...]


def fly_cells(
    cells: Sequence[Cell], folder: Path, executor: Executor, threads: int | None, flown: Callable[[], None]
) -> list[CellRecord]:
    """Fly the cells that have no record in a folder, each on a free worker, and return the records of all cells.

    folder : of all cells; executor : provides the workers
    threads : number of threads of each run, for the compiled engine; None for one per core
    flown : called after each cell that has flown

    Raises
    ------
    InputError
        The result folder of a cell contains other files. Or the run of a cell is refused; the message has the values of
        the cell. Or a worker was killed; the message has the values of a cell that has not flown. Cells that have not
        begun are cancelled.
    """
    records = {cell.digest: record_of(cell, folder) for cell in cells}
    missing = [cell for cell in cells if records[cell.digest] is None]
    for cell in missing:
        check_folder(folder / cell.name)
    try:
        for cell, found in _flown(missing, folder, executor, threads):
            records[cell.digest] = found
            flown()
    except BrokenExecutor as fault:
        flying = next((cell for cell in missing if record_of(cell, folder) is None), missing[-1])
        raise InputError(
            f"cell {flying.describe()}: a process ended while this cell and others flew, as when memory runs out; "
            "cells that have flown are kept; fly fewer cells at the same time, such as with --workers 1"
        ) from fault
    return [record for cell in cells if (record := records[cell.digest]) is not None]


def _flown(
    cells: Sequence[Cell], folder: Path, executor: Executor, threads: int | None
) -> Iterator[tuple[Cell, CellRecord]]:
    """Yield each cell with its record when the cell has flown.

    Raises InputError, with the values of the cell, if the run of a cell is refused; BrokenExecutor if a worker was
    killed.
    """
    flying = {
        executor.submit(fly_cell, cell.scene, cell.digest, folder / cell.name, threads): number
        for number, cell in enumerate(cells)
    }
    with as_they_finish(flying) as finished:
        for future, number in finished:
            try:
                yield cells[number], future.result()
            except InputError as fault:
                raise InputError(f"cell {cells[number].describe()}: {fault}") from fault


def fly_cell(scene: Scene, digest: str, folder: Path, threads: int | None) -> CellRecord:
    """Fly one cell in this process, write its result folder and its record, and return the record.

    scene, digest : of the cell; folder : for its result; threads : as in `fly_cells`

    Raises
    ------
    InputError
        As `run_scene`; or before or after the run, the files of the scene do not have the given digest. Then no record
        is written.
    """
    check_files(scene, [digest])
    run = run_scene(scene, folder, control=RunControl(threads=threads), recording=False)
    if scene_digest(scene) != digest:
        raise InputError(f"{scene.path}: a file of the scene changed while the cell flew; sweep again")
    sets = run.maps.sets
    record = CellRecord(
        digest=digest, versions=_versions(), rocks=run.totals.rocks, sets=None if sets is None else sets.flown,
        warnings=tuple(warnings_of_run(run)), surer=tuple(surer_than_it_may_be(run)), figures=tuple(figures_of(run)),
    )  # fmt: skip
    _write(_path(folder), record)
    return record


def record_of(cell: Cell, folder: Path) -> CellRecord | None:
    """Return the record of a cell in a folder; None if the cell must fly.

    A cell must fly if the folder has no readable record or no result of the cell, or if the record has other versions
    of packages than this process.
    """
    try:
        content = json.loads(_path(folder / cell.name).read_text(encoding="utf-8"))
        figures = tuple(Figure(**each) for each in content.pop("figures"))
        content |= {name: tuple(content[name]) for name in ("warnings", "surer")}
        record = CellRecord(figures=figures, **content)
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
    is_of_cell = (record.digest, record.versions) == (cell.digest, _versions())
    return record if is_of_cell and (folder / cell.name / SUMMARY).is_file() else None


def _path(folder: Path) -> Path:
    return folder.with_name(f"{folder.name}.json")


def _write(path: Path, record: CellRecord) -> None:
    """Write a record completely or not at all."""
    content: dict[str, Any] = {**record._asdict(), "figures": [figure._asdict() for figure in record.figures]}
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    part.write_text(json.dumps(plain(content), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    part.replace(path)


@cache
def _versions() -> Mapping[str, str | None]:
    """Return the versions of all packages that affect a result; they are read only once in a process."""
    return versions()
