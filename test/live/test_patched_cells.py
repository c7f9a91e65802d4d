"""Tests that the terrain cells and heights after a patch equal those of a new computation."""

import numpy as np
import pytest

from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.scene import live_scene
from rpf3d_core.live.standing import stand_after, stand_on
from rpf3d_core.live.survey import GridSurvey

SIDE = 60


def slope():
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    return np.stack([x, y, 0.3 * x + np.sin(y)], axis=-1)


@pytest.mark.parametrize("shift", [(0.0, 0.0, 1.5), (0.4, -0.3, -2.0)])
def test_cells_after_a_patch_are_those_of_the_ground_that_came_of_it(shift):
    scene, workshop = live_scene({"hazard.cell": 0.5}), Workshop()
    before = stand_on(workshop.whole(GridSurvey(slope())), scene)
    known = before.cells
    patch = slope()[20:30, 25:40] + shift
    patched = workshop.patched(before.ground, GridSurvey(patch), 1)
    after = stand_after(before, patched)
    assert after.before is not None, "nothing of the cells before is used"
    found, anew = after.cells, stand_on(patched, scene).cells
    assert np.array_equal(found.covered, anew.covered)
    assert found.height[found.covered] == pytest.approx(anew.height[found.covered], abs=1e-5)
    assert not np.array_equal(known.height, found.height, equal_nan=True)
