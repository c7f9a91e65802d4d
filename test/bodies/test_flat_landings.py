"""Tests of boxes that fall flat onto a level plane, also in scenes that are moved, turned or mirrored."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import G, Terms, about, angle_between, drop, flown_over, ground
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.shapes.families import box
from rpf3d_core.values import Outcome

BOX, HALF, HEIGHT = box((1.2, 0.8, 0.5)), 0.25, 1.5
"""A box, half of its height (m), and the height of its fall (m)."""
SHORT_HALF = 0.4
"""Half of the shorter side of the face on which the box falls (m)."""


def level(at=(0.0, 0.0, 0.0), side: float = 40.0):
    """Return a level square of two facets around the point `at` (m). side : half its length (m)"""
    corners = [(x, y, 0.0) for x in (-side, side) for y in (-side, side)]
    return terrain_of(np.array(corners) + np.asarray(at), grid_triangles(2, 2))


def fallen(terms: Terms, terrain=None, at=(0.0, 0.0, 0.0), yaw: float = 0.3):
    """Return the flight of the box that falls flat from HEIGHT above a point of a plane."""
    x = np.asarray(at) + np.array((0.2, -0.1, HALF + HEIGHT))
    return flown_over(terrain or level(at), [BOX], drop([BOX], x, about((0, 0, 1), yaw)), terms)


@pytest.mark.parametrize("mu", [0.0, 0.5, 2.0])
@pytest.mark.parametrize("accuracy", [2e-3, 1e-4])
def test_a_box_that_falls_flat_without_restitution_lies_at_once(mu, accuracy):
    end = fallen(Terms((ground(mu),), accuracy, 1000))
    assert end.outcome[0] == Outcome.STOPPED
    blows = end.blows()
    assert len(blows) == 1
    assert blows[0, 7] == pytest.approx(math.sqrt(2.0 * G * HEIGHT), abs=accuracy * G / 5.0)
    assert blows[0, 8] < 1e-9 and blows[0, 10] < 1e-9, "no speed and no spin are left"
    assert blows[0, 11] >= 4
    assert 0.0 <= end.x[0, 2] - HALF <= 1.05 * accuracy
    assert end.x[0, :2] == pytest.approx((0.2, -0.1), abs=1e-6)
    assert angle_between(end.q[0], about((0, 0, 1), 0.3)) < 1e-3 * accuracy / SHORT_HALF, "steps are solved to 1e-3"
    assert end.t[0] - blows[0, 0] < 0.5, "it counts as standing after 0.3 s"


@pytest.mark.parametrize("accuracy", [2e-3, 1e-4])
def test_a_box_that_falls_flat_rebounds_to_the_share_e_squared_of_its_height(accuracy):
    e = 0.5
    end = fallen(Terms((ground(0.5, e),), accuracy, 5000))
    blows = end.blows()
    into = math.sqrt(2.0 * G * HEIGHT)
    speeds = into * e ** np.arange(4)
    assert blows[:4, 7] == pytest.approx(speeds, abs=4.0 * accuracy * G / into * 8.0)
    assert blows[:4, 8] == pytest.approx(e * blows[:4, 7], rel=1e-9)
    first, second = blows[0, 0], blows[1, 0]
    tops = blows[0, 8] ** 2 / (2.0 * G)
    assert tops == pytest.approx(e * e * HEIGHT, abs=accuracy)
    assert second - first == pytest.approx(2.0 * blows[0, 8] / G, abs=1e-3)
    assert (blows[:4, 9:11] < 1e-6).all(), "the box does not turn"
    assert end.outcome[0] == Outcome.STOPPED and 0.0 <= end.x[0, 2] - HALF <= accuracy


@pytest.mark.parametrize("at", [(1e6, -2e6, 0.0), (512_345.678, 4_567_890.123, 1687.0)])
def test_a_scene_that_is_moved_ends_at_the_same_place(at):
    terms = Terms((ground(0.5, 0.3),))
    here, there = fallen(terms), fallen(terms, at=at)
    assert there.outcome[0] == here.outcome[0] == Outcome.STOPPED
    assert there.x[0] - at == pytest.approx(here.x[0], abs=1e-6)
    assert angle_between(here.q[0], there.q[0]) < 1e-6
    assert there.t[0] == pytest.approx(here.t[0], abs=1e-5)


def test_a_scene_that_is_turned_ends_at_the_turned_place():
    terms, angle = Terms((ground(0.5, 0.3),)), 0.8
    here, there = fallen(terms), fallen(terms, yaw=0.3 + angle)
    assert there.x[0] == pytest.approx(here.x[0], abs=1e-6)
    assert angle_between(there.q[0], about((0, 0, 1), 0.3 + angle)) < 1e-6
