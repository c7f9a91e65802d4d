"""Tests of bodies that roll: the rimless wheel, and hulls with more and more corners, which approach a sphere."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import G, Terms, about, drop, flown_over, ground, matrix, product, random_poses
from bodies.slabs import quaternion, slope
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.shapes.families import ball
from rpf3d_core.shapes.polyhedron import polyhedron_of

N, GAMMA, LENGTH = 12, 0.1, 1.0
"""Corners of the wheel, slope (rad), radius of its corners (m)."""
AL = math.pi / N
J = LENGTH**2 * (2.0 + math.cos(2.0 * AL)) / 6.0
ETA = (J + LENGTH**2 * math.cos(2.0 * AL)) / (J + LENGTH**2)
GAIN = 4.0 * G * LENGTH * math.sin(AL) * math.sin(GAMMA) / (J + LENGTH**2)
AFTER = ETA * math.sqrt(GAIN / (1.0 - ETA**2))
"""Spin (rad/s) after each corner in steady rolling: McGeer 1990; Coleman, Chatterjee & Ruina 1997."""


def wheel():
    """Return a prism over a polygon of N corners; its third principal axis (largest moment) is the wheel's axis."""
    turn = 2.0 * math.pi * np.arange(N) / N
    ring = LENGTH * np.column_stack([np.cos(turn), np.sin(turn)])
    return polyhedron_of(np.vstack([np.column_stack([ring, np.full(N, y)]) for y in (-0.5, 0.5)]), "wheel")


def on_a_corner(shape) -> np.ndarray:
    """Return the orientation (4,) of a wheel with its axis along y and two corners vertically below the centre."""
    corner = float(np.arctan2(shape.corners[:, 1], shape.corners[:, 0]).min())
    u, axis = np.array([0.0, 0.0, -1.0]), np.array([0.0, -1.0, 0.0])
    v = np.cross(axis, u)
    columns = [math.cos(corner) * u - math.sin(corner) * v, math.sin(corner) * u + math.cos(corner) * v, axis]
    return quaternion(np.array(columns).T)


def steady_spins(accuracy: float) -> np.ndarray:
    """Return the mean spins (rad/s) just before and after an impact of a corner, over the last 40 impacts: (2,).

    The wheel starts at rest, so that friction does not turn it sideways.
    """
    shape = wheel()
    lean = about((0.0, 1.0, 0.0), 0.02)
    arm = matrix(lean) @ np.array([0.0, 0.0, LENGTH])
    out, down = np.array([math.sin(GAMMA), 0.0, math.cos(GAMMA)]), np.array([math.cos(GAMMA), 0.0, -math.sin(GAMMA)])
    x = arm + 1.6 * accuracy * out - 60.0 * down
    bodies = drop([shape], x, product(lean, on_a_corner(shape)))
    end = flown_over(slope(GAMMA), [shape], bodies, Terms((ground(10.0),), accuracy, 60_000, 25.0))
    blows = end.blows()
    corners = blows[blows[:, 9] > 1.0]
    assert len(corners) > 60
    return corners[-40:, 9:11].mean(axis=0)


def test_a_rimless_wheel_rolls_with_the_spin_of_the_closed_form():
    """The relative error of the spin is at most 7 accuracies over the radius, and falls faster than the accuracy."""
    assert G * math.cos(GAMMA + AL) > LENGTH * (AFTER / ETA) ** 2, "it does not lift off"
    accuracies = np.array([4e-3, 2e-3, 1e-3, 5e-4, 2.5e-4])
    spins = np.array([steady_spins(accuracy) for accuracy in accuracies])
    errors = np.abs(spins / (AFTER / ETA, AFTER) - 1.0).max(axis=1)
    assert (errors <= 7.0 * accuracies / LENGTH).all(), errors
    order = np.polyfit(np.log(accuracies), np.log(errors), 1)[0]
    assert order > 1.0, (order, errors)


# --- hulls of many corners --------------------------------------------------------------------------------------------

HULLS = (20, 60, 200)


def level(side: float = 40.0):
    """Return a level square of two facets."""
    return terrain_of([(x, y, 0.0) for x in (-side, 1.1 * side) for y in (-side, side)], grid_triangles(2, 2))


@pytest.mark.parametrize(("mu", "e"), [(0.1, 0.5), (2.0, 0.0), (2.0, 0.5), (0.0, 1.0)])
def test_the_bounce_of_a_hull_tends_to_that_of_a_sphere(mu, e):
    """Errors are means over 60 orientations; a sphere does not slip after the impact if (1 + e) mu v_z >= 2/7 v_x."""
    v_x, v_z = 3.0, 3.0
    slowed = (1.0 + e) * min(mu * v_z, 2.0 / 7.0 * v_x)
    errors = []
    for corners in HULLS:
        shape = ball(corners)
        radius = float(np.linalg.norm(shape.corners, axis=1).max())
        x = np.column_stack([np.zeros(60), np.zeros(60), np.full(60, radius + 0.01)])
        poses = random_poses(np.random.default_rng(3), 60)
        bodies = drop([shape], x, poses, np.array([v_x, 0.0, -v_z]))
        end = flown_over(level(), [shape], bodies, Terms((ground(mu, e),), 1e-4, 2000, 0.05, 1))
        after = np.array([end.path(i).v[end.path(i).t >= end.blows(i)[0, 0]][0] for i in range(60)])
        fell = np.sqrt(v_z**2 + 2.0 * G * (x[:, 2] - [end.blows(i)[0, 3] for i in range(60)]))
        away = after - np.column_stack([np.full(60, v_x - slowed), np.zeros(60), e * fell])
        errors.append(float(np.linalg.norm(away, axis=1).mean()))
    assert errors[2] < errors[1] < errors[0]


def test_a_hull_that_skids_begins_to_roll_as_a_sphere_does():
    """A sphere skids with deceleration mu g until t = 2 v / (7 mu g), then rolls at 5/7 v."""
    v, mu = 4.0, 0.3
    lasts, errors = 2.0 * v / (7.0 * mu * G), []
    for corners in HULLS:
        shape = ball(corners)
        x = np.column_stack([np.zeros(8), np.zeros(8), np.full(8, np.linalg.norm(shape.corners, axis=1).max() + 1e-3)])
        bodies = drop([shape], x, random_poses(np.random.default_rng(4), 8), np.array([v, 0.0, 0.0]))
        end = flown_over(level(), [shape], bodies, Terms((ground(mu),), 1e-3, 40_000, lasts))
        errors.append(float(np.abs(np.array([end.path(i).v_end[-2, 0] for i in range(8)]) - 5.0 / 7.0 * v).mean()))
    assert errors[2] < errors[1] < errors[0]
