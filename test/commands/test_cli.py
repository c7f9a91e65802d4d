"""Tests of the command line: bad input and Ctrl-C end with one sentence, an exit code, and no files left."""

import importlib.metadata
import json
import re
import resource
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import SLOPE, ascii_stl, grid, write_binary_stl
from programs.command_line import call, python, refused, rpf3d

from rpf3d_core.setup.terrain import read_surface
from rpf3d_core.terrain.pit.parameters import Pit

SCENE = f"""\
{SLOPE}  - {{name: top, points: [[1.3, 1.2, 9]], rocks: 3}}
ground: sliding
rebound: constant
"""
RESULTS = {
    "summary.json", "deposits.csv", "impacts.parquet", "trajectories.parquet", "terrain.vtp", "trajectories.vtp",
    "profiles", "map.png", "hazard", "run.rrd", "inputs.json",
}  # fmt: skip
SCENES = Path(__file__).parents[2] / "config" / "scenes"

COMMANDS = ("run", "check", "cost", "materials", "pit", "replay", "compare", "study", "audit")

HELP_S = 2.0
"""Longest CPU time (s) for help, which takes 0.3 s; importing VTK and numba would add more than 1 s."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return a folder with a valid scene, and with its mesh damaged in many ways."""
    vertices, triangles = grid(5, 6)
    corners = vertices[triangles]
    whole = write_binary_stl(tmp_path / "slope.stl", corners)
    (tmp_path / "empty.stl").write_bytes(b"")
    (tmp_path / "truncated.stl").write_bytes(whole.read_bytes()[:-37])
    (tmp_path / "truncated_ascii.stl").write_text(ascii_stl(corners)[:700])
    write_binary_stl(tmp_path / "boasting.stl", corners, announced=4_000_000_000)
    for name, value in (("nan", np.nan), ("infinite", np.inf)):
        damaged = corners.copy()
        damaged[3, 1, 2] = value
        write_binary_stl(tmp_path / f"{name}.stl", damaged)
    (tmp_path / "scene.yaml").write_text(SCENE)
    return tmp_path


