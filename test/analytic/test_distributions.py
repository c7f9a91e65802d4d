"""Tests of truncated distributions against high-precision formulas: bounds, quantiles, moments, equal bits."""

import math

import mpmath
import numpy as np
import pytest

from rpf3d_core.materials.distributions import (
    FEW,
    Distribution,
    Measured,
    fixed,
    quantile,
    quantiles,
    triangular_between,
    truncated_lognormal,
    truncated_normal,
    truncated_power_law,
    truncated_weibull,
    uniform_between,
)
from rpf3d_core.materials.normal_quantile import normal_quantile
from rpf3d_core.materials.streams import Purpose, uniform

DIGITS = 40
ALGORITHM_AS241 = 4e-16
"""Largest relative error: that stated by Wichura (about 1e-16), and rounding of the last operations."""
ROUNDING = 1e-12
"""Largest relative error: probabilities are rounded to 1e-16, and a quantile divides this by the density."""
DRAWS = 200_000
DISTRIBUTIONS = {
    "uniform": uniform_between(0.2, 0.8),
    "sandstone R_t of physics 1.16": truncated_normal(0.40, 0.15, 0.25, 0.55),
    "mudstone R_n, cut on one side": truncated_normal(0.47, 0.30, 0.1, 1.0),
    "mean on its bound": truncated_normal(1.0, 0.20, 0.82, 1.0),
    "lognormal": truncated_lognormal(0.4, 0.3, 0.05, 3.0),
    "lognormal from zero": truncated_lognormal(0.4, 0.3, 0.0, 0.6),
    "volumes of physics 6.4": truncated_power_law(0.5, 0.01, 8.0),
    "steep power law": truncated_power_law(2.5, 0.5, 0.6),
    "weibull of shape 1.5": truncated_weibull(1.5, 0.8, 0.1, 3.0),
    "weibull of shape 0.7, from zero": truncated_weibull(0.7, 0.8, 0.0, 3.0),
    "triangular": triangular_between(0.2, 0.5, 1.4),
    "triangular, mode on its bound": triangular_between(0.2, 0.2, 1.4),
}
SHARES = (0.0, 1e-12, 0.01, 0.25, 0.5, 0.9, 0.999, 1.0 - 2.0**-53)

named = pytest.mark.parametrize("distribution", DISTRIBUTIONS.values(), ids=DISTRIBUTIONS.keys())


def exact_quantile(d: Distribution, name: str, u: float) -> mpmath.mpf:
    """Return the quantile x with (F(x) - F(low)) / (F(high) - F(low)) = u, in closed form or as a root."""
    low, high, u = mpmath.mpf(d.low), mpmath.mpf(d.high), mpmath.mpf(u)
    if "uniform" in name:
        return low + u * (high - low)
    if "power" in name or "volumes" in name:
        b = mpmath.mpf(2.5 if "steep" in name else 0.5)
        return (low**-b - u * (low**-b - high**-b)) ** (-1 / b)  # as in physics.md 6.4
    if "weibull" in name:
        k, scale = mpmath.mpf(1.5 if "1.5" in name else 0.7), mpmath.mpf(d.scale)
        kept = [mpmath.exp(-((edge / scale) ** k)) for edge in (low, high)]
        return scale * (-mpmath.log(kept[0] - u * (kept[0] - kept[1]))) ** (1 / k)
    if "triangular" in name:
        mode = mpmath.mpf(d.location)
        if u < (mode - low) / (high - low):
            return low + mpmath.sqrt(u * (high - low) * (mode - low))
        return high - mpmath.sqrt((1 - u) * (high - low) * (high - mode))
    logarithm = mpmath.log if "lognormal" in name else mpmath.mpf
    first, last = (
        mpmath.ncdf((logarithm(edge) - d.location) / d.scale) if edge > 0 or "log" not in name else mpmath.mpf(0)
        for edge in (low, high)
    )
    z = mpmath.sqrt(2) * mpmath.erfinv(2 * (first + u * (last - first)) - 1)
    x = d.location + d.scale * z
    return mpmath.exp(x) if "lognormal" in name else x


@pytest.mark.parametrize(
    "p", [1e-300, 1e-100, 1e-20, 1e-11, 1.5e-11, 1e-5, 0.01, 0.0749, 0.0751, 0.3, 0.4999, 0.6, 0.9, 0.99, 1 - 1e-9]
)
def test_the_inverse_normal_has_the_precision_that_its_author_states(p: float) -> None:
    with mpmath.workdps(DIGITS):
        z = mpmath.mpf(normal_quantile(p))
        # One Newton step from the result; its length is the error of the result.
        error = (mpmath.ncdf(z) - mpmath.mpf(p)) / mpmath.npdf(z)
        assert abs(error) <= ALGORITHM_AS241 * abs(z)


def test_the_inverse_normal_is_odd_and_infinite_at_the_ends() -> None:
    assert normal_quantile(0.5) == 0.0 and normal_quantile(0.75) == -normal_quantile(0.25)
    assert (normal_quantile(0.0), normal_quantile(1.0)) == (-np.inf, np.inf)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
@pytest.mark.parametrize("u", SHARES)
def test_a_quantile_is_that_of_the_definition(name: str, u: float) -> None:
    d = DISTRIBUTIONS[name]
    if u == 0.0:
        assert quantile(d, u) == pytest.approx(d.low, rel=ROUNDING)
        return
    with mpmath.workdps(DIGITS):
        exact = float(exact_quantile(d, name, u))
    assert quantile(d, u) == pytest.approx(exact, rel=1e-9 if u == 1e-12 and "zero" in name else ROUNDING)


