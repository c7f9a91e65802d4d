"""Tests of Ctrl-C and SIGTERM on a process with a terminal: while rocks fly, they leave a partial result."""

import csv
import json
import os
import signal
import sys
import time
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import pyarrow.parquet as parquet
import pytest
import rasterio
from input_files.terrain_files import SLOPE, grid, write_binary_stl
from programs.command_line import COMMAND, LONGEST, rpf3d
from programs.on_a_terminal import OnATerminal
from programs.processes import children_of, computed, is_there, threads_of
from programs.waiting import wait_for

RESULTS = {
    "summary.json", "deposits.csv", "impacts.parquet", "trajectories.parquet", "terrain.vtp", "trajectories.vtp",
    "profiles", "map.png", "hazard", "run.rrd", "inputs.json",
}  # fmt: skip
SCENE = f"""\
{SLOPE}  - {{name: top, points: [[8.3, 7.2, 9]], rocks: 3, spread: [0.5, 0.5, 0.5]}}
  - {{name: other, points: [[9.3, 7.2, 9]], rocks: 1, spread: [0.5, 0.5, 0.5]}}
ground: sliding
rebound: constant
"""
DEMO = Path(__file__).parents[2] / "config" / "scenes" / "demo.yaml"
INTERRUPTED = 130
COMPUTING = 5.0
"""Longest CPU time (s) until Ctrl-C has ended the flight; on an idle machine it takes well below 1 s."""
MANY = {"reference": 60_000, "compiled": 3_000_000}
"""Number of rocks, for each engine, that no machine can fly before the interruption."""
SOME_HAVE_FLOWN = "rocks/s"
"""Text that the progress bar shows from the first rocks on."""


def held(package: str, module: str, step: str, seconds: float = LONGEST) -> tuple[str, ...]:
    """Return the command line of the program with a pause (s) after a step, because a signal may arrive late."""
    return (
        sys.executable, "-c",
        "import time\n"
        f"from {package} import {module}\n"
        f"whole = {module}.{step}\n"
        f"{module}.{step} = lambda *given: (whole(*given), time.sleep({seconds:g}))[0]\n"
        "from rpf3d_core.results import painting\n"
        "painting.has_spare_core = lambda: True\n"  # a second process always draws
        "from rpf3d_core.cli import main\n"
        "main()\n",
    )  # fmt: skip


WRITES_ON = held("rpf3d_core.results", "folder", "_write_pictures")
PREPARES_ON = held("rpf3d_core.runs", "run", "prepare")
PREPARES_ON_A_WHILE = held("rpf3d_core.runs", "run", "prepare", 5.0)
REFUSED = 2


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    vertices, triangles = grid(16, 18)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


@pytest.fixture
def on_a_terminal(folder: Path):  # type: ignore[no-untyped-def]
    started: list[OnATerminal] = []

    def start(*words: object, command: Sequence[str] = tuple(COMMAND)) -> OnATerminal:
        started.append(OnATerminal(*words, cwd=folder, command=command))
        return started[-1]

    yield start
    for one in started:
        one.close()


