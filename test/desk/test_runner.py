"""Tests of the thread that simulates rocks: growing results, stops, terrain read only once, and reports."""

import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from programs.waiting import wait_for
from scenes.small_pit import scene_file

import rpf3d_core as rpf3d
from rpf3d_core.desk import compiling
from rpf3d_core.desk.runner import Listener, Runner, Written
from rpf3d_core.desk.shapes import (
    ENERGY,
    REACH,
    area_lines,
    barrier_mesh,
    ground_seen,
    hazard_map,
    lifted,
    on_ground,
    path_lines,
)
from rpf3d_core.desk.tables import bench_section, progress_words
from rpf3d_core.desk.whole_files import whole_file
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.benches import text_rows
from rpf3d_core.hazard.by_source.each_source import worst_benches
from rpf3d_core.hazard.maps import reach_probability
from rpf3d_core.hazard.scales import FEW_COLOUR
from rpf3d_core.jit.cache import compiled_apart
from rpf3d_core.jit.from_cache import NotCached
from rpf3d_core.report.view import MAPS as VIEW_MAPS
from rpf3d_core.report.view import UPPER_REACH, Seen
from rpf3d_core.results.findings import Run
from rpf3d_core.results.second_process import SecondProcessEnded, second_process
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles

LONGEST = 300.0
"""Time limit (s) of a wait for something that takes some seconds on an idle machine."""


class Received:
    """A listener that keeps what it receives."""

    def __init__(self) -> None:
        self.terrains: list[object] = []
        self.results: list[tuple[Run, bool]] = []
        self.rows: list[list[list[str]]] = []
        self.rocks: list[int] = []
        self.reports: list[Path] = []
        self.refusals: list[str] = []
        self.hold = threading.Event()
        self.hold.set()

    def listener(self) -> Listener:
        return Listener(
            prepared=lambda written, prepared: self.terrains.append(prepared.terrain), results=self.result,
            report=self.reports.append, refused=self.refusals.append, busy=lambda text: None,
        )  # fmt: skip

    def result(self, run: Run, last: bool) -> None:
        self.results.append((run, last))
        self.rows.append(bench_section(run)["rows"])
        self.rocks.append(run.totals.rocks)
        self.hold.wait(LONGEST)

    def ends(self) -> int:
        return sum(last for _, last in self.results)

    def done(self) -> bool:
        return bool(self.refusals) or self.ends() > 0


def written(folder: Path, engine: str = "reference", rocks: int = 25) -> Written:
    """Return the scene of the small pit; rocks : number of rocks of its second source."""
    path = scene_file(folder, more=f"engine: {engine}\n")
    return Written(text=path.read_text().replace("rocks: 25", f"rocks: {rocks}"), path=path)


@contextmanager
def flying_while_the_compiler_waits(scene: Written, received: Received) -> Iterator[Runner]:
    """Fly a scene in a new runner; the compiler begins only after the `with` block, as if another scene took long."""
    runner = Runner(received.listener())
    with compiling.ONE:
        runner.fly(scene)
        yield runner


def test_results_grow_until_they_are_those_of_a_run(tmp_path: Path) -> None:
    scene, received = written(tmp_path), Received()
    runner = Runner(received.listener())
    runner.fly(scene)
    wait_for(received.done, LONGEST)
    runner.close()
    assert received.refusals == [] and received.rocks[0] in (16, 17) and received.rocks[-1] == 100
    run, whole = received.results[-1][0], rpf3d.simulate(scene.path)
    assert received.rows[-1] == _bench_rows(whole)
    assert progress_words(run).startswith("100 rocks, ")
    paths = path_lines(run)
    assert len(paths.starts) - 1 == 10 and paths.starts[-1] == len(paths.points)
    seen = ground_seen(run.terrain)
    reach, energy = (hazard_map(seen, run.maps, kind) for kind in (REACH, ENERGY))
    assert reach.mesh is not None and 0.0 < reach.largest <= 100.0 and energy.unit == "kJ"
    assert energy.mesh is not None and energy.has_few and not reach.has_few
    few = (energy.mesh.colours == FEW_COLOUR).all(axis=1)
    assert few.any() and len(few) == len(reach.mesh.colours), "both maps colour all ground that rocks reached"


