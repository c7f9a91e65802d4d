"""Tests that colour scales have round ends and distinguish the values that matter."""

import numpy as np
import pytest

from rpf3d_core.hazard.scales import (
    COLOURS,
    Scale,
    colours_at,
    places,
    reach_scale,
    scale_of_energy,
    scale_of_height,
    value_at,
)


@pytest.mark.parametrize(("flown", "low"), [(3000, 2e-4), (40_000, 2e-5), (10**7, 1e-5), (1, 0.1), (0, 0.1)])
def test_reach_probability_begins_at_or_below_one_rock(flown, low):
    scale = reach_scale(flown, np.array([np.nan, 0.7]))
    assert scale.low == pytest.approx(low) and scale.high == 1.0 and scale.logarithmic


def test_reach_probability_ends_at_a_round_share_that_no_cell_exceeds_a_power_of_ten_above_its_beginning():
    for most, high in ((0.034, 0.05), (0.05, 0.05), (0.9, 1.0), (2e-4, 2e-3), (np.nan, 1.0)):
        assert reach_scale(3000, np.array([np.nan, most])).high == pytest.approx(high)


def test_energies_lie_between_round_ends_at_least_a_power_of_ten_apart():
    scale = scale_of_energy(np.append(np.geomspace(1234.0, 876e3, 1000), np.nan))
    assert scale.low == pytest.approx(1000.0) and scale.high == pytest.approx(1e6)
    narrow = scale_of_energy(np.full(50, 3.1e5))
    assert narrow.high == pytest.approx(5e5) and narrow.low <= narrow.high / 10.0


def test_without_values_a_scale_is_still_one():
    for scale in (scale_of_energy(np.full(3, np.nan)), scale_of_height(np.full(3, np.nan))):
        assert scale.low < scale.high


def test_a_single_high_cell_does_not_stretch_the_scale_of_heights():
    assert scale_of_height(np.append(np.full(1000, 1.9), 80.0)) == Scale(0.0, 2.0, False)


@pytest.mark.parametrize("scale", [Scale(0.0, 20.0, False), Scale(1e3, 1e6, True)])
def test_a_value_has_its_place_and_a_place_its_value(scale):
    place = np.linspace(0.0, 1.0, 7)
    values = np.array([value_at(scale, at) for at in place])
    np.testing.assert_allclose(places(scale, values), place, atol=1e-12)
    beyond = places(scale, np.array([scale.low - 1.0, scale.high * 2.0, np.nan]))
    np.testing.assert_array_equal(beyond, [0.0, 1.0, np.nan])


def test_colours_grow_ever_darker_so_that_they_read_in_grey():
    brightness = colours_at(np.linspace(0.0, 1.0, 256)) @ np.array([0.2126, 0.7152, 0.0722])
    assert (np.diff(brightness) <= 0.5).all()
    np.testing.assert_array_equal(colours_at(np.array([0.0, 1.0])), COLOURS[[0, -1]])
