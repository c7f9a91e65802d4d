"""Tests that blocks, batches and tables have no effect on the results of a run, and memory stays bounded."""

import json
import re
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as parquet
import pytest
from flights import scenes_of_facets as made
from input_files.terrain_files import SLOPE, grid, write_binary_stl
from programs.command_line import call, refused

import rpf3d_core as rpf3d
from rpf3d_core.ensemble import samples, stream
from rpf3d_core.ensemble.flights import given_columns
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import blocks_of
from rpf3d_core.runs import fly_scene as fly_scene_module
from rpf3d_core.runs.run import Run, run_scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.rounds import FIRST_ROUND, rounds_of
from rpf3d_core.values import Outcome

SCENE = f"""\
{SLOPE}  - {{name: top, points: [[8.3, 7.2, 9]], rocks: 3, spread: [0.5, 0.5, 0.5], velocity: [1, 0.3, 0]}}
  - {{name: other, points: [[9.3, 7.2, 9]], rocks: 1, spread: [0.5, 0.5, 0.5]}}
ground: sliding
rebound: constant
"""
AREA = '{"type": "Polygon", "coordinates": [[[7, 7], [11, 7], [11, 9], [7, 9], [7, 7]]]}'
AREAS = "areas_of_interest: [{name: middle, polygons: middle.json}]\n"
FEW = 400
"""Number of rocks that fill several blocks if blocks are made small."""
OF_THEIR_OWN = 8_000_000
"""Memory (bytes) that 180,000 more rocks may take, for progress and for batches that wait.

These take 0.1 MB on an idle machine and up to about 5 MB on a busy one; kept deposits would take 20 MB.
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    vertices, triangles = grid(16, 18)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    (tmp_path / "middle.json").write_text(AREA)
    (tmp_path / "scene.yaml").write_text(SCENE + AREAS)
    return tmp_path


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write no pictures, which take most of the time of a run and have their own tests."""
    monkeypatch.setattr("rpf3d_core.results.folder._write_pictures", lambda *_: None)


def more(folder: Path, text: str) -> Path:
    """Write the scene with more YAML at its end; return its path."""
    path = folder / "more.yaml"
    path.write_text((folder / "scene.yaml").read_text() + text)
    return path


def facts(folder: Path) -> dict[str, object]:
    return dict(json.loads((folder / "summary.json").read_text()))


def assert_same_layers(one: Run, other: Run) -> None:
    """Assert that the maps of two runs are equal to the last bit."""
    for kind in ("cells", "facets", "zones", "areas"):
        for name, value in vars(getattr(one.maps, kind)).items():
            theirs = getattr(getattr(other.maps, kind), name)
            parts = [vars(layer).values() if hasattr(layer, "p95") else [layer] for layer in (value, theirs)]
            for a, b in zip(*parts, strict=True):
                assert np.array_equal(a, b, equal_nan=True), f"{kind}.{name}"


# --- blocks -----------------------------------------------------------------------------------------------------------


def test_blocks_take_their_share_of_every_source_and_every_rock_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "BLOCK", 10)
    first, last = (5, 0, 2), (35, 7, 2)
    blocks = list(blocks_of(first, last))
    assert len(blocks) == 4 and max(sum(map(len, ranges)) for ranges in blocks) <= 10 + len(first)
    for source in range(3):
        numbers = [number for ranges in blocks for number in ranges[source]]
        assert sorted(numbers) == list(range(first[source], last[source]))
    assert all(np.ptp(ranges[0]) > 23 for ranges in blocks), "from all over a source, not its first rocks"
    assert all(7 <= len(ranges[0]) <= 8 and 1 <= len(ranges[1]) <= 2 for ranges in blocks)


