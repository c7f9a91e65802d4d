"""Tests that values of a scene can be replaced by key paths, with the checks of a scene file."""

from pathlib import Path

import pytest

from rpf3d_core.errors import SceneError
from rpf3d_core.scene.key_paths import given_keys, with_values
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene, scene_digest

POINTS = """\
terrain: {pit: {triangles: 6000}}
materials:
  bench_1: {normal_restitution: {mean: 0.5, sd: 0.1, min: 0.2, max: 0.8}, tangential_restitution: 0.8}
  rock.v2*: {normal_restitution: 0.4, tangential_restitution: 0.7, friction_angle_deg: 25}
  default: {normal_restitution: 0.3, tangential_restitution: 0.6}
sources:
  - {name: top, zone: bench_1, above_ground: 8, rocks: 75}
rebound: {pfeiffer_bowen: {K: 9.144}}
ground: sliding
effects: {roughness: {angle_sd_deg: 5}, drag: {}, loam.Loam: {depth: 0.3}}
"""
BODIES = """\
terrain: {pit: {triangles: 6000}}
materials: {default: {restitution: 0.1, friction: 0.5, rolling_resistance: 0.12}}
rock: {shape: {box: [1, 1, 0.5]}}
sources: [{name: top, zone: bench_1, above_ground: 8, rocks: 75}]
"""


def scene_of(folder: Path, text: str) -> Scene:
    path = folder / "scene.yaml"
    (folder / "loam.py").write_text("from typing import NamedTuple\n\nclass Loam(NamedTuple):\n    depth: float\n")
    path.write_text(text)
    return read_scene(path)


@pytest.fixture
def points(tmp_path: Path) -> Scene:
    return scene_of(tmp_path, POINTS)


@pytest.mark.parametrize(
    ("key", "new", "written"),
    [
        ("materials.default.normal_restitution", 0.35, ("normal_restitution: 0.3,", "normal_restitution: 0.35,")),
        ("materials.bench_1.normal_restitution.mean", 0.45, ("mean: 0.5", "mean: 0.45")),
        ("materials.rock.v2*.friction_angle_deg", 31.0, ("angle_deg: 25", "angle_deg: 31")),
        ("materials.default.friction_angle_deg", 31.0, ("0.6", "0.6, friction_angle_deg: 31")),
        ("rebound.pfeiffer_bowen.K", 8.0, ("9.144", "8.0")),
        ("effects.roughness.angle_sd_deg", 2.0, ("angle_sd_deg: 5", "angle_sd_deg: 2")),
        ("effects.drag.coefficient", 0.7, ("drag: {}", "drag: {coefficient: 0.7}")),
        ("effects.loam.Loam.depth", 0.4, ("depth: 0.3", "depth: 0.4")),
        ("sources.top.above_ground", 9.0, ("above_ground: 8", "above_ground: 9")),
        ("sources.0.above_ground", 9.0, ("above_ground: 8", "above_ground: 9")),
        ("stop_speed", 0.2, ("ground: sliding", "ground: sliding\nstop_speed: 0.2")),
        ("terrain.pit.triangles", 4000, ("triangles: 6000", "triangles: 4000")),
    ],
)  # fmt: skip
def test_a_replaced_value_gives_the_scene_whose_file_has_that_value(
    points: Scene, tmp_path: Path, key: str, new: float, written: tuple[str, str]
) -> None:
    changed = with_values(points, {key: new})
    assert scene_digest(changed) != scene_digest(points)
    assert POINTS.count(written[0]) == 1
    assert scene_digest(changed) == scene_digest(scene_of(tmp_path, POINTS.replace(*written)))


def test_a_star_stands_for_all_materials_and_a_full_path_wins(points: Scene) -> None:
    changed = with_values(
        points, {"materials.default.tangential_restitution": 0.5, "materials.*.tangential_restitution": 0.9}
    )
    assert [material.tangential_restitution for material in changed.materials.values()] == [0.9, 0.9, 0.5]
    assert list(changed.materials) == ["bench_1", "rock.v2*", "default"]
    assert points.materials["default"].tangential_restitution == 0.6


def test_materials_of_rocks_with_a_shape_change_too(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, BODIES)
    changed = with_values(scene, {"materials.*.friction": 0.7, "contact": {"rigid": {"accuracy": 0.004}}})
    text = BODIES.replace("friction: 0.5", "friction: 0.7") + "contact: {rigid: {accuracy: 0.004}}\n"
    assert scene_digest(changed) == scene_digest(scene_of(tmp_path, text))


def test_no_change_gives_the_scene_itself(points: Scene) -> None:
    assert with_values(points, {}) is points


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (
            {"materials.grey.normal_restitution": 0.5},
            "the key path `materials.grey.normal_restitution` leads to no value: `grey` is not one of bench_1, "
            "rock.v2*, default",
        ),
        (
            {"materials.default.normal_restitution": -1},
            "`materials.default.normal_restitution` is -1, but must be a number from 0 to 1 (-), R_n, or a "
            "distribution",
        ),
        (
            {"materials.default.normal_restitution.mean": 0.2},
            "the key path `materials.default.normal_restitution.mean` leads to no value: above `mean` there is 0.3",
        ),
        ({"contact.rigid.accuracy": 0.1}, "above `rigid` nothing is given there"),
        ({"path": "x"}, "`path` is not one of terrain,"),
        (
            {"effects.loam.Loam.dept": 0.4},
            "the key path `effects.loam.Loam.dept` leads to no value: `dept` is not one of depth; did you mean "
            "`depth`?",
        ),
        ({"effects.loam.Loam.depth": "deep"}, "gives loam.Loam 'deep' as depth, which must be a number"),
        ({"diameter": 2.0}, "; did you mean `rock.diameter`?"),
        (
            {"materials.bench_1.normal_restitution.mean": 0.9},
            "`materials.bench_1.normal_restitution.mean` is 0.9, but must lie between min 0.2 and max 0.8",
        ),
        (
            {"materials.bench_1.normal_restitution": 0.4, "materials.bench_1.normal_restitution.mean": 0.4},
            "and one above or below it both have a value; remove one",
        ),
    ],
)
def test_a_refusal_names_the_path(points: Scene, values: dict[str, float], message: str) -> None:
    with pytest.raises(SceneError) as caught:
        with_values(points, values)
    assert message in str(caught.value)
    assert str(points.path) in str(caught.value)


def test_a_key_of_a_designed_terrain_needs_it(tmp_path: Path) -> None:
    (tmp_path / "pit.stl").write_bytes(b"")
    text = BODIES[BODIES.index("materials:"):]
    scene = scene_of(tmp_path, "terrain: {files: [{path: pit.stl}]}\n" + text)
    with pytest.raises(SceneError, match="the terrain is read from files, and this key needs"):
        with_values(scene, {"terrain.benches.berm": 6})


def test_the_given_keys_are_those_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "wall.obj").write_text("v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n")
    text = POINTS.replace("pit: {triangles: 6000}", "files: [{path: wall.obj}]")
    text = text.replace("zone: bench_1, above_ground: 8", "points: [[1, 1, 9]]")
    keys = set(given_keys(scene_of(tmp_path, text)))
    assert {"terrain.files", "terrain.files.0.path", "ground", "effects.roughness.angle_sd_deg"} <= keys
    assert "path" not in keys and "stop_speed" not in keys
