"""Tests of densities of simulated stops at observed stops: explicit sums, and the effect of lost rocks."""

import numpy as np
import pytest

from rpf3d_core.calibration.density import (
    GROUPS,
    Stops,
    kernel_widths,
    misfits_of,
    share_densities,
    stop_densities,
    value_densities,
)

RANDOM = np.random.default_rng(18)
PLACE = RANDOM.normal((40.0, 0.0), (8.0, 4.0), (320, 2))
SEEN = np.array([[40.0, 0.0], [55.0, -6.0], [20.0, 3.0]])
ALL = np.ones(len(PLACE), dtype=bool)
ERRORS = np.array([0.5, 3.0])


def normal(z: np.ndarray, sd: np.ndarray) -> np.ndarray:
    return np.exp(-0.5 * (z / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))


def written_out(place: np.ndarray, error: float, rocks: int) -> list[float]:
    """Return the kernel estimate (1/m2) at each observed stop of SEEN, as an explicit sum over rocks.

    place : (R, 2) m, stops; error : measuring error (m); rocks : number of rocks flown
    """
    sd = kernel_widths(place, error)
    return [sum(float(np.prod(normal(seen - one, sd))) for one in place) / rocks for seen in SEEN]


def test_the_mean_over_groups_is_the_kernel_estimate_of_all_rocks() -> None:
    found = stop_densities(Stops(PLACE, ALL), SEEN, ERRORS, None)
    assert found.shape == (GROUPS, 2, 3)
    for m, error in enumerate(ERRORS):
        np.testing.assert_allclose(found[:, m].mean(axis=0), written_out(PLACE, error, len(PLACE)), rtol=1e-9)


def test_a_rock_that_left_the_terrain_is_wrong_and_not_missing() -> None:
    deposited = ALL.copy()
    deposited[::4] = False
    found = stop_densities(Stops(PLACE, deposited), SEEN, ERRORS, None).mean(axis=0)[0]
    np.testing.assert_allclose(found, written_out(PLACE[deposited], ERRORS[0], len(PLACE)), rtol=1e-9)
    none = stop_densities(Stops(PLACE, ~ALL), SEEN, ERRORS, None)
    assert not none.any()


def test_densities_are_the_same_in_the_coordinates_of_a_country() -> None:
    """With kernels of 0.1 m at 5,200 km from the origin, only the coordinates are rounded, to 1e-9 m."""
    place = np.round(RANDOM.normal((3.0, 0.0), (0.3, 0.2), (64, 2)) * 2.0**20) / 2.0**20
    seen, country = place[:5] + 0.0625, np.array([500_000.0, 5_200_000.0])
    rocks = np.ones(len(place), dtype=bool)
    near = stop_densities(Stops(place, rocks), seen, np.array([0.05]), None)
    far = stop_densities(Stops(place + country, rocks), seen + country, np.array([0.05]), None)
    assert near.min() > 0.0
    np.testing.assert_allclose(far, near, rtol=1e-6)


def test_no_observed_stop_has_no_density() -> None:
    assert stop_densities(Stops(PLACE, ALL), np.empty((0, 2)), ERRORS, None).shape == (GROUPS, 2, 0)


def test_rocks_of_another_mass_do_not_stand_for_a_block() -> None:
    far = np.where(np.arange(len(PLACE)) % 2, 1000.0, 0.0)[:, None] + PLACE
    alike = np.ones((len(SEEN), len(PLACE)))
    alike[:, 1::2] = 0.0  # the rocks that stopped a kilometre away
    alone = stop_densities(Stops(far, ALL), SEEN, np.array([3.0]), None).mean(axis=0)[0]
    found = stop_densities(Stops(far, ALL), SEEN, np.array([3.0]), alike).mean(axis=0)[0]
    np.testing.assert_allclose(found, 2.0 * alone, rtol=1e-9)


def test_values_at_a_gate_have_a_density_that_integrates_to_one() -> None:
    speeds = np.where(np.arange(400) % 5, RANDOM.normal(12.0, 2.0, 400), np.nan)
    grid = np.linspace(0.0, 30.0, 601)
    density = value_densities(speeds, grid, 0.3).mean(axis=0)
    assert np.trapezoid(density, grid) == pytest.approx(1.0, abs=1e-3)
    assert grid[density.argmax()] == pytest.approx(12.0, abs=1.0)


def test_shares_of_rocks_are_counted() -> None:
    flags = np.stack([np.arange(320) < 80, np.full(320, 0.5)])  # two misfits
    found = share_densities(flags.astype(float))
    assert found.shape == (GROUPS, 2, 2)
    np.testing.assert_allclose(found.mean(axis=0), [[0.25, 0.75], [0.5, 0.5]])


def test_misfits_scale_with_the_spread_of_the_stops() -> None:
    stops = np.array([[0.0, 0.0], [4.0, 2.0], [4.0, 0.0]])
    assert misfits_of(stops)[-1] == pytest.approx(np.sqrt(np.sqrt(16.0 / 3.0) * np.sqrt(4.0 / 3.0)))


def test_stops_on_a_line_do_not_make_the_model_exact() -> None:
    along = np.array([0.0, 10.0, 20.0])  # standard deviation 10 m
    on_a_line = np.stack([along, np.full(3, 7.0)], axis=1)
    assert misfits_of(on_a_line)[-1] == pytest.approx(np.sqrt(10.0 * 2.5))
    assert misfits_of(on_a_line[:, ::-1])[-1] == pytest.approx(np.sqrt(10.0 * 2.5))
    in_one_place = misfits_of(np.zeros((3, 2)))
    assert in_one_place[0] == 0.0
    assert in_one_place[-1] == pytest.approx(0.1)


def test_two_stops_leave_the_misfit_unknown() -> None:
    assert misfits_of(np.array([[0.0, 0.0], [4.0, 1.0]])).tolist() == [0.0]
