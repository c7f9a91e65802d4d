"""Tests that terrain that lost digits in single precision is reported, with the loss in metres."""

from pathlib import Path

import numpy as np
import pytest
from input_files.mine_files import at_site
from input_files.terrain_files import grid, scene_of, write_binary_stl

from rpf3d_core.formats.precision import lost_precision
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.setup.terrain import read_terrain

VERTICES, TRIANGLES = grid(6, 6, 0.4)
SITE = at_site(VERTICES)
NAME = Path("pit.stl")


def test_a_binary_stl_at_survey_coordinates_is_reported_with_the_metres_that_it_really_lost(tmp_path):
    write_binary_stl(tmp_path / "pit.stl", SITE[TRIANGLES])
    _, faults = read_terrain(scene_of(tmp_path / "pit.stl"))
    (remark,) = faults.remarks
    assert "steps of 0.5 m at 7654002 m" in remark and "the median edge is" in remark and "double precision" in remark
    lost = float(remark.partition("off by up to ")[2].split()[0])
    worst = np.linalg.norm(SITE.astype(np.float32).astype(float) - SITE, axis=1).max()
    assert worst <= lost < 2.0 * worst


@pytest.mark.parametrize(
    ("points", "reported"),
    [
        (SITE.astype(np.float32), True),
        (SITE.astype(np.float32).astype(float), True),
        (SITE, False),
        (VERTICES.astype(np.float32), False),
        (VERTICES.astype(np.float32).astype(float), False),
        (np.column_stack([np.round(SITE[:, :2]), SITE[:, 2]]), False),
    ],
    ids=["float32", "float64 from float32", "float64", "local float32", "local from float32", "whole metres"],
)
def test_only_a_loss_that_matters_is_reported(points, reported):
    assert (lost_precision(NAME, FileMesh(points, TRIANGLES)) is not None) is reported


def test_the_loss_is_in_metres_whatever_the_unit_of_the_file(tmp_path):
    """A file in mm at the same place has the same loss, within the factor of two between two steps of float32."""
    lost = {}
    for unit, length in (("m", 1.0), ("mm", 0.001)):
        write_binary_stl(tmp_path / f"{unit}.stl", (SITE / length)[TRIANGLES])
        scene = scene_of(tmp_path / f"{unit}.stl")
        files = tuple(file.model_copy(update={"unit": unit}) for file in scene.terrain.files)
        terrain = scene.terrain.model_copy(update={"files": files})
        _, faults = read_terrain(scene.model_copy(update={"terrain": terrain}))
        remark = next(each for each in faults.remarks if "single precision" in each)
        assert "at 7654002 m" in remark
        lost[unit] = float(remark.partition("off by up to ")[2].split()[0])
    assert 0.4 < lost["mm"] / lost["m"] < 2.5  # the steps of float32 depend on the power of two below the number
