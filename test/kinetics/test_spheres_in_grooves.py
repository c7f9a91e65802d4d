"""Tests of spheres that roll along a groove between two facets, or across a groove."""

import math
from dataclasses import replace

import numpy as np
import pytest
from flights.on_both_engines import BOTH
from flights.rolling_spheres import roll, spheres
from flights.scenes_of_facets import engine_over, grid_triangles, strip, terrain_of

from rpf3d_core.materials.library import Surface
from rpf3d_core.terrain.pit.synthetic import Pit, pit_terrain
from rpf3d_core.values import Outcome

G, RADIUS, FALL = 9.81, 0.5, 0.05
"""Gravity (m/s2), radius (m), and fall of the ditch per metre along it (-)."""


def ditch(rise=0.02, fall=FALL, face=70.0):
    """Return a ditch along x, 60 m long, between a bench face (y < 0) and a berm (y > 0).

    rise : rise of the berm away from the ditch (-); fall : fall of the ditch per metre along it (-)
    face : angle of the bench face (degrees)
    """
    x, y = np.meshgrid(np.arange(0.0, 60.1, 2.0), [-4.0, 0.0, 4.0], indexing="ij")
    z = np.where(y < 0.0, -y * math.tan(math.radians(face)), rise * y) - fall * x
    return terrain_of(np.stack([x, y, z], -1).reshape(-1, 3), grid_triangles(x.shape[0], 3))


def above(engine, x, y, height):
    """Return points (N, 3) m at a vertical height (m) above the ground."""
    ground = engine.ground_below(np.column_stack([x, y, np.full(len(x), 1000.0)]))
    return np.column_stack([x, y, 1000.0 - ground[:, 0] + height])


@BOTH
def test_a_sphere_rolls_along_a_ditch_as_down_a_slope(engine):
    """Without rolling friction, a = 5/7 g sin(slope) along the ditch, wherever the sphere has rolled into the ditch."""
    over, y = engine_over(engine, ditch()), np.linspace(0.4, 1.5, 3)
    x = above(over, np.full(3, 3.0), y, RADIUS + 1e-3)
    flights = roll(over, spheres(Surface(0.3, 0.8, 0.6, 0.05, 0.0), max_time=60.0), RADIUS, x, (2.0, -0.3, -0.1))
    slope, paths = math.atan(FALL), flights.paths
    for rock in range(3):
        mine = np.flatnonzero((paths.row == rock) & (paths.x[:, 0] > 20.0))
        speed = np.linalg.norm(paths.v[mine[0]])
        way = np.linalg.norm(paths.x[mine[-1]] - paths.x[mine[0]])
        a = 5.0 / 7.0 * G * math.sin(slope)
        takes = (math.sqrt(speed * speed + 2.0 * a * way) - speed) / a
        assert paths.t[mine[-1]] - paths.t[mine[0]] == pytest.approx(takes, rel=2e-3)
    assert (flights.deposits.outcome == Outcome.LEFT_TERRAIN).all()


@pytest.mark.parametrize("mu_r", [0.3, 0.4, 0.45])
def test_friction_alone_does_not_hold_a_sphere_at_a_wall(mu_r):
    """Gravity does not press these spheres on the face, but their spin and the friction of the berm do, mu 1.58.

    The berm falls away from the face by 1 in 1,000. With mu_r 0.4, gravity and resistance along it are almost equal.
    """
    over, y = engine_over("compiled", ditch(rise=-0.001, fall=0.4)), np.linspace(0.36, 1.5, 100)
    x = above(over, np.full(len(y), 3.0), y, 1.08 * RADIUS + 1e-3)
    ground = Surface(0.0, 0.8, 1.58, 0.05, mu_r)
    ends = roll(over, spheres(ground, max_time=60.0), RADIUS, x, (3.0, -0.3, -1.2)).deposits
    assert (ends.outcome == (Outcome.LEFT_TERRAIN if mu_r <= 0.4 else Outcome.STOPPED)).all()