@pytest.mark.long
@pytest.mark.parametrize("block", [1, 7, 64])
def test_blocks_do_not_change_the_answer(folder: Path, monkeypatch: pytest.MonkeyPatch, block: int) -> None:
    whole = rpf3d.simulate(folder / "scene.yaml", rocks=60, engine="reference")
    monkeypatch.setattr(stream, "BLOCK", block)
    parted = rpf3d.simulate(folder / "scene.yaml", rocks=60, engine="reference")
    one, other = whole.flights.deposits, parted.flights.deposits
    order = np.lexsort((other.rock, other.source))
    for name, column in given_columns(one).items():
        assert np.array_equal(column, getattr(other, name)[order], equal_nan=True), name
    if block < 60:
        assert not np.array_equal(order, np.arange(60)), "each block has rocks of both sources"
    assert_same_layers(whole, parted)
    assert parted.totals.rocks == 60 and parted.totals.path == whole.totals.path
    for name in ("runout", "max_speed", "max_energy", "max_height"):
        assert getattr(parted.totals, name).summary((5, 50, 95)) == getattr(whole.totals, name).summary((5, 50, 95))
    impacts = [run.flights.impacts for run in (whole, parted)]
    keys = [
        sorted(zip(run.flights.deposits.source[i.row], run.flights.deposits.rock[i.row], i.t, i.speed_in, strict=True))
        for run, i in zip((whole, parted), impacts, strict=True)
    ]
    assert keys[0] == keys[1] and len(keys[0]) > 60


@pytest.mark.long
def test_the_rocks_that_are_shown_are_spread_over_all_blocks(
    folder: Path, monkeypatch: pytest.MonkeyPatch, no_pictures: None
) -> None:
    monkeypatch.setattr(stream, "BLOCK", 50)
    monkeypatch.setattr("rpf3d_core.runs.run.SHOWN", 40)
    scene = more(folder, "outputs: {trajectories: 20}\n")
    run = run_scene(scene, folder / "out", rocks=FEW, engine="reference", recording=False)
    assert len(run.flights.deposits.rock) == 40 and run.totals.rocks == FEW
    assert np.bincount(run.flights.deposits.source) == pytest.approx([30, 10], abs=1), "three to one, as all of them"
    assert len(np.unique(run.flights.paths.row)) == 20
    whole = rpf3d.simulate(folder / "scene.yaml", rocks=FEW, engine="reference").flights
    every, shown = (
        {(s, r): x.tolist() for s, r, x in zip(of.source, of.rock, of.x, strict=True)}
        for of in (whole.deposits, run.flights.deposits)
    )
    assert shown.items() <= every.items()


# --- tables -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("block", [70, 100_000])
def test_tables_written_while_flying_are_those_written_from_memory(
    folder: Path, monkeypatch: pytest.MonkeyPatch, no_pictures: None, block: int
) -> None:
    monkeypatch.setattr(stream, "BLOCK", block)
    run_scene(folder / "scene.yaml", folder / "streamed", rocks=FEW, recording=False)
    rpf3d.write_run(rpf3d.simulate(folder / "scene.yaml", rocks=FEW), folder / "kept", recording=False)
    streamed, kept = folder / "streamed", folder / "kept"
    assert (streamed / "deposits.csv").read_bytes() == (kept / "deposits.csv").read_bytes()
    assert (streamed / "deposits.csv").read_bytes().count(b"\n") == FEW + 1
    tables = [parquet.read_table(path / "impacts.parquet") for path in (streamed, kept)]
    assert tables[0].to_pylist() == tables[1].to_pylist() and tables[0].schema == tables[1].schema
    timed = {"read_s", "index_s", "wall_s", "fly_s", "compile_s", "write_s", "total_s", "rocks_per_s"}
    told = [facts(path) for path in (streamed, kept)]
    assert {name: told[0][name] for name in told[0].keys() - timed} == {
        name: told[1][name] for name in told[1].keys() - timed
    }  # fmt: skip
    for path in (kept / "hazard").glob("*.tif"):
        assert path.read_bytes() == (streamed / "hazard" / path.name).read_bytes()


@pytest.mark.long
def test_without_impacts_there_is_no_table_of_them_and_everything_else_is_the_same(folder: Path) -> None:
    for name, text in (("with", ""), ("without", "outputs: {impacts: false}\n")):
        run_scene(more(folder, text), folder / name, rocks=FEW, recording=False)
    names = [{path.name for path in (folder / name).iterdir()} for name in ("with", "without")]
    assert names[0] - names[1] == {"impacts.parquet"} and names[1] < names[0]
    for name in ("deposits.csv", "terrain.vtp", "hazard/impacts.tif"):
        assert (folder / "with" / name).read_bytes() == (folder / "without" / name).read_bytes(), name
    assert facts(folder / "with")["impacts"] == facts(folder / "without")["impacts"]


