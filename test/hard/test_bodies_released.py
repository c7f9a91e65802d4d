"""Tests of bodies released very near the ground, partly inside the ground, and where they have no room."""

import numpy as np
import pytest
from bodies.flying_bodies import Terms, about, drop, flown, flown_over, ground, random_poses
from bodies.solid_overlap import gaps, solid_of
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.shapes.families import box
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.values import Outcome

SIDES, HALF = (1.2, 1.0, 0.8), 0.4
BOX = box(SIDES)
ACCURACY = 1e-3
TERMS = Terms((ground(0.5),), ACCURACY, 2000, 20.0)
"""SIDES : sides of BOX (m), the shortest upright; HALF : half of the shortest side (m).

ACCURACY : accuracy (m) of the contacts; TERMS : ground and limits of the flights.
"""


def sheets(heights, side: float = 20.0):
    """Return level squares of two facets each, one at each of the heights (m). side : about half their length (m)"""
    corners = np.array([(x, y, z) for z in heights for x in (-side, side) for y in (-side, 0.9 * side)])
    parts = [np.asarray(grid_triangles(2, 2)) + 4 * k for k in range(len(heights))]
    return terrain_of(corners, np.vstack(parts))


@pytest.mark.parametrize("above", [1e-12, 1e-9, 1e-6, 1e-4, -1e-9, -1e-3, -0.1, -0.39])
def test_a_body_released_in_or_near_the_ground_is_lifted_just_clear_of_it_and_stands(above):
    """The centre of the box is above the ground: sources with a centre below the ground are refused."""
    end = flown_over(sheets([0.0]), [BOX], drop([BOX], np.array([0.1, 0.2, HALF + above])), TERMS)
    least, most = 1.5 * ACCURACY - above, 1.6 * ACCURACY - above
    assert least - 1e-9 <= end.lift[0] <= most, "1.5 skins, known to 5 %"
    assert end.path().x[0, 2] == HALF + above + end.lift[0]
    assert end.outcome[0] == Outcome.STOPPED
    assert 0.0 <= end.x[0, 2] - HALF <= 1.05 * ACCURACY


def test_a_body_released_clear_of_the_ground_is_not_lifted():
    end = flown_over(sheets([0.0]), [BOX], drop([BOX], np.array([0.1, 0.2, HALF + 1.6 * ACCURACY])), TERMS)
    assert end.lift[0] == 0.0


@pytest.mark.parametrize("engine", ["compiled", "reference"])
def test_a_body_without_room_at_its_release_or_above_is_reported_as_unresolved(engine):
    """The stack of sheets, 0.5 m apart, is higher than the region searched for a clear place."""
    terrain = sheets(np.arange(12) * 0.5)
    x = np.array([0.3, 0.1, 0.25])
    end = flown(engine_of(engine, facets_of(terrain)), [BOX], drop([BOX], x, about((1, 1, 0), 0.7)), TERMS)
    assert end.outcome[0] == Outcome.UNRESOLVED_CONTACT
    assert (end.x[0] == x).all() and end.t[0] == 0.0 and end.lift[0] == 0.0 and len(end.blows()) == 0


def test_a_body_that_slides_to_more_facets_than_its_memory_holds_gets_more_memory(monkeypatch):
    """The body slides down a plane of 45 degrees from large facets to facets of 0.5 m, with memory for four facets."""
    coarse = np.array([(x, y, -x) for x in (-20.0, 0.0) for y in (-3.0, 3.0)])
    fine = np.array([(x, y, -x) for x in np.arange(9) * 0.5 for y in np.arange(13) * 0.5 - 3.0])
    triangles = np.vstack([np.asarray(grid_triangles(2, 2)), 4 + np.asarray(grid_triangles(9, 13))])
    facets = facets_of(terrain_of(np.vstack([coarse, fine]), triangles))
    above = (HALF + 0.5 * ACCURACY) * np.sqrt(2.0)
    start, pose = np.array([-1.5, 0.05, 1.5 + above]), about((0, 1, 0), np.pi / 4)
    bodies, terms = drop([BOX], start, pose, [1.0, 0.0, -1.0]), Terms((ground(0.2),), ACCURACY, 2000, 0.5)
    usual = flown(engine_of("reference", facets), [BOX], bodies, terms)
    monkeypatch.setattr("rpf3d_core.simulation.bodies.fly.FEWEST_FACETS", 4)
    small = flown(engine_of("reference", facets), [BOX], bodies, terms)
    assert usual.outcome[0] == Outcome.MAX_TIME and (usual.finals == small.finals)[np.isfinite(usual.finals)].all()
    assert np.linalg.norm(usual.x[0] - start) > 1.0, "the body slides"


def test_a_body_between_sheets_is_lifted_past_them_if_there_is_room_above():
    end = flown_over(sheets([0.0, 0.5, 1.0]), [BOX], drop([BOX], np.array([0.3, 0.1, 0.25])), TERMS)
    assert end.outcome[0] == Outcome.STOPPED
    assert end.x[0, 2] == pytest.approx(1.0 + HALF, abs=1.1 * ACCURACY)


@pytest.mark.parametrize("engine", ["compiled", "reference"])
def test_a_body_released_over_a_mesh_finer_than_its_first_room_has_all_facets_looked_at(engine):
    """More than 256 facets lie near the box; a peak among the last of these facets lifts the box."""
    count, step = 41, 0.05
    corners = np.array([(i * step, j * step, 0.0) for i in range(count) for j in range(count)])
    place = np.array([1.0, 1.0])
    peak = int(np.argmin(np.linalg.norm(corners[:, :2] - place - 0.3, axis=1)))
    corners[peak, 2] = 0.3
    terrain = terrain_of(corners, grid_triangles(count, count))
    bodies = drop([BOX], np.array([*place, HALF + 1e-3]))
    terms = Terms((ground(0.5),), ACCURACY, 2000, 1e-3)
    end = flown(engine_of(engine, facets_of(terrain)), [BOX], bodies, terms)
    triangles = np.asarray(terrain.vertices[terrain.triangles])
    assert gaps(solid_of(BOX), end.path().x[:1], end.path().q[:1], triangles)[0] > 0.0
    assert end.lift[0] == pytest.approx(0.3, abs=2e-3), "the peak is under the box"


def test_bodies_released_on_random_ground_in_random_poses_begin_clear_of_it():
    draw = np.random.default_rng(5)
    count = 12
    corners = np.array([(i * 0.4, j * 0.4, 0.0) for i in range(count) for j in range(count)])
    corners[:, 2] = draw.uniform(0.0, 0.5, len(corners))
    terrain = terrain_of(corners, grid_triangles(count, count))
    triangles = np.asarray(terrain.vertices[terrain.triangles])
    x = np.column_stack([draw.uniform(1.5, 3.0, (40, 2)), np.full(40, 0.55)])
    bodies = drop([BOX], x, random_poses(draw, 40))
    end = flown_over(terrain, [BOX], bodies, Terms((ground(0.5),), ACCURACY, 40_000, 0.05))
    before = gaps(solid_of(BOX), x, bodies.pose, triangles)
    begun = np.array([end.path(i).x[0] for i in range(40)])
    after = gaps(solid_of(BOX), begun, bodies.pose, triangles)
    assert (before < 0.0).sum() > 20, "most would begin inside the ground"
    assert (after > 0.0).all()
    assert (end.lift[before < 0.0] > 0.0).all()
