"""Tests of map errors, intervals of quantiles, coarser terrains, and the resulting price list."""

import math

import numpy as np
import pytest
from flights.scenes_of_facets import engine_over, flight, floor, fly, joined, rough_grid, surface
from scenes.price_lists import STEPS, price_list

from rpf3d_core.accuracy.choice import (
    MOST_ROCKS,
    cheapest,
    cheapest_by_events,
    check_target,
    errors_of_scene,
    largest,
    rocks_needed,
    statistical_error,
)
from rpf3d_core.accuracy.decimated import decimated
from rpf3d_core.accuracy.differences import (
    AnswerDifference,
    Metres,
    first_bounces,
    first_impacts,
    map_distance,
    metres,
    share_distance,
)
from rpf3d_core.accuracy.flown import PILOT, Reached, affordable, spread
from rpf3d_core.accuracy.geometric import put_back
from rpf3d_core.accuracy.in_contact import InContact
from rpf3d_core.accuracy.numerical import under_ground
from rpf3d_core.accuracy.precise import ImpactErrors
from rpf3d_core.accuracy.price_list import (
    EVENTS,
    Priced,
    PriceList,
    contact_setting,
    price_list_of,
    priced_contact,
    section,
)
from rpf3d_core.accuracy.statistical import (
    Sampled,
    beyond_chance,
    distance_from_truth,
    floor_of,
    quantile_half_width,
    together,
)
from rpf3d_core.accuracy.tables import findings, ordinal
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.convergence import Place, Step
from rpf3d_core.simulation.engines import Engine, stepping
from rpf3d_core.terrain.facets import area_vectors
from rpf3d_core.values import STANDARD_GRAVITY


def reached(flown: int, **cells: int) -> Reached:
    return Reached(np.array([int(c[1:]) for c in cells]), np.array(list(cells.values())), flown)


def test_the_distance_of_maps_is_0_for_equal_1_for_disjoint_and_linear_between() -> None:
    a = reached(10, c1=10, c2=5)
    assert map_distance(a, a) == 0.0
    assert map_distance(a, reached(20, c1=20, c2=10)) == 0.0, "shares count, not rocks"
    assert map_distance(a, reached(10, c3=10, c4=5)) == 1.0
    assert map_distance(a, reached(10, c1=10, c3=5)) == pytest.approx((0.5 + 0.5) / 3.0)
    assert map_distance(reached(10), reached(10)) == 0.0


def test_the_distance_of_shares_is_the_largest_of_any_place_known_to_either() -> None:
    one = Step(10, {"a": Place(0.5, 0.1, 0.0, None), "b": Place(0.2, 0.2, 0.0, None)})
    other = Step(10, {"a": Place(0.5, 0.2, 0.0, None), "c": Place(0.25, 0.0, 0.0, None)})
    assert share_distance(one, other) == pytest.approx(0.25)
    assert share_distance(one, one) == 0.0


def test_the_half_width_of_a_quantile_is_that_of_the_binomial_and_unknown_for_few_values() -> None:
    n = 10_000
    uniform = (np.arange(n) + 0.5) / n
    expected = 1.96 * math.sqrt(0.95 * 0.05 / n) / 0.95
    assert quantile_half_width(uniform, 0.95) == pytest.approx(expected, rel=0.01)
    assert quantile_half_width(uniform[:20], 0.95) is None
    draws = [np.random.default_rng(k).exponential(size=2000) for k in range(200)]
    truth, within = -math.log(0.05), 0
    for values in draws:
        half = quantile_half_width(values, 0.95)
        assert half is not None
        middle = float(np.sort(values)[1899])
        within += abs(middle - truth) <= half * middle
    assert within / 200 > 0.9, "a 95 % interval, made symmetric, covers about as often"


def test_chance_falls_with_the_square_root_of_the_number_of_rocks() -> None:
    sampled = [Sampled(100, 0.2, 0.3, 0.1, None, 1.0), Sampled(400, 0.1, 0.15, 0.05, None, 4.0)]
    assert floor_of(100, sampled) == pytest.approx(0.3)
    assert floor_of(1600, sampled) == pytest.approx(0.075)


