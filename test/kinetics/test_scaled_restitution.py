"""Tests of restitution that falls with speed or mass, and of v_half: factors, limits, and the sum of the bounces."""

import math

import numpy as np
import pytest
from flights.rebounds_named import MODELS, UP, falling_rock, flight_with, struck
from flights.scenes_of_facets import engine_over, floor, fly, incline, same_bits, surface

from rpf3d_core.kinetics.rebound import ConstantRestitution, rest_of_bounces
from rpf3d_core.kinetics.rebounds.mass_scaled import MassScaled
from rpf3d_core.kinetics.rebounds.v_half import VHalf
from rpf3d_core.kinetics.rebounds.velocity_scaled import VelocityScaled
from rpf3d_core.values import ZERO, Motion

PRINTED = 5.1e-4
"""Half a unit of the third decimal, the last that the reference prints."""
SPEEDS = (2.0, 5.0, 10.0, 20.0, 30.0)
G = 9.81


def left_of(model, v_n: float, R_n: float = 1.0, mass: float = 1000.0) -> float:
    """Return the share of the normal speed v_n (m/s) that remains after an impact. mass : of the rock (kg)"""
    return struck(model, surface(R_n, 0.8), (3.0, 0.0, -v_n), rock=falling_rock(mass)).v[2] / v_n


@pytest.mark.parametrize(
    ("v_n", "share"), list(zip(SPEEDS, (0.954, 0.770, 0.455, 0.173, 0.085), strict=True)),
    ids=[f"physics-9.4-velocity-{v:g}" for v in SPEEDS],
)  # fmt: skip
def test_r_n_falls_with_the_speed_into_the_ground(v_n, share):
    assert left_of(VelocityScaled(9.144), v_n) == pytest.approx(share, abs=PRINTED)
    assert left_of(VelocityScaled(9.144), v_n, 0.4) == pytest.approx(0.4 * share, abs=PRINTED)


@pytest.mark.parametrize(
    ("v_n", "share"), list(zip(SPEEDS, (0.833, 0.667, 0.5, 0.333, 0.25), strict=True)),
    ids=[f"physics-9.4-v_half-{v:g}" for v in SPEEDS],
)  # fmt: skip
def test_v_half_gives_back_half_at_its_speed_whatever_the_material(v_n, share):
    assert left_of(VHalf(10.0), v_n, 0.1) == pytest.approx(share, abs=PRINTED)


@pytest.mark.parametrize(
    ("mass", "share"), [(0.0, 1.0), (500.0, 0.8), (1000.0, 0.5), (3000.0, 0.1)],
    ids=["physics-1.4-no-mass", "physics-1.4-half-C", "physics-1.4-C", "physics-1.4-3C"],
)  # fmt: skip
def test_r_n_falls_with_the_mass(mass, share):
    assert left_of(MassScaled(1000.0, math.inf), 10.0, 0.6, mass) == pytest.approx(0.6 * share, rel=1e-14)
    both = left_of(MassScaled(1000.0, 9.144), 10.0, 0.6, mass)
    assert both == pytest.approx(0.6 * share * left_of(VelocityScaled(9.144), 10.0), rel=1e-14)


@pytest.mark.parametrize("model", [MODELS[name] for name in ("velocity_scaled", "mass_scaled", "v_half")])
def test_r_t_is_the_materials_and_the_spin_is_kept(model):
    after = struck(model, surface(0.5, 0.7), (3.0, -2.0, -5.0), (1.0, 2.0, 3.0))
    assert after.v[:2] == pytest.approx((2.1, -1.4), rel=1e-14)
    assert after.w == (1.0, 2.0, 3.0)


@pytest.mark.parametrize("model", [VelocityScaled(1e300), MassScaled(1e300, math.inf)])
def test_without_scaling_every_bit_is_that_of_constant_restitution(model):
    over = engine_over("reference", incline(25.0, 15.0, cells=(9, 3)))
    models = (model, MODELS["constant"])
    assert same_bits(*(fly(over, flight_with(m, surface()), (0.3, 0.2, 4.0), (1.0, 0.3, 0.0)) for m in models))


