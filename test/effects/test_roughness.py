"""Tests of rough ground: the laws of CRSP and RocFall, their limits, and no effect without roughness."""

import math

import numpy as np
import pytest
from flights.rebounds_named import MODELS, UP, falling_rock, flight_with
from flights.scenes_of_facets import (
    ENGINES,
    down_the_slope,
    engine_over,
    floor,
    fly,
    incline,
    rough_grid,
    same_bits,
    surface,
)

from rpf3d_core.effects.hooks import chain_of, felt_normal
from rpf3d_core.effects.roughness import STEEPEST, CrspRoughness, RocfallRoughness, SpreadRoughness, tilted
from rpf3d_core.simulation import settling
from rpf3d_core.simulation.settings import Settings
from rpf3d_core.values import ZERO, Mode, Motion, Outcome

AHEAD = Motion(0.0, ZERO, (6.0, 0.0, -3.0), ZERO)
DRAWS = 4000
SIX_SIGMA = 6.0
"""Largest error of a mean of n draws, in standard errors; a correct mean exceeds it once in a billion."""


def normals(effect, motion=AHEAD, n=UP, radius=0.5):
    """Return the tilted normals (DRAWS, 3) of DRAWS impacts."""
    rocks = (falling_rock(radius=radius, rock=i) for i in range(DRAWS))
    return np.array([felt_normal(effect, n, motion, rock) for rock in rocks])


def tilts(felt):
    """Return the tilts (N,) in degrees of normals (N, 3): against the motion along x, and to the left of the motion."""
    return np.degrees(np.arctan2(-felt[:, 0], felt[:, 2])), np.degrees(np.arcsin(felt[:, 1]))


def test_crsps_tilt_is_uniform_up_to_the_angle_of_the_irregularity_within_a_radius():
    """By physics.md 1.3, theta ~ U(0, atan(S / R)): up to 11.31 degrees for S = 0.1 m and R = 0.5 m."""
    back, aside = tilts(normals(CrspRoughness(0.1, False)))
    most = math.degrees(math.atan(0.2))
    assert most == pytest.approx(11.3099, abs=1e-4)
    assert back.min() >= 0.0 and back.max() < most and back.max() > 0.99 * most
    assert back.mean() == pytest.approx(most / 2, abs=SIX_SIGMA * most / math.sqrt(12 * DRAWS))
    assert np.all(aside == 0.0)


