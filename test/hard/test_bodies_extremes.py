"""Tests of bodies at the limits of the valid input, and in scenes that are moved, turned or mirrored."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import (
    SOUND,
    G,
    Terms,
    about,
    angle_between,
    drop,
    flown_over,
    ground,
    matrix,
    product,
    random_poses,
    triangles_of,
)
from bodies.slabs import quaternion, slab, slope
from bodies.solid_overlap import gaps, solid_of
from flights.scenes_of_facets import grid_triangles, terrain_of
from meshes.random_ground import UTM

from rpf3d_core.shapes.families import box
from rpf3d_core.values import Outcome

ACCURACY = 1e-3


def level(side: float, at=(0.0, 0.0, 0.0)):
    """Return a level square of two facets around the point `at` (m). side : half its length (m)"""
    corners = [(x, y, 0.0) for x in (-side, side) for y in (-side, side)]
    return terrain_of(np.array(corners) + np.asarray(at), grid_triangles(2, 2))


# --- friction and restitution -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("mu", [0.0, 0.5, 2.0, 100.0])
def test_a_slab_on_a_slope_slides_by_the_closed_form_or_stands(mu):
    angle = math.radians(35.0)
    shape, x, q = slab(0.5, 0.1, angle)
    end = flown_over(slope(angle), [shape], drop([shape], x, q), Terms((ground(mu),), ACCURACY, 20_000, 3.0))
    a = max(G * (math.sin(angle) - mu * math.cos(angle)), 0.0)
    down = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    assert (end.x[0] - x) @ down == pytest.approx(0.5 * a * end.t[0] ** 2, rel=0.01, abs=3.0 * ACCURACY)
    assert (end.outcome[0] == Outcome.STOPPED) == (a == 0.0)


def test_a_box_with_e_1_bounces_for_a_hundred_times_without_loss_or_gain():
    shape = box((1.2, 0.8, 0.5))
    bodies = drop([shape], np.array([0.0, 0.0, 1.25]), about((0, 0, 1), 0.4))
    end = flown_over(level(20.0), [shape], bodies, Terms((ground(0.0, 1.0),), ACCURACY, 5000, 1e4, 100))
    blows = end.blows()
    assert len(blows) == 100 and end.outcome[0] == Outcome.MAX_IMPACTS
    assert blows[:, 8] == pytest.approx(blows[:, 7], rel=1e-12)
    assert blows[:, 7] == pytest.approx(math.sqrt(2.0 * G), rel=1e-3), "each fall ends within the skin of the ground"
    assert (blows[:, 10] < 1e-7).all(), "rounding turns it by less than that"


@pytest.mark.parametrize("mu", [0.0, 0.5, 2.0, 100.0])
@pytest.mark.parametrize("e", [0.0, 1.0])
def test_tumbling_boxes_gain_no_energy_and_stay_above_the_ground(mu, e):
    shapes, count = [box((1.2, 0.8, 0.5)), box((1.0, 1.0, 1.0))], 10
    x = np.column_stack([np.linspace(-3, 3, count), np.zeros(count), np.full(count, 3.0)])
    bodies = drop(shapes, x, random_poses(np.random.default_rng(3), count), np.array([2.0, 1.0, 0.0]))
    end = flown_over(level(60.0), shapes, bodies, Terms((ground(mu, e),), ACCURACY, 400_000, 8.0))
    assert set(end.outcome) <= set(SOUND)
    for i in range(count):
        blows, path = end.blows(i), end.path(i)
        assert (blows[:, 13] <= blows[:, 12] * (1.0 + 1e-12)).all()
        assert path.energy.max() <= path.energy[0] + 1e-9
        assert gaps(solid_of(shapes[i % 2]), path.x, path.q, triangles_of(level(60.0))).min() > -1e-9
        if mu == 0.0 and e == 1.0:
            assert path.energy.min() == pytest.approx(path.energy[0], rel=2e-3), "nothing is lost"


# --- slender shapes and sizes -----------------------------------------------------------------------------------------

SLENDER = [(1.0, 0.05, 0.05), (1.0, 1.0, 0.05), (1.0, 0.2, 0.05), (20.0, 1.0, 1.0), (20.0, 20.0, 1.0)]


@pytest.mark.parametrize("lengths", SLENDER)
@pytest.mark.parametrize("e", [0.0, 0.5])
def test_a_needle_or_a_plate_of_1_to_20_that_falls_flat_rebounds_with_e(lengths, e):
    shape, half = box(lengths), 0.5 * min(lengths)
    x = np.array([0.0, 0.0, half + 1.0])
    end = flown_over(level(60.0), [shape], drop([shape], x), Terms((ground(0.5, e),), ACCURACY, 20_000, 60.0))
    first = end.blows()[0]
    assert first[8] == pytest.approx(e * first[7], abs=1e-6 * first[7]) and first[10] < 1e-6 * first[7] / max(lengths)
    assert end.outcome[0] == Outcome.STOPPED
    assert 0.0 < end.x[0, 2] - half < 1.1 * ACCURACY


@pytest.mark.parametrize("angle", [0.1, 0.6, 1.2])
def test_a_needle_that_falls_askew_turns_as_the_closed_form_of_a_rod_says(angle):
    """Without friction and with e = 0, the spin is v r m / (J + m r^2) with the lever r of the lowest corners."""
    shape, v = box((1.0, 0.05, 0.05)), 3.0
    q = about((0, 1, 0), angle)
    low = shape.corners @ matrix(q).T
    lever, height = abs(low[low[:, 2].argmin(), 0]), -low[:, 2].min()
    bodies = drop([shape], np.array([0.0, 0.0, height + 2.0 * ACCURACY]), q, np.array([0.0, 0.0, -v]))
    end = flown_over(level(9.0), [shape], bodies, Terms((ground(0.0),), ACCURACY, 2000, 1.0, 1))
    first = end.blows()[0]
    assert first[10] == pytest.approx(first[7] * lever / (shape.moments[2] + lever**2), rel=1e-3)


@pytest.mark.parametrize("radius", [0.02, 0.1, 10.0])
def test_boxes_of_2_cm_and_10_m_do_the_same_in_their_own_units(radius):
    """The first impacts are equal if lengths and the accuracy are scaled by s, and times by sqrt(s).

    The smallest box is 2 cm because smaller ones fall slower than the least speed of an impact with restitution.
    """
    unit = box((1.2, 0.8, 0.5))
    shape = box(tuple(radius * np.array((1.2, 0.8, 0.5))))
    q = random_poses(np.random.default_rng(12), 1)[0]
    x, v = np.array([0.0, 0.0, 1.5]), np.array([1.0, 0.3, 0.0])

    def first(block, size: float) -> np.ndarray:
        terms = Terms((ground(0.6, 0.5),), 1e-3 * size, 3000, 60.0, 2)
        at = drop([block], size * x, q, math.sqrt(size) * v)
        return flown_over(level(30.0 * size), [block], at, terms).blows()[0]

    here, there = first(unit, 1.0), first(shape, radius)
    root = math.sqrt(radius)
    assert there[0] == pytest.approx(here[0] * root, rel=1e-6)
    assert there[1:4] == pytest.approx(here[1:4] * radius, rel=1e-6, abs=1e-6 * radius)
    assert there[7:9] == pytest.approx(here[7:9] * root, rel=1e-5)
    assert there[10] == pytest.approx(here[10] / root, rel=1e-5)


@pytest.mark.parametrize("radius", [1e-3, 10.0])
def test_boxes_of_1_mm_and_10_m_stop_on_the_ground(radius):
    shape, count = box(tuple(radius * np.array((1.2, 0.8, 0.5)))), 6
    x = np.column_stack([np.zeros((count, 2)), np.full(count, 3.0 * radius)])
    bodies = drop([shape], x, random_poses(np.random.default_rng(2), count))
    terms = Terms((ground(0.5),), ACCURACY, 60_000, 120.0)
    end = flown_over(level(60.0 * radius), [shape], bodies, terms)
    assert (end.outcome == Outcome.STOPPED).all()
    triangles = triangles_of(level(60.0 * radius))
    skin = min(ACCURACY, 4e-3 * float(np.linalg.norm(shape.corners, axis=1).max()))
    gap = gaps(solid_of(shape), end.x, end.q, triangles, 3.0 * skin)
    assert (gap > 0.0).all() and (gap < 2.1 * skin).all()
    assert all(angle_to_face(end.q[i]) < 0.02 for i in range(count)), "all lie on a face"


def angle_to_face(q: np.ndarray) -> float:
    """Return the angle (rad) between the horizontal and the face of a box that is nearest to level."""
    return math.acos(min(float(np.abs(matrix(q)[2]).max()), 1.0))


# --- moved, turned and mirrored ---------------------------------------------------------------------------------------


def hills(seed: int = 4):
    """Return the points (V, 3) m and the facets (F, 3) of a rough slope of about 30 degrees."""
    draw, count = np.random.default_rng(seed), 20
    corners = np.array([(i * 1.1, j * 1.3 - 12.0, -0.6 * i) for i in range(count) for j in range(count)])
    corners[:, 2] += draw.uniform(0.0, 0.4, len(corners))
    return corners, np.asarray(grid_triangles(count, count))


CUBE = box((0.9, 0.9, 0.9))
RELEASE, POSE = np.array([2.0, 0.3, 2.2]), random_poses(np.random.default_rng(6), 1)[0]
BLOWS = 6
"""Number of impacts that are compared: rounding errors grow from impact to impact."""


def blows_of(corners: np.ndarray, facets: np.ndarray, x: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Return the first BLOWS impacts of the cube on a ground, one row each.

    corners (V, 3) m, facets (F, 3) : the ground; x (3,) m, q (4,) : release position and orientation
    """
    terms = Terms((ground(0.6, 0.3),), 1e-3, 9000, 9.0)
    end = flown_over(terrain_of(corners, facets), [CUBE], drop([CUBE], x, q), terms)
    return end.blows()[:BLOWS]