# --- memory -----------------------------------------------------------------------------------------------------------


@pytest.mark.long
def test_memory_does_not_grow_with_the_rocks(folder: Path, monkeypatch: pytest.MonkeyPatch, no_pictures: None) -> None:
    pytest.importorskip("numba", reason="numba is not installed: plain Python would fly for an hour")
    monkeypatch.setattr(stream, "BLOCK", 8192)
    monkeypatch.setattr(samples, "EXACT", 5000)
    monkeypatch.setattr("rpf3d_core.runs.run.SHOWN", 1000)
    scene = more(folder, "outputs: {impacts: false, trajectories: 10}\nhazard: {cell: 0.5}\n")
    peaks = [peak_of(scene, folder / "out", rocks) for rocks in (3000, 24_000, 200_000)][1:]  # in blocks of 8,000
    assert facts(folder / "out")["rocks"] == 200_000
    assert peaks[1] < peaks[0] + OF_THEIR_OWN


def peak_of(scene: Path, out: Path, rocks: int) -> int:
    """Return the peak memory (bytes) that a run allocates."""
    tracemalloc.start()
    try:
        run_scene(scene, out, rocks=rocks, engine="compiled", recording=False)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_maps_that_need_too_much_memory_are_refused_before_a_rock_flies(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("rpf3d_core.runs.run.fly_scene", lambda *_: pytest.fail("it flew"))
    for command in ("run", "check"):
        scene = more(folder, "hazard: {cell: 0.01, memory_gb: 0.1}\n")
        out, printed = (("--out", folder / "out"), "") if command == "run" else ((), "terrain")
        said = refused(monkeypatch, capsys, command, scene, *out, printed=printed)
        assert "need 0.34 GB of memory, but memory_gb allows 0.1 GB" in said
        (fits,) = re.findall(r"a cell of ([\d.]+) m fits: set cell to \1", said)
        more(folder, f"hazard: {{cell: {fits}, memory_gb: 0.1}}\n")
        assert call(monkeypatch, "check", folder / "more.yaml") == 0
        capsys.readouterr()
    assert not (folder / "out").exists()


# --- how many rocks ---------------------------------------------------------------------------------------------------


def test_rocks_double_until_the_target_is_reached_and_the_report_says_so(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = more(folder, "rocks: auto\ntarget: {half_width: 0.03, p95_energy: 0.1}\n")
    assert call(monkeypatch, "run", scene, "--out", folder / "out") == 0
    told = facts(folder / "out")
    convergence = told["convergence"]
    rocks = [step["rocks"] for step in convergence["steps"]]
    assert rocks == [FIRST_ROUND * 2**k for k in range(len(rocks))] and rocks[-1] == told["rocks"]
    assert convergence["reached"] is True and told["partial"] is False
    assert convergence["half_width"] <= 0.03 and convergence["p95_energy_change"] <= 0.1
    assert len(rocks) >= 3, "percentiles have to hold still over two doublings"
    assert (folder / "out" / "convergence.png").stat().st_size > 0
    said = capsys.readouterr().out
    reached = "target reached: half-width of the sampling intervals of shares"
    assert f"{reached} {convergence['half_width']:.3g} (target 0.03)" in said
    low, high = told["areas_of_interest"]["middle"]["reached"]["interval_95"]
    assert 0.5 * (high - low) <= convergence["half_width"]
    assert set(convergence["steps"][-1]["places"]) == {"middle"}, "the areas of interest decide, where there are any"


@pytest.mark.long
@pytest.mark.parametrize(("most", "flown"), [(500, [500]), (1000, [1000]), (3999, [1000, 2000])])
def test_a_target_that_is_out_of_reach_is_given_up_and_the_report_says_so(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], no_pictures: None, most: int,
    flown: list[int],
) -> None:  # fmt: skip
    scene = more(folder, f"rocks: auto\ntarget: {{half_width: 0.0001, most_rocks: {most}}}\n")
    assert call(monkeypatch, "run", scene, "--out", folder / "out", "--engine", "reference") == 0
    told = facts(folder / "out")
    assert [step["rocks"] for step in told["convergence"]["steps"]] == flown
    assert told["rocks"] == told["rocks_planned"] == flown[-1] and told["partial"] is False
    assert told["convergence"]["reached"] is False
    assert "target NOT reached" in capsys.readouterr().out


def test_the_rocks_of_an_open_number_are_those_of_the_number_they_came_to(folder: Path, no_pictures: None) -> None:
    scene = more(folder, "target: {half_width: 0.0001, most_rocks: 2000}\n")
    lines = []
    for name, rocks in (("open", "auto"), ("fixed", 2000)):
        run_scene(scene, folder / name, rocks=rocks, recording=False, engine="compiled")
        lines.append(sorted((folder / name / "deposits.csv").read_text().splitlines()))
    assert lines[0] == lines[1] and len(lines[0]) == 2001


def test_an_open_number_of_rocks_is_kept_whole_in_memory(folder: Path, no_pictures: None) -> None:
    scene = more(folder, "target: {half_width: 0.0001, most_rocks: 2000}\n")
    run = rpf3d.simulate(scene, rocks="auto", engine="compiled")
    assert len(run.flights.deposits.rock) == run.totals.rocks == 2000
    rpf3d.write_run(run, folder / "out", recording=False)
    assert (folder / "out" / "deposits.csv").read_bytes().count(b"\n") == 2001


def test_every_source_flies_in_the_first_round_even_if_the_most_rocks_do_not_suffice(folder: Path) -> None:
    """The danger of a source without a rock would count as none, and doubling would never give it a rock."""
    scene = read_scene(folder / "scene.yaml")
    few, many = (source.model_copy(update={"rocks": n}) for source, n in zip(scene.sources, (1, 5000), strict=True))
    target = scene.target.model_copy(update={"most_rocks": 1000})
    auto = scene.model_copy(update={"rocks": "auto", "sources": (few, many), "target": target})
    rounds = list(rounds_of(auto, [1, 1]))
    assert rounds[0].last[0] >= 1 and 1000 <= rounds[-1].rocks <= 1001


def test_a_number_of_rocks_leaves_one_round(folder: Path) -> None:
    assert list(rounds_of(read_scene(folder / "scene.yaml"), [1, 1])) == [([0, 0], [3, 1])]


# --- rocks that fail --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("engine", made.ENGINES)
def test_a_rock_that_fails_is_counted_and_in_no_map(
    folder: Path, monkeypatch: pytest.MonkeyPatch, no_pictures: None, engine: str
) -> None:
    third = "  - {name: absurd, points: [[8.3, 7.2, 9]], rocks: 5}\nground: sliding\n"
    (folder / "scene.yaml").write_text(SCENE.replace("ground: sliding\n", third) + AREAS)
    drawn = fly_scene_module.releases_in_ranges

    def too_fast(*of: Any) -> Releases:
        """Return releases whose speeds have an infinite square, which no scene can cause."""
        releases = drawn(*of)
        releases.v[releases.source == 2] = (1e200, 0.0, -1e200)
        return releases

    monkeypatch.setattr(fly_scene_module, "releases_in_ranges", too_fast)
    run = run_scene(folder / "scene.yaml", folder / "out", engine=engine, recording=False)
    assert run.totals.outcomes == {Outcome.STOPPED: 4, Outcome.FAILED: 5}
    told = facts(folder / "out")
    assert told["outcomes"]["failed"]["rocks"] == 5 and told["rocks"] == 9
    for layers in (run.maps.cells, run.maps.facets, run.maps.zones, run.maps.areas):
        assert layers.rocks.max() <= 4 and layers.passages.max() <= 4 * 100
        assert not np.nanmax(layers.speed.largest) > 100.0 and not np.isinf(layers.energy.largest).any()
    assert told["max_speed_m_s"]["rocks"] == 4 and told["max_speed_m_s"]["max"] < 100.0
    assert 0.0 < told["path_m"] < 4 * 100.0
    failed = run.flights.deposits.outcome == Outcome.FAILED
    assert run.flights.deposits.source[failed].tolist() == [2] * 5
    again = rpf3d.replay(folder / "scene.yaml", "absurd", 3, engine=engine)
    assert again.flights.deposits.outcome.tolist() == [Outcome.FAILED], "by its source, number and seed"