def test_the_same_irregularity_is_rougher_for_a_smaller_rock():
    small, large = (tilts(normals(CrspRoughness(0.1, False), radius=radius))[0] for radius in (0.1, 1.0))
    np.testing.assert_allclose(small / large, math.atan(1.0) / math.atan(0.1), rtol=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_crsps_tilt_adds_to_the_angle_of_every_impact(seed):
    """The tilt never makes an impact flatter; a steep impact can pass the perpendicular and is then thrown back."""
    draw = np.random.default_rng(seed)
    n = draw.normal(size=3)
    n /= np.linalg.norm(n)
    v = draw.normal(size=3) * 5.0
    v -= 2.0 * max(v @ n, 0.0) * n
    rock = falling_rock(rock=seed)
    felt = felt_normal(CrspRoughness(0.3, False), tuple(n.tolist()), AHEAD._replace(v=tuple(v.tolist())), rock)
    ahead = v - (v @ n) * n
    ahead /= np.linalg.norm(ahead)
    angle, tilt = math.atan2(-(v @ n), v @ ahead), math.atan2(-np.dot(felt, ahead), np.dot(felt, n))
    assert 0.0 < tilt < math.atan(0.6)
    assert -np.dot(v, felt) == pytest.approx(np.linalg.norm(v) * math.sin(angle + tilt), rel=1e-12)
    assert np.linalg.norm(felt) == pytest.approx(1.0, abs=1e-15)


def test_platrocks_form_shares_the_tilt_between_back_and_either_side():
    """By physics.md 1.3, the tilt a = U atan(S / R) is split into a b against the motion and a (1 - b) to a side."""
    back, aside = tilts(normals(CrspRoughness(0.1, True)))
    most = math.degrees(math.atan(0.2))
    total = back + np.abs(aside)
    assert back.min() >= 0.0 and total.max() < most + 1e-9
    assert np.mean(aside > 0.0) == pytest.approx(0.5, abs=SIX_SIGMA * 0.5 / math.sqrt(DRAWS))
    same = tilts(normals(CrspRoughness(0.1, False)))[0]
    np.testing.assert_allclose(total, same, rtol=1e-9)


def test_rocfalls_tilt_is_normal_about_the_ground_itself():
    """By physics.md 1.5, the tilt follows Normal(0, sigma)."""
    back, aside = tilts(normals(RocfallRoughness(math.radians(8.0))))
    assert back.mean() == pytest.approx(0.0, abs=SIX_SIGMA * 8.0 / math.sqrt(DRAWS))
    assert back.std() == pytest.approx(8.0, abs=SIX_SIGMA * 8.0 / math.sqrt(2 * DRAWS))
    assert np.all(aside == 0.0)
    same = tilts(normals(RocfallRoughness(math.radians(8.0)), radius=3.0))[0]
    assert np.array_equal(same, back), "a rock's size is no part of this law"


def test_the_lateral_tilt_is_normal_drawn_by_itself_and_leaves_the_tilt_along_the_motion_as_it_was():
    back, aside = tilts(normals(SpreadRoughness(math.radians(8.0), math.radians(5.0))))
    along = tilts(normals(RocfallRoughness(math.radians(8.0))))[0]
    np.testing.assert_allclose(back, along, rtol=1e-9)
    assert aside.mean() == pytest.approx(0.0, abs=SIX_SIGMA * 5.0 / math.sqrt(DRAWS))
    assert aside.std() == pytest.approx(5.0, abs=SIX_SIGMA * 5.0 / math.sqrt(2 * DRAWS))
    assert np.corrcoef(back, aside)[0, 1] == pytest.approx(0.0, abs=SIX_SIGMA / math.sqrt(DRAWS))


def test_no_ground_is_tilted_by_90_degrees():
    back, _ = tilts(normals(RocfallRoughness(math.radians(60.0))))
    assert np.abs(back).max() == pytest.approx(math.degrees(STEEPEST), rel=1e-12)


@pytest.mark.parametrize("v", [(0.0, 0.0, -3.0), (1e-14, 0.0, -3.0), (0.0, 0.0, 0.0)])
def test_without_motion_along_the_ground_there_is_no_tilt(v):
    for effect in (CrspRoughness(0.3, True), RocfallRoughness(0.2), SpreadRoughness(0.2, 0.1)):
        assert felt_normal(effect, UP, AHEAD._replace(v=v), falling_rock()) == UP


def test_a_motion_hardly_along_the_ground_tilts_a_normal_that_stays_one():
    n = (math.sin(0.3), 0.0, math.cos(0.3))
    v = tuple(float(c) for c in -5.0 * np.array(n) + 1e-10 * np.array([0.0, 1.0, 0.0]))
    assert np.linalg.norm(tilted(n, v, 0.5, 0.0)) == pytest.approx(1.0, abs=1e-9)


def test_each_impact_draws_anew():
    felt = [felt_normal(CrspRoughness(0.1, False), UP, AHEAD, falling_rock(impacts=k)) for k in range(50)]
    assert len(set(felt)) == 50


# --- flights ----------------------------------------------------------------------------------------------------------

GROUND = rough_grid(10, 60.0, 0.7, 0.3, seed=5)
EFFECTS = {
    "crsp": CrspRoughness(0.1, False), "platrock": CrspRoughness(0.1, True), "rocfall": RocfallRoughness(0.14),
    "spread": SpreadRoughness(0.14, 0.07),
}  # fmt: skip


def flown(engine, effect, model="constant", rocks=30, **settings):
    """Fly rocks over a mesh with an effect; without effects if `effect` is None. model : rebound model"""
    draw = np.random.default_rng(8)
    x = np.column_stack([draw.uniform(3, 12, rocks), draw.uniform(15, 45, rocks), draw.uniform(2, 9, rocks)])
    effects = chain_of([effect] if effect else [])
    physics = flight_with(MODELS[model], surface(0.5, 0.8, 35.0), effects=effects, **settings)
    return fly(engine_over(engine, GROUND), physics, x, draw.normal(size=(rocks, 3)) * 3.0)


@pytest.mark.long
@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_both_engines_leave_the_same_bits_and_every_rock_comes_to_an_end(effect):
    reference, compiled = (flown(name, effect) for name in ENGINES)
    assert same_bits(reference, compiled)
    assert set(reference.deposits.outcome) <= {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    assert not same_bits(reference, flown("reference", None))


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize(
    "effect",
    [CrspRoughness(0.0, False), CrspRoughness(0.0, True), RocfallRoughness(0.0), SpreadRoughness(0.0, 0.0)],
    ids=["crsp", "platrock", "rocfall", "spread"],
)  # fmt: skip
def test_no_roughness_leaves_every_bit_as_it_is_without_the_effect(engine, effect):
    assert same_bits(flown(engine, effect), flown(engine, None))


@pytest.mark.long
@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("model", ["constant", "velocity_scaled", "mass_scaled"])
def test_bounces_are_summed_up_as_on_a_plane_only_of_rocks_too_slow_to_rise_off_a_tilt(engine, model):
    """The next tilted impact throws up a rock that leaves an impact flat and fast, so its bounces do not end there."""
    paths = flown(engine, EFFECTS["rocfall"], model, rocks=60).paths
    speeds = np.linalg.norm(paths.v[paths.mode == Mode.SETTLING], axis=1)
    assert len(speeds) > 5
    assert speeds.max() < math.sqrt(2.0 * Settings().gravity * Settings().smallest_bounce)


@pytest.mark.long
@pytest.mark.parametrize("model", ["pfeiffer_bowen", "stochastic_matrix"])
def test_it_acts_beside_rebounds_that_spin_and_draw_on_both_engines(model):
    assert same_bits(*(flown(name, EFFECTS["platrock"], model) for name in ENGINES))


def test_naming_roughness_leaves_what_a_rebound_draws_as_it_was():
    """The draws of the rebound depend only on rock and impact, not on the draws of the roughness."""
    without, with_it = (flown("reference", effect, "stochastic_matrix") for effect in (None, CrspRoughness(0.0, True)))
    assert same_bits(without, with_it)


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_rough_ground_gives_a_rock_no_energy(effect):
    paths = flown("reference", effect).paths
    after = 9.81 * paths.x[:, 2] + 0.5 * (paths.v**2).sum(1)
    before = 9.81 * paths.x[1:, 2] + 0.5 * (paths.v_end[:-1] ** 2).sum(1)
    same = np.diff(paths.row) == 0
    assert np.all((after[1:] - before)[same] <= 1e-9 * np.abs(after).max())


@pytest.mark.parametrize("restitution", [0.0, 0.02])
def test_rocks_do_not_fall_through_where_one_impact_after_another_takes_their_speed_off_the_ground(restitution):
    """If several tilts in a row are along the motion, the speed away from the facet decays to zero."""
    flights = _down_a_rough_plane(restitution)
    assert Outcome.FELL_THROUGH not in flights.deposits.outcome
    low = flights.paths.x[:, 2] + math.tan(math.radians(25.0)) * flights.paths.x[:, 0]
    assert low.min() > -1e-6, "a path lies below the plane"


@pytest.mark.long
def test_the_runout_on_rough_ground_does_not_depend_on_the_ratio_at_which_rocks_are_kept_off_it(monkeypatch):
    ends = []
    for ratio in (1e-10, 1e-13):
        monkeypatch.setattr(settling, "SKIMMING", ratio)
        ends.append(np.mean([np.linalg.norm(x) for x in _down_a_rough_plane(0.02).deposits.x]))
    assert ends[0] == pytest.approx(ends[1], rel=0.2)


def _down_a_rough_plane(restitution):
    """Fly 40 rocks that hit a rough plane of 25 degrees; its friction angle of 35 degrees would hold them at rest."""
    physics = flight_with(
        MODELS["coulomb_limited"], surface(restitution, 0.95, 35.0), effects=chain_of([RocfallRoughness(0.1)]),
        max_impacts=20_000,
    )  # fmt: skip
    over, x = engine_over("reference", incline(25.0, down=400.0)), np.tile((0.5, 0.0, 1.0), (40, 1))
    return fly(over, physics, x, (6.0, 0.0, -3.0))


def test_a_tilt_that_would_send_a_rock_into_the_ground_is_dropped_and_it_bounces_as_on_smooth_ground():
    """The rock arrives at 11 degrees; a tilt (sigma 0.14 rad) with which it could not leave the ground is dropped."""
    over, x, v = engine_over("reference", floor(400.0)), np.tile((0.1, 0.3, 1e-3), (200, 1)), (6.0, 0.0, -1.2)
    flights = fly(over, flight_with(MODELS["constant"], surface(), effects=chain_of([RocfallRoughness(0.14)])), x, v)
    first = np.unique(flights.impacts.row, return_index=True)[1]
    after = flights.paths.v[np.unique(flights.paths.row, return_index=True)[1] + 1]
    smooth = fly(over, flight_with(MODELS["constant"], surface()), x[:1], v).paths.v[1]
    assert len(first) == 200 and after[:, 2].min() > 0.0
    as_smooth = np.all(after == smooth, axis=1)
    assert 20 < as_smooth.sum() < 100
    assert set(flights.deposits.outcome) == {Outcome.STOPPED}


def test_without_deviation_rocks_keep_to_their_fall_line_and_with_it_they_spread():
    over, x = engine_over("reference", incline(35.0, down=80.0)), np.tile((0.5, 0.0, 4.0), (40, 1))
    x[:, 1] += 0.1 * np.arange(40) - 2.0
    chains = [chain_of([CrspRoughness(0.1, deviates)]) for deviates in (False, True)]
    ends = [fly(over, flight_with(MODELS["constant"], surface(), effects=chain), x).deposits for chain in chains]
    assert np.abs(ends[0].x[:, 1] - x[:, 1]).max() < 1e-9
    assert np.abs(ends[1].x[:, 1] - x[:, 1]).max() > 0.5


def test_without_a_lateral_part_every_bit_is_that_of_rocfalls_law():
    assert same_bits(flown("reference", SpreadRoughness(0.14, 0.0)), flown("reference", EFFECTS["rocfall"]))


SLOPE, R_N, R_T, BOUNCES, FIRST = 30.0, 0.7, 0.9, 4, (6.0, 0.0, -8.0)
"""Plane: slope (degrees), R_n, R_t; number of bounces; first velocity (m/s) along, across and normal to the plane."""


def spread_by_hand(back_sd, lateral_sd, rocks, seed=1):
    """Return the lateral places (rocks,) m of the last of BOUNCES impacts, computed by numpy in the plane's axes.

    back_sd, lateral_sd : standard deviations (rad) of the tilts

    A tilt is dropped if the rock would not hit the tilted ground or would move into the plane afterwards.
    """
    rng, g = np.random.default_rng(seed), 9.81
    gravity = g * np.array([math.sin(math.radians(SLOPE)), 0.0, -math.cos(math.radians(SLOPE))])
    v, side = np.tile(FIRST, (rocks, 1)), np.zeros(rocks)
    for _ in range(BOUNCES - 1):
        back, aside = rng.normal(0.0, back_sd, rocks), rng.normal(0.0, lateral_sd, rocks)
        t = v[:, :2] / np.linalg.norm(v[:, :2], axis=1)[:, None]
        ahead = -np.cos(aside) * np.sin(back)
        felt = np.stack([
            ahead * t[:, 0] - np.sin(aside) * t[:, 1], ahead * t[:, 1] + np.sin(aside) * t[:, 0],
            np.cos(aside) * np.cos(back),
        ], 1)  # fmt: skip
        into = (v * felt).sum(1)
        after = -(R_N + R_T) * into[:, None] * felt + R_T * v
        smooth = (into >= 0.0) | (after[:, 2] < 0.0)
        after[smooth] = v[smooth] * (R_T, R_T, -R_N)
        flight = 2.0 * after[:, 2] / -gravity[2]
        side += after[:, 1] * flight
        v = after + gravity * flight[:, None]
    return side


@pytest.mark.parametrize("engine", ENGINES)
def test_the_lateral_spread_on_a_plane_grows_with_the_lateral_part_as_worked_out_by_hand(engine):
    """1,000 rocks are compared with 200,000 computed by hand; without a lateral part, all rocks stay on their line."""
    descent, normal = down_the_slope(SLOPE)
    over, rocks = engine_over(engine, incline(SLOPE, down=400.0, half_width=300.0)), 1000
    v = FIRST[0] * descent + FIRST[2] * normal
    spreads = []
    for lateral in (0.0, 2.0, 5.0, 10.0):
        effect = SpreadRoughness(math.radians(4.0), math.radians(lateral))
        physics = flight_with(MODELS["constant"], surface(R_N, R_T), effects=chain_of([effect]), max_impacts=BOUNCES)
        ends = fly(over, physics, np.tile(1e-9 * normal, (rocks, 1)), v).impacts
        last = np.flatnonzero(np.append(np.diff(ends.row) > 0, True))
        assert len(ends.row) == BOUNCES * rocks
        expected = spread_by_hand(math.radians(4.0), math.radians(lateral), 200_000)
        side = ends.x[last, 1]
        spreads.append(side.std())
        assert side.std() == pytest.approx(expected.std(), rel=SIX_SIGMA / math.sqrt(2 * rocks), abs=1e-9)
        assert abs(side.mean()) <= SIX_SIGMA * side.std() / math.sqrt(rocks) + 1e-9
        assert abs(np.median(side)) <= SIX_SIGMA * 1.3 * side.std() / math.sqrt(rocks) + 1e-9
    assert np.all(np.diff(spreads) > 0.5)
