"""Terrain files that show the same ground twice are reported: rocks would fly on the upper one."""

import time
from pathlib import Path

import numpy as np
import pytest
from input_files.terrain_files import grid, scene_of, write_binary_stl

from rpf3d_core.setup.terrain import read_terrain
from rpf3d_core.setup.warnings.overlapping_files import overlap_warnings, shared_window
from rpf3d_core.terrain.facets import Terrain


def survey(path: Path, up: float = 0.0, east: float = 0.0, columns: int = 41) -> Path:
    """Write a wavy grid of 40 m by 40 m, or of another number of columns, moved by `up` and `east` (m)."""
    vertices, triangles = grid(41, columns)
    return write_binary_stl(path, (vertices + np.array([east, 0.0, up]))[triangles])


def remarks(*files: Path) -> list[str]:
    """Return the remarks on two surfaces or on duplicates of the terrain of a scene of some files."""
    found = read_terrain(scene_of(*files))[1].remarks
    return [remark for remark in found if "two surfaces" in remark or "same vertices" in remark]


@pytest.mark.parametrize("up", [0.3, 5.0])
def test_two_surveys_of_one_ground_are_reported_with_their_area_and_height(tmp_path: Path, up: float) -> None:
    (found,) = remarks(survey(tmp_path / "new.stl"), survey(tmp_path / "old.stl", up=up))
    assert found.startswith(f"about 1,600 m2 of the terrain have two surfaces above each other, old.stl above new.stl "
                            f"by {up:g} m in the median")  # fmt: skip
    assert "are these two surveys of the same ground, or is one a pile or building on it? If they are two" in found
    assert found.endswith("keep one; a pile or building on the ground is right")


def test_only_the_common_part_counts(tmp_path: Path) -> None:
    (found,) = remarks(survey(tmp_path / "west.stl", up=2.0), survey(tmp_path / "east.stl", east=25.0, columns=26))
    assert "about 600 m2" in found and "west.stl above east.stl" in found
    assert remarks(survey(tmp_path / "west.stl", up=2.0), survey(tmp_path / "east.stl", east=30.0, columns=31)) == []


def test_a_survey_as_small_as_a_thousandth_of_the_ground_is_found(tmp_path: Path) -> None:
    (found,) = remarks(survey(tmp_path / "ground.stl"), survey(tmp_path / "patch.stl", up=1.0, columns=3))
    assert "patch.stl above ground.stl" in found


