"""Tests that a run in growing rounds shows results early and ends with the same bits as a run in one round."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import rpf3d_core as rpf3d
from rpf3d_core.desk.tables import progress_words
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.benches import bench_table
from rpf3d_core.results.findings import Run
from rpf3d_core.results.folder import write_findings
from rpf3d_core.runs.fly_scene import RunControl
from rpf3d_core.runs.run import fly_into, run_scene
from rpf3d_core.scene.reading import scene_of_text
from rpf3d_core.setup import rounds
from rpf3d_core.setup.choices import with_choices
from rpf3d_core.setup.prepared import prepare
from rpf3d_core.setup.rounds import even_order, growing_rounds
from rpf3d_core.unknowns.dealing import sets_of_rocks

SCENES = Path(__file__).parents[2] / "config" / "scenes"


@pytest.mark.parametrize(
    ("counts", "points", "first", "sets"),
    [
        ([200], [1], 16, 0), ([200], [200], 16, 0), ([5, 0, 90], [5, 1, 9], 16, 0), ([3], [3], 16, 0),
        ([1, 1, 1], [1, 1, 1], 1, 0), ([50] * 40, [50] * 40, 16, 0), ([997, 101, 4], [997, 7, 1], 16, 0),
        ([64], [64], 16, 64), ([200], [200], 16, 64), ([1000, 333], [10, 333], 16, 64), ([900, 30], [900, 30], 16, 64),
        ([2000], [1], 16, 64), ([1001], [50], 300, 10), ([500, 129], [16, 16], 16, 32),
    ],
)  # fmt: skip
def test_rounds_represent_all_rocks(counts: list[int], points: list[int], first: int, sets: int) -> None:
    plan, total = growing_rounds(counts, points, first, sets), sum(counts)
    flown: list[list[int]] = [[] for _ in counts]
    for number, each in enumerate(plan):
        sizes = [len(its) for its in flown]
        for dealt in each.dealt(sets) if sets else each.blocks():
            flown = [[*before, *map(int, its)] for before, its in zip(flown, dealt, strict=True)]
        assert each.rocks == sum(map(len, flown)) - sum(sizes) > 0
        so_far = sum(map(len, flown))
        assert all(abs(len(its) - n * so_far / total) < 1.0 for its, n in zip(flown, counts, strict=True)), "shares"
        if sets and number < len(plan) - 1:
            for source, its in enumerate(flown):
                assert set(sets_of_rocks(np.array(its), sets, source)) == set(range(sets)), "each set, each source"
    assert [sorted(its) for its in flown] == [list(range(n)) for n in counts], "the rocks of a run, each once"
    assert all(later.rocks <= sum(each.rocks for each in plan[:i]) for i, later in enumerate(plan) if i)


@pytest.mark.parametrize(("rocks", "points", "sets"), [
    (200, 200, 0), (1000, 200, 0), (997, 60, 0), (200, 200, 64), (1400, 700, 64), (1280, 16, 64), (256, 16, 64),
    (500, 129, 32),
])  # fmt: skip
def test_each_round_visits_the_points_evenly(rocks: int, points: int, sets: int) -> None:
    """For each first part of a line of points, its share of the visits is about its share of the points."""
    flown = np.zeros(0, dtype=int)
    for each in growing_rounds([rocks], [points], 16, sets):
        flown = np.concatenate([flown, *(its for (its,) in each.dealt(max(sets, 1)))])
        visits = np.bincount(flown % points, minlength=points)
        parts = np.cumsum(visits) / len(flown) - np.arange(1, points + 1) / points
        assert np.ptp(parts) < 0.2, "the first rocks of a line of 200 points would give 0.9"
    assert sorted(flown) == list(range(rocks))


def test_the_order_of_a_line_begins_with_every_nth_point() -> None:
    assert sorted(even_order(200, 200)[:16]) == [200 * n // 16 for n in range(16)]
    assert sorted(even_order(64, 64)[:8]) == list(range(0, 64, 8))
    assert even_order(5, 1).tolist() == [0, 1, 2, 3, 4], "the places are random: any order is even"
    assert even_order(0, 3).tolist() == [] == even_order(0, 3, sets=4).tolist()


@pytest.fixture(scope="module")
def whole() -> Run:
    """Return a run of 200 rocks over 64 parameter sets, in one round."""
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


@pytest.mark.parametrize("scene", ["bench_15m", "demo"])
def test_a_stop_from_the_start_leaves_a_partial_result(tmp_path: Path, scene: str) -> None:
    """With unknowns (bench_15m) few rocks of a set fly at the same time, so the run can stop between the sets."""
    chosen = with_choices(rpf3d.read_scene(SCENES / f"{scene}.yaml"), 200, "reference", None)
    run = run_scene(chosen, tmp_path, control=RunControl(stop=lambda: True), recording=False)
    assert 0 < run.totals.rocks < 200 == run.planned
    assert json.loads((tmp_path / "summary.json").read_text())["partial"] is True


def test_a_stop_between_the_rounds_of_rocks_auto_is_partial(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The stop comes after the last rock of a round, but a further round was planned."""
    monkeypatch.setattr(rounds, "FIRST_ROUND", 100)
    scene = with_choices(rpf3d.read_scene(SCENES / "bench_15m.yaml"), 200, "reference", None)
    scene = with_choices(scene, "auto", None, None)
    target = scene.target.model_copy(update={"half_width": 1e-9, "most_rocks": 4000})
    scene = scene.model_copy(update={"target": target})
    stopped: list[bool] = []
    control = RunControl(after_round=lambda run: stopped.append(True), stop=lambda: any(stopped))
    run = fly_into(tmp_path, prepare(scene), control)
    assert (len(stopped), run.totals.rocks, run.planned) == (1, 200, 400)
    assert progress_words(run).startswith("partial: 200 of 400 rocks, ")


def test_a_release_that_no_early_round_has_is_refused_before_rocks_fly(tmp_path: Path) -> None:
    points = [[0.1, 0.25 * n - 5.0, -5.0 if n == 37 else 32.0] for n in range(40)]
    text = (SCENES / "bench_15m.yaml").read_text()
    line = "line: [[0.1, -10, 0], [0.1, 10, 0]], above_ground: 0.5, rocks: 6400"
    text = text.replace(line, f"points: {points}, rocks: 40").replace("{prior: {min: 1, max: 10}}", "5")
    text = text.replace("library: bedrock", "normal_restitution: 0.4, tangential_restitution: 0.8")
    scene = with_choices(scene_of_text(text, SCENES / "bench_15m.yaml"), None, "reference", None)
    begun: list[int] = []

    def progress(rocks: int) -> Callable[[int], None]:
        begun.append(rocks)
        return begun.append

    with pytest.raises(InputError, match=r"crest_edge.*rock 37"):
        fly_into(tmp_path, prepare(scene), RunControl(first=8, progress=progress))
    assert begun == []


def test_its_folder_becomes_a_result_like_that_of_a_run(tmp_path: Path) -> None:
    (tmp_path / "grown").mkdir()
    run = grown(tmp_path / "grown", RunControl(first=16))
    write_findings(tmp_path / "grown", run)
    run_scene(SCENES / "bench_15m.yaml", tmp_path / "whole", 200, "reference", recording=False)
    names = sorted(path.name for path in (tmp_path / "whole").iterdir())
    assert sorted(path.name for path in (tmp_path / "grown").iterdir()) == names
    rows = [sorted((tmp_path / name / "deposits.csv").read_text().splitlines()) for name in ("grown", "whole")]
    assert rows[0] == rows[1]
