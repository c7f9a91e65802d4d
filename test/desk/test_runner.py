"""The thread that flies: results grow, a stop is followed, the ground is read once, and a report needs a run."""

import tempfile
import threading
from pathlib import Path

import pytest
from small_pit import scene_file
from waiting import wait_for

import rpf3d_core as rpf3d
from rpf3d_core.desk.runner import Listener, Runner, Written
from rpf3d_core.desk.shapes import ENERGY, REACH, ground_seen, hazard_map, path_lines
from rpf3d_core.desk.tables import bench_section, progress_words
from rpf3d_core.hazard.benches import Bench, bench_table, text_rows
from rpf3d_core.results.findings import Run

LONGEST = 300.0
"""Seconds for what takes some on an idle machine."""


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


def written(folder: Path, engine: str = "reference") -> Written:
    path = scene_file(folder, more=f"engine: {engine}\n")
    return Written(text=path.read_text(), path=path)


def test_results_grow_until_they_are_those_of_a_run(tmp_path: Path) -> None:
    scene, received = written(tmp_path), Received()
    runner = Runner(received.listener())
    runner.fly(scene)
    wait_for(received.done, LONGEST)
    runner.close()
    assert received.refusals == [] and received.rocks[0] in (16, 17) and received.rocks[-1] == 100
    run, whole = received.results[-1][0], rpf3d.simulate(scene.path)
    assert received.rows[-1] == [list(row) for row in text_rows(bench_table(whole.terrain, whole.maps))]
    assert progress_words(run).startswith("100 rocks, ")
    paths = path_lines(run)
    assert len(paths.starts) - 1 == 10 and paths.starts[-1] == len(paths.points)
    seen = ground_seen(run.terrain)
    reach, energy = (hazard_map(seen, run.maps, kind) for kind in (REACH, ENERGY))
    assert reach.mesh is not None and 0.0 < reach.largest <= 100.0 and energy.unit == "kJ"


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


@pytest.mark.long
def test_no_one_waits_for_the_compiler(tmp_path: Path) -> None:
    """The reference engine shows the first rocks, the compiled engine flies all; a second run is compiled at once."""
    pytest.importorskip("numba", reason="numba is not installed")
    scene, received = written(tmp_path, "compiled"), Received()
    runner = Runner(received.listener())
    for number in (1, 2):
        runner.fly(scene)
        wait_for(lambda number=number: received.refusals or received.ends() == number, LONGEST)
    runner.close()
    engines = [run.flights.engine for run, _ in received.results]
    first = [last for _, last in received.results].index(True) + 1
    assert received.refusals == []
    assert engines[0] == "reference" and engines[first - 1] == "compiled" and set(engines[first:]) == {"compiled"}
    assert received.rows[-1] == received.rows[first - 1]
    assert received.rows[-1] == [list(row) for row in text_rows(_benches(rpf3d.simulate(scene.path)))]


def _benches(run: Run) -> list[Bench]:
    return bench_table(run.terrain, run.maps)
