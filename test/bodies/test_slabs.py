"""Tests that slabs on an inclined plane slide, stand or tip over, depending on friction, slope and slenderness."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import G, Terms, about, angle_between, drop, flown_over, ground, matrix
from bodies.slabs import ACCURACY, slab, slope

from rpf3d_core.values import Outcome


def released(b: float, h: float, angle: float, mu: float, **more):
    """Return the flight of a slab released on a slope, its position (3,) m, and its orientation (4,).

    b, h : half lengths (m) down the slope and normal to it; mu : friction
    """
    rows, max_time = more.pop("rows", 20_000), more.pop("max_time", 3.0)
    shape, x, q = slab(b, h, angle, **more)
    terms = Terms((ground(mu),), ACCURACY, rows, max_time)
    return flown_over(slope(angle, **more), [shape], drop([shape], x, q), terms), x, q


SLIDES = [  # half width, half height (m), slope (degrees), friction
    (0.4, 0.1, 30.0, 0.2), (0.4, 0.1, 30.0, 0.5), (0.4, 0.1, 60.0, 1.0), (0.3, 0.3, 25.0, 0.0), (0.3, 0.35, 40.0, 0.6),
    (0.15, 0.6, 20.0, 0.2),
]  # fmt: skip


@pytest.mark.parametrize(("b", "h", "degrees", "mu"), SLIDES)
def test_a_slab_slides_with_the_acceleration_of_coulomb(b, h, degrees, mu):
    angle = math.radians(degrees)
    assert mu < math.tan(angle) and mu < b / h
    end, x, q = released(b, h, angle, mu, max_time=2.0)
    path = end.path()
    a = G * (math.sin(angle) - mu * math.cos(angle))
    down = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    late = path.t > 0.5
    rate = 2.0 * np.polyfit(path.t[late], (path.x @ down)[late], 2)[0]
    assert rate == pytest.approx(a, rel=0.01)
    assert (path.x[-1] - x) @ down == pytest.approx(0.5 * a * path.t[-1] ** 2, rel=0.03)
    assert abs(path.x[-1, 1] - x[1]) < ACCURACY
    assert max(angle_between(q, each) for each in path.q) < 2.0 * ACCURACY / min(b, h)


STANDS = [
    (0.4, 0.1, 30.0, 0.7),
    (0.4, 0.1, 10.0, 0.2),
    (0.3, 0.3, 40.0, 0.9),
    (0.2, 0.6, 15.0, 2.0),
    (0.4, 0.1, 70.0, 4.0),
]


@pytest.mark.parametrize(("b", "h", "degrees", "mu"), STANDS)
def test_a_slab_stands_where_it_was_released(b, h, degrees, mu):
    angle = math.radians(degrees)
    assert mu > math.tan(angle) and math.tan(angle) < b / h
    end, x, q = released(b, h, angle, mu, max_time=20.0)
    assert end.outcome[0] == Outcome.STOPPED
    assert np.linalg.norm(end.x[0] - x) < 3.0 * ACCURACY
    assert angle_between(q, end.q[0]) < 3.0 * ACCURACY / min(b, h)


TIPS = [(0.2, 0.6, 25.0, 2.0), (0.3, 0.3, 50.0, 1.5), (0.1, 0.5, 15.0, 0.5)]


@pytest.mark.parametrize(("b", "h", "degrees", "mu"), TIPS)
def test_a_slab_tips_over_its_lower_edge(b, h, degrees, mu):
    angle = math.radians(degrees)
    assert math.tan(angle) > b / h and mu > b / h
    end, x, q = released(b, h, angle, mu, max_time=30.0)
    path = end.path()
    turned = np.array([angle_between(q, each) for each in path.q])
    assert turned.max() > 0.5
    down = np.array([math.cos(angle), 0.0, -math.sin(angle)])
    first = int(np.argmax(turned > 0.2))
    axis = matrix(path.q[first]) @ path.w[first]
    assert axis[1] > 0.99 * np.linalg.norm(axis), "it turns head first, down the slope"
    radius, lean = math.hypot(b, h), math.atan(b / h) - turned[first]
    assert (path.x[first] - x) @ down == pytest.approx(b - radius * math.sin(lean), abs=3.0 * ACCURACY), (
        "about its edge"
    )


@pytest.mark.parametrize(
    ("strike", "at"), [(0.0, (1e6, -1e6, 500.0)), (2.1, (0.0, 0.0, 0.0)), (math.pi, (5e6, 5e6, 1000.0))]
)
def test_a_slab_slides_the_same_way_in_a_scene_that_is_moved_and_turned(strike, at):
    angle, turn = math.radians(30.0), matrix(about((0, 0, 1), strike))
    here, x, _ = released(0.4, 0.1, angle, 0.4, max_time=2.0)
    there, y, _ = released(0.4, 0.1, angle, 0.4, max_time=2.0, strike=strike, at=np.array(at))
    assert turn @ (here.x[0] - x) == pytest.approx(there.x[0] - y, abs=0.01)
    assert there.t[0] == pytest.approx(here.t[0], abs=0.02)
