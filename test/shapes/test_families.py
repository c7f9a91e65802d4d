"""Tests of boxes, ideal bodies, norm blocks and balls: closed forms, and published lengths of norm blocks."""

import math
from fractions import Fraction

import numpy as np
import pytest
from bodies.solid_checks import assert_is_a_closed_convex_solid, integrals

from rpf3d_core.errors import InputError
from rpf3d_core.shapes.directions import fibonacci_sphere
from rpf3d_core.shapes.families import FAMILIES, ball, box, family

ALL = pytest.mark.parametrize("name", ["equant", "plate", "column", "eota111", "eota221"])


def test_a_box_has_its_lengths_its_volume_and_its_name():
    body = box((0.5, 3.0, 2.0))
    assert np.ptp(body.corners, axis=0) == pytest.approx([3.0, 2.0, 0.5])
    assert (body.volume, body.name) == (pytest.approx(3.0, rel=1e-14), "box 0.5 x 3 x 2")
    assert len(body.faces) == 6


@pytest.mark.parametrize("lengths", [(1, 1), (1, 1, 1, 1), (1, 0, 1), (1, -2, 1), (1, math.nan, 1), (1, 1, math.inf)])
def test_lengths_that_make_no_box_are_refused(lengths):
    with pytest.raises(InputError, match="three positive numbers"):
        box(lengths)


def test_a_box_that_is_too_thin_is_refused():
    with pytest.raises(InputError, match="in one plane"):
        box((1.0, 1.0, 1e-7))


@ALL
def test_a_block_of_a_family_is_a_closed_solid_of_1_m3_and_24_corners(name):
    body = family(name)
    assert_is_a_closed_convex_solid(body)
    assert (body.volume, len(body.corners), body.name) == (1.0, 24, name)
    volume, centre, inertia = integrals(body.corners)
    assert volume == pytest.approx(1.0, rel=1e-12)
    assert centre == pytest.approx((0, 0, 0), abs=1e-12)
    assert inertia == pytest.approx(np.diag(body.moments), abs=1e-12)


@ALL
def test_a_block_of_a_family_has_the_same_bits_each_time(name):
    first, again = family(name), family(name)
    assert np.array_equal(first.corners, again.corners)
    assert np.array_equal(first.moments, again.moments)
    assert first.faces == again.faces


def test_the_families_are_those_that_a_scene_may_name():
    assert set(FAMILIES) == {"equant", "plate", "column", "eota111", "eota221"}
    with pytest.raises(InputError, match="'cube' does not exist; known families are equant, plate, column"):
        family("cube")


@pytest.mark.parametrize(("name", "lengths"), [("eota111", 3 * [1.122]), ("eota221", [1.4136, 1.4136, 0.7068])])
def test_a_norm_block_has_the_published_lengths_to_their_last_digit(name, lengths):
    body = family(name)
    assert np.ptp(body.corners, axis=0) == pytest.approx(lengths, abs=3e-4)
    assert sorted(map(len, body.faces)) == 8 * [3] + 18 * [4]


def test_a_cut_of_a_quarter_gives_the_published_volume_and_a_truncated_cube_cannot():
    c = Fraction(1, 4)
    inner = 1 - 2 * c
    # A core, 6 slabs on it, 12 prisms along its edges and 8 tetrahedra at its corners.
    share = inner**3 + 6 * inner**2 * c + 12 * inner * c**2 / 2 + 8 * c**3 / 6
    assert share == Fraction(17, 24)
    assert family("eota111").volume / np.prod(np.ptp(family("eota111").corners, axis=0)) == pytest.approx(17 / 24)
    for lengths in (3 * [1.122], [1.4136, 1.4136, 0.7068]):
        assert math.prod(lengths) * share == pytest.approx(1.0, abs=6e-4)
        assert math.prod(lengths) * (1 - 8 * Fraction(1, 2) ** 3 / 6) > 1.17


@pytest.mark.parametrize(("name", "low", "high"), [("equant", 0.9, 1.0), ("plate", 0.38, 0.42), ("column", 2.1, 2.3)])
def test_the_ideal_bodies_are_equant_flat_and_long(name, low, high):
    first, second, third = np.ptp(family(name).corners, axis=0)
    # The first principal axis has the smallest moment, so it is the longest.
    ratio = 2 * first / (second + third) if name == "column" else 2 * third / (first + second)
    assert low < ratio < high
    assert second / (first if name != "column" else third) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("name", ["equant", "plate", "column"])
def test_the_ideal_bodies_have_no_parallel_faces_within_a_quarter_of_a_degree(name):
    normals = family(name).normals
    assert len(normals) == 44
    assert (normals @ normals.T).min() > math.cos(math.radians(180.0 - 0.25))


@pytest.mark.parametrize("corners", [4, 12, 150, 600])
def test_a_ball_is_a_closed_solid_with_all_its_corners(corners):
    body = ball(corners)
    assert_is_a_closed_convex_solid(body, tolerance=1e-6)
    assert len(body.corners) == corners
    assert body.volume == 1.0


def test_a_ball_of_many_corners_tends_to_the_sphere():
    radius = (3 / (4 * math.pi)) ** (1 / 3)
    errors = []
    for corners in (100, 400):
        body = ball(corners)
        errors.append(max(abs(body.moments / (0.4 * radius**2) - 1)))
    assert errors[1] < 0.005
    assert errors[1] < errors[0] / 3


@pytest.mark.parametrize("count", [1, 4, 40, 200])
def test_the_points_of_a_fibonacci_sphere_are_unit_vectors_at_equal_steps_of_height(count):
    points = fibonacci_sphere(count)
    assert np.linalg.norm(points, axis=1) == pytest.approx(np.ones(count), abs=1e-15)
    assert points[:, 2] == pytest.approx(1 - (2 * np.arange(count) + 1) / count, abs=1e-15)


def test_every_direction_has_a_point_of_a_fibonacci_sphere_nearby():
    points = fibonacci_sphere(200)
    directions = np.random.default_rng(2).normal(size=(5000, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    # A cap with the share of one point, 4 pi / 200, has a radius of 0.141 rad.
    assert np.arccos((directions @ points.T).max(axis=1)).max() < 1.5 * 0.1415
