"""Tests that gaps of a live terrain are capped when it is built, and again where a patch changes its border."""

from dataclasses import replace

import numpy as np
from flights.scenes_of_facets import flight, fly, surface
from live_sites.surveyed_hills import grid

from rpf3d_core.alerts.evidence import unfinished_of
from rpf3d_core.live.ground import Workshop
from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.terrain.mesh.border import border_of
from rpf3d_core.values import Outcome


def holed() -> GridSurvey:
    points = grid().points.copy()
    points[12:20, 14:24] = np.nan
    return GridSurvey(points)


def lost_over(ground) -> int:
    """Drop 200 rocks over the middle of the hills; return how many are lost to a hole."""
    rng = np.random.default_rng(2)
    low = np.array(ground.facets.low)
    x = np.column_stack([low[0] + rng.uniform(13, 24, 200), low[1] + rng.uniform(11, 20, 200), np.full(200, 40.0)])
    ends = fly(ground.engine, flight(surface(0.0, 0.0, 80.0)), x).deposits
    return int((ends.outcome == Outcome.LOST_TO_HOLE).sum())


def sides(border):
    return {tuple(side.ravel()) for side in border[:, :2]}


def test_a_survey_with_a_hole_loses_rocks_and_a_patch_that_closes_it_ends_that():
    workshop = Workshop()
    ground = workshop.whole(holed())
    assert lost_over(ground) > 100
    after = workshop.patched(ground, grid(14, 16, 11.37, 9.21, seed=0))
    assert lost_over(after) == 0 and after.engine.caps is not ground.engine.caps
    live = after.terrain.triangles[np.flatnonzero(after.facets.normals.any(axis=1))]
    assert sides(after.border.sides) == sides(border_of(after.terrain.vertices, live))


def test_a_patch_within_the_ground_leaves_border_and_caps_as_they_were():
    workshop = Workshop()
    ground = workshop.whole(holed())
    after = workshop.patched(ground, grid(6, 6, 30.37, 25.21, seed=1))
    assert after.border is ground.border and after.engine.caps is ground.engine.caps
    assert lost_over(after) > 100


def test_a_patch_with_a_hole_of_its_own_next_to_the_rim_is_counted_from_the_same_border():
    workshop = Workshop()
    after = workshop.patched(workshop.whole(grid()), grid(10, 12, 0.0, 9.21, seed=1))
    live = after.terrain.triangles[np.flatnonzero(after.facets.normals.any(axis=1))]
    assert sides(after.border.sides) == sides(border_of(after.terrain.vertices, live))


def test_rocks_lost_to_a_hole_are_no_evidence_that_an_area_is_safe():
    assert unfinished_of({Outcome.STOPPED: 5, Outcome.LOST_TO_HOLE: 3}) == 3


def test_every_ground_has_caps_of_one_kind_so_that_a_patch_compiles_nothing():
    workshop = Workshop()
    with_gap, without = workshop.whole(holed()), workshop.whole(grid())
    assert type(with_gap.engine.caps) is type(without.engine.caps)
    assert replace(without).engine.caps is not None
