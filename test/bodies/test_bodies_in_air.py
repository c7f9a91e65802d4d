"""Tests of drag, drag layers and soft ground on bodies, against closed forms and integrated motions."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import NO_TURN, G, Terms, about, drop, flown, ground, random_poses, soft_ground
from bodies.slabs import slab, slope
from flights.scenes_of_facets import floor

from rpf3d_core.effects.drag import Drag
from rpf3d_core.effects.drag_layer import DragLayer
from rpf3d_core.effects.scarring import driven_through, penetration
from rpf3d_core.shapes.families import box
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.simulation.record import POSE
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.values import Outcome

MASS = 300.0
EVERYWHERE = np.empty((0, 4))


def one(terrain, shape, x, v, *effects, pose=NO_TURN, mu=0.5, e=0.0, max_time=20.0):
    """Return the path of one body with effects on the reference engine."""
    terms = Terms((ground(mu, e),), 1e-3, 40_000, max_time, effects=effects, mass=MASS)
    bodies = drop([shape], [x], [pose], v)
    return flown(engine_of("reference", facets_of(terrain)), [shape], bodies, terms)


def integrated(x, v, slowing, t, steps=20_000):
    """Return place (3,) m and velocity (3,) m/s after t seconds of dv/dt = -slowing(|v|) v - g, by Runge-Kutta."""
    state, dt = np.array([*x, *v], dtype=float), t / steps

    def rates(s):
        return np.array([*s[3:], *(-slowing(np.linalg.norm(s[3:])) * s[3:] - (0.0, 0.0, G))])

    for _ in range(steps):
        a = rates(state)
        b = rates(state + 0.5 * dt * a)
        c = rates(state + 0.5 * dt * b)
        state = state + dt / 6.0 * (a + 2.0 * b + 2.0 * c + rates(state + dt * c))
    return state[:3], state[3:]


@pytest.mark.parametrize("kind", ["drag", "layer"])
def test_air_bends_the_path_of_the_centre_within_the_accuracy_and_turns_nothing(kind):
    shape, x, v = box((1.0, 0.8, 0.5)), (-15.0, 0.3, 18.0), (9.0, 0.5, 6.0)
    radius = drop([shape], [x]).radius[0]
    accuracy = 1e-3
    if kind == "drag":
        effect = Drag(5.0, 1.2, accuracy, G)
        per_metre = 0.5 * 1.2 * 5.0 * math.pi * radius**2 / MASS
        path = one(floor(half=60.0), shape, x, v, effect).path()

        def slowing(speed):
            return per_metre * speed
    else:
        effect = DragLayer(120.0, 100.0, accuracy, G, EVERYWHERE)
        path = one(floor(half=60.0), shape, x, v, effect).path()

        def slowing(speed):
            return 120.0 / MASS

    contact = int(np.argmax(path.sliding))
    t, dt = path.t[:contact], np.diff(path.t[: contact + 1])
    assert t[-1] > 1.5 and len(t) > 4, "several parabolas"
    k = contact - 1
    at, _ = integrated(x, v, slowing, t[k])
    assert np.linalg.norm(at - path.x[k]) < accuracy
    without, _ = integrated(x, v, lambda _: 0.0, t[k], 100)
    assert np.linalg.norm(without - path.x[k]) > 100.0 * accuracy
    assert (dt > 0.0).all() and not path.w[:contact].any()


def test_spin_is_not_changed_by_air():
    """After an impact, a body turns freely in the air: energy of rotation and angular momentum are constant."""
    shape = box((1.0, 0.8, 0.5))
    pose = random_poses(np.random.default_rng(5), 1)[0]
    end = one(floor(half=60.0), shape, (-20.0, 0.0, 6.0), (12.0, 0.0, 0.0), Drag(5.0, 1.2, 1e-3, G), pose=pose, e=0.8)
    path = end.path()
    assert end.outcome[0] == Outcome.STOPPED
    flights = ~path.sliding[:-1]
    spin, speed = path.rows[:, POSE + 7], np.linalg.norm(path.v, axis=1)
    pairs = [i for i in np.flatnonzero(flights[:-1] & flights[1:]) if speed[i] > 1.0 and spin[i] > 0.1]
    same = [i for i in pairs if abs(spin[i + 1] / spin[i] - 1.0) < 1e-9]
    assert len(same) > 10
    in_air = [i for i in same if (path.v[i + 1, :2] != path.v[i, :2]).any()]
    assert in_air, "the air has braked these"
    assert all(np.linalg.norm(path.v[i + 1, :2]) < np.linalg.norm(path.v[i, :2]) for i in in_air)


@pytest.mark.parametrize("mu", [0.0, 0.2])
def test_a_layer_brakes_a_sliding_slab_as_the_closed_form_says(mu):
    angle, q = math.radians(30.0), 150.0 / MASS
    shape, x, pose = slab(0.4, 0.1, angle)
    layer = DragLayer(150.0, 50.0, 1e-2, G, EVERYWHERE)
    path = one(slope(angle), shape, x, (0.0, 0.0, 0.0), layer, pose=pose, mu=mu, max_time=4.0).path()
    down = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    a = G * (math.sin(angle) - mu * math.cos(angle))
    s, t = (path.x - x) @ down, path.t
    expected = a / q * (t - (1.0 - np.exp(-q * t)) / q)
    late = t > 1.0
    np.testing.assert_allclose(s[late], expected[late], rtol=0.01)
    assert s[-1] < 0.75 * 0.5 * a * t[-1] ** 2


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_soft_ground_takes_speed_from_a_box_that_lands_flat_before_it_rebounds(e):
    shape, height = box((1.0, 0.8, 0.5)), 5.0
    radius = drop([shape], [(0.0, 0.0, 0.0)]).radius[0]
    end = one(floor(), shape, (0.3, 0.4, height + 0.25), (0.0, 0.0, 0.0), soft_ground(), e=e)
    blow = end.blows()[0]
    into = blow[7]
    assert into == pytest.approx(math.sqrt(2.0 * G * height), rel=1e-3)
    depth = penetration(MASS, 5e6, into)
    kept = math.exp(-0.5 * 2.5 * 1700.0 * driven_through(depth, 0.0, radius) / MASS)
    assert kept < 0.95 and blow[8] == pytest.approx(e * kept * into, rel=1e-9, abs=1e-9)


def test_soft_ground_keeps_the_direction_and_spin_of_a_body_on_a_corner():
    shape = box((1.0, 0.8, 0.5))
    pose = about((1.0, 1.0, 0.0), 0.7)
    hard = one(floor(), shape, (0.0, 0.0, 6.0), (4.0, 0.0, 0.0), pose=pose, mu=1e6)
    soft_ = one(floor(), shape, (0.0, 0.0, 6.0), (4.0, 0.0, 0.0), soft_ground(), pose=pose, mu=1e6)
    first, other = hard.blows()[0], soft_.blows()[0]
    np.testing.assert_array_equal(first[:8], other[:8])
    v = np.array([4.0, 0.0, -G * first[0]])
    radius = drop([shape], [(0.0, 0.0, 0.0)]).radius[0]
    depth, aside = penetration(MASS, 5e6, -v[2]), 4.0 / -v[2]
    kept = math.exp(-0.5 * 2.5 * 1700.0 * driven_through(depth, aside, radius) / MASS)
    assert other[8] == pytest.approx(kept * first[8], rel=1e-9), "all speeds of an impact scale alike without spin"
    assert other[10] == pytest.approx(kept * first[10], rel=1e-9)