# --- the rest of the bouncing -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("R_n", [0.2, 0.5, 0.9])
@pytest.mark.parametrize("rise", [1e-2, 1e-3])
def test_the_rest_is_that_of_bounces_one_by_one_within_the_stated_share(R_n, rise):
    w, u = math.sqrt(2.0 * G * rise), 0.7
    rest = rest_of_bounces(
        VelocityScaled(9.144), surface(R_n, 0.8), Motion(0.0, ZERO, (u, 0.0, w), ZERO), UP, G, falling_rock()
    )
    x = t = 0.0
    for _ in range(4000):
        T = 2.0 * w / G
        x, t = x + u * T, t + T
        u, w = 0.8 * u, R_n * w / (1.0 + (w / 9.144) ** 2)
    share = 2.0 * G * rise / 9.144**2 / (1.0 - R_n)
    assert t <= rest.t <= t * (1.0 + share) + 1e-15
    assert x <= rest.along[0] <= x * (1.0 + share) + 1e-15


@pytest.mark.parametrize("name", ["velocity_scaled", "mass_scaled"])
def test_half_of_smallest_bounce_moves_the_stop_by_less_than_the_stated_share(name):
    """The sums, such as u T / (1 - r q) and 4 h tan(slope) / (1 - r^2), are less than 1 m here."""
    over = engine_over("reference", incline(20.0, down=200.0))
    physics = [flight_with(MODELS[name], surface(), "none", smallest_bounce=h) for h in (1e-3, 5e-4)]
    ends = [fly(over, one, (0.5, 0.2, 3.0)).deposits for one in physics]
    share = 2.0 * G * 1e-3 / 9.144**2 / (1.0 - 0.5)
    assert float(np.linalg.norm(ends[0].x[0] - ends[1].x[0])) < share * 1.0
    assert abs(ends[0].t[0] - ends[1].t[0]) < share * 1.0


@pytest.mark.parametrize("angle", [0.0, 15.0])
@pytest.mark.parametrize("R_t", [0.5, 0.8])
def test_what_v_half_leaves_out_below_smallest_bounce_is_within_the_stated_lengths(angle, R_t):
    """Where friction holds the rock, it stops where its bounces end, off by at most the length that is left out."""
    a, model = math.radians(angle), MODELS["v_half"]
    over = engine_over("reference", incline(angle, down=200.0))
    heights = (1e-3, 5e-4)
    physics = [flight_with(model, surface(0.5, R_t, stop_speed=5.0), "none", smallest_bounce=h) for h in heights]
    ends = [fly(over, one, (0.5, 0.2, 2.0), (1.0, 0.0, 0.0)).deposits for one in physics]
    g_n, g_t = G * math.cos(a), G * math.sin(a)
    v_0 = math.sqrt(2.0 * g_n * heights[0])
    T_0, u_0 = 2.0 * v_0 / g_n, float(ends[0].ground_speed[0])
    most = u_0 * T_0 / (1.0 - R_t) + g_t * (0.5 + R_t / (1.0 - R_t)) * (T_0**2 + 4.0 * 10.0 * v_0 / g_n**2)
    moved = float(np.linalg.norm(ends[0].x[0] - ends[1].x[0]))
    assert ends[1].impacts[0] > ends[0].impacts[0] > 0.5 * 10.0 / v_0
    assert moved <= most
    assert angle == 0.0 or moved > 1e-3, "the bound is not one that anything would meet"


def test_the_bounces_of_v_half_fall_as_one_over_their_number():
    over = engine_over("reference", floor(50.0))
    flights = fly(over, flight_with(VHalf(10.0), surface(0.5, 0.8)), (0.1, 0.3, 2.0))
    speeds = 0.5 * G * np.diff(flights.impacts.t)
    assert len(speeds) > 50
    np.testing.assert_allclose(np.diff(1.0 / speeds), 0.1, rtol=1e-6)


def test_constant_restitution_and_v_half_part():
    assert left_of(ConstantRestitution(), 10.0, 0.5) == left_of(VHalf(10.0), 10.0)
    assert left_of(ConstantRestitution(), 5.0, 0.5) < left_of(VHalf(10.0), 5.0)
