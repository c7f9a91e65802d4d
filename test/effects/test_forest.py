"""Tests of trees: energy and offset by Dorren and Berger, and impacts on trees in both engines."""

import math

import numpy as np
import pytest
from flights import scenes_of_facets as made
from flights.obstacles_made import ASIDE, RADIUS, energy_of, rough_ground, thrown, trees, with_effects
from flights.on_both_engines import BOTH, loses_energy

from rpf3d_core.effects.forest import most_energy, share_at_offset
from rpf3d_core.materials.gamma import gamma_of
from rpf3d_core.materials.streams import Purpose
from rpf3d_core.values import Outcome

G = 9.81
ROUNDING = 1e-15
"""Largest relative rounding error of a velocity that is turned."""


def over_a_floor(engine, x, v, *effects, friction=30.0):
    physics = made.flight(made.surface(0.5, 0.8, friction))
    return made.fly(made.engine_over(engine, made.floor(cells=10)), with_effects(physics, *effects), x, v)


def met(flights):
    return flights.impacts.facet < 0


@pytest.mark.parametrize(("dbh", "energy"), [(20, 39e3), (30, 100e3), (40, 194e3), (60, 496e3)])
def test_the_energy_of_a_stem_is_that_of_dorren_and_berger_2006_physics_4_1(dbh, energy):
    assert most_energy(dbh, 1.0) == pytest.approx(energy, rel=0.01)


@pytest.mark.parametrize(("offset", "share", "digits"), [(0.0, 0.98, 5e-3), (0.5, 0.789, 5e-3), (1.0, 0.0, 5e-3)])
def test_the_share_at_an_offset_is_that_of_physics_4_1(offset, share, digits):
    assert share_at_offset(offset) == pytest.approx(share, abs=digits)


@pytest.mark.long
@BOTH
@pytest.mark.parametrize("aside", [0.0, 0.35])
def test_a_rock_loses_what_the_stem_takes_at_its_offset_and_height(engine, aside):
    dbh, height, most = 40.0, 20.0, 30e3
    forest = trees(made.floor(cells=10), [(0.0, 0.0)], dbh, height, most)
    flights = over_a_floor(engine, (-4.0, aside, 2.0), (15.0, 0.0, 0.0), forest)
    reach = 0.2 + RADIUS
    t = (4.0 - math.sqrt(reach**2 - aside**2)) / 15.0
    z = 2.0 - 0.5 * G * t * t
    assert flights.impacts.t[0] == pytest.approx(t, rel=1e-12) and flights.impacts.x[0, 2] == pytest.approx(z)
    before = energy_of(math.hypot(15.0, G * t))
    taken = most * share_at_offset(aside / reach) * (1.0 - z / height)
    assert energy_of(flights.impacts.speed_out[0]) == pytest.approx(before - taken, rel=1e-9)


@BOTH
def test_a_rock_that_the_stem_stops_drops_to_the_ground_and_lies_there(engine):
    forest = trees(made.floor(cells=10), [(0.0, 0.0)], energy=1e7)
    flights = over_a_floor(engine, (-4.0, 0.0, 2.0), (15.0, 0.0, 0.0), forest)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    np.testing.assert_allclose(flights.deposits.x[0], (-0.7, 0.0, 0.0), atol=1e-9)


@BOTH
def test_a_sliding_rock_that_the_stem_stops_lies_against_it(engine):
    forest = trees(made.floor(cells=10), [(0.0, 0.0)], energy=1e7)
    flights = over_a_floor(engine, (-4.0, 0.0, 0.0), (9.0, 0.0, 0.0), forest, friction=5.0)
    assert flights.deposits.outcome[0] == Outcome.STOPPED and met(flights).sum() == 1
    np.testing.assert_allclose(flights.deposits.x[0], (-0.7, 0.0, 0.0), atol=1e-9)


@BOTH
def test_a_sliding_rock_that_is_turned_aside_stays_on_its_facet(engine):
    forest = trees(made.floor(cells=10), [(0.0, 0.1)], energy=10e3, deflection=ASIDE)
    flights = over_a_floor(engine, (-4.0, 0.0, 0.0), (12.0, 0.0, 0.0), forest, friction=5.0)
    assert met(flights).sum() == 1 and np.abs(flights.paths.x[:, 2]).max() < 1e-12
    assert flights.deposits.x[0, 1] < -0.1, "away from the axis"