@pytest.fixture
def no_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Write no pictures and no recording, which take most of the time of a run and have their own tests."""
    monkeypatch.setattr("rpf3d_core.results.folder._write_pictures", lambda *_: None)
    monkeypatch.setattr("rpf3d_core.recordings.log.write_recording", lambda *_: None)


BAD_SCENES = [
    ("materials:", "matterials:", "line 4: `matterials` is not a key of a scene; did you mean `materials`?"),
    ("restitution: 0.5", "restitution: 1.5", "line 5: `materials.rock.normal_restitution` is 1.5, but must"),
    ("restitution: 0.5", "restitution: -0.1", "line 5: `materials.rock.normal_restitution` is -0.1, but must"),
    ("ground: sliding", "rock: {mass: -3}", "scene.yaml, line 8: `rock.mass` is -3, but must be a number above 0 (kg)"),
    ("slope.stl", "gone.stl", "line 3: `terrain.files[0].path` names 'gone.stl', but there is no such file"),
    ("slope.stl", "empty.stl", "empty.stl: is empty"),
    ("slope.stl", "truncated.stl", "truncated.stl: the header of a binary STL announces 40 triangles"),
    ("slope.stl", "truncated_ascii.stl", "truncated_ascii.stl: the file ends after line"),
    ("slope.stl", "boasting.stl", "boasting.stl: the header of a binary STL announces 4,000,000,000 triangles"),
    ("slope.stl", "nan.stl", "nan.stl: facet number 3 (from 0) has a vertex that is NaN or infinite"),
    ("slope.stl", "infinite.stl", "infinite.stl: facet number 3 (from 0) has a vertex that is NaN or infinite"),
    ("1.2, 9]", "1.2, -9]", "source 'top': rock 0 at (1.300, 1.200, -9.000) is 10.5 m under the ground; raise it"),
    ("[1.3, 1.2", "[130, 1.2", "source 'top': rock 0 at (130.000, 1.200, 9.000) is off the terrain"),
    ("zone: rock", "zone: sand", "scene.yaml, line 4: no material for the zone 'sand'"),
    ("ground: sliding", "effects: {dreg: {}}", "scene.yaml, line 8: `effects.dreg` is not a key of a scene"),
    ("terrain:", "terrain: [", "scene.yaml, line 3: not valid YAML"),
]


@pytest.mark.parametrize(("written", "instead", "sentence"), BAD_SCENES, ids=[case[2][:40] for case in BAD_SCENES])
@pytest.mark.parametrize("command", ["run", "check"])
def test_a_bad_scene_is_refused_in_one_sentence_and_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, command: str,
    written: str, instead: str, sentence: str,
) -> None:  # fmt: skip
    assert written in SCENE
    (folder / "scene.yaml").write_text(SCENE.replace(written, instead, 1))
    before = sorted(folder.rglob("*"))
    out = ("--out", folder / "out") if command == "run" else ()
    if command == "check" and sentence.startswith("source"):
        pytest.skip("check shows sources that are out of place in its table: see test_check.py")
    shown = "terrain  " if command == "check" and "no material" in sentence else ""  # the terrain itself is valid
    assert sentence in refused(monkeypatch, capsys, command, folder / "scene.yaml", *out, printed=shown)
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--rocks", 0), "the number of rocks is 0; it must be from 1 to 4000000000, or auto"),
        (("--rocks", -5), "the number of rocks is -5; it must be from 1 to 4000000000, or auto"),
        (("--rocks", 10**20), f"the number of rocks is {10**20}; it must be from 1 to 4000000000, or auto"),
        (("--rocks", "1e5"), "--rocks is '1e5'; it must be a whole number of at least 1, or auto"),
        (("--engine", "foo"), "the engine is 'foo'; it must be auto, reference or compiled"),
        (("--seed", -1), f"the seed is -1; it must be a whole number from 0 to {2**63 - 1}"),
        (("--seed", 2**63), f"the seed is {2**63}; it must be a whole number from 0 to {2**63 - 1}"),
    ],
)
@pytest.mark.parametrize("command", ["run", "check"])
def test_a_bad_option_is_refused_in_one_sentence_and_leaves_nothing(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, command: str,
    words: tuple[object, ...], sentence: str,
) -> None:  # fmt: skip
    if command == "check" and "--seed" in words:
        pytest.skip("checking has no use for a seed")
    out = ("--out", folder / "out") if command == "run" else ()
    assert refused(monkeypatch, capsys, command, folder / "scene.yaml", *out, *words) == sentence
    assert not (folder / "out").exists()


def test_the_largest_seed_of_the_command_line_is_the_largest_of_a_scene(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    for seed, code in ((2**63 - 1, 0), (2**63, 2)):
        (folder / "scene.yaml").write_text(f"{SCENE}seed: {seed}\n")
        assert call(monkeypatch, "check", folder / "scene.yaml") == code


def test_a_scene_that_is_not_there_or_is_a_folder_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    said = refused(monkeypatch, capsys, "run", folder / "none.yaml", "--out", folder / "out")
    assert said == f"{folder / 'none.yaml'}: there is no such scene file"
    assert "cannot be read as a scene file" in refused(monkeypatch, capsys, "check", folder)


def test_a_result_folder_that_is_occupied_is_refused_before_any_work(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    monkeypatch.setattr("rpf3d_core.runs.run.prepare", lambda *_: pytest.fail("it worked before it looked"))
    said = refused(monkeypatch, capsys, "run", folder / "scene.yaml", "--out", folder)
    assert "but no result of rpf3d; give the path of a new or empty folder" in said
    file = folder / "slope.stl"
    before = file.read_bytes()
    said = refused(monkeypatch, capsys, "run", folder / "scene.yaml", "--out", file)
    assert said == f"{file}: is a file; the results need the path of a folder"
    assert file.read_bytes() == before
    said = refused(monkeypatch, capsys, "run", folder / "scene.yaml", "--out", file / "out")
    assert "cannot be written" in said


def test_a_result_folder_that_turns_out_not_to_be_writable_is_refused_in_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    # No one can create a folder in /proc; the superuser may write to most other folders.
    if not Path("/proc").is_dir():
        pytest.skip("there is no /proc")
    said = refused(monkeypatch, capsys, "run", folder / "scene.yaml", "--out", "/proc/rpf3d")
    assert said.startswith("/proc/rpf3d: could not be written")


@pytest.mark.parametrize("table", ["impacts_table", "write_trajectories"])
def test_a_disk_that_fills_up_leaves_nothing_and_no_traceback(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, table: str
) -> None:
    """The disk fills up while rocks fly, or afterwards."""

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(f"rpf3d_core.results.tables.{table}", full)
    said = refused(monkeypatch, capsys, "run", folder / "scene.yaml", "--out", folder / "out")
    assert said == f"{folder / 'out'}: could not be written (No space left on device)"
    assert [path.name for path in folder.iterdir() if "out" in path.name] == []


@pytest.mark.long
@pytest.mark.parametrize("largest", [100, 20_000, 60_000])
def test_files_that_may_not_grow_end_a_run_in_one_sentence_and_leave_nothing(folder: Path, largest: int) -> None:
    """The limit acts like a full disk, in the tables or in one of the files that are written at the end."""
    done = python(
        f"import resource, sys\nresource.setrlimit(resource.RLIMIT_FSIZE, ({largest}, {largest}))\n"
        "from rpf3d_core import cli\n"
        "sys.argv = ['rpf3d', 'run', 'scene.yaml', '--out', 'out', '--engine', 'reference']\ncli.main()",
        cwd=folder,
    )
    assert done.returncode == 2, done.stderr
    assert done.stderr.splitlines()[-1].startswith("rpf3d: out: could not be written")
    assert "Traceback" not in done.stderr
    assert [path.name for path in folder.iterdir() if "out" in path.name] == []


def test_an_option_that_does_not_exist_or_is_no_number_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    for words in (("cost", folder / "scene.yaml"), ("run",), ("frob",), ("run", "a", "--rocks", "x", "--out", "b")):
        assert call(monkeypatch, *words) == 2
        assert "Traceback" not in capsys.readouterr().err


def test_a_refusal_in_a_process_of_its_own_has_exit_code_2_and_no_traceback(folder: Path) -> None:
    done = rpf3d("run", "none.yaml", "--out", "out", cwd=folder)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "rpf3d: none.yaml: there is no such scene file\n"


@pytest.mark.long
def test_a_run_says_what_it_did_and_leaves_all_files(folder: Path) -> None:
    done = rpf3d("run", "scene.yaml", "--out", "out/a b", "--rocks", 7, cwd=folder)
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    assert {path.name for path in (folder / "out" / "a b").iterdir()} == RESULTS
    # The text stays on one line, however narrow the output is.
    numbers = (
        r"^7 rocks, \d+ impacts, reference engine: start [\d.]+ s, read [\d.]+ s, index [\d.]+ s, compile [\d.]+ s, "
        r"fly [\d.]+ s, count [\d.]+ s, write [\d.]+ s(, pictures [\d.]+ s)?: [\d.]+ s$"
    )
    assert re.search(numbers, done.stdout, re.MULTILINE)
    assert done.stdout.endswith(f"results in {folder / 'out' / 'a b'}\n")
    assert "\x1b" not in done.stdout, "no colours where the output is no terminal"
    facts = json.loads((folder / "out" / "a b" / "summary.json").read_text())
    for name in facts["outcomes"]:
        assert name in done.stdout


def test_without_a_folder_the_results_are_in_out_under_the_name_of_the_scene(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    assert call(monkeypatch, "run", "scene.yaml", "--engine", "reference") == 0
    assert (folder / "out" / "scene" / "summary.json").is_file()


def test_pieces_of_rocks_are_told_from_rocks_on_the_screen(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, no_pictures: None
) -> None:
    """Otherwise a share of rocks and fragments together could be taken for a share of released rocks."""
    breaking = "effects: {fragmentation: {least_ratio: 0.01, spread: 0, least_volume: 0.01, generations: 1}}\n"
    (folder / "scene.yaml").write_text(SCENE + breaking)
    assert call(monkeypatch, "run", folder / "scene.yaml", "--out", folder / "out") == 0
    printed, facts = capsys.readouterr(), json.loads((folder / "out" / "summary.json").read_text())
    rocks, pieces = facts["rocks"], facts["pieces"]
    assert pieces > 0 and rocks == 3 + pieces
    assert f"\n3 rocks and {pieces} pieces of them, " in printed.out
    assert f"{pieces} of {rocks} rocks are pieces of the other 3: shares and reach probability are" in printed.err


def test_names_with_square_brackets_are_printed_as_they_are(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path, no_pictures: None
) -> None:
    (folder / "scene.yaml").write_text(SCENE.replace("zone: rock", 'zone: "[/b]"').replace("  rock:", "  default:"))
    assert call(monkeypatch, "check", folder / "scene.yaml") == 0
    assert "[/b]" in capsys.readouterr().out
    assert call(monkeypatch, "run", folder / "scene.yaml", "--out", folder / "out[red]") == 0
    assert capsys.readouterr().out.endswith("out[red]\n")


def test_rocks_engine_and_seed_of_the_command_line_win_over_the_scene(
    monkeypatch: pytest.MonkeyPatch, folder: Path, no_pictures: None
) -> None:
    (folder / "scene.yaml").write_text(SCENE + "seed: 4\nengine: compiled\n")
    words = ("--out", folder / "out", "--rocks", 5, "--engine", "reference", "--seed", 9)
    assert call(monkeypatch, "run", folder / "scene.yaml", *words) == 0
    facts = json.loads((folder / "out" / "summary.json").read_text())
    assert (facts["rocks"], facts["engine"], facts["scene"]["seed"]) == (5, "reference", 9)


def test_both_engines_write_the_same_deposits_to_the_last_figure(
    monkeypatch: pytest.MonkeyPatch, folder: Path, no_pictures: None
) -> None:
    pytest.importorskip("numba", reason="numba is not installed: there is no compiled engine")
    spread = SCENE.replace("rocks: 3", "rocks: 60, spread: [0.8, 0.8, 0.5], velocity: [1, 0.3, 0]")
    (folder / "scene.yaml").write_text(spread)
    both = []
    for engine in ("reference", "compiled"):
        words = ("--out", folder / engine, "--engine", engine)
        assert call(monkeypatch, "run", folder / "scene.yaml", *words) == 0
        both.append((folder / engine / "deposits.csv").read_bytes())
    assert both[0] == both[1] and both[0].count(b"\n") == 61


@pytest.mark.long
def test_what_a_run_prints_fits_a_terminal_of_80_columns(folder: Path) -> None:
    words = ("run", SCENES / "demo.yaml", "--out", "out", "--rocks", 60, "--engine", "reference")
    done = rpf3d(*words, cwd=folder, COLUMNS="80")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    header = next(i for i, line in enumerate(lines) if line.startswith("zone"))
    end = next(i for i, line in enumerate(lines) if line.startswith("shares of all rocks"))
    rows = [line for line in lines[header + 1 : end] if "more in hazard/benches.csv" not in line]
    assert len(rows) > 3 and all(re.match(r"\S+ +\d[\d.]* % \([\d.]+-[\d.]+\)  ", row) for row in rows), "a line a row"
    assert max(map(len, lines[: end + 2])) <= 80


# --- help, check, pit, replay -----------------------------------------------------------------------------------------


def test_the_version_is_that_of_the_package(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    assert call(monkeypatch, "--version") == 0
    assert capsys.readouterr().out == f"rpf3d {importlib.metadata.version('rpf3d')}\n"


def test_help_is_quick_and_loads_neither_vtk_nor_numba() -> None:
    program = (
        "import sys\nfrom rpf3d_core import cli\nsys.argv = ['rpf3d', '--help']\n"
        "try:\n    cli.main()\nexcept SystemExit as end:\n    assert not end.code\n"
        "print('loaded', sorted({name.split('.')[0] for name in sys.modules}), file=sys.stderr)"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = python(program)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    assert done.returncode == 0
    for command in COMMANDS:
        assert command in done.stdout
    for heavy in ("vtk", "vtkmodules", "numba", "matplotlib", "pyarrow", "rerun", "rasterio"):
        assert f"'{heavy}'" not in done.stderr
    assert seconds < HELP_S


@pytest.mark.parametrize("command", COMMANDS)
def test_each_command_explains_itself(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    assert call(monkeypatch, command, "--help") == 0
    assert "Usage:" in capsys.readouterr().out


@pytest.mark.parametrize("extension", ["vtp", "stl", "ply", "obj", "STL"])
def test_a_pit_is_written_in_the_format_of_its_extension(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, extension: str
) -> None:
    path = tmp_path / f"pit.{extension}"
    assert call(monkeypatch, "pit", path, "--triangles", 5000) == 0
    said = capsys.readouterr().out
    written = read_surface(path)
    facets = len(written.points) // 3 if written.triangles is None else len(written.triangles)
    assert facets == pytest.approx(5000, rel=0.03), "the help says within 3 %"
    assert said == f"{facets:,} triangles in {path}\n"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("pit.xyz",), "pit.xyz: the extension must be one of .vtp, .stl, .ply, .obj"),
        (("pit",), "pit: the extension must be one of .vtp, .stl, .ply, .obj"),
        (("none/pit.stl",), "none/pit.stl: there is no folder none"),
        (("pit.stl", "--triangles", 10), "triangles is 10; it must lie between"),
        (("pit.stl", "--seed", -1), "seed is -1; it must lie between"),
    ],
)
def test_a_pit_that_cannot_be_made_or_written_is_refused(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, words: tuple[object, ...],
    sentence: str,
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    if "--triangles" not in words:
        words = (*words, "--triangles", 5000)
    assert sentence in refused(monkeypatch, capsys, "pit", *words)
    assert list(tmp_path.iterdir()) == []


def test_a_pit_with_an_unknown_extension_is_refused_before_it_is_dug(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    def dug(pit: Pit) -> None:
        pytest.fail("it dug before it looked")

    monkeypatch.setattr("rpf3d_core.terrain.pit.synthetic.pit_terrain", dug)
    assert "the extension must be" in refused(monkeypatch, capsys, "pit", tmp_path / "pit.xyz")


@pytest.mark.long
def test_a_pit_on_a_scene_of_its_own_can_be_flown(folder: Path) -> None:
    assert rpf3d("pit", "slope.vtp", "--triangles", 5000, cwd=folder).returncode == 0
    on_the_wall = "points: [[-600, 0, 0]], above_ground: 2"
    scene = SCENE.replace("slope.stl", "slope.vtp").replace("points: [[1.3, 1.2, 9]]", on_the_wall)
    (folder / "scene.yaml").write_text(scene)
    done = rpf3d("run", "scene.yaml", "--out", "out", cwd=folder)
    assert done.returncode == 0, done.stderr


def test_a_folder_without_a_recording_is_not_replayed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], folder: Path
) -> None:
    assert "contains no run.rrd" in refused(monkeypatch, capsys, "replay", folder)
    assert "is not a folder" in refused(monkeypatch, capsys, "replay", folder / "none")
