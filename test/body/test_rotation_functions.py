"""Tests of elliptic functions, theta series and exact differences, against mpmath with 50 digits and fractions."""

import math
from fractions import Fraction

import mpmath
import numpy as np
import pytest

from rpf3d_core.body import theta
from rpf3d_core.body.elliptic import carlson, complete, exponential, first_kind, hyperbolic_pair, jacobi
from rpf3d_core.body.rotation import beyond_separatrix

PARAMETERS = [0.0, 1e-20, 1e-9, 0.01, 0.3, 0.5, 0.77, 0.99, 1.0 - 1e-9]
NOMES = [0.0, 1e-30, 1e-5, 0.01, 0.0432]


@pytest.fixture(autouse=True)
def fifty_digits():
    with mpmath.workdps(50):
        yield


@pytest.mark.parametrize("x", [0.0, 1e-200, 1e-20, 0.3, 0.999, 1.0, 7.0])
@pytest.mark.parametrize("y", [1e-150, 1e-9, 0.5, 1.0, 1e6])
def test_carlsons_integral_is_mpmaths(x, y):
    assert carlson(x, y, 1.0) == pytest.approx(float(mpmath.elliprf(x, y, 1)), rel=1e-15)
    assert carlson(x, y, 1.0) == pytest.approx(carlson(1.0, x, y), rel=1e-15)


@pytest.mark.parametrize("m1", [1e-32, 1e-12, 1e-3, 0.5, 1.0])
def test_the_complete_integral_is_mpmaths(m1):
    assert complete(m1) == pytest.approx(float(mpmath.ellipk(1 - mpmath.mpf(m1))), rel=1e-15)


@pytest.mark.parametrize("m", PARAMETERS)
@pytest.mark.parametrize("phi", [0.0, 1e-9, 0.4, -1.2, 1.5, -1.5707])
def test_the_integral_of_the_first_kind_is_mpmaths(m, phi):
    value = first_kind(math.sin(phi), math.cos(phi) ** 2, m, 1.0 - m)
    assert value == pytest.approx(float(mpmath.ellipf(phi, m)), rel=1e-14)


@pytest.mark.parametrize("m", PARAMETERS)
@pytest.mark.parametrize("u", [0.0, 1e-9, 0.4, -1.2, 3.0, 11.0])
def test_jacobis_functions_are_mpmaths(m, u):
    expected = [float(mpmath.ellipfun(kind, u, m=m)) for kind in ("sn", "cn", "dn")]
    assert jacobi(u, m) == pytest.approx(expected, abs=1e-14)


@pytest.mark.parametrize("x", [0.0, 1e-12, 0.1, 0.49999, 0.5, 1.0, 17.3, 40.0, 200.0])
def test_hyperbolic_functions_are_exact_to_their_last_digits(x):
    expected = float(mpmath.sinh(x)), float(mpmath.cosh(x))
    assert hyperbolic_pair(x) == pytest.approx(expected, rel=1e-15, abs=0.0)
    assert hyperbolic_pair(-x) == pytest.approx((-expected[0], expected[1]), rel=1e-15, abs=0.0)
    assert exponential(x) == pytest.approx(float(mpmath.exp(x)), rel=1e-15)


@pytest.mark.parametrize("m", [0.0, 1e-30, 1e-6, 0.1, 0.5])
def test_the_nome_is_mpmaths(m):
    expected = float(mpmath.qfrom(m=mpmath.mpf(m)))
    assert theta.nome_of(m, 1.0 - m) == pytest.approx(expected, rel=1e-15, abs=0.0)


def four_thetas(waves, q):
    """Return the theta functions 1 to 4 of waves and nome q, without the factor 2 q^(1/4) of the first two."""
    powers = theta.powers_of(q)
    return (
        theta.alternating(waves.sines, powers.odd), theta.plain(waves.cosines, powers.odd),
        theta.theta_3(waves.even, powers.even), theta.theta_4(waves.even, powers.even),
    )  # fmt: skip


def jtheta(n, z, q):
    """Return theta function n of z and nome q by mpmath, without the factor 2 q^(1/4) of the first two."""
    q = mpmath.mpf(q)
    return mpmath.jtheta(n, z, q) / (2 * mpmath.root(q, 4) if n < 3 else 1)