@BOTH
@pytest.mark.parametrize(("y", "z"), [(0.75, 2.0), (0.0, 26.0)], ids=["beside", "above"])
def test_a_rock_that_passes_a_tree_is_not_changed_in_its_last_bit(engine, y, z):
    x, v = (-4.0, y, z), (15.0, 0.0, 0.0)
    forest = trees(made.floor(cells=10), [(0.0, 0.0)])
    assert made.same_bits(over_a_floor(engine, x, v), over_a_floor(engine, x, v, forest))


@BOTH
def test_a_forest_without_trees_leaves_every_bit_of_a_flight(engine):
    x, v = thrown(20)
    terrain, physics = rough_ground(), made.flight(made.surface(0.5, 0.8, 25.0))
    none = trees(terrain, [], deflection=ASIDE)
    flown = [made.fly(made.engine_over(engine, terrain), p, x, v) for p in (physics, with_effects(physics, none))]
    assert made.same_bits(*flown)


def wood(terrain, number=80, **how):
    random = np.random.default_rng(7)
    places = np.stack([random.uniform(1.0, 45.0, number), random.uniform(-7.0, 7.0, number)], 1)
    return trees(terrain, places.tolist(), deflection=ASIDE, **how)


def test_both_engines_meet_the_same_trees_to_the_last_bit_and_no_energy_is_gained():
    x, v = thrown(60)
    terrain, physics = rough_ground(), made.flight(made.surface(0.5, 0.8, 25.0))
    forest = wood(terrain, energy=4e3)
    one, other = (
        made.fly(made.engine_over(engine, terrain), with_effects(physics, forest), x, v) for engine in made.ENGINES
    )
    assert met(one).sum() > 60 and made.same_bits(one, other)
    assert loses_energy(one)
    assert (one.impacts.speed_out[met(one)] <= one.impacts.speed_in[met(one)] * (1.0 + ROUNDING)).all()


@BOTH
def test_rocks_in_a_dense_wood_on_a_slope_that_holds_nothing_all_come_to_an_end(engine):
    x, v = thrown(40 if engine == "compiled" else 15)
    terrain, physics = rough_ground(), made.flight(made.surface(0.5, 0.8, 25.0))
    flights = made.fly(made.engine_over(engine, terrain), with_effects(physics, wood(terrain, 300, energy=1e6)), x, v)
    ends = {Outcome.STOPPED, Outcome.LEFT_TERRAIN}
    assert {Outcome(outcome) for outcome in flights.deposits.outcome} <= ends
    assert flights.deposits.impacts.max() < 2000, "no rock hammers at a tree for ever"


def test_rocks_are_turned_by_the_classes_in_their_shares_and_alike_to_both_sides():
    terrain = made.floor(cells=10)
    forest = trees(terrain, [(0.0, 0.0)], energy=0.0, deflection=ASIDE)
    number = 3000
    x = np.tile((-4.0, 0.0, 2.0), (number, 1))
    flights = over_a_floor("compiled", x, (15.0, 0.0, 0.0), forest)
    _, first = np.unique(flights.paths.row, return_index=True)
    v = flights.paths.v[first + 1]
    turn = np.degrees(np.arctan2(v[:, 1], v[:, 0]))
    shares = np.histogram(np.abs(turn), (0.0, 22.5, 67.5, 76.0))[0] / number
    np.testing.assert_allclose(shares, (0.4, 0.4, 0.2), atol=4.0 * 0.5 / math.sqrt(number))
    assert (turn > 0).mean() == pytest.approx(0.5, abs=4.0 * 0.5 / math.sqrt(number))


def test_naming_a_forest_leaves_every_other_draw_as_it_was():
    assert len({int(purpose) for purpose in Purpose}) == len(Purpose)
    assert {int(p) for p in Purpose if p.name.startswith("TREE")} <= set(range(32, 44))


@pytest.mark.parametrize(("mean", "sd"), [(30.0, 10.0), (30.0, 45.0), (30.0, 0.0)])
def test_diameters_have_the_mean_and_the_standard_deviation_that_were_asked_for(mean, sd):
    number = 100_000
    drawn = gamma_of(1, Purpose.TREE_DIAMETER, np.arange(number), mean, sd)
    assert drawn.mean() == pytest.approx(mean, abs=5.0 * sd / math.sqrt(number) + 1e-9)
    assert drawn.std() == pytest.approx(sd, rel=0.03)
    some = gamma_of(1, Purpose.TREE_DIAMETER, np.arange(50, 60), mean, sd)
    assert np.array_equal(some, drawn[50:60]), "a tree does not depend on how many there are"
