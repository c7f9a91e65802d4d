"""Tests of two rebound models: constant restitution, and the thesis' printed transform with its known faults."""

import math
from pathlib import Path

import numpy as np
import pytest
from flights.any_rock import ANY_ROCK
from flights.scenes_of_facets import ENGINES, engine_over, flight, floor, fly, incline, same_bits, surface

from rpf3d_core.kinetics.rebound import ConstantRestitution, rebound, rest_of_bounces
from rpf3d_core.kinetics.rebounds.thesis_literal import ThesisLiteral, thesis_literal
from rpf3d_core.values import ZERO, Motion, Outcome

V = (3.0, 2.0, -10.0)
"""A velocity (m/s) for checks by hand; its square is 113 m2/s2."""


def plane_rising(theta: float, phi: float) -> tuple[float, float, float]:
    """Return the upward unit normal of a plane that rises by theta degrees along x and phi degrees along y."""
    n = np.array([-math.tan(math.radians(theta)), -math.tan(math.radians(phi)), 1.0])
    return tuple(float(c) for c in n / np.linalg.norm(n))


@pytest.mark.parametrize(
    ("theta", "phi", "squared", "digits"),
    [(30.0, 0.0, 71.5, 0.05), (0.0, 30.0, 56.7, 0.05), (45.0, 45.0, 86.0, 0.5), (0.0, 0.0, 113.0, 1e-9)],
    ids=["physics-0.1-theta-30", "physics-0.1-phi-30", "physics-0.1-both-45", "level"],
)
def test_the_printed_transform_loses_speed_even_without_restitution(theta, phi, squared, digits):
    n = plane_rising(theta, phi)
    after = rebound(ThesisLiteral(), surface(1.0, 1.0), Motion(0.0, ZERO, V, ZERO), n, ANY_ROCK).v
    assert np.dot(after, after) == pytest.approx(squared, abs=digits)


def test_on_level_ground_the_printed_transform_is_right():
    motion, n = Motion(0.0, ZERO, V, ZERO), (0.0, 0.0, 1.0)
    printed = rebound(ThesisLiteral(), surface(0.5, 0.8), motion, n, ANY_ROCK).v
    assert printed == pytest.approx(rebound(ConstantRestitution(), surface(0.5, 0.8), motion, n, ANY_ROCK).v, abs=1e-15)


@pytest.mark.parametrize("model", [ConstantRestitution(), ThesisLiteral()], ids=["constant", "thesis_literal"])
def test_no_model_sends_a_rock_into_the_ground(model):
    draw = np.random.default_rng(3)
    for _ in range(2000):
        n = draw.normal(size=3)
        n /= np.linalg.norm(n)
        v = draw.normal(size=3) * 10.0 ** draw.uniform(-6, 2)
        v -= 2.0 * max(v @ n, 0.0) * n
        n, v = tuple(map(float, n)), tuple(map(float, v))
        after = rebound(model, surface(draw.uniform(), draw.uniform()), Motion(0.0, ZERO, v, ZERO), n, ANY_ROCK).v
        assert np.dot(after, n) >= -1e-14 * np.linalg.norm(v)


def test_constant_restitution_scales_the_two_parts_and_keeps_their_directions():
    n = plane_rising(33.0, -12.0)
    after = np.array(rebound(ConstantRestitution(), surface(0.3, 0.7), Motion(0.0, ZERO, V, ZERO), n, ANY_ROCK).v)
    normal, along = np.dot(V, n) * np.array(n), np.array(V) - np.dot(V, n) * np.array(n)
    np.testing.assert_allclose(after, -0.3 * normal + 0.7 * along, rtol=1e-14)