HERE = [0, 7, 8, 9, 10, 12, 13]
"""Columns of impacts that do not change if the scene is moved, turned or mirrored."""


@pytest.mark.parametrize("at", [(100.0, -50.0, 7.0), UTM, (1e6, -2e6, 500.0)])
def test_a_moved_cube_and_ground_have_the_moved_impacts(at):
    corners, facets = hills()
    here, there = blows_of(corners, facets, RELEASE, POSE), blows_of(corners + at, facets, RELEASE + at, POSE)
    assert len(here) == BLOWS
    assert there[:, HERE] == pytest.approx(here[:, HERE], rel=1e-4, abs=1e-4)
    assert there[:, 1:4] - at == pytest.approx(here[:, 1:4], abs=1e-4)


@pytest.mark.parametrize("angle", [0.7, 0.5 * math.pi, 3.0])
def test_a_turned_cube_and_ground_have_the_turned_impacts(angle):
    corners, facets = hills()
    turn, by = matrix(about((0, 0, 1), angle)), about((0, 0, 1), angle)
    here = blows_of(corners, facets, RELEASE, POSE)
    there = blows_of(corners @ turn.T, facets, turn @ RELEASE, product(by, POSE))
    assert there[:, HERE] == pytest.approx(here[:, HERE], rel=1e-4, abs=1e-4)
    assert there[:, 1:4] == pytest.approx(here[:, 1:4] @ turn.T, abs=1e-4)


def test_a_mirrored_cube_and_ground_have_the_mirrored_impacts():
    corners, facets = hills()
    mirror = np.diag([1.0, -1.0, 1.0])
    here = blows_of(corners, facets, RELEASE, POSE)
    q = quaternion(mirror @ matrix(POSE) @ mirror)
    there = blows_of(corners @ mirror, facets[:, ::-1], mirror @ RELEASE, q)
    assert there[:, HERE] == pytest.approx(here[:, HERE], rel=1e-4, abs=1e-4)
    assert there[:, 1:4] == pytest.approx(here[:, 1:4] @ mirror, abs=1e-4)
    assert angle_between(q, POSE) > 0.1, "the mirrored cube lies otherwise"