@pytest.mark.parametrize("q", NOMES[1:])
@pytest.mark.parametrize("v", [0.0, 1e-9, 0.3, 1.57, -2.0, 30.0])
def test_circular_series_are_mpmaths_theta_functions(q, v):
    expected = [float(jtheta(n, mpmath.mpf(v), q)) for n in (1, 2, 3, 4)]
    assert four_thetas(theta.circular(v), q) == pytest.approx(expected, rel=1e-14, abs=1e-15)


@pytest.mark.parametrize("q", NOMES[1:])
@pytest.mark.parametrize("share", [0.0, 1e-9, 0.3, -0.7, 1.0])
def test_hyperbolic_series_are_mpmaths_theta_functions_of_imaginary_numbers(q, share):
    """The comparison goes up to half a period, -ln(q) / 2, where theta 4 is 0."""
    x = -0.5 * math.log(q) * share
    z = mpmath.mpc(0, x)
    ours = four_thetas(theta.hyperbolic(x), q)
    assert ours[0] == pytest.approx(float(jtheta(1, z, q).imag), rel=1e-14, abs=1e-25)
    assert ours[1:] == pytest.approx([float(jtheta(n, z, q).real) for n in (2, 3, 4)], rel=1e-14, abs=1e-13)


@pytest.mark.parametrize("q", NOMES[1:])
@pytest.mark.parametrize("share", [1e-12, 1e-3, 0.4, 0.999])
@pytest.mark.parametrize("v", [1e-9, 0.3, 1.57, -2.0])
def test_the_circular_phase_is_the_argument_of_theta_1_also_near_the_real_axis(q, share, v):
    b = -0.5 * math.log(q) * share
    phase, waves = theta.circular_phase(q, b), theta.circular(v)
    ours = mpmath.mpc(theta.combined(phase.first, waves.sines), theta.combined(phase.second, waves.cosines))
    turn = mpmath.arg(ours / jtheta(1, mpmath.mpc(v, b), q))
    assert abs(float(turn)) < 1e-15
    at_quarter = jtheta(2, mpmath.mpc(0, b), q)
    slope = mpmath.diff(lambda z: mpmath.jtheta(2, z, mpmath.mpf(q)), mpmath.mpc(0, b)) / (
        2 * mpmath.root(mpmath.mpf(q), 4)
    )
    assert phase.rate == pytest.approx(-float((slope / at_quarter).imag), rel=1e-14)


@pytest.mark.parametrize("q", NOMES[1:])
@pytest.mark.parametrize("y", [1e-12, 1e-3, 0.7, 1.5707])
@pytest.mark.parametrize("share", [1e-9, 0.3, -0.7, 1.0])
def test_the_hyperbolic_phase_is_the_argument_of_theta_1(q, y, share):
    x = -0.5 * math.log(q) * share
    phase, waves = theta.hyperbolic_phase(q, y), theta.hyperbolic(x)
    ours = mpmath.mpc(theta.combined(phase.first, waves.cosines), theta.combined(phase.second, waves.sines))
    assert abs(float(mpmath.arg(ours / jtheta(1, mpmath.mpc(y, -x), q)))) < 1e-15
    slope = mpmath.diff(lambda z: mpmath.jtheta(4, z, mpmath.mpf(q)), y) / mpmath.jtheta(4, y, mpmath.mpf(q))
    assert phase.rate == pytest.approx(float(slope), rel=1e-14, abs=1e-25)


def test_the_distance_from_the_separatrix_keeps_its_digits_where_its_terms_cancel():
    rng = np.random.default_rng(2)
    for _ in range(300):
        second = rng.uniform(0.1, 1.0, 3)
        J = sorted(second.sum() - second)
        w = list(rng.normal(size=3))
        w[2] = w[0] * math.sqrt((J[1] - J[0]) * J[0] / ((J[2] - J[1]) * J[2])) * (1.0 + 10.0 ** rng.uniform(-17, 0))
        A, B, C, x, _, z = map(Fraction, (*J, *w))
        true = float(C * (C - B) * z * z - A * (B - A) * x * x)
        assert beyond_separatrix(tuple(J), tuple(w)) == pytest.approx(true, rel=1e-13, abs=0.0)
