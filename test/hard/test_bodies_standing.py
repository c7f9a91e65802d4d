"""Tests of bodies on an edge or corner, in gullies and in gaps: they stand, tip over, fit or are wedged."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import (
    SOUND,
    Terms,
    about,
    angle_between,
    drop,
    flown_over,
    ground,
    product,
    random_poses,
    triangles_of,
)
from bodies.slabs import quaternion, slab, slope
from bodies.solid_overlap import gaps, solid_of
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.shapes.families import box
from rpf3d_core.shapes.polyhedron import Polyhedron
from rpf3d_core.values import Outcome

CUBE, ACCURACY = box((1.0, 1.0, 1.0)), 1e-3
DIAGONAL = math.sqrt(0.5)
"""Distance (m) of an edge of the cube from its centre."""


def level(side: float = 20.0):
    """Return a level square of two facets, whose common edge is its diagonal through the origin."""
    return terrain_of([(x, y, 0.0) for x in (-side, side) for y in (-side, side)], grid_triangles(2, 2))


def stays_outside(terrain, shape: Polyhedron, end, i: int = 0) -> bool:
    """Return True if no recorded place of a body overlaps a facet."""
    path = end.path(i)
    return bool(gaps(solid_of(shape), path.x, path.q, triangles_of(terrain)).min() > -1e-9)


# --- on an edge -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("off", [0.1, 0.01, 2e-3, -2e-3, -0.01, -0.1])
def test_a_cube_on_its_edge_falls_to_the_side_on_which_its_centre_is(off):
    """The centre is above the edge at a lean of 45 degrees; deviations grow at a rate of 3.2 1/s."""
    lean = 0.25 * math.pi + off
    q = about((0, 1, 0), lean)
    x = np.array([0.0, 0.0, DIAGONAL * math.cos(off) + 1.6 * ACCURACY])
    end = flown_over(level(), [CUBE], drop([CUBE], x, q), Terms((ground(2.0),), ACCURACY, 20_000, 20.0))
    assert end.outcome[0] == Outcome.STOPPED
    assert end.x[0, 2] - 0.5 == pytest.approx(0.5 * ACCURACY, abs=0.6 * ACCURACY)
    turned = about((0, 1, 0), 0.5 * math.pi if off > 0.0 else 0.0)
    assert angle_between(end.q[0], turned) < 4.0 * ACCURACY
    assert np.sign(end.x[0, 0]) == np.sign(off), "it turns about the edge, without sliding back"


@pytest.mark.parametrize("off", [1.0, 0.3, -0.3, -1.0])
def test_a_cube_on_a_slope_stands_below_45_degrees_and_tips_above(off):
    angle = math.radians(45.0 + off)
    shape, x, q = slab(0.5, 0.5, angle)
    end = flown_over(slope(angle), [shape], drop([shape], x, q), Terms((ground(2.0),), 1e-3, 20_000, 12.0))
    if off < 0.0:
        assert end.outcome[0] == Outcome.STOPPED
        assert angle_between(q, end.q[0]) < 6.0 * ACCURACY and np.linalg.norm(end.x[0] - x) < 3.0 * ACCURACY
    else:
        assert max(angle_between(q, each) for each in end.path().q) > 0.5 * math.pi


@pytest.mark.parametrize("e", [0.0, 0.5])
@pytest.mark.parametrize("along", [0.0, 1e-9, 0.3])
def test_a_cube_that_lands_on_its_edge_along_the_edge_of_two_facets_rebounds_with_e(e, along):
    """Seen from above, the edges of cube and facets are parallel, 1e-9 rad apart, or 0.3 rad apart."""
    lean = product(about((0, 0, 1), 0.25 * math.pi + along), about((1, 0, 0), 0.25 * math.pi))
    x = np.array([0.5, 0.5, DIAGONAL + 0.5])
    end = flown_over(level(), [CUBE], drop([CUBE], x, lean), Terms((ground(2.0, e),), ACCURACY, 20_000, 20.0))
    first = end.blows()[0]
    assert first[8] == pytest.approx(e * first[7], abs=1e-9 * first[7])
    assert first[10] < 1e-8, "the impulse passes through its centre"
    assert end.outcome[0] == Outcome.STOPPED and stays_outside(level(), CUBE, end)


# --- in gullies -------------------------------------------------------------------------------------------------------


def corner_of_a_room(reach: float = 6.0):
    """Return three squares at right angles with their common corner lowest, at the origin, and a matrix (3, 3).

    The columns of the matrix are the directions of the three edges. reach : side of the squares (m)
    """
    k = np.array([1.0, 1.0, 1.0]) / math.sqrt(3.0)
    first = np.array([1.0, -1.0, 0.0]) / math.sqrt(2.0)
    basis = np.array([first, np.cross(k, first), k])  # rows: axes of the room, with its diagonal upright
    axes = basis.T  # columns: the room's axes of x, y, z in space are the columns of basis
    a, b, c = reach * basis[:, 0], reach * basis[:, 1], reach * basis[:, 2]
    corners = [np.zeros(3), a, b, c, a + b, b + c, c + a]
    faces = [(0, 1, 4), (0, 4, 2), (0, 2, 5), (0, 5, 3), (0, 3, 6), (0, 6, 1)]
    return terrain_of(corners, faces), axes.T


def test_a_cube_that_falls_into_the_corner_of_three_faces_that_it_fits_lies_there_at_once():
    terrain, basis = corner_of_a_room()
    q = quaternion(basis)
    x = basis @ np.full(3, 0.5) + np.array([0.0, 0.0, 1.0])
    end = flown_over(terrain, [CUBE], drop([CUBE], x, q), Terms((ground(0.5),), ACCURACY, 20_000, 20.0))
    first = end.blows()[0]
    assert first[8] < 1e-6 and first[10] < 1e-6, "no speed and no spin are left"
    assert end.outcome[0] == Outcome.STOPPED and stays_outside(terrain, CUBE, end)
    away = basis.T @ end.x[0] - 0.5
    assert (away > 0.0).all() and (away < 1.6 * ACCURACY).all(), "it touches all three faces"
    assert angle_between(q, end.q[0]) < 3.0 * ACCURACY


def test_cubes_that_fall_into_a_corner_on_a_corner_stay_outside_and_stop():
    terrain, _ = corner_of_a_room()
    count = 12
    x = np.tile([0.0, 0.0, 2.5], (count, 1))
    poses = random_poses(np.random.default_rng(8), count)
    terms = Terms((ground(0.5),), ACCURACY, 300_000, 30.0)
    end = flown_over(terrain, [CUBE], drop([CUBE], x, poses), terms)
    assert (end.outcome == Outcome.STOPPED).all()
    assert all(stays_outside(terrain, CUBE, end, i) for i in range(count))


def gully(half: float, reach: float = 8.0):
    """Return a V-shaped gully along y. half : angle (rad) of its walls with the vertical; reach : their length (m)"""
    wall = reach * np.array([math.sin(half), 0.0, math.cos(half)])
    corners = [(sign * wall[0], y, wall[2] if sign else 0.0) for y in (-9.0, 9.3) for sign in (-1.0, 0.0, 1.0)]
    return terrain_of(corners, [(0, 1, 4), (0, 4, 3), (1, 2, 5), (1, 5, 4)])


WEDGE = box((2.0, 1.0, 0.3))
"""A slab 1 m wide and 0.3 m high, 2 m long along the gully."""
LONG_ALONG_Y = about((0, 0, 1), 0.5 * math.pi)


@pytest.mark.parametrize("half", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("mu", [1.0, 2.0, 100.0])
def test_a_slab_that_falls_flat_into_a_gully_is_wedged_where_its_lower_edges_meet_the_walls(half, mu):
    """Friction holds the slab if the friction angle exceeds the angle of the reaction; so does geometry here."""
    terrain = gully(half)
    height = 0.5 / math.tan(half) + 0.15
    bodies = drop([WEDGE], np.array([0.0, 0.0, height + 0.2]), LONG_ALONG_Y)
    end = flown_over(terrain, [WEDGE], bodies, Terms((ground(mu),), ACCURACY, 20_000, 20.0))
    assert end.outcome[0] == Outcome.STOPPED and stays_outside(terrain, WEDGE, end)
    assert 0.0 < end.x[0, 2] - height < 1.6 * ACCURACY / math.sin(half)
    assert abs(end.x[0, 0]) < 2.0 * ACCURACY and angle_between(end.q[0], LONG_ALONG_Y) < 8.0 * ACCURACY


@pytest.mark.parametrize("mu", [0.0, 0.2, 0.5, 2.0, 100.0])
def test_blocks_that_fall_askew_into_a_narrow_gully_stay_outside(mu):
    terrain, count = gully(0.25), 8
    shapes = [CUBE, WEDGE]
    x = np.column_stack([np.linspace(-0.4, 0.4, count), np.linspace(-5.0, 5.0, count), np.full(count, 5.5)])
    bodies = drop(shapes, x, random_poses(np.random.default_rng(9), count))
    end = flown_over(terrain, shapes, bodies, Terms((ground(mu),), ACCURACY, 400_000, 10.0))
    assert set(end.outcome) <= set(SOUND)
    assert all(stays_outside(terrain, shapes[i % 2], end, i) for i in range(count))
    for i in range(count):
        energy = end.path(i).energy
        assert energy[1:].max() <= energy[0] + 1e-9, "no wedge gives energy"
    if mu >= 0.5:
        assert (end.outcome == Outcome.STOPPED).sum() >= count - 1, "one may swing between two points that hold it"


# --- through gaps -----------------------------------------------------------------------------------------------------

PLATE, NEEDLE = box((2.0, 1.0, 0.1)), box((2.0, 0.1, 0.1))
UPRIGHT = product(about((0, 0, 1), 0.0), about((0, 1, 0), 0.5 * math.pi))
"""Longest side upright, shortest side along x."""


def slot(width: float, depth: float = 5.0, side: float = 6.0):
    """Return two level banks at height 0 with an upright slot along y between them, and the floor of the slot.

    width, depth : of the slot (m); side : distance (m) of the outer border from the middle
    """
    half = 0.5 * width
    profile = [(-side, 0.0), (-half, 0.0), (-half, -depth), (half, -depth), (half, 0.0), (side, 0.0)]
    return terrain_of([(x, y, z) for x, z in profile for y in (-side, 1.1 * side)], grid_triangles(6, 2))


ROOMS = [(1e-2, 1e-3), (3e-3, 1e-3), (5e-4, 1e-4), (5e-5, 1e-5), (-1e-6, 1e-3), (-1e-3, 1e-3), (-1e-3, 1e-5)]
"""(Width of the gap minus thickness of the body, accuracy), both in m; contact begins within one accuracy of a wall."""


@pytest.mark.parametrize("shape", [PLATE, NEEDLE], ids=["plate", "needle"])
@pytest.mark.parametrize(("room", "accuracy"), ROOMS)
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_a_plate_and_a_needle_pass_a_gap_of_their_size_if_it_has_room(shape, room, accuracy, mu):
    terrain = slot(0.1 + room)
    bodies = drop([shape], np.array([0.0, 0.3, 1.5]), UPRIGHT)
    end = flown_over(terrain, [shape], bodies, Terms((ground(mu),), accuracy, 100_000, 3.0))
    assert stays_outside(terrain, shape, end)
    lowest = end.path().x[:, 2].min()
    if room > 0.0:
        assert lowest < -3.99, "it stands upright on the floor, or has leaned over there"
    else:
        assert lowest > 0.0, "no part of it is in the gap"


@pytest.mark.parametrize("shape", [PLATE, NEEDLE], ids=["plate", "needle"])
def test_in_a_gap_with_less_room_than_the_accuracy_a_body_stays_outside_all_walls(shape):
    """At this accuracy, the body may or may not pass."""
    terrain = slot(0.1 + 5e-4)
    bodies = drop([shape], np.array([0.0, 0.3, 1.5]), UPRIGHT)
    end = flown_over(terrain, [shape], bodies, Terms((ground(0.5),), 1e-3, 100_000, 3.0))
    assert stays_outside(terrain, shape, end) and set(end.outcome) <= set(SOUND)
