"""Tests that a report first warns of input files that changed since the run or could not be compared."""

import hashlib
import json
import shutil
from pathlib import Path

import pytest

from rpf3d_core.report.changed_inputs import NOT_STORED
from rpf3d_core.report.content import report_elements
from rpf3d_core.report.elements import Warnings
from rpf3d_core.report.run_files import read_run
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.reading import read_scene

SCENES = Path(__file__).parents[2] / "config" / "scenes"


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Return a folder with a scene, its terrain, and the result of 20 rocks."""
    folder = tmp_path_factory.mktemp("flown")
    for path in SCENES.glob("bench_15m*"):
        shutil.copy(path, folder)
    run_scene(read_scene(folder / "bench_15m.yaml"), folder / "run", 20, "reference")
    return folder


@pytest.fixture
def scene(flown, tmp_path):
    """Return a copy of the folder whose result refers to the copied files."""
    folder = shutil.copytree(flown, tmp_path / "copy")
    path = folder / "run" / "inputs.json"
    path.write_text(path.read_text().replace(str(flown.resolve()), str(folder.resolve())))
    return folder


def first_warnings(scene: Path) -> list[str]:
    elements = report_elements(read_run(scene / "run"), "site")
    return list(next(element for element in elements if isinstance(element, Warnings)).sentences)


def test_a_run_stores_path_and_digest_of_the_scene_and_of_each_file_that_it_names(scene):
    files = json.loads((scene / "run" / "inputs.json").read_text())["files"]
    assert [file["key"] for file in files] == ["scene", *(f"terrain.files.{number}.path" for number in range(5))]
    for file in files:
        assert hashlib.sha256(Path(file["path"]).read_bytes()).hexdigest() == file["sha256"]


def test_inputs_as_they_were_give_no_warning(scene):
    assert not any("changed" in sentence for sentence in first_warnings(scene))


@pytest.mark.parametrize(
    ("name", "words"), [("bench_15m.yaml", "scene file"), ("bench_15m_face.obj", "file of `terrain.files.1.path`")]
)
def test_a_file_that_has_changed_since_the_run_is_named_first(scene, name, words):
    with (scene / name).open("a") as file:
        file.write("# blasted\n")
    first, second, *_ = first_warnings(scene)
    assert first.startswith(f"The {words}, {(scene / name).resolve()}, has changed since the run")
    assert "changed" not in second


def test_a_file_that_is_no_longer_there_could_not_be_compared(scene):
    (scene / "bench_15m_floor.obj").unlink()
    assert "bench_15m_floor.obj, cannot be read, so the report could not check" in first_warnings(scene)[0]


def test_a_result_without_digests_says_that_nothing_was_compared(scene):
    path = scene / "run" / "inputs.json"
    inputs = json.loads(path.read_text())
    path.write_text(json.dumps(inputs | {"files": [file for file in inputs["files"] if file["key"] != "scene"]}))
    assert first_warnings(scene)[0].startswith("The run stored no digest of the scene file")
    del inputs["files"]
    path.write_text(json.dumps(inputs))
    assert first_warnings(scene)[0] == NOT_STORED
