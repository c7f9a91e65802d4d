"""A run in rounds that grow shows results early, and ends with the bits of a run in one round."""

from pathlib import Path

import numpy as np
import pytest

import rpf3d_core as rpf3d
from rpf3d_core.hazard.benches import bench_table
from rpf3d_core.results.findings import Run
from rpf3d_core.results.folder import write_findings
from rpf3d_core.runs.run import RunControl, fly_into, run_scene
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.setup.rounds import growing_rounds

SCENES = Path(__file__).parents[2] / "config" / "scenes"


@pytest.mark.parametrize(("counts", "first"), [([200], 16), ([5, 0, 90], 16), ([3], 16), ([1, 1, 1], 1), ([64], 64)])
def test_rounds_grow_to_all_rocks_of_each_source(counts: list[int], first: int) -> None:
    rounds = growing_rounds(counts, first)
    flown = np.zeros(len(counts), dtype=int)
    for each in rounds:
        assert list(each.first) == flown.tolist() and each.rocks > 0
        flown = np.array(each.last)
    assert flown.tolist() == counts
    assert rounds[0].rocks <= first + len(counts)


@pytest.fixture(scope="module")
def whole() -> Run:
    """A run of 200 rocks over 64 parameter sets, in one round."""
    return rpf3d.simulate(SCENES / "bench_15m.yaml", rocks=200, engine="reference")


def grown(folder: Path, control: RunControl) -> Run:
    scene = with_choices(rpf3d.read_scene(SCENES / "bench_15m.yaml"), 200, "reference", None)
    return fly_into(folder, prepare(scene), control)


def test_a_run_in_rounds_ends_with_the_bits_of_a_run_in_one_round(tmp_path: Path, whole: Run) -> None:
    seen: list[tuple[int, int, int]] = []

    def look(run: Run) -> None:
        seen.append((run.totals.rocks, run.planned, len(np.unique(run.flights.paths.row))))

    run = grown(tmp_path, RunControl(first=16, after_round=look))
    assert [rocks for rocks, _, _ in seen] == [64, 128] and {planned for _, planned, _ in seen} == {200}
    assert [paths for _, _, paths in seen] == [64, 128], "the first rocks have paths to draw"
    assert bench_table(run.terrain, run.maps) == bench_table(whole.terrain, whole.maps)
    np.testing.assert_array_equal(run.maps.cells.rocks, whole.maps.cells.rocks)
    np.testing.assert_array_equal(run.maps.cells.energy.p95, whole.maps.cells.energy.p95)
    np.testing.assert_array_equal(run.maps.reach_band.high, whole.maps.reach_band.high)
    assert run.totals.outcomes == whole.totals.outcomes


def test_the_result_of_a_stopped_run_is_partial(tmp_path: Path) -> None:
    stopped: list[bool] = []
    run = grown(tmp_path, RunControl(first=16, after_round=lambda run: stopped.append(True), stop=lambda: any(stopped)))
    assert (run.totals.rocks, run.planned) == (64, 200) and len(stopped) == 1


def test_its_folder_becomes_a_result_like_that_of_a_run(tmp_path: Path) -> None:
    (tmp_path / "grown").mkdir()
    run = grown(tmp_path / "grown", RunControl(first=16))
    write_findings(tmp_path / "grown", run)
    run_scene(SCENES / "bench_15m.yaml", tmp_path / "whole", 200, "reference", recording=False)
    names = sorted(path.name for path in (tmp_path / "whole").iterdir())
    assert sorted(path.name for path in (tmp_path / "grown").iterdir()) == names
    rows = [sorted((tmp_path / name / "deposits.csv").read_text().splitlines()) for name in ("grown", "whole")]
    assert rows[0] == rows[1]