@pytest.mark.parametrize("chance", [1e-3, 0.2])
def test_the_error_of_some_rocks_is_their_distance_from_the_truth_however_rarely_cells_are_reached(
    chance: float,
) -> None:
    # The mean absolute deviation of a binomial number (de Moivre 1730): 2 (k + 1) C(n, k + 1) p^(k+1) q^(n-k), where k
    # is the integer part of n p.
    n, most, cells = 125, 32_000, 4000
    k = math.floor(n * chance)
    deviation = 2 * (k + 1) * math.comb(n, k + 1) * chance ** (k + 1) * (1 - chance) ** (n - k)
    expected = deviation / (2.0 * n * chance)
    random, numbers = np.random.default_rng(1), np.arange(cells)
    some = Reached(numbers, random.binomial(n, chance, cells), n)
    rest = Reached(numbers, random.binomial(most - n, chance, cells), most - n)
    assert distance_from_truth(some, together(some, rest)) == pytest.approx(expected, rel=0.03)


def test_half_of_all_rocks_are_off_the_truth_by_what_lies_between_the_halves_over_the_square_root_of_two() -> None:
    one, other = reached(10, c1=6, c2=4), reached(10, c1=4, c3=6)
    both = together(one, other)
    assert (both.cells.tolist(), both.rocks.tolist(), both.flown) == ([1, 2, 3], [10, 4, 6], 20)
    expected = map_distance(one, other) / math.sqrt(2.0)
    assert distance_from_truth(one, both) == pytest.approx(expected)


def test_rocks_are_the_fewest_measured_or_as_many_as_the_last_ones_promise() -> None:
    lines = price_list().statistical
    assert rocks_needed(lines, 0.2) == 100
    assert rocks_needed(lines, 0.11) == 400
    assert rocks_needed(lines, 0.01) == pytest.approx(40_000, abs=1)
    assert rocks_needed(lines, 0.0) is None
    assert rocks_needed(lines, 2.0 / math.sqrt(2 * MOST_ROCKS)) is None
    assert statistical_error(lines, 6400) == pytest.approx(0.025)


def test_the_cheapest_setting_may_be_another_terrain_but_a_run_keeps_its_own() -> None:
    prices = price_list()
    best = cheapest(prices, 0.12)
    assert best is not None
    assert (best.method, best.terrain["part"], best.rocks) == (EVENTS, 2, 400)
    assert best.total == pytest.approx(0.11) and best.seconds == pytest.approx(0.01 * 0.4 * 0.4)
    own = cheapest_by_events(prices, 0.12)
    assert own is not None
    assert (own.terrain["part"], own.rocks, own.total) == (1, 400, pytest.approx(0.1))
    tight = cheapest(prices, 0.0101)
    assert tight is not None and tight.terrain["part"] == 1, "what is left over half the terrain is not enough"
    assert cheapest(prices, 1e-9) is None


def test_what_no_scene_can_ask_for_is_not_chosen_however_cheap() -> None:
    raster = Priced({"method": "raster", "cell": 2.0, "dt": 1e-2}, 0.0, 1e-6, {})
    best = cheapest(price_list(numerical=[*price_list().numerical, raster]), 0.12)
    assert best is not None and best.method == EVENTS


def test_a_choice_says_that_its_terrain_is_another_one() -> None:
    _, any_terrain, its_own, _ = findings(price_list(), 0.12)
    assert "cheapest: 400 rocks by events (exact), 400 triangles (the mesh, decimated to 1/2)" in any_terrain
    assert its_own.endswith("800 triangles, total 0.1, 0.004 s of one core"), "a run keeps its own terrain"


@pytest.mark.parametrize(
    ("changes", "words"),
    [({}, "statistical (100 rocks) 0.2"), ({"rocks": 1}, "statistical (1 rock) 1"),
     ({"auto": True}, "statistical (100 rocks, the first of `rocks: auto`) 0.2")],
)  # fmt: skip
def test_the_statistical_error_of_a_scene_is_told_with_its_number_of_rocks(changes: dict, words: str) -> None:
    assert any(words in line for line in findings(price_list(**changes), 0.1))


def test_how_exact_events_are_is_told_of_the_first_impact_and_of_all() -> None:
    off = [ImpactErrors(50, 1e-14, 2e-14, 0.0, 0.0), ImpactErrors(1, 3e-13, 3e-13, 0.0, 0.0)]
    assert findings(price_list(off_exact=off), 0.1)[0] == (
        "events against 50 digits: rounding moves the first impact by 1.0e-14 m (median of 50 rocks) and by at most "
        "2.0e-14 m; of all impacts up to the 2nd, which only 1 rock had, rounding moves none by more than 3.0e-13 m"
    )
    assert [ordinal(n) for n in (1, 3, 4, 11, 13, 21, 112)] == ["1st", "3rd", "4th", "11th", "13th", "21st", "112th"]


