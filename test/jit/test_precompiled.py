"""Tests that a second process compiles, before terrain is read, exactly what runs call, in the order of calls."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from scenes.small_pit import scene_file

from rpf3d_core.detection import bucket_grid, slabs
from rpf3d_core.jit.background import BackgroundCompiler
from rpf3d_core.runs import fly_scene as fly_scene_module
from rpf3d_core.runs.run import simulate
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup import precompiler as precompiler_module
from rpf3d_core.setup import prepared as prepared_module
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.simulation import engines
from rpf3d_core.simulation.engines import Compiled, precompile_ground_below, precompile_index
from rpf3d_core.terrain import facets

numba = pytest.importorskip("numba", reason="numba is not installed: there is nothing to compile")

GROUND_BELOW: Any = engines._ground_below_all
INDEX: list[Any] = [facets.lay_out, *(
    loop for module in (bucket_grid, slabs) for loop in vars(module).values() if hasattr(loop, "overloads")
)]  # fmt: skip


@pytest.fixture(params=[6000, 120_000])
def engine(request: pytest.FixtureRequest, tmp_path: Path) -> Compiled:
    """Return the engine of a scene from a file, with a pit of about `request.param` facets."""
    path = scene_file(tmp_path, more="engine: compiled")
    path.write_text(path.read_text().replace("triangles: 6000", f"triangles: {request.param}"))
    engine = prepare(read_scene(path)).engine
    assert isinstance(engine, Compiled)
    return engine


def test_the_index_that_is_precompiled_has_the_types_of_any_other(engine: Compiled) -> None:
    precompiled = precompile_index()
    assert numba.typeof(precompiled.facets) == numba.typeof(engine.facets)
    assert numba.typeof(precompiled.locator) == numba.typeof(engine.locator)


def test_what_is_precompiled_is_compiled_once_for_all(engine: Compiled) -> None:
    assert len(INDEX) > 6, "not all loops of the index are looked at"
    precompile_ground_below()
    known = {loop: set(loop.overloads) for loop in (*INDEX, GROUND_BELOW)}
    assert all(known.values()), "it leaves some of them out"
    Compiled(engine.facets).ground_below(np.zeros((3, 3)))
    assert {loop: set(loop.overloads) for loop in known} == known


class Told(BackgroundCompiler):
    """Keeps what is reported to it and which functions are called. slow : whether one loop takes long to compile"""

    def __init__(self, slow: bool) -> None:
        super().__init__(None)
        self.slow, self.noted = slow, list[str]()

    def compile(self, *calls: Any) -> None:
        self.noted.append("types known")

    def call(self, *functions: Any) -> None:
        self.noted += [f"begin {function.__name__}" for function in functions]

    def wait(self, *parts: Any) -> None:
        self.noted += [f"wait {part.__name__}" for part in parts] or ["wait"]

    def has_done(self, part: Any) -> bool:
        return not self.slow

    def note(self, monkeypatch: pytest.MonkeyPatch, module: ModuleType, name: str) -> None:
        """Note when a function of a module is called."""
        function = getattr(module, name)
        monkeypatch.setattr(module, name, lambda *args: self.noted.append(name) or function(*args))


@pytest.mark.parametrize("slow", [False, True], ids=["in time", "slow"])
def test_a_run_waits_for_each_part_before_it_needs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, slow: bool
) -> None:
    told = Told(slow)

    @contextmanager
    def background(*loops: Any) -> Iterator[BackgroundCompiler]:
        yield told

    monkeypatch.setattr(precompiler_module, "background_compiler", background)
    told.note(monkeypatch, prepared_module, "facets_of")
    told.note(monkeypatch, precompiler_module, "precompile_flights")
    told.note(monkeypatch, fly_scene_module, "_check_all")
    simulate(scene_file(tmp_path, more="engine: compiled"))
    assert told.noted == [
        "begin precompile_index", "begin precompile_ground_below", "wait precompile_index", "facets_of", "types known",
        *(["precompile_flights"] if slow else []), "wait precompile_ground_below", "_check_all", "precompile_flights",
        "wait",
    ]  # fmt: skip
