"""Tests that sampled points along paths are exact in flight and at every event."""

import numpy as np
import pytest
from flights.flights_on_a_floor import BOUNCES, floor, none_thrown, thrown

from rpf3d_core.ensemble.paths import display_step, displayed_rows, positions_at, sample_paths
from rpf3d_core.values import STANDARD_GRAVITY, Mode

ROUNDING = 1e-12
"""Largest rounding error (m) of sampled points; paths are about 10 m long."""

EVENTS = BOUNCES + 3
"""Number of rows in the path of a rock: flights, settling, sliding, end."""


@pytest.fixture
def paths():
    return thrown(floor()).paths


def test_points_of_a_flight_lie_on_its_parabola(paths):
    samples = sample_paths(paths, [2], max_step=0.1)
    start = np.flatnonzero(paths.row == 2)[0]
    flying = samples.t <= paths.t[start + 1]
    t = samples.t[flying][:, None]
    exact = paths.x[start] + paths.v[start] * t + 0.5 * np.array([0, 0, -STANDARD_GRAVITY]) * t**2
    assert len(t) > 50
    np.testing.assert_allclose(samples.x[flying], exact, atol=ROUNDING)


def test_the_moon_pulls_less(paths):
    earth, moon = (sample_paths(paths, [0], max_step=0.1, gravity=g) for g in (9.81, 1.62))
    assert moon.x[5, 2] - earth.x[5, 2] == pytest.approx(0.5 * (9.81 - 1.62) * earth.t[5] ** 2)


def test_every_event_is_a_point_with_its_exact_time_place_and_velocity(paths):
    samples = sample_paths(paths, max_step=0.3)
    found = {(row, t, *x, *v) for row, t, x, v in zip(samples.row, samples.t, samples.x, samples.v, strict=True)}
    assert {(row, t, *x, *v) for row, t, x, v in zip(paths.row, paths.t, paths.x, paths.v, strict=True)} <= found


def test_an_impact_is_two_points_with_the_velocity_before_and_after(paths):
    samples = sample_paths(paths, [1], max_step=0.3)
    first = np.flatnonzero(paths.row == 1)[0]
    before, after = np.flatnonzero(samples.t == paths.t[first + 1])
    np.testing.assert_array_equal(samples.v[before], paths.v_end[first])
    np.testing.assert_array_equal(samples.v[after], paths.v[first + 1])
    np.testing.assert_array_equal(samples.x[before], samples.x[after])


def test_a_piece_without_a_jump_at_its_end_gives_that_point_once(paths):
    samples = sample_paths(paths, [1], max_step=0.3)
    slide_begins = paths.t[(paths.row == 1) & (paths.mode == Mode.SLIDING)]
    assert np.count_nonzero(samples.t == slide_begins) == 1


@pytest.mark.parametrize("step", [2.0, 0.5, 0.05])
def test_no_two_neighbours_of_a_flight_are_farther_apart_than_the_step(paths, step):
    samples = sample_paths(paths, max_step=step)
    flying = (samples.mode[:-1] == Mode.FLIGHT) & (np.diff(samples.row) == 0)
    assert np.linalg.norm(np.diff(samples.x, axis=0), axis=1)[flying].max() <= step * (1 + ROUNDING)


def test_a_slide_is_drawn_with_the_right_velocity_at_both_ends(paths):
    samples = sample_paths(paths, [0], max_step=1e-4)
    sliding = np.flatnonzero(samples.mode == Mode.SLIDING)
    near_start, near_end = samples.x[sliding[:2]], samples.x[sliding[-1] : sliding[-1] + 2]
    dt = samples.t[sliding[1]] - samples.t[sliding[0]]
    begin = paths.v[(paths.row == 0) & (paths.mode == Mode.SLIDING)][0]
    # The slope of a chord differs from that at its end by half the deceleration times dt.
    np.testing.assert_allclose(np.diff(near_start, axis=0)[0] / dt, begin, atol=10.0 * dt)
    np.testing.assert_allclose(np.diff(near_end, axis=0)[0] / dt, np.zeros(3), atol=10.0 * dt)


def test_a_slide_of_constant_deceleration_is_drawn_as_it_is(paths):
    samples = sample_paths(paths, [0], max_step=0.01)
    piece = np.flatnonzero((paths.row == 0) & (paths.mode == Mode.SLIDING))[0]
    inside = samples.mode == Mode.SLIDING
    t = (samples.t[inside] - paths.t[piece])[:, None]
    slowing = paths.v[piece] / (paths.t[piece + 1] - paths.t[piece])
    exact = paths.x[piece] + paths.v[piece] * t - slowing * t**2 / 2
    np.testing.assert_allclose(samples.x[inside], exact, atol=ROUNDING)
    np.testing.assert_allclose(samples.v[inside], paths.v[piece] - slowing * t, atol=ROUNDING)


def test_no_drawn_speed_exceeds_those_of_the_events(paths):
    samples = sample_paths(paths, max_step=0.01)
    for row in range(6):
        own = paths.row == row
        fastest = np.linalg.norm(np.concatenate([paths.v[own], paths.v_end[own]]), axis=1).max()
        settling = (samples.row == row) & (samples.mode == Mode.SETTLING)
        start = np.linalg.norm(paths.v[own & (paths.mode == Mode.SETTLING)])
        assert samples.speed[samples.row == row].max() <= fastest * (1 + ROUNDING)
        assert samples.speed[settling].max() <= start * (1 + ROUNDING)


def test_only_the_rows_asked_for_are_sampled_in_order_of_time(paths):
    samples = sample_paths(paths, [4, 1])
    assert list(np.unique(samples.row)) == [1, 4]
    assert list(samples.row[samples.starts]) == [1, 4]
    assert np.all(np.diff(samples.t)[np.diff(samples.row) == 0] >= 0.0)


def test_a_row_without_a_path_gives_no_points(paths):
    assert len(sample_paths(paths, [77]).row) == 0


def test_no_paths_at_all_are_no_points():
    samples = sample_paths(none_thrown().paths)
    assert len(samples.row) == len(samples.starts) == 0
    assert display_step(none_thrown().paths) > 0.0


def test_displayed_rows_are_spread_over_all(paths):
    assert list(displayed_rows(paths, 3)) == [0, 2, 5]
    assert list(displayed_rows(paths, 100)) == list(range(6))
    assert len(displayed_rows(paths, 0)) == 0


def test_positions_at_given_times_agree_with_the_samples(paths):
    samples = sample_paths(paths, [3], max_step=0.2)
    np.testing.assert_allclose(positions_at(paths, 3, samples.t), samples.x, atol=ROUNDING)


def test_a_rock_lies_still_before_its_release_and_after_its_end(paths):
    own = paths.row == 3
    np.testing.assert_array_equal(positions_at(paths, 3, np.array([-5.0, 1e4])), [paths.x[own][0], paths.x[own][-1]])


def test_asking_where_a_rock_without_a_path_is_is_an_error(paths):
    with pytest.raises(KeyError, match="row 77"):
        positions_at(paths, 77, np.array([0.0]))


def test_pieces_that_take_no_time_are_harmless(paths):
    frozen = type(paths)(paths.row, paths.t * 0.0, paths.x, paths.v, paths.v_end, paths.mode)
    samples = sample_paths(frozen)
    assert np.isfinite(samples.x).all() and np.isfinite(samples.v).all()
    assert len(samples.starts) == 6 and len(paths.row) == 6 * EVENTS