@pytest.mark.parametrize(
    ("seconds", "rocks"), [(1e-3, 2000), (1.01e-3, 1000), (3e-3, 500), (1.0, PILOT)]
)  # fmt: skip
def test_rocks_are_halved_until_they_keep_to_a_budget(seconds: float, rocks: int) -> None:
    assert affordable(2000, seconds, 2.0) == rocks
    assert affordable(7, 100.0, 2.0) == 7


def test_the_largest_error_is_that_of_the_scene_as_it_stands() -> None:
    assert errors_of_scene(price_list()) == {"numerical": 0.0, "geometric": 0.01, "statistical": pytest.approx(0.2)}
    assert largest(price_list()) == "statistical"
    assert largest(price_list(rocks=1_000_000)) == "geometric"
    alike = [Priced({"rocks": 100}, 0.0, 0.01, {"seconds": 1e-3})]  # as for rocks with equal releases
    assert largest(price_list(statistical=alike, geometric=[])) is None
    assert largest(price_list(rocks=1_000_000, method=STEPS)) == "numerical"


@pytest.mark.parametrize("target", [0.0, 1.0, -0.1, math.nan, 5.0])
def test_an_accuracy_that_is_no_error_of_a_map_is_refused(target: float) -> None:
    with pytest.raises(InputError, match=r"must be a number above 0 and below 1, an error of the map"):
        check_target(target)


def test_a_price_list_comes_back_from_what_is_written_of_it() -> None:
    again = price_list_of(section(price_list()))
    assert again == price_list()
    with pytest.raises(KeyError):
        price_list_of({"scene": {}})


def test_a_coarser_terrain_keeps_its_zones_where_they_were_and_its_area() -> None:
    terrain = rough_grid(24, 24.0, 0.3, 0.2, seed=3)
    east = terrain.vertices[terrain.triangles].mean(axis=1)[:, 0] > 12.0
    terrain.zone[:] = east
    coarse = decimated(terrain, 0.25)
    assert 0.2 * len(terrain.triangles) <= len(coarse.triangles) <= 0.3 * len(terrain.triangles)
    middles = coarse.vertices[coarse.triangles].mean(axis=1)[:, 0]
    assert (coarse.zone[np.abs(middles - 12.0) > 2.0] == (middles > 12.0)[np.abs(middles - 12.0) > 2.0]).all()
    plan = [area_vectors(t.vertices, t.triangles)[:, 2].sum() for t in (terrain, coarse)]
    assert plan[1] == pytest.approx(plan[0], rel=0.02), "facets still look up, and cover the same ground"


def test_rocks_are_put_back_to_their_height_above_another_ground() -> None:
    fine = rough_grid(24, 24.0, 0.3, 0.4, seed=3)
    before, after = engine_over("compiled", fine), engine_over("compiled", decimated(fine, 0.1))
    x = np.random.default_rng(3).uniform((4, 4, 3), (20, 20, 9), (50, 3))
    nothing = np.zeros(50)
    releases = Releases(nothing.astype(int), np.arange(50), x, 0.0 * x, nothing, nothing)
    moved = put_back(releases, before, after)
    expected = before.ground_below(x)[:, 0]
    np.testing.assert_allclose(after.ground_below(moved.x)[:, 0], expected, atol=1e-9)
    np.testing.assert_array_equal(moved.x[:, :2], x[:, :2])
    far = Releases(*(getattr(releases, n) for n in ("source", "rock")), x + 100.0, 0.0 * x, nothing, nothing)
    np.testing.assert_array_equal(put_back(far, before, after).x, far.x)


def test_a_rock_under_an_overhang_is_put_back_under_it_even_where_it_would_now_be_in_the_ground() -> None:
    def under_a_roof(ground: float, roof: float) -> Engine:
        return engine_over("reference", joined(floor(20.0, z=ground), floor(4.0, z=roof)))

    x = np.array([[0.3, 0.2, 2.0], [0.3, 0.2, 6.5], [9.0, 0.2, 0.5], [0.3, 0.2, 0.5]])
    nothing = np.zeros(4)
    releases = Releases(nothing.astype(int), np.arange(4), x, 0.0 * x, nothing, nothing)
    moved = put_back(releases, under_a_roof(0.0, 6.0), under_a_roof(1.0, 8.0))
    np.testing.assert_allclose(moved.x[:, 2], [3.0, 8.5, 1.5, 1.5], atol=1e-9)