@pytest.mark.parametrize("face", [70.0, 75.0, 80.0, 85.0])
@pytest.mark.parametrize(("fall", "mu", "mu_r"), [(0.28, 0.577, 0.2), (0.4, 1.0, 0.2), (0.4, 0.2, 0.03)])
def test_a_sphere_rolls_along_a_ditch_with_a_level_floor(face, fall, mu, mu_r):
    """The floor alone carries the sphere; friction presses it against the face only until its spin is that of rolling.

    Then it rolls as down a slope, where friction suffices: a = 5/7 g (sin - mu_r cos).
    """
    over, rng = engine_over("compiled", ditch(rise=0.0, fall=fall, face=face)), np.random.default_rng(20261201)
    x = above(over, np.full(200, 3.0), rng.uniform(0.3, 1.5, 200), 1.1 * RADIUS + 1e-3)
    v = np.column_stack([rng.uniform(0.0, 3.0, 200), rng.uniform(-2.0, 0.0, 200), np.zeros(200)])
    flights = roll(over, spheres(Surface(0.3, 0.0, mu, 0.05, mu_r), max_time=20.0), RADIUS, x, v)
    assert (flights.deposits.outcome == Outcome.LEFT_TERRAIN).all()
    slope, paths = math.atan(fall), flights.paths
    a = 5.0 / 7.0 * G * (math.sin(slope) - mu_r * math.cos(slope))
    for rock in range(0, 200, 20):
        mine = np.flatnonzero((paths.row == rock) & (abs(paths.x[:, 0] - 40.0) < 12.0))
        first, last = np.linalg.norm(paths.v[mine[[0, -1]]], axis=1)
        way = np.linalg.norm(paths.x[mine[-1]] - paths.x[mine[0]])
        assert last * last - first * first == pytest.approx(2.0 * a * way, rel=5e-3)


@pytest.mark.parametrize("kink", [0.05, 0.5, 2.0])
@pytest.mark.parametrize("speed", [0.5, 5.0])
def test_a_shallow_groove_does_not_stop_a_sphere_that_rolls_across(kink, speed):
    """The impact in the groove takes at most the speed into the second facet and the spin that belongs to it."""
    rise = math.tan(math.radians(kink))
    over = engine_over("compiled", strip([(-30.0, 0.0), (0.0, 0.0), (30.0, 30.0 * rise)], half_width=30.0))
    flights = roll(
        over,
        spheres(Surface(0.0, 0.8, 1.0, 0.0, 0.0), max_time=12.0),
        RADIUS,
        (-2.0, 0.2, RADIUS),
        (speed, 0.1 * speed, 0),
    )
    paths = flights.paths
    before = np.flatnonzero(paths.x[:, 0] < -0.1)[-1]
    after = np.flatnonzero(paths.x[:, 0] > 0.1)[0]
    height = paths.x[after, 2] - paths.x[before, 2]
    kept = np.dot(paths.v[after], paths.v[after]) + 10.0 / 7.0 * G * height
    assert kept > np.dot(paths.v[before], paths.v[before]) * (1.0 - 2.0 * math.sin(math.radians(kink)))


def test_every_sphere_in_a_pit_with_benches_comes_to_rest():
    """In the ditches of the benches, 4 of 100 spheres once ended as unresolved contacts."""
    terrain = pit_terrain(Pit(triangles=20_000))
    over = engine_over("compiled", replace(terrain, zone=np.zeros_like(terrain.zone), zones=("ground",)))
    rng, rocks = np.random.default_rng(20261128), 400
    places = np.column_stack([rng.uniform(-606.7, -530.0, rocks), rng.uniform(-200.0, 200.0, rocks), np.zeros(rocks)])
    local = terrain.frame.points_to_local(places)
    x = above(over, local[:, 0], local[:, 1], 0.8)
    flights = roll(over, spheres(Surface(0.35, 0.8, 0.58, 0.05, 0.1), max_time=300.0), RADIUS, x, (5.0, 0.0, 0.0))
    assert (flights.deposits.outcome == Outcome.STOPPED).all()
