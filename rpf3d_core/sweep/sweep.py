"""Sweep a scene: fly each combination of values of some keys, and write a table and a picture of the results."""

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import Rocks
from rpf3d_core.sweep.cells import Cell, cells_of
from rpf3d_core.sweep.files import check_out, write_sweep
from rpf3d_core.sweep.flying import CELLS, CellRecord, fly_cells, record_of
from rpf3d_core.sweep.varied import Varied


class Sweep(NamedTuple):
    """The result of a sweep: its keys with their values, its cells, and the record of each cell in the same order."""

    varied: tuple[Varied, ...]
    cells: tuple[Cell, ...]
    records: tuple[CellRecord, ...]


def sweep(
    scene: Scene | str | Path,
    varied: Mapping[str, Sequence[Any]],
    out: str | Path,
    executor: Executor,
    rocks: Rocks = None,
    threads: int | None = 1,
    report: Callable[[int, int], None] = lambda done, of: None,
) -> Sweep:
    """Fly a scene with each combination of values of some keys, and write sweep.csv and sweep.png into a folder.

    A cell that has flown into the same folder does not fly again if its scene, its files and the versions of all
    packages that affect a result are the same.

    Parameters
    ----------
    scene : a scene, or the path of a scene file
    varied : the values of each key, in the scene's unit, by key path such as `terrain.benches.berm`
    out : folder of the sweep, which every worker can write to; each cell writes a result folder below it
    executor : any `concurrent.futures.Executor`; every worker must see the scene's files at the same paths
    rocks : number of rocks of each cell, as in `rpf3d_core.simulate`
    threads : number of threads of each cell, for the compiled engine; None for one per core
    report : called with the number of cells that have flown and the number of all cells, after each cell; first called
        with the number of cells that flew in an earlier sweep

    Raises
    ------
    InputError
        The scene, a key path, a value or a cell is refused, a worker was killed, or the folder contains other files or
        cannot be written.
    """
    folder = check_out(out)
    asked = tuple(Varied(key=key, values=tuple(values)) for key, values in varied.items())
    cells = cells_of(scene if isinstance(scene, Scene) else read_scene(scene), asked, rocks)
    done = sum(record_of(cell, folder / CELLS) is not None for cell in cells)
    report(done, len(cells))

    def flown() -> None:
        nonlocal done
        done += 1
        report(done, len(cells))

    try:
        (folder / CELLS).mkdir(parents=True, exist_ok=True)
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault
    found = Sweep(
        varied=asked, cells=tuple(cells), records=tuple(fly_cells(cells, folder / CELLS, executor, threads, flown))
    )
    write_sweep(folder, found.varied, found.cells, found.records)
    return found