@pytest.mark.parametrize("R_t", [0.0, 0.3, 0.5, 0.5 + 1e-12, 0.9, 1.0])
@pytest.mark.parametrize("R_n", [0.1, 0.5, 0.99])
def test_the_sum_of_all_bounces_is_what_adding_them_one_by_one_gives(R_n, R_t):
    n, u, w = plane_rising(-20.0, 10.0), np.array([1.0, 2.0, 0.0]), 3.0
    u = u - (u @ n) * np.array(n)
    g = np.array([0.0, 0.0, -9.81])
    g_n, g_t = -(g @ n), g - (g @ n) * np.array(n)
    rest = rest_of_bounces(
        ConstantRestitution(), surface(R_n, R_t), Motion(0.0, ZERO, tuple(u + w * np.array(n)), ZERO), n, 9.81, ANY_ROCK
    )
    x, t = np.zeros(3), 0.0
    for _ in range(3000):
        T = 2 * w / g_n
        x, t = x + u * T + 0.5 * g_t * T * T, t + T
        u, w = R_t * (u + g_t * T), R_n * w
    assert rest.ends
    assert rest.t == pytest.approx(t, rel=1e-12)
    np.testing.assert_allclose(np.add(rest.along, rest.down), x, rtol=1e-11)
    np.testing.assert_allclose(rest.v, u, atol=1e-11)


def test_bounces_that_lose_nothing_have_no_end():
    motion, up = Motion(0.0, ZERO, (1.0, 0.0, 1.0), ZERO), (0.0, 0.0, 1.0)
    rest = rest_of_bounces(ConstantRestitution(), surface(1.0, 0.5), motion, up, 9.81, ANY_ROCK)
    assert not rest.ends


@pytest.mark.parametrize("engine", ENGINES)
def test_thesis_literal_flies_to_a_stop_on_level_ground(engine):
    over = engine_over(engine, floor())
    physics = flight(surface(0.5, 0.8, stop_speed=5.0), "none", "thesis_literal")
    end = fly(over, physics, (0.3, 0.2, 5.0), (1.0, 0.5, 0.0)).deposits
    assert end.outcome[0] == Outcome.STOPPED
    assert end.impacts[0] > 3


def test_thesis_literal_is_the_same_on_both_engines_and_not_the_same_as_constant():
    physics = [flight(surface(), "none", name, max_impacts=6) for name in ("thesis_literal", "constant")]
    start = (0.3, 0.2, 5.0)
    terrain = incline(30.0, 15.0)
    printed, compiled, right = (
        fly(engine_over(*pair), p, start)
        for pair, p in zip(
            [("reference", terrain), ("compiled", terrain), ("reference", terrain)], [physics[0], *physics], strict=True
        )
    )
    assert same_bits(printed, compiled)
    assert np.linalg.norm(printed.paths.v[1] - right.paths.v[1]) > 0.1


def largest_gain(n: tuple[float, float, float]) -> float:
    """Return the largest ratio of energies after and before, over 400 velocities.

    The impacts follow the printed transform with R_n = R_t = 1, on a plane with unit normal n.
    """
    gains = []
    for v in np.random.default_rng(1).normal(size=(400, 3)):
        v = -v if v @ np.array(n) > 0 else v
        after = rebound(ThesisLiteral(), surface(1.0, 1.0), Motion(0.0, ZERO, tuple(v.tolist()), ZERO), n, ANY_ROCK).v
        gains.append(float(np.dot(after, after) / (v @ v)))
    return max(gains)


def test_the_equations_as_printed_gain_energy_and_their_docstring_and_the_physics_page_say_so():
    """Equations 2-3 to 2-8 are not an orthonormal transform; a limit on the energy would change the thesis' model."""
    gain = max(largest_gain(plane_rising(t, p)) for t in range(0, 90, 15) for p in range(0, 90, 15))
    assert 1.5 < gain <= 3.0 + 1e-9
    assert "three times its energy" in " ".join((thesis_literal.__doc__ or "").split())
    physics = Path(__file__).parents[2] / "docs" / "explanation" / "physics.md"
    assert "facet that dips along both axes, it may triple |v|^2" in " ".join(physics.read_text().split())


def test_a_model_without_a_rule_is_refused_by_name():
    with pytest.raises(TypeError, match="rebound has no rule for str"):
        rebound("bouncy", surface(), Motion(0.0, ZERO, V, ZERO), (0.0, 0.0, 1.0), ANY_ROCK)
