"""Tests of the folder of a calibration: which scenes may continue there, and reports of damaged files."""

from pathlib import Path

import numpy as np
import pytest

from rpf3d_core.calibration.density import Stops
from rpf3d_core.calibration.flying import Flown
from rpf3d_core.calibration.state import (
    KeptSets,
    check_folder,
    drop_parts,
    open_state,
    read_round,
    save_part,
)
from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene

SCENE = """\
terrain: {files: [{path: slope.obj, zone: default}]}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.8, friction_angle_deg: 32}}
rock: {density: 2700, mass: 500}
sources: [{name: top, points: [[1, 1, 9]], rocks: 10, velocity: [1, 0, 0]}]
rebound: constant
ground: sliding
engine: ENGINE
"""


def scene(folder: Path, engine: str = "compiled") -> Scene:
    (folder / "slope.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n")
    path = folder / "scene.yaml"
    path.write_text(SCENE.replace("ENGINE", engine))
    return read_scene(path)


def kept(sets: int, begin: int = 0) -> KeptSets:
    stops = Stops(place=np.zeros((2, 2)), deposited=np.ones(2, dtype=bool))
    flown = Flown(stops=stops, densities=np.zeros((1, 1, 1)), energy=np.zeros(2))
    return KeptSets(z=np.arange(begin, begin + sets, dtype=float)[:, None], flown=[flown] * sets)


@pytest.mark.parametrize("engine", ["auto", "reference", "compiled"])
def test_a_calibration_continues_with_another_engine(tmp_path: Path, engine: str) -> None:
    open_state(tmp_path / "out", scene(tmp_path))
    open_state(tmp_path / "out", scene(tmp_path, engine))


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"digest": 3}', "\udc80"])
def test_a_damaged_plan_is_named(tmp_path: Path, text: str) -> None:
    out = tmp_path / "out"
    plan = open_state(out, scene(tmp_path)) / "plan.json"
    plan.write_bytes(text.encode(errors="surrogateescape"))
    with pytest.raises(InputError, match=r"plan.json: is damaged .* delete its folder"):
        check_folder(out, scene(tmp_path))


@pytest.mark.parametrize("part", [0.0, 0.5, 0.99])
def test_a_damaged_round_is_named(tmp_path: Path, part: float) -> None:
    save_part(tmp_path, 0, 0, kept(5))
    path = tmp_path / "round_00_000.npz"
    path.write_bytes(path.read_bytes()[: int(part * path.stat().st_size)])
    with pytest.raises(InputError, match=r"round_00_000.npz: is damaged .* delete this file"):
        read_round(tmp_path, 0, 1)


def test_a_round_with_a_deleted_file_flies_the_rest_again(tmp_path: Path) -> None:
    for part in range(4):
        save_part(tmp_path, 0, part, kept(5, 5 * part))
    (tmp_path / "round_00_001.npz").unlink()
    found, part = read_round(tmp_path, 0, 1)
    assert (len(found.flown), part) == (5, 1)
    drop_parts(tmp_path, 0, part)
    save_part(tmp_path, 0, part, kept(15, 5))
    found, part = read_round(tmp_path, 0, 1)
    assert found.z.ravel().tolist() == list(range(20))


def test_all_files_after_a_gap_are_deleted(tmp_path: Path) -> None:
    for part in range(6):
        save_part(tmp_path, 0, part, kept(5, 5 * part))
    save_part(tmp_path, 1, 5, kept(5))
    for part in (1, 2):
        (tmp_path / f"round_00_{part:03d}.npz").unlink()
    drop_parts(tmp_path, 0, 1)
    assert sorted(path.name for path in tmp_path.glob("round_*")) == ["round_00_000.npz", "round_01_005.npz"]
