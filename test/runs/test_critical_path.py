"""Tests that each result contains the path of the rock that stopped farthest away, bit for bit as it flew."""

from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import with_models

from rpf3d_core.report.run_files import read_run
from rpf3d_core.report.section import critical_section
from rpf3d_core.results.folder import CRITICAL
from rpf3d_core.runs.run import replay, run_scene, simulate, write_run
from rpf3d_core.scene.reading import read_scene

SCENE = """\
terrain: {{benches: {{number: 2, height: 12, berm: 6, width: 60}}}}
materials: {{default: {{{ground}}}}}
rock: {{density: 2500, diameter: 0.8{rock}}}
sources:
  - {{name: left, points: [[-1, -9, 24]], above_ground: 1, rocks: 20, velocity: [2, 0, 0], velocity_spread: [1, 0, 0]}}
  - {{name: top, crest: 1, above_ground: 1, rocks: 60, velocity: [2, 0, 0], velocity_spread: [3, 0, 0]}}
outputs: {{trajectories: {kept}, pictures: false, recording: false}}
{more}
"""
POINTS = "normal_restitution: {mean: 0.3, sd: 0.15, min: 0, max: 0.6}, tangential_restitution: 0.85"
BREAKING = "effects: {fragmentation: {least_ratio: 0.4, least_volume: 0.01}}"


def scene(folder: Path, kept: int, ground: str = POINTS, rock: str = "", more: str = "") -> Path:
    text = SCENE.format(kept=kept, ground=ground, rock=rock, more=more)
    (folder / "scene.yaml").write_text(with_models(text, ground="sliding") if not rock else text)
    return folder / "scene.yaml"


@pytest.mark.parametrize(
    ("engine", "kept", "changes"),
    [
        ("reference", 0, {}), ("compiled", 2, {}),
        ("reference", 2, {"more": "rocks: auto\ntarget: {most_rocks: 200, half_width: 0.4}"}),
        ("reference", 2, {"ground": "library: bedrock", "more": "unknowns: {sets: 40}"}),
        ("reference", 1, {"ground": "restitution: 0.3, friction: 0.5", "rock": ", shape: {family: equant}"}),
    ],
    ids=["no-path-kept", "few-paths-kept", "auto", "unknowns", "bodies"],
)  # fmt: skip
def test_a_result_has_the_path_of_the_rock_that_stopped_farthest_away(
    tmp_path: Path, engine: str, kept: int, changes: dict[str, str]
) -> None:
    path = scene(tmp_path, kept, **changes)
    run_scene(read_scene(path), tmp_path / "run", engine=engine)
    run = read_run(tmp_path / "run")
    section = critical_section(run)
    assert section is not None and section.path is not None
    row, way = run.ends.key.index(section.key), run.path_of(section.key)
    assert way is not None and run.ends.runout[row] == run.ends.runout[run.ends.at_rest].max()
    assert np.array_equal(way[0], run.ends.release[row]) and np.array_equal(way[-1], run.ends.end[row])
    assert (tmp_path / "run" / CRITICAL).is_file() is (section.key not in run.paths.key)


def test_a_path_that_is_kept_is_not_written_again(tmp_path: Path) -> None:
    run_scene(read_scene(scene(tmp_path, 80)), tmp_path / "run", engine="reference")
    assert not (tmp_path / "run" / CRITICAL).exists()
    run = read_run(tmp_path / "run")
    section = critical_section(run)
    assert section is not None and run.path_of(section.key) is not None


def test_a_run_in_memory_has_the_path_too_and_other_files_are_the_same(tmp_path: Path) -> None:
    path = read_scene(scene(tmp_path, 0))
    write_run(simulate(path, engine="reference"), tmp_path / "memory")
    run_scene(path, tmp_path / "disk", engine="reference")
    for name in (CRITICAL, "deposits.csv"):
        assert (tmp_path / "memory" / name).read_bytes() == (tmp_path / "disk" / name).read_bytes()


def test_a_rock_flown_again_has_its_path_although_the_scene_keeps_none(tmp_path: Path) -> None:
    again = replay(scene(tmp_path, 0), "top", 7)
    assert len(again.flights.paths.row) > 2


def test_a_fragment_may_be_the_rock_that_stopped_farthest_away(tmp_path: Path) -> None:
    run_scene(read_scene(scene(tmp_path, 0, more=BREAKING)), tmp_path / "run", engine="reference")
    section = critical_section(read_run(tmp_path / "run"))
    assert section is not None and section.path is not None
    assert section.key[2] > 0, "the rock is a fragment"
