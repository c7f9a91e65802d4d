"""Tests that a record is reused only with its result and the same versions; reports of killed workers name the cell."""

import json
import os
import shutil
from concurrent.futures import BrokenExecutor, Future, ProcessPoolExecutor
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import Any

import pytest
from scenes.sweeps import BERM, SCENE, Here, road, written

from rpf3d_core.commands.sweep import _executor
from rpf3d_core.errors import InputError
from rpf3d_core.jit.cores import usable_cores
from rpf3d_core.results.findings import Run
from rpf3d_core.runs.run import run_scene
from rpf3d_core.sweep import flying
from rpf3d_core.sweep.sweep import Sweep, sweep


@pytest.fixture
def scene(tmp_path: Path) -> Path:
    (tmp_path / "road.geojson").write_text(road(20.0, 24.0))
    return written(tmp_path, SCENE)


def swept(scene: Path, executor: Any, *berms: float) -> Sweep:
    return sweep(scene, {BERM: berms}, scene.parent / "out", executor)


def test_a_record_without_its_result_does_not_count(scene: Path) -> None:
    whole = swept(scene, Here(), 3)
    shutil.rmtree(scene.parent / "out" / "cells" / whole.cells[0].name)
    assert swept(scene, again := Here(), 3).records == whole.records
    assert again.flown == 1
    assert (scene.parent / "out" / "cells" / whole.cells[0].name / "summary.json").is_file()


@pytest.mark.parametrize("package", ["rpf3d", "numpy", "numba"])
def test_another_version_of_a_package_flies_the_cell_again(scene: Path, package: str) -> None:
    whole = swept(scene, Here(), 3)
    path = scene.parent / "out" / "cells" / f"{whole.cells[0].name}.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"versions": content["versions"] | {package: "0.0.1"}}))
    assert swept(scene, again := Here(), 3).records == whole.records
    assert again.flown == 1


def test_a_file_that_changes_during_the_flight_leaves_no_record(scene: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def changing(*given: Any, **more: Any) -> Run:
        run = run_scene(*given, **more)
        (scene.parent / "road.geojson").write_text(road(12.0, 30.0))
        return run

    monkeypatch.setattr(flying, "run_scene", changing)
    with pytest.raises(
        InputError, match=r"cell terrain\.benches\.berm 3: .*a file of the scene changed while the cell"
    ):
        swept(scene, Here(), 3)
    assert not list((scene.parent / "out" / "cells").glob("*.json"))


class Killed(Here):
    """Flies `whole` cells, then fails like a pool with a killed worker: in each further future, or at submission."""

    def __init__(self, whole: int, at_once: bool) -> None:
        super().__init__()
        self.whole, self.at_once = whole, at_once

    def submit(self, fn: Any, /, *args: Any, **kwargs: Any) -> "Future[Any]":
        if self.flown < self.whole:
            return super().submit(fn, *args, **kwargs)
        if self.at_once:
            raise BrokenExecutor
        future: Future[Any] = Future()
        future.set_exception(BrokenExecutor())
        return future


@pytest.mark.parametrize("at_once", [True, False])
def test_a_killed_worker_is_reported_with_its_cell_and_the_others_are_kept(scene: Path, at_once: bool) -> None:
    with pytest.raises(InputError, match=r"cell terrain\.benches\.berm 4: a process ended while .*--workers 1"):
        swept(scene, Killed(1, at_once), 3, 4, 5)
    swept(scene, rest := Here(), 3, 4, 5)
    assert rest.flown == 2


def test_a_pool_of_processes_that_die_is_reported(scene: Path) -> None:
    with (
        ProcessPoolExecutor(1, mp_context=get_context("spawn"), initializer=os._exit, initargs=(1,)) as pool,
        pytest.raises(InputError, match=r"cell terrain\.benches\.berm 3: a process ended"),
    ):
        swept(scene, pool, 3)


def test_there_are_no_more_processes_than_cells_to_fly() -> None:
    before = len(active_children())
    with _executor(4) as pool:
        assert pool.submit(os.getpid).result() != os.getpid()
        assert len(active_children()) - before == 1


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="the system has no affinity")
def test_a_cell_for_each_core_that_the_process_may_use() -> None:
    allowed = os.sched_getaffinity(0)
    assert usable_cores() == len(allowed)
    try:
        os.sched_setaffinity(0, {min(allowed)})
        assert usable_cores() == 1
    finally:
        os.sched_setaffinity(0, allowed)