def test_rocks_that_fell_through_the_ground_are_told_from_those_that_left_it() -> None:
    terrain = rough_grid(6, 12.0, 0.0, 0.0, centred=True)
    engine = engine_over("reference", terrain)
    x = np.array([[0.0, 0.1, 8.0], [0.3, 0.2, 9.0], [5.0, 0.0, 3.0]])
    v = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [30.0, 0.0, 0.0]])
    deposits = fly(stepping(engine, 0.1, 1e-3), flight(surface()), x, v).deposits
    assert under_ground(deposits, engine).tolist() == [True, True, False]
    assert not under_ground(fly(engine, flight(surface()), x, v).deposits, engine).any()


def test_first_impacts_and_first_bounces_are_those_of_a_drop_on_a_floor() -> None:
    engine = engine_over("reference", rough_grid(6, 12.0, 0.0, 0.0, centred=True))
    flights = fly(engine, flight(surface(R_n=0.5)), np.array([[0.3, 0.2, 2.0], [0.0, 0.3, 4.0]]))
    np.testing.assert_allclose(first_impacts(flights), [[0.3, 0.2, 0.0], [0.0, 0.3, 0.0]], atol=1e-9)
    assert first_bounces(flights, STANDARD_GRAVITY) == pytest.approx([0.5, 1.0])
    assert metres(np.array([1.0, 3.0, math.nan])).median == 2.0
    assert metres(np.array([math.nan])).median is None


def test_some_rocks_are_spread_over_all_of_them() -> None:
    assert spread(np.arange(100), 5).tolist() == [0, 24, 49, 74, 99]
    assert spread(np.arange(3), 5).tolist() == [0, 1, 2]


CONTACTS = [contact_setting(0.001 * factor) for factor in (8.0, 2.0, 0.5)]


def price_list_of_bodies() -> PriceList:
    """Return a price list whose numerical lines are accuracies of contact; the scene has the middle one."""
    known = zip(CONTACTS, (0.3, 0.01, 0.0), (0.3, 10.0, 40.0), strict=True)
    lines = [Priced(setting, error, seconds, {}) for setting, error, seconds in known]
    return price_list(numerical=lines, method=CONTACTS[1])


def test_only_what_exceeds_chance_is_an_error_of_the_accuracy() -> None:
    assert beyond_chance(0.5, 0.3) == pytest.approx(0.4), "3, 4, 5"
    assert beyond_chance(0.3, 0.3) == 0.0 and beyond_chance(0.1, 0.3) == 0.0
    assert beyond_chance(0.2, 0.0) == 0.2


def test_the_line_of_an_accuracy_keeps_the_distance_and_has_no_bounce() -> None:
    nothing = Metres(None, None)
    off = AnswerDifference(of_map=0.5, of_shares=0.1, first_impact=nothing, stop=nothing, bounce=Metres(1.0, 2.0),
                           other_outcome=0.0)  # fmt: skip
    line = priced_contact(InContact(0.002, 400, off, 3.0), [Sampled(100, 0.2, 0.6, 0.1, None, 1.0)])
    assert line.error == pytest.approx(0.4) and line.more["floor"] == pytest.approx(0.3)
    assert line.more["distance"] == 0.5 and line.more["bounce_height_m"] == [None, None]
    assert line.setting == contact_setting(0.002) and line.seconds_per_1000_rocks == 3.0


def test_rocks_with_a_shape_keep_the_accuracy_of_their_scene() -> None:
    prices = price_list_of_bodies()
    choice = cheapest_by_events(prices, 0.2)
    assert choice is not None and choice.method == CONTACTS[1] and choice.numerical == 0.01
    assert errors_of_scene(prices)["numerical"] == 0.01
    told = findings(prices, 0.2)
    assert any("left out" in line for line in told) and any("contact at 2 mm" in line for line in told)
    assert not any("left out" in line for line in findings(price_list(), 0.2)), "points have every row"
    spheres = findings(price_list(numerical=[Priced(EVENTS, 0.0, 0.01, {})]), 0.2)
    assert any(line.startswith("spheres:") and "left out" in line for line in spheres)
