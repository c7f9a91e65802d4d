"""Tests of slip friction: closed forms of a sliding slab, and a slab that tips where mu(s) is b / h."""

import math

import numpy as np
import pytest
from bodies.flying_bodies import G, Terms, about, angle_between, drop, flown, ground
from bodies.slabs import slab, slope
from flights.scenes_of_facets import grid_triangles, terrain_of

from rpf3d_core.kinetics.slippage import SlipFriction, slip_in_air, slip_on_ground
from rpf3d_core.shapes.families import box
from rpf3d_core.simulation.engines import engine_of
from rpf3d_core.terrain.facets import facets_of

ANGLE = math.radians(45.0)
MU_MIN, MU_MAX, KAPPA, BETA = 0.2, 1.3, 0.7, 20.0
"""The scarring block of Leine et al. 2014, section 5.1."""
TIPS_AT = math.tan(0.5 * math.pi * (1.0 - MU_MIN) / (MU_MAX - MU_MIN)) / KAPPA
"""Slip (m) at which mu is 1: 3.128 m."""


def slip_friction(*zones: tuple[float, float, float, float]) -> SlipFriction:
    """Return the slip friction of zones with mu_min, mu_max, kappa, beta."""
    return SlipFriction(*(np.array(column) for column in zip(*zones, strict=True)))


def mu(s: float) -> float:
    """Return the friction at a slip s (m)."""
    return MU_MIN + 2.0 / math.pi * (MU_MAX - MU_MIN) * math.atan(KAPPA * s)


def slid(b: float, h: float, max_time: float):
    """Return path, slip (S,) m and turn (S,) rad of a slab of half sides b and h that slides from a standstill."""
    shape, x, q = slab(b, h, ANGLE)
    law = slip_friction((MU_MIN, MU_MAX, KAPPA, BETA))
    terms = Terms((ground(0.0),), 1e-3, 20_000, max_time, slip=law)
    path = flown(engine_of("reference", facets_of(slope(ANGLE))), [shape], drop([shape], x, q), terms).path()
    down = np.array([math.cos(ANGLE), 0.0, -math.sin(ANGLE)])
    return path, (path.x - x) @ down, np.array([angle_between(q, each) for each in path.q])


def test_the_block_of_leine_has_slipped_3_128_m_where_its_friction_is_1():
    assert pytest.approx(3.128, abs=5e-4) == TIPS_AT
    assert mu(TIPS_AT) == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("b", [0.3, 0.4])
def test_a_slab_slides_with_the_speed_that_the_work_of_growing_friction_leaves(b):
    path, s, _ = slid(b, 0.1, 2.0)
    middle, speed = 0.5 * (s[1:] + s[:-1]), np.diff(s) / np.diff(path.t)
    late = middle > 0.3
    some = middle[late]
    integral = some * np.arctan(KAPPA * some) - np.log1p((KAPPA * some) ** 2) / (2.0 * KAPPA)
    work = some * (math.sin(ANGLE) - MU_MIN * math.cos(ANGLE))
    work -= math.cos(ANGLE) * 2.0 / math.pi * (MU_MAX - MU_MIN) * integral
    np.testing.assert_allclose(speed[late], np.sqrt(2.0 * G * work), rtol=1e-3)


def tipping(b: float, h: float, turn: float) -> tuple[float, float]:
    """Return time (s) and slip (m) at which a sliding block has turned over its lower edge by `turn` (rad).

    The edge slides on the plane: N = m (g cos(angle) + y''), with y = b sin(a) + h cos(a). The moments of friction and
    N about the centre turn the block, once mu(s) has reached b / h. Midpoint steps of 1e-5 s.
    """

    def rates(state):
        s, v, a, w = state
        y, off = b * math.sin(a) + h * math.cos(a), b * math.cos(a) - h * math.sin(a)
        lever, inertia = mu(s) * y - off, (b * b + h * h) / 3.0
        load = G * math.cos(ANGLE) - y * w * w
        turning = lever * load / (inertia - lever * off)
        if a <= 0.0 and turning <= 0.0:
            turning = 0.0
        normal = load + off * turning
        return np.array([v, G * math.sin(ANGLE) - mu(s) * normal, w, turning])

    state, t, dt = np.zeros(4), 0.0, 1e-4
    while state[2] < turn:
        half = state + 0.5 * dt * rates(state)
        state, t = state + dt * rates(half), t + dt
    return t, state[0]


def test_a_square_block_tips_where_its_friction_has_grown_to_1():
    path, s, turned = slid(0.3, 0.3, 1.7)
    assert turned[s < TIPS_AT].max() < 1e-5, "it slides flat as long as mu < b / h"
    tilts = [0.003, 0.01, 0.03, 0.1]
    for tilt in tilts:
        k = int(np.argmax(turned > tilt))
        share = (tilt - turned[k - 1]) / (turned[k] - turned[k - 1])
        t, slip = tipping(0.3, 0.3, tilt)
        assert path.t[k - 1] + share * (path.t[k] - path.t[k - 1]) == pytest.approx(t, abs=0.02)
        at = s[k - 1] + share * (s[k] - s[k - 1])
        assert at == pytest.approx(slip, rel=0.02) and at > TIPS_AT


def test_slip_grows_on_the_ground_and_fades_in_the_air():
    law = slip_friction((MU_MIN, MU_MAX, KAPPA, BETA), (math.nan,) * 4)
    assert slip_on_ground(law, 1.5, 0, 0.25) == 1.75
    assert slip_on_ground(law, 1.5, 1, 0.25) == 0.0, "ground without slip friction ends a scar"
    assert slip_in_air(law, 1.5, 0, 0.1) == pytest.approx(1.5 * math.exp(-2.0), rel=1e-15)
    assert slip_in_air(law, 0.0, 1, 0.1) == 0.0
    assert slip_in_air(law, 1.5, 1, 0.1) == 0.0, "an impact on ground without slip friction ends a scar, too"
    assert slip_on_ground(None, None, 0, 1.0) is None and slip_in_air(None, None, 0, 1.0) is None


def test_a_slab_on_ground_without_slip_friction_keeps_the_friction_of_its_material():
    corners = np.array([(x, y, 0.0) for x in (-5.0, 4.0, 40.0) for y in (-5.0, 5.0)])
    triangles = grid_triangles(3, 2)
    beyond = [int(max(corners[t, 0]) > 4.0) for t in triangles]
    terrain = terrain_of(corners, triangles, beyond, ("rough", "smooth"))
    law = slip_friction((0.1, 0.1, 0.0, BETA), (math.nan,) * 4)
    shape = box((1.0, 0.8, 0.2))
    terms = Terms((ground(5.0), ground(0.4)), 1e-3, 20_000, 10.0, slip=law)
    bodies = drop([shape], [(-3.0, 0.0, 0.1 + 2e-3)], about((0, 0, 1), 0.0), (12.0, 0.0, 0.0))
    end = flown(engine_of("reference", facets_of(terrain)), [shape], bodies, terms)
    path = end.path()
    x, v = path.x[:, 0], path.v[:, 0]
    k = int(np.argmax(x > 3.0))
    assert v[k] ** 2 == pytest.approx(144.0 - 2.0 * 0.1 * G * (x[k] + 3.0), rel=2e-3)
    j = int(np.argmax(x > 6.0))
    m = int(np.argmax(x > 9.0))
    assert v[j] ** 2 - v[m] ** 2 == pytest.approx(2.0 * 0.4 * G * (x[m] - x[j]), rel=5e-3)
