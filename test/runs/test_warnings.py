"""Tests of the warnings about scenes whose rocks would roll or float without end."""

from pathlib import Path

import pytest
from input_files.terrain_files import SLOPE, grid, write_binary_stl
from programs.command_line import rpf3d

from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.warnings.suspicious_settings import warnings_of

ABOVE = "  - {name: above, points: [[1.3, 1.2, 9], [2.5, 2.5, 8]], rocks: 4}\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    vertices, triangles = grid(5, 6)
    write_binary_stl(tmp_path / "slope.stl", vertices[triangles])
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize("command", ["run", "check"])
def test_a_sphere_without_rolling_friction_is_said_to_roll_through_the_pit(folder: Path, command: str) -> None:
    (folder / "scene.yaml").write_text(SLOPE + ABOVE + "rock: {shape: sphere}\nground: sphere\n")
    done = rpf3d(command, "scene.yaml", *(("--out", "out") if command == "run" else ()), cwd=folder)
    assert done.returncode == 0
    assert "rpf3d: note: `materials.rock.rolling_friction` is not given" in done.stderr
    assert "so it may roll across the whole pit" in done.stderr


LAYER = "effects: {{drag_layer: {{coefficient: {c}}}}}\n"


@pytest.mark.parametrize(
    ("rock", "c", "told"),
    [
        # m g / c: 11 x 9.81 / 490 = 0.220, and 1 m/s is reached at c = 11 x 9.81 = 107.91
        ("rock: {mass: 11}\n", 490, "lightest rock (11 kg) sink at no more than 0.22 m/s, below 1 m/s: it floats"),
        ("rock: {mass: 11}\n", 110, "lightest rock (11 kg) sink at no more than 0.98 m/s, below 1 m/s"),
        ("rock: {mass: 11}\n", 107.8, None),
        ("rock: {mass: {mean: 900, sd: 500, min: 20, max: 3000}}\n", 250, "(20 kg) sink at no more than 0.78 m/s"),
        ("rock: {mass: {mean: 900, sd: 500, min: 30, max: 3000}}\n", 250, None),
        ("rock: {mass: 11}\n", 0, None),
    ],
)
def test_a_drag_layer_that_floats_the_lightest_rock_is_told(folder: Path, rock: str, c: float, told: str) -> None:
    (folder / "scene.yaml").write_text(SLOPE + ABOVE + "ground: none\n" + rock + LAYER.format(c=c))
    found = [sentence for sentence in warnings_of(read_scene(folder / "scene.yaml")) if "drag_layer" in sentence]
    assert len(found) == (told is not None)
    assert told is None or (told in found[0] and "max_impacts" in found[0])


@pytest.mark.long
@pytest.mark.parametrize("command", ["run", "check"])
def test_a_run_and_a_check_say_that_a_rock_floats(folder: Path, command: str) -> None:
    (folder / "scene.yaml").write_text(SLOPE + ABOVE + "ground: none\nrock: {mass: 11}\n" + LAYER.format(c=490))
    done = rpf3d(command, "scene.yaml", *(("--out", "out") if command == "run" else ()), cwd=folder)
    assert done.returncode == 0
    assert "rpf3d: note: `effects.drag_layer` lets the lightest rock (11 kg) sink" in done.stderr


def test_the_fragments_of_rocks_that_break_float_first(folder: Path) -> None:
    breaks = "effects: {drag_layer: {coefficient: 250}, fragmentation: {least_volume: 0.001}}\nrock: {mass: 900}\n"
    (folder / "scene.yaml").write_text(SLOPE + ABOVE + "ground: none\n" + breaks)
    told = " ".join(warnings_of(read_scene(folder / "scene.yaml")))
    assert "the lightest fragment (2.7 kg) sink at no more than 0.11 m/s" in told