def test_the_map_of_reach_is_the_upper_end_that_a_report_shows_or_says_that_it_is_the_mean(tmp_path: Path) -> None:
    """One title has one meaning. If a stopped run has too few parameter sets for an interval, the title says so."""
    path = scene_file(tmp_path, more="engine: reference\nunknowns: {sets: 40}\n")
    unknown_value = "normal_restitution: {prior: {min: 0.3, max: 0.6}}"
    path.write_text(path.read_text().replace("normal_restitution: 0.5", unknown_value))
    run = rpf3d.simulate(path)
    maps, seen = run.maps, ground_seen(run.terrain)
    mean, high = 100.0 * reach_probability(maps.cells, maps.flown).max(), 100.0 * np.nanmax(maps.reach_band.high)
    upper = hazard_map(seen, maps, REACH)
    assert upper.title == UPPER_REACH == VIEW_MAPS[0][2] and upper.largest == pytest.approx(high) and high > mean
    unknown = maps.reach_band._replace(high=np.full_like(maps.reach_band.high, np.nan))
    shown = hazard_map(seen, replace(maps, reach_band=unknown, sources=None), REACH)
    assert shown.title.startswith("reach probability, mean; ") and shown.largest == pytest.approx(mean)


def test_a_stop_leaves_a_partial_result_and_the_next_run_reads_no_terrain(tmp_path: Path) -> None:
    scene, received = written(tmp_path), Received()
    received.hold.clear()
    runner = Runner(received.listener())
    runner.fly(scene)
    wait_for(lambda: received.results or received.refusals, LONGEST)
    runner.stop_flying()
    received.hold.set()
    wait_for(received.done, LONGEST)
    assert received.refusals == [] and received.rocks[-1] < 100 and received.results[-1][0].planned == 100
    other = scene._replace(text=scene.text.replace("rocks: 25", "rocks: 26"))
    runner.prepare(other)
    wait_for(lambda: len(received.terrains) == 2, LONGEST)
    runner.close()
    assert received.terrains[0] is received.terrains[1]


def test_a_refusal_is_a_sentence_and_the_thread_goes_on(tmp_path: Path) -> None:
    scene, received = written(tmp_path), Received()
    runner = Runner(received.listener())
    runner.fly(scene._replace(text=scene.text.replace("zone: bench_1", "zone: bench_99")))
    wait_for(lambda: received.refusals, LONGEST)
    runner.write_report(scene, tmp_path / "r.html")
    wait_for(lambda: len(received.refusals) == 2, LONGEST)
    runner.close()
    assert "bench_99" in received.refusals[0] and "have not flown; press Run" in received.refusals[1]
    assert not (tmp_path / "r.html").exists()