@named
def test_no_draw_leaves_the_bounds_and_the_draws_fill_them(distribution: Distribution) -> None:
    x = quantiles(distribution, uniform(3, 1, np.arange(DRAWS), Purpose.ROCK_SIZE))
    assert distribution.low <= x.min() and x.max() <= distribution.high
    edges = np.array([quantile(distribution, k / 50) for k in range(51)])
    counts = np.histogram(x, np.maximum.accumulate(edges))[0]
    chi_squared = ((counts - DRAWS / 50) ** 2 / (DRAWS / 50)).sum()
    assert 22.0 < chi_squared < 90.0  # 49 degrees of freedom: outside in fewer than 1 of 1,000


@pytest.mark.long
@pytest.mark.parametrize("name", [name for name in DISTRIBUTIONS if "zero" not in name])
def test_the_mean_and_the_spread_of_draws_are_those_of_the_cut_distribution(name: str) -> None:
    d = DISTRIBUTIONS[name]
    x = quantiles(d, uniform(5, 0, np.arange(DRAWS), Purpose.SPEED))
    with mpmath.workdps(15):
        cells = [float(exact_quantile(d, name, (k + 0.5) / 4000)) for k in range(4000)]  # midpoint rule over u
    mean, sd = np.mean(cells), np.std(cells)
    assert x.mean() == pytest.approx(mean, abs=4.0 * sd / DRAWS**0.5 + 1e-3 * sd)
    assert x.std() == pytest.approx(sd, rel=0.02)


def test_the_lognormal_has_the_mean_and_sd_that_are_written_where_its_bounds_are_far() -> None:
    x = quantiles(truncated_lognormal(0.4, 0.1, 1e-6, 1e3), uniform(5, 0, np.arange(DRAWS), Purpose.SPEED))
    assert x.mean() == pytest.approx(0.4, abs=4 * 0.1 / DRAWS**0.5) and x.std() == pytest.approx(0.1, rel=0.02)


@named
def test_compiled_draws_and_plain_ones_have_the_same_bits_however_many(distribution: Distribution) -> None:
    u = uniform(1, 0, np.arange(3 * FEW), Purpose.ROCK_SIZE)
    together = quantiles(distribution, u)
    np.testing.assert_array_equal(together[:FEW], quantiles(distribution, u[:FEW]))
    np.testing.assert_array_equal(together[7:20], [quantile(distribution, share) for share in u[7:20].tolist()])


@pytest.mark.parametrize("make", [truncated_normal, truncated_lognormal])
def test_without_spread_a_distribution_is_its_mean(make) -> None:
    assert make(0.3, 0.0, 0.1, 0.9) == fixed(0.3)
    assert quantile(fixed(0.3), 0.77) == 0.3


def test_weibull_draws_have_the_moments_of_the_closed_form_where_the_bounds_are_far() -> None:
    shape, scale = 1.7, 0.6
    x = quantiles(truncated_weibull(shape, scale, 0.0, 1e3), uniform(5, 0, np.arange(DRAWS), Purpose.ROCK_SIZE))
    mean = scale * math.gamma(1.0 + 1.0 / shape)
    sd = math.sqrt(scale**2 * math.gamma(1.0 + 2.0 / shape) - mean**2)
    assert x.mean() == pytest.approx(mean, abs=4.0 * sd / DRAWS**0.5)
    assert x.std() == pytest.approx(sd, rel=0.02)
    assert np.mean(x < scale) == pytest.approx(1.0 - math.exp(-1.0), abs=4.0 * 0.5 / DRAWS**0.5)


def test_triangular_draws_have_the_moments_of_the_closed_form() -> None:
    low, mode, high = 0.2, 0.5, 1.4
    x = quantiles(triangular_between(low, mode, high), uniform(5, 0, np.arange(DRAWS), Purpose.ROCK_SIZE))
    variance = (low**2 + mode**2 + high**2 - low * mode - low * high - mode * high) / 18.0
    assert x.mean() == pytest.approx((low + mode + high) / 3.0, abs=4.0 * (variance / DRAWS) ** 0.5)
    assert x.var() == pytest.approx(variance, rel=0.02)


def test_a_truncated_weibull_far_in_its_tail_stays_finite_and_within_its_bounds() -> None:
    d = truncated_weibull(3.0, 1.0, 2.5, 1e6)
    x = [quantile(d, u) for u in (0.0, 0.5, 1.0 - 2.0**-53)]
    assert np.isfinite(x).all()
    assert 2.5 <= x[0] < x[1] < x[2] <= 1e6


def test_a_measured_list_is_drawn_with_replacement_each_item_alike() -> None:
    values = np.array([0.3, 0.3, 0.9, 2.0])
    x = quantiles(Measured(values), uniform(5, 0, np.arange(DRAWS), Purpose.ROCK_SIZE))
    for value, share in ((0.3, 0.5), (0.9, 0.25), (2.0, 0.25)):
        assert np.mean(x == value) == pytest.approx(share, abs=4.0 * (share * (1.0 - share) / DRAWS) ** 0.5)
    assert set(x.tolist()) == {0.3, 0.9, 2.0}
    assert quantiles(Measured(values), np.array([0.0, 1.0 - 2.0**-53])).tolist() == [0.3, 2.0]