def plan(low: float, high: float, step: float = 2.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return x (V,) m, y (V,) m and triangles (F, 3) of a square grid from `low` to `high` (m) in x and y."""
    count = round((high - low) / step) + 1
    vertices, triangles = grid(count, count)
    return *(low + step * np.round(vertices[:, :2])).T, triangles


def relief(path: Path, low: float, high: float, height, step: float = 2.0, radius: float = np.inf) -> Path:
    """Write the ground of heights `height(x, y)` (m) on a square grid, within a radius (m) around the origin."""
    x, y, triangles = plan(low, high, step)
    near = (np.hypot(x, y) <= radius)[triangles].all(axis=1)
    return write_binary_stl(path, np.stack([x, y, height(x, y)], axis=1)[triangles[near]])


def hill(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.asarray(0.1 * x + np.sin(0.1 * y))


@pytest.mark.parametrize("buried", [0.0, 1.0, 5.0])
@pytest.mark.parametrize("flat", [0.0, 60.0])
def test_a_dump_whose_rim_lies_in_the_ground_is_right(tmp_path: Path, buried: float, flat: float) -> None:
    def dump(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return hill(x, y) + np.minimum(40.0, 40.0 + 0.75 * (flat - np.hypot(x, y)))

    radius = flat + (40.0 + buried) / 0.75
    files = relief(tmp_path / "ground.stl", -200, 200, hill), relief(tmp_path / "d.stl", -130, 130, dump, 2.0, radius)
    assert remarks(*files) == []
    assert remarks(*files[::-1]) == []


@pytest.mark.parametrize("closed", [False, True])
def test_a_building_is_right(tmp_path: Path, closed: bool) -> None:
    """Its walls are upright, so that its whole roof is as far above the ground as a second survey would be."""
    corners = np.array([[x, y, z] for z in (-1.0, 6.0) for x, y in ((-9, -5), (9, -5), (9, 5), (-9, 5))])
    walls = [f for i in range(4) for j in [(i + 1) % 4] for f in ((i, j, j + 4), (i, j + 4, i + 4))]
    faces = [*walls, (4, 5, 6), (4, 6, 7), *([(0, 2, 1), (0, 3, 2)] if closed else [])]
    building = write_binary_stl(tmp_path / "plant.stl", corners[np.array(faces)])
    assert remarks(relief(tmp_path / "ground.stl", -40, 40, lambda x, y: 0.0 * x), building) == []


def test_a_berm_with_a_buried_rim_is_right(tmp_path: Path) -> None:
    corners = np.array([[x, y, 1.2 - 0.7 * abs(y)] for y in (-2.3, 0.0, 2.3) for x in (-30.0, 30.0)])
    berm = write_binary_stl(tmp_path / "berm.stl", corners[np.array([(0, 1, 2), (2, 1, 3), (2, 3, 4), (4, 3, 5)])])
    assert remarks(relief(tmp_path / "ground.stl", -40, 40, lambda x, y: 0.0 * x), berm) == []


def face(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Return the heights (m) of a wall of 70 degrees, 41 m high, between two benches."""
    return np.asarray(np.clip(x + 0.05 * np.sin(y), -7.5, 7.5) * np.tan(np.radians(70.0)))


def test_tiles_of_a_steep_wall_that_are_shifted_in_plan_are_right(tmp_path: Path) -> None:
    files = (
        relief(tmp_path / "a.stl", -12, 12, face, 0.5),
        relief(tmp_path / "b.stl", -12, 12, lambda x, y: face(x + 0.05, y), 0.5),
    )
    assert not [each for each in remarks(*files) if "two surfaces" in each]


@pytest.mark.parametrize("size", [100, 60])
def test_a_second_survey_that_is_half_a_metre_higher_or_lower_is_reported(tmp_path: Path, size: int) -> None:
    ground = relief(tmp_path / "ground.stl", -100, 100, hill)
    for shift in (0.5, -0.5):
        (found,) = remarks(ground, relief(tmp_path / "second.stl", -size, size, lambda x, y, up=shift: hill(x, y) + up))
        assert "by 0.5 m in the median" in found


@pytest.mark.parametrize("size", [100, 40])
def test_the_pit_after_a_blast_is_reported_with_the_pit_before_it(tmp_path: Path, size: int) -> None:
    """The blast moved the face by 12 m, and left a pile on the floor; the survey after it shows the pit or a part."""

    def after(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        cut = np.where(np.abs(y) < 25.0, face(np.clip(x - 12.0, -7.5, None), y), face(x, y))
        pile = np.clip(6.0 - 0.5 * np.hypot(x + 8.0, 0.3 * y), 0.0, None)
        return np.asarray(np.minimum(face(x, y), cut) + pile)

    files = relief(tmp_path / "before.stl", -100, 100, face), relief(tmp_path / "after.stl", -size, size, after)
    (found,) = [each for each in remarks(*files) if "two surfaces" in each]
    assert "before.stl above after.stl" in found


def test_tiles_next_to_each_other_and_one_file_with_two_levels_are_not_reported(tmp_path: Path) -> None:
    assert remarks(survey(tmp_path / "west.stl"), survey(tmp_path / "east.stl", east=40.0)) == []
    vertices, triangles = grid(41, 41)
    both = np.concatenate([vertices[triangles], (vertices + np.array([0, 0, 3.0]))[triangles]])
    assert remarks(write_binary_stl(tmp_path / "overhang.stl", both)) == []


def test_surveys_that_differ_by_centimetres_are_not_reported(tmp_path: Path) -> None:
    assert remarks(survey(tmp_path / "one.stl"), survey(tmp_path / "other.stl", up=0.04)) == []


def test_the_same_ground_twice_is_reported_as_duplicate_triangles(tmp_path: Path) -> None:
    (found,) = remarks(survey(tmp_path / "one.stl"), survey(tmp_path / "other.stl"))
    assert found.startswith("3,200 of 6,400 triangles lie on the same vertices as other triangles")


def test_two_surveys_of_a_million_triangles_each_take_less_than_the_bound() -> None:
    """The bound is 2 s on a busy machine; a free core takes 0.1 s."""
    vertices, triangles = grid(701, 715)
    terrain = Terrain(
        vertices=np.concatenate([vertices, vertices + np.array([0, 0, 2.0])]),
        triangles=np.concatenate([triangles, triangles + np.int32(len(vertices))]),
        zone=np.zeros(2 * len(triangles), np.int32), zones=("a",),
    )  # fmt: skip
    began = time.perf_counter()
    window = shared_window(terrain.vertices[:, :2], [len(vertices)] * 2)
    found = overlap_warnings(terrain, [len(triangles)] * 2, [Path("a"), Path("b")], window)
    assert len(found) == 1 and time.perf_counter() - began < 2.0
