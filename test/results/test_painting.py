"""Tests that a second process draws the same pictures as this process, and reports its failures here."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from flights.flights_on_a_floor import SURVEY, findings, floor, scene, thrown
from input_files.terrain_files import SLOPE, grid, write_binary_stl
from programs.command_line import LONGEST, ROOT, environment
from programs.processes import children_of, is_there

from rpf3d_core.errors import InputError
from rpf3d_core.hazard.convergence import Place, Step
from rpf3d_core.results import painting as module
from rpf3d_core.results.findings import Run
from rpf3d_core.results.folder import result_folder, write_all_tables, write_findings
from rpf3d_core.results.painting import Painting, painting

STEPS = [Step(n, {"floor": Place(0.5, 0.4, 0.1, 5e3)}) for n in (1000, 2000)]
DRAWN = {
    "map.png", "convergence.png", "hazard/reach_probability.png", "hazard/energy_p95.png", "hazard/height_p95.png",
    "profiles/overview.png", "profiles/overview.csv", "profiles/sections.png", "profiles/sections.csv",
}  # fmt: skip
"""Files of the drawn pictures and of the tables with their points."""


@pytest.fixture
def two_cores(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "has_spare_core", lambda: True)


def a_run(tmp_path: Path) -> Run:
    terrain = floor(SURVEY)
    return findings(scene(tmp_path), terrain, thrown(terrain), steps=STEPS)


def written(folder: Path, run: Run, drawn: Painting | None) -> Path:
    with result_folder(folder) as part:
        write_all_tables(part, run)
        if drawn is not None:
            drawn.begin(run.terrain)
        write_findings(part, run, painting=drawn)
    return folder


def files(folder: Path) -> dict[str, bytes]:
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_pictures_of_a_second_process_have_the_same_bytes(tmp_path: Path, two_cores: None) -> None:
    run = a_run(tmp_path)
    with painting() as drawn:
        assert drawn._second is not None
        apart = files(written(tmp_path / "apart", run, drawn))
        assert drawn._second is not None and drawn.waited_s > 0.0
    here = files(written(tmp_path / "here", run, None))
    assert apart.keys() == here.keys() >= DRAWN
    assert [name for name in sorted(DRAWN) if apart[name] != here[name]] == []


def test_no_process_is_left(tmp_path: Path, two_cores: None) -> None:
    with painting() as drawn:
        assert drawn._second is not None
        number = drawn._second._process.pid
        assert number in children_of(os.getpid())
        written(tmp_path / "out", a_run(tmp_path), drawn)
    assert not is_there(number)


def test_a_killed_process_is_an_error_that_says_what_to_do_and_leaves_the_earlier_result(
    tmp_path: Path, two_cores: None
) -> None:
    run = a_run(tmp_path)
    before = files(written(tmp_path / "out", run, None))
    with painting() as drawn:
        assert drawn._second is not None and drawn._second.has_begun()
        drawn._second._process.send_signal(signal.SIGKILL)
        with pytest.raises(InputError, match=r"pictures was killed by SIGKILL.*`outputs: \{pictures: false\}`"):
            written(tmp_path / "out", run, drawn)
    assert files(tmp_path / "out") == before
    assert {path.name for path in tmp_path.iterdir()} == {"out", "floor.yaml"}


def test_a_full_disk_is_the_same_error_in_both_processes(
    tmp_path: Path, two_cores: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    run, sentences = a_run(tmp_path), set()
    folder = tmp_path / "out"
    for second in (False, True):
        with painting(None if second else 1) as drawn:
            drawn.begin(run.terrain)
            with pytest.raises(InputError) as refused, result_folder(folder) as part:
                (part / "map.png").mkdir()  # stands for any file that cannot be written
                write_findings(part, run, painting=drawn)
        sentences.add(str(refused.value))
    (sentence,) = sentences
    assert sentence == f"{folder}: could not be written (Is a directory)"


def test_there_is_no_second_process_where_no_core_is_free_or_for_one_thread(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(module, "has_spare_core", lambda: False)
    with painting() as busy:
        assert busy._second is None
    monkeypatch.setattr(module, "has_spare_core", lambda: True)
    with painting(threads=1) as one_thread:
        assert one_thread._second is None
        assert files(written(tmp_path / "out", a_run(tmp_path), one_thread)).keys() >= DRAWN


@pytest.mark.parametrize("program", ["", "/nowhere/python", "/bin/true"])
def test_where_no_second_process_can_start_this_one_draws(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, two_cores: None, program: str
) -> None:
    monkeypatch.setattr(sys, "executable", program)
    with painting() as drawn:
        assert files(written(tmp_path / "out", a_run(tmp_path), drawn)).keys() >= DRAWN
        assert drawn._second is None


def test_pictures_that_the_scene_leaves_out_need_no_process(tmp_path: Path, two_cores: None) -> None:
    with painting() as drawn:
        assert drawn._second is not None
        number = drawn._second._process.pid
        drawn.end()
        assert not is_there(number)
        drawn.wait()
    assert drawn.waited_s == 0.0


def test_a_script_without_a_guard_runs_once_and_leaves_no_process(tmp_path: Path) -> None:
    vertices, triangles = grid(16, 18)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    (tmp_path / "scene.yaml").write_text(f"{SLOPE}  - {{name: top, points: [[8.3, 7.2, 9]], rocks: 3}}\n")
    script = tmp_path / "script.py"
    script.write_text(
        "import os\n"
        "from programs.processes import children_of\n"
        "from rpf3d_core.results import painting\n"
        "from rpf3d_core.runs import run\n"
        "painting.has_spare_core = lambda: True\n"
        "seen, prepare = [], run.prepare\n"
        "run.prepare = lambda *given: (seen.extend(children_of(os.getpid())), prepare(*given))[1]\n"
        "run.run_scene('scene.yaml', 'out', engine='reference')\n"
        "print('flown', len(seen), len(children_of(os.getpid())))\n"
    )
    support = str(Path(__file__).parents[1] / "support")
    done = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, timeout=LONGEST,
        env=environment(PYTHONPATH=os.pathsep.join([str(ROOT), support])),
    )  # fmt: skip
    assert (done.returncode, done.stdout.split()) == (0, ["flown", "1", "0"]), done.stderr
    assert (tmp_path / "out" / "map.png").is_file() and (tmp_path / "out" / "hazard" / "energy_p95.png").is_file()