@pytest.mark.long
def test_a_report_is_written_from_the_run_and_its_folder_goes_at_the_end(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("plotly", reason="the extra `report` is not installed")
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    scene, received = written(tmp_path), Received()
    runner = Runner(received.listener())
    runner.fly(scene)
    runner.write_report(scene, tmp_path / "r.html")
    runner.write_report(scene, tmp_path / "twice.html")
    wait_for(lambda: len(received.reports) == 2 or received.refusals, LONGEST)
    assert received.refusals == [] and list(tmp_path.glob("rpf3d-desk-*"))
    runner.close()
    assert list(tmp_path.glob("rpf3d-desk-*")) == []
    assert "east_side" in (tmp_path / "r.html").read_text()


def test_no_one_waits_for_the_compiler(tmp_path: Path) -> None:
    """While the compiler works, the reference engine flies; a run of few rocks ends before the compiler does."""
    pytest.importorskip("numba", reason="numba is not installed")
    scene, received = written(tmp_path, "compiled"), Received()
    with flying_while_the_compiler_waits(scene, received) as runner:
        wait_for(lambda: received.refusals or received.ends() == 1, LONGEST)
    runner.close()
    assert received.refusals == [] and {run.flights.engine for run, _ in received.results} == {"reference"}
    assert received.rows[-1] == _bench_rows(rpf3d.simulate(scene.path))


@pytest.mark.long
def test_the_compiled_engine_takes_over_as_soon_as_it_is_ready(tmp_path: Path) -> None:
    pytest.importorskip("numba", reason="numba is not installed")
    scene, received = written(tmp_path, "compiled", rocks=20_000), Received()
    with flying_while_the_compiler_waits(scene, received) as runner:
        wait_for(lambda: received.refusals or received.results, LONGEST)
    wait_for(lambda: received.refusals or received.ends() == 1, LONGEST)
    runner.fly(scene)
    wait_for(lambda: received.refusals or received.ends() == 2, LONGEST)
    runner.close()
    engines = [run.flights.engine for run, _ in received.results]
    first = [last for _, last in received.results].index(True) + 1
    assert received.refusals == []
    assert engines[0] == "reference" and engines[first - 1] == "compiled" and set(engines[first:]) == {"compiled"}
    scene.path.write_text(scene.text)
    assert received.rows[-1] == received.rows[first - 1] == _bench_rows(rpf3d.simulate(scene.path))


def test_a_stop_while_the_compiler_works_ends_the_run_at_once_and_not_after_the_check_of_all_releases(
    tmp_path: Path,
) -> None:
    pytest.importorskip("numba", reason="numba is not installed")
    scene, received = written(tmp_path, "compiled", rocks=400_000), Received()
    with flying_while_the_compiler_waits(scene, received) as runner:
        wait_for(lambda: received.refusals or received.results, LONGEST)
        runner.stop_flying()
        began = time.monotonic()
        wait_for(lambda: received.refusals or received.ends() == 1, LONGEST)
        waited = time.monotonic() - began
    runner.close()
    run, _ = received.results[-1]
    assert received.refusals == [] and 0 < run.totals.rocks < run.planned
    assert waited < 20.0, "all releases take minutes"


FACE = "v 0 0 {top}\nv 0 40 {top}\nv 20 40 0\nv 20 0 0\nv -20 0 {top}\nv -20 40 {top}\nv 90 40 0\nv 90 0 0\n" \
    "f 1 4 3 2\nf 5 1 2 6\nf 4 8 7 3\n"
SLOPE = """\
terrain: {files: [{path: slope.obj}]}
materials: {default: {normal_restitution: 0.3, tangential_restitution: 0.8, friction_angle_deg: 30}}
sources: [{name: crest, points: [[0.5, 20, 40]], rocks: 20, velocity_spread: [1, 1, 0]}]
engine: reference
"""


def test_a_mesh_that_was_written_again_is_read_again_and_no_report_mixes_both(tmp_path: Path) -> None:
    mesh, path, received = tmp_path / "slope.obj", tmp_path / "slope.yaml", Received()
    mesh.write_text(FACE.format(top=20))
    path.write_text(SLOPE)
    scene, runner = Written(text=SLOPE, path=path), Runner(received.listener())
    runner.fly(scene)
    wait_for(received.done, LONGEST)
    mesh.write_text(FACE.format(top=30))
    runner.write_report(scene, tmp_path / "r.html")
    wait_for(lambda: received.refusals or received.reports, LONGEST)
    assert received.refusals == [f"{mesh}: changed since the rocks flew; press Run, then Report"]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["slope.obj", "slope.yaml"]
    runner.fly(scene)
    wait_for(lambda: received.ends() == 2 or len(received.refusals) > 1, LONGEST)
    runner.close()
    assert len(received.refusals) == 1
    heights = [np.ptp(run.terrain.vertices[:, 2]) for run, last in received.results if last]
    assert heights == [20.0, 30.0]


def test_scenes_that_are_superseded_are_not_prepared(tmp_path: Path) -> None:
    scene, received, begun, go = written(tmp_path), Received(), threading.Event(), threading.Event()

    def hold(text: str) -> None:
        begun.set()
        go.wait(LONGEST)

    prepared: list[str] = []
    listener = received.listener()._replace(busy=hold, prepared=lambda written, _: prepared.append(written.text))
    runner = Runner(listener)
    texts = [scene.text.replace("rocks: 25", f"rocks: {rocks}") for rocks in (26, 27, 28)]
    runner.prepare(scene._replace(text=texts[0]))
    begun.wait(LONGEST)
    for text in texts[1:]:
        runner.prepare(scene._replace(text=text))
    go.set()
    wait_for(lambda: len(prepared) == 2 or received.refusals, LONGEST)
    runner.close()
    assert received.refusals == [] and prepared == [texts[0], texts[2]]


def test_a_report_that_fails_leaves_the_file_that_was_there(tmp_path: Path) -> None:
    target = tmp_path / "r.html"
    target.write_text("earlier")
    with pytest.raises(InputError, match="no flight"), whole_file(target) as part:
        part.write_text("half")
        raise InputError("no flight")
    assert target.read_text() == "earlier" and [path.name for path in tmp_path.iterdir()] == ["r.html"]
    with whole_file(target) as part:
        part.write_text("all")
    assert target.read_text() == "all" and [path.name for path in tmp_path.iterdir()] == ["r.html"]


def test_one_scene_compiles_at_a_time_and_a_cancelled_scene_does_not_compile(monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba", reason="numba is not installed")
    begun: list[object] = []
    ended = threading.Event()

    def prepare(scene: object, engine: str, ground: object) -> None:
        begun.append(scene)
        ended.set()
        raise InputError("refused")

    monkeypatch.setattr(compiling, "prepared_for", prepare)
    with compiling.ONE:
        first, second = (compiling.Compiling(name, "", None) for name in ("first", "second"))
        first.cancel()
    assert ended.wait(LONGEST)
    with compiling.ONE:
        assert begun == ["second"] and (first.done(), second.done()) == (None, None)


class Second:
    """Stands for the process that compiles."""

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self.killed = threading.Event()

    def ask(self, *request: Any) -> None:
        self.asked.append(request)

    def end(self) -> None:
        self.killed.set()


@pytest.mark.parametrize("is_cancelled", [False, True])
def test_what_is_not_in_the_cache_is_compiled_by_a_second_process_which_a_newer_scene_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_cancelled: bool
) -> None:
    """numba holds a lock while it compiles, for which the flight of the first rocks would wait in one process."""
    made: list[str] = []

    class Waiting(Second):
        def wait(self) -> None:
            if is_cancelled:
                assert self.killed.wait(LONGEST)
                raise SecondProcessEnded("was killed")

    def compiled(scene: Any, ground: object) -> str:
        made.append(scene.path.name)
        if len(made) == 1:
            raise NotCached
        return "compiled"

    second = Waiting()
    monkeypatch.setattr(compiling, "compiled_for", compiled)
    monkeypatch.setattr(compiling, "second_process", lambda *_, compiles: nullcontext(second))
    scene = read_scene(scene_file(tmp_path))
    text = scene.path.read_text()
    one = compiling.Compiling(scene, text, None)  # type: ignore[arg-type]
    wait_for(lambda: second.asked, LONGEST)
    if is_cancelled:
        one.cancel()
        with compiling.ONE:
            assert one.done() is None and len(made) == 1
    else:
        wait_for(one.done, LONGEST)
        assert len(made) == 2
    assert second.asked == [("fill", text, scene.path, compiled_apart())]  # other tests may have compiled own models


FROM_CACHE = """
import sys
from rpf3d_core.desk.compiling import compiled_for
from rpf3d_core.jit.from_cache import only_from_cache
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain
scene = read_scene(sys.argv[1])
with only_from_cache():
    compiled_for(scene, read_terrain(scene))
"""


@pytest.mark.long
def test_the_second_process_compiles_all_that_the_first_process_needs(tmp_path: Path) -> None:
    """The cache is empty at first. Afterwards, a process that may not compile prepares the scene."""
    pytest.importorskip("numba", reason="numba is not installed")
    path = scene_file(tmp_path, more="engine: compiled\n")
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", environment["XDG_CACHE_HOME"])
        with second_process(compiling.__name__, compiling.CacheFiller.__name__, compiles=True) as second:
            assert second is not None
            second.ask("fill", path.read_text(), path, [])
            second.wait()
    done = subprocess.run([sys.executable, "-c", FROM_CACHE, path], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_marks_and_outlines_have_the_height_of_their_own_place(tmp_path: Path) -> None:
    """The nearest vertex of a place at the toe of a face may be on the crest."""
    x, z = np.array([-40.0, -5.0, 0.0, 40.0]), np.array([15.0, 15.0, 0.0, 0.0])
    vertices = np.array([(x[i], y, z[i]) for i in range(4) for y in (-50.0, 50.0)])
    triangles = np.array([t for i in (0, 2, 4) for t in ((i, i + 2, i + 3), (i, i + 3, i + 1))], dtype=np.int32)
    seen = Seen(vertices=vertices, triangles=triangles, of=len(triangles))
    found = on_ground(seen, np.array([[-1.0, 0.0, 99.0], [1.0, 20.0, 99.0], [50.0, 50.0, 99.0]]))
    np.testing.assert_allclose(found[:, 2], [3.1, 0.1, 0.1], atol=0.01)  # the marks are raised by 0.1 m
    lines = area_lines(seen, {"floor": [np.array([[0.0, -40.0], [20.0, -40.0], [20.0, 40.0], [0.0, -40.0]])]})
    assert np.abs(lines.points[:, 2]).max() < 0.01
    assert np.allclose(lifted(lines, 2.0).points - lines.points, [0.0, 0.0, 2.0])


def test_the_panels_of_barriers_stand_on_their_lines() -> None:
    foot = np.array([[0.0, 0.0, 1.0], [4.0, 0.0, 2.0], [4.0, 3.0, 2.0]])
    lines = (("fence", foot), ("net", foot[:2]), ("broken", foot))
    obstacles = Obstacles(tuple(name for name, _ in lines), np.arange(3), lines, np.empty((0, 4)), (3.0, 2.0, 0.0))
    mesh = barrier_mesh(obstacles)
    assert mesh is not None and len(mesh.triangles) == len(mesh.colours) == 4 + 2
    corners = mesh.vertices[mesh.triangles]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
    assert area == pytest.approx(3.0 * (4.0 + 3.0) + 2.0 * 4.0), "no panel of a height of 0"
    assert barrier_mesh(NO_OBSTACLES) is None


def _bench_rows(run: Run) -> list[list[str]]:
    return [list(row) for row in text_rows(worst_benches(run.terrain, run.maps))]