def left_behind(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


@pytest.mark.long
@pytest.mark.parametrize(
    ("engine", "number"), [("reference", signal.SIGINT), ("compiled", signal.SIGTERM)], ids=["Ctrl-C", "SIGTERM"]
)
def test_an_interrupted_flight_leaves_a_whole_result_of_what_has_flown(
    on_a_terminal, folder: Path, engine: str, number: int
) -> None:  # type: ignore[no-untyped-def]
    if engine == "compiled":
        pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine")
    before = left_behind(folder)
    run = on_a_terminal("run", "scene.yaml", "--out", "out", "--rocks", MANY[engine], "--engine", engine)
    run.until(SOME_HAVE_FLOWN)
    run.send(number)
    assert run.end() == INTERRUPTED, run.shown[-500:]
    assert "Traceback" not in run.shown
    assert left_behind(folder) == sorted([*before, "out"])
    out = folder / "out"
    names = {path.name for path in out.iterdir()}
    assert names - {"critical_rock.parquet"} == RESULTS, "that path is there unless it is among the kept ones"
    facts = json.loads((out / "summary.json").read_text())
    assert facts["partial"] is True and facts["rocks_planned"] == MANY[engine]
    assert 0 < facts["rocks"] < MANY[engine]
    assert f"interrupted; {facts['rocks']:,} of {MANY[engine]:,} rocks have flown" in " ".join(run.shown.split())
    assert "nothing was written" not in run.shown
    said = [line for line in run.shown.splitlines() if line.startswith("rpf3d: ")]
    assert all(line.startswith("rpf3d: note: only ") for line in said[:-1]), "one source may have few rocks so far"
    assert said[-1].startswith("rpf3d: interrupted; ") and "it is partial" in " ".join(run.shown.split())[-40:]
    with (out / "deposits.csv").open(newline="") as file:
        lines = [(line["source"], line["rock"], line["outcome"]) for line in csv.DictReader(file)]
    assert len(lines) == len({line[:2] for line in lines}) == facts["rocks"], "each rock once, and no other"
    assert Counter(outcome for *_, outcome in lines) == {
        name: told["rocks"] for name, told in facts["outcomes"].items()
    }  # fmt: skip
    # Batches take every n-th rock, so each has its share of every source, within one rock.
    from_top = sum(source == "top" for source, *_ in lines)
    assert from_top == pytest.approx(0.75 * len(lines), abs=max(1.0, 0.05 * len(lines)))
    assert parquet.read_metadata(out / "impacts.parquet").num_rows == facts["impacts"]
    with rasterio.open(out / "hazard" / "deposits.tif") as raster:
        counts = raster.read(1, masked=True)
    assert counts.sum() == facts["outcomes"]["stopped"]["rocks"], "the maps hold what has flown, too"


@pytest.mark.long
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM], ids=["Ctrl-C", "SIGTERM"])
@pytest.mark.parametrize(("moment", "command"), [("preparing", PREPARES_ON), ("writing results", WRITES_ON)])
def test_a_run_interrupted_while_it_prepares_or_writes_leaves_nothing(
    on_a_terminal, folder: Path, moment: str, command: tuple[str, ...], number: int
) -> None:  # type: ignore[no-untyped-def]
    before = left_behind(folder)
    run = on_a_terminal("run", "scene.yaml", "--out", "out", "--rocks", 3, "--engine", "reference", command=command)
    run.until(moment)
    run.send(number)
    assert run.end() == INTERRUPTED
    assert "rpf3d: interrupted; nothing was written" in run.shown and "Traceback" not in run.shown
    assert left_behind(folder) == before


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "SIGKILL"])
def test_the_process_that_draws_ends_with_an_interrupted_or_killed_run(on_a_terminal, number: int) -> None:  # type: ignore[no-untyped-def]
    run = on_a_terminal("run", "scene.yaml", "--out", "out", "--rocks", 3, command=WRITES_ON)
    run.until("writing results")
    (drawing,) = children_of(run.process.pid)
    run.send(number)
    run.end()
    wait_for(lambda: not is_there(drawing), LONGEST)


@pytest.mark.long
def test_a_run_whose_drawing_process_is_killed_says_so_and_leaves_nothing(on_a_terminal, folder: Path) -> None:  # type: ignore[no-untyped-def]
    before = left_behind(folder)
    words = ("run", "scene.yaml", "--out", "out", "--rocks", 3, "--engine", "reference")  # no child compiles
    run = on_a_terminal(*words, command=PREPARES_ON_A_WHILE)
    run.until("preparing")
    (drawing,) = wait_for(lambda: children_of(run.process.pid), LONGEST)
    wait_for(lambda: threads_of(drawing) > 1, LONGEST)  # drawing has begun
    time.sleep(0.5)
    os.kill(drawing, signal.SIGKILL)
    assert run.end() == REFUSED
    assert "the process that draws the pictures was killed by SIGKILL" in " ".join(run.shown.split())
    assert "Traceback" not in run.shown and left_behind(folder) == before


@pytest.mark.long
def test_ctrl_c_a_second_time_ends_at_once_and_leaves_nothing(on_a_terminal, folder: Path) -> None:  # type: ignore[no-untyped-def]
    before = left_behind(folder)
    words = ("run", "scene.yaml", "--out", "out", "--rocks", MANY["reference"], "--engine", "reference")
    run = on_a_terminal(*words, command=WRITES_ON)
    run.until("flying rocks")
    run.send(signal.SIGINT)
    run.until("writing results")
    run.send(signal.SIGINT)
    assert run.end() == INTERRUPTED
    assert "nothing was written" in run.shown and "Traceback" not in run.shown
    assert left_behind(folder) == before


def test_an_interrupted_run_leaves_the_earlier_result_as_it_was(on_a_terminal, folder: Path) -> None:  # type: ignore[no-untyped-def]
    assert rpf3d("run", "scene.yaml", "--out", "out", cwd=folder).returncode == 0
    before = {path.name: path.stat().st_mtime_ns for path in (folder / "out").iterdir()}
    run = on_a_terminal("run", "scene.yaml", "--out", "out", command=WRITES_ON)
    run.until("writing results")
    run.send(signal.SIGINT)
    assert run.end() == INTERRUPTED
    assert {path.name: path.stat().st_mtime_ns for path in (folder / "out").iterdir()} == before
    assert not [path for path in folder.iterdir() if path.name.startswith(".")]


@pytest.mark.long
def test_the_slow_engine_stops_flying_soon(on_a_terminal) -> None:  # type: ignore[no-untyped-def]
    run = on_a_terminal("run", DEMO, "--out", "out", "--rocks", 6000, "--engine", "reference")
    run.until("flying rocks")
    time.sleep(1.0)  # well into the first batch
    run.send(signal.SIGINT)
    before = computed(run.process.pid)
    run.until("writing results")
    assert computed(run.process.pid) - before < COMPUTING
    assert run.end() == INTERRUPTED
