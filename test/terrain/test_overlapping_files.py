"""Terrain files that show the same ground twice are reported: rocks would fly on the upper one."""

import time
from pathlib import Path

import numpy as np
import pytest
from terrain_files import grid, scene_of, write_binary_stl

from rpf3d_core.setup.overlapping_files import overlap_warnings, shared_window
from rpf3d_core.setup.terrain import read_terrain
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
    assert "are these two surveys of the same ground? Keep one" in found


def test_only_the_common_part_counts(tmp_path: Path) -> None:
    (found,) = remarks(survey(tmp_path / "west.stl", up=2.0), survey(tmp_path / "east.stl", east=30.0, columns=31))
    assert "about 400 m2" in found and "west.stl above east.stl" in found


def test_a_pile_as_small_as_a_thousandth_of_the_ground_is_found(tmp_path: Path) -> None:
    (found,) = remarks(survey(tmp_path / "ground.stl"), survey(tmp_path / "pile.stl", up=1.0, columns=3))
    assert "pile.stl above ground.stl" in found


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
