"""Tests that each script in examples/ runs to its end in a separate process and an empty folder."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest
from programs.command_line import ROOT, environment

EXAMPLES = ROOT / "examples"
SCRIPTS = sorted(path.stem for path in EXAMPLES.glob("[!_]*.py"))
LONGEST = 900.0
"""Timeout of a script (s): the live node may first have to be compiled, on a busy machine."""
LINES = range(10, 61)
"""Allowed numbers of lines of a script."""


def run(name: str, folder: Path, *options: str, **changes: str) -> list[str]:
    """Run a script in a folder; return the lines that it prints."""
    done = subprocess.run(
        [sys.executable, EXAMPLES / f"{name}.py", *options],
        cwd=folder, env=environment(**changes), capture_output=True, text=True, timeout=LONGEST,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


def numbers(line: str) -> list[float]:
    """Return the numbers in a line; digits in units such as m2 do not count."""
    return [float(word.replace(",", "")) for word in re.findall(r"(?<![A-Za-z\d.])[-+]?\d[\d,]*\.?\d*", line)]


def test_every_script_has_a_test_here_and_is_short() -> None:
    tests = Path(__file__).read_text(encoding="utf-8")
    assert len(SCRIPTS) == 10
    assert [name for name in SCRIPTS if f'run("{name}"' not in tests] == []
    lengths = {name: len((EXAMPLES / f"{name}.py").read_text(encoding="utf-8").splitlines()) for name in SCRIPTS}
    assert [name for name, lines in lengths.items() if lines not in LINES] == []


def test_a_run_in_ten_lines_prints_where_each_rock_stops(tmp_path: Path) -> None:
    lines = run("01_ten_lines", tmp_path)
    assert [numbers(line)[0] for line in lines] == list(range(100))
    heights = [numbers(line)[3] for line in lines]
    assert all(1390 < z < 1690 for z in heights), "within the pit, below its crest"
    assert sum(z > 1670 for z in heights) > 50, "the first bench holds most of the rocks"
    assert min(heights) < 1630, "some come to the ramp"


@pytest.mark.long
def test_zones_of_a_mesh_of_ones_own_hold_all_rocks_and_gravel_holds_more(tmp_path: Path) -> None:
    lines = run("02_own_mesh", tmp_path)
    shares = {line.split()[0]: numbers(line)[0] for line in lines}
    assert set(shares) == {"face", "bench", "floor", "gravel_bed"}
    assert sum(shares.values()) == pytest.approx(100, abs=0.2)
    assert shares["face"] == 0 and shares["gravel_bed"] > 30 and shares["floor"] > 30
    facets = (tmp_path / "out/own_mesh/floor.obj").read_text().count("\nf ")
    assert facets == 43 * 30 * 2
    assert (tmp_path / "out/own_mesh/result/terrain.vtp").is_file()


def test_a_rebound_of_ones_own_stops_rocks_sooner(tmp_path: Path) -> None:
    (constant, *_, far), (sand, *_, near) = (numbers(line) for line in run("03_own_rebound", tmp_path))
    assert 5 < sand < constant < 20, "median runouts (m)"
    assert near < far / 3, "95th percentiles (m)"


def test_a_hazard_map_is_a_geotiff_in_which_fewer_cells_have_larger_shares(tmp_path: Path) -> None:
    rasterio = pytest.importorskip("rasterio")
    first, meaning, *levels = run("04_hazard_map", tmp_path)
    path = tmp_path / "out/hazard_map/hazard/reach_probability.tif"
    with rasterio.open(path) as tif:
        assert tif.crs.to_epsg() == 32633 and tif.res == (5, 5)
        reach = tif.read(1)
    assert "EPSG:32633" in first and "share of all simulated rocks" in meaning
    for line, share in zip(levels, (0.01, 0.05, 0.1), strict=True):
        cells = int((reach >= share).sum())
        assert numbers(line) == [100 * share, cells, 25 * cells] and cells > 0
    assert [numbers(line)[1] for line in levels] == sorted((numbers(line)[1] for line in levels), reverse=True)


@pytest.mark.long
def test_the_chosen_barrier_keeps_rocks_off_the_road(tmp_path: Path) -> None:
    before, figures, chosen, after, caught = run("05_barrier_design", tmp_path)
    assert numbers(before)[0] > 50 and numbers(after)[0] < 5, "shares of the rocks that reach the road (%)"
    energy, height = numbers(figures)
    capacity, high = numbers(chosen)
    assert energy <= capacity and height < high, "the fence is chosen from the figures"
    assert numbers(caught)[0] > 95
    summary = json.loads((tmp_path / "out/barrier_design/with_fence/summary.json").read_text())
    assert summary["outcomes"]["caught"]["rocks"] > 100


@pytest.mark.long
def test_ten_times_smaller_steps_are_ten_times_closer_and_ten_times_as_many(tmp_path: Path) -> None:
    exact, *steps = run("06_price_of_accuracy", tmp_path)
    assert 5 < numbers(exact)[0] < 30
    size, error, price = zip(*(numbers(line) for line in steps), strict=True)
    assert list(size) == [0.01, 0.003, 0.001, 0.0003, 0.0001]
    for i in (0, 1, 2):
        assert 5 < error[i] / error[i + 2] < 20, "the error goes with the step"
        assert 5 < price[i + 2] / price[i] < 20, "the price goes with its inverse"


@pytest.mark.long
def test_a_berm_at_the_toe_keeps_more_rocks_off_the_road(tmp_path: Path) -> None:
    reached = next(line for line in run("07_compare_designs", tmp_path) if line.startswith("road reached"))
    a, b, low, high = numbers(reached)
    assert b < a - 20 and low < b - a < high < 0 and reached.endswith(", significant")
    for design in "AB":
        assert (tmp_path / f"out/compare_designs/{design}/summary.json").is_file()


@pytest.mark.long
def test_a_project_of_rockyfor3d_becomes_a_scene_that_flies(tmp_path: Path) -> None:
    lines = run("08_import_rockyfor3d", tmp_path)
    assert "zones: 2, of soil type and obstacles alike" in lines and "Not carried over:" in lines
    share, farthest = numbers(lines[-1])[0], numbers(lines[-1])[-1]
    assert share > 90 and 201000 < farthest < 201080
    text = (tmp_path / "out/import_rockyfor3d/scene/scene.yaml").read_text()
    assert "soil_4_rg_0.05_0.1_0.3" in text and "density: 2650" in text


def test_the_live_node_raises_the_level_and_ends_with_the_script(tmp_path: Path) -> None:
    pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")
    from rpf3d_ros.demo.domains import free_domain

    domain, lock = free_domain()
    with lock:
        level, hazard, end = run("09_live_node", tmp_path, ROS_DOMAIN_ID=str(domain), ROS_LOG_DIR=str(tmp_path))
    assert level.startswith("level of the site: evacuate; ") and "road" in level
    assert 20 < numbers(hazard)[0] <= 100, "the largest share of the rocks that reach a cell (%)"
    assert end == "the simulator has ended with exit code 0"
    log = "".join(path.read_text() for path in (tmp_path / "out/live_node/decisions").rglob("*") if path.is_file())
    assert "evacuate" in log


def test_a_replay_says_how_to_open_its_recording_and_opens_nothing(tmp_path: Path) -> None:
    recorded, how = run("10_replay", tmp_path)
    path = tmp_path / "out/replay/run.rrd"
    assert recorded.startswith("50 rocks are in ") and how == "open it with: rpf3d replay out/replay"
    assert path.read_bytes()[:4] == b"RRF2" and path.stat().st_size > 100_000


@pytest.mark.long
def test_the_replay_opens_the_viewer_with_a_flag(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, EXAMPLES / "10_replay.py", "--open"],
        cwd=tmp_path, env=environment(DISPLAY="", WAYLAND_DISPLAY=""), capture_output=True, text=True, timeout=LONGEST,
    )  # fmt: skip
    assert done.returncode != 0 and "there is no display to show it on" in done.stderr
