"""Tests of answers to bursts of sources: ever larger ensembles, always with the same bits."""

import math
from dataclasses import replace
from itertools import count, islice, pairwise

import numpy as np
import pytest
from live_sites.live_ground import ENGINES, over_the_wall, pit_scene, pit_standing
from live_sites.watched_road import standing_over

from rpf3d_core.ensemble import batches, stream
from rpf3d_core.errors import InputError
from rpf3d_core.hazard.convergence import is_enough, step_of
from rpf3d_core.live import released
from rpf3d_core.live.answers import BLOCK, EnsembleSize, answers
from rpf3d_core.live.released import ReleaseSpread
from rpf3d_core.live.standing import stand_on
from rpf3d_core.live.triggers import trigger_of
from rpf3d_core.setup.rounds import doubling_rounds

WIDE = ReleaseSpread(position=5.0, velocity=1.0, above_ground=2.0)
NOTHING_LIVE = {}
TARGET = "target: {half_width: 0.03, p95_energy: 0.2, most_rocks: 20000}"


def never(stage):
    return False


def flown(standing, trigger, around=WIDE, areas=NOTHING_LIVE, first=200, stop=never):
    return list(answers(standing, trigger, around, areas, EnsembleSize(first), stop, count(1)))


def bits(answer):
    """Return the content of an answer, except computing times, as numbers and bytes to compare."""
    maps, deposits = answer.maps, answer.flights.deposits
    layers = [maps.cells, maps.zones, maps.areas]
    told = [column for each in layers for column in (each.cell, each.rocks, each.deposits, each.first_arrival)]
    told += [getattr(each.energy, name) for each in layers for name in ("largest", "mean", "p95")]
    told += [maps.reached_facets.cell, maps.reached_facets.rocks]
    told += [deposits.x, deposits.t, deposits.mass, deposits.v if hasattr(deposits, "v") else deposits.path]
    told += [answer.flights.paths.x, answer.flights.impacts.x]
    return (answer.rocks, maps.flown, *(np.ascontiguousarray(column).tobytes() for column in told))


def test_the_first_answer_is_small_and_each_further_one_has_twice_the_rocks(tmp_path):
    found = flown(pit_standing(tmp_path, more=TARGET), over_the_wall(5), first=150)
    assert [a.rocks for a in found] == [150 * 2**k for k in range(len(found))]
    assert [a.stage for a in found] == list(range(len(found)))
    assert [a.result for a in found] == [k + 1 for k in range(len(found))]
    assert [a.complete for a in found] == [False] * (len(found) - 1) + [True]


def test_refinement_ends_when_the_scenes_target_is_met_and_not_before(tmp_path):
    standing = pit_standing(tmp_path, more=TARGET)
    found = flown(standing, over_the_wall(5))
    target = standing.scene.target
    steps = [step_of(a.maps, standing.ground.terrain.zones) for a in found]
    assert found[-1].rocks * 2 <= target.most_rocks, "the target was not what ended it: make it looser"
    assert is_enough(steps, target.half_width, target.p95_energy)
    assert not is_enough(steps[:-1], target.half_width, target.p95_energy)


def test_refinement_ends_at_the_most_rocks_that_the_scene_allows(tmp_path):
    found = flown(pit_standing(tmp_path, more="target: {half_width: 1.0e-4, most_rocks: 900}"), over_the_wall(5))
    assert [a.rocks for a in found] == [200, 400, 800]
    assert found[-1].complete


def test_a_newer_trigger_ends_refinement_between_stages_and_within_one(tmp_path):
    standing, trigger = pit_standing(tmp_path, more=TARGET), over_the_wall(5)
    assert [a.rocks for a in flown(standing, trigger, stop=lambda stage: stage == 2)] == [200, 400]
    asked = []

    def during_the_second(stage):
        asked.append(stage)
        return asked.count(1) >= 1

    assert [a.rocks for a in flown(standing, trigger, stop=during_the_second)] == [200]


@pytest.mark.parametrize("side", [0.0, math.inf])
def test_a_stage_that_is_given_up_flies_no_further_block(tmp_path, side, monkeypatch):
    """The stage has 8,000 rocks, of one cluster or of five; newer sources come when the stage begins."""
    standing = pit_standing(tmp_path, more="target: {half_width: 1.0e-4, most_rocks: 16000}")
    size, trigger = EnsembleSize(8000, 0, side), over_the_wall(5)
    stages = answers(standing, trigger, WIDE, {}, size, lambda stage: stage == 1, count(1))
    assert next(stages).rocks == 8000
    fly, blocks = batches.fly_batches, []
    monkeypatch.setattr(stream, "fly_batches", lambda *args: blocks.append(len(args[2].x)) or fly(*args))
    assert next(stages, None) is None
    assert sum(blocks) <= BLOCK


@pytest.mark.parametrize("engine", ENGINES)
def test_the_same_trigger_has_the_same_bits_however_it_was_interrupted(tmp_path, engine):
    first = 30 if engine == "reference" else 200
    standing, trigger = (
        pit_standing(tmp_path, engine, "target: {half_width: 1.0e-4, most_rocks: 1000}"),
        over_the_wall(5),
    )
    stages = 3 if engine == "compiled" else 2
    size = EnsembleSize(first)
    whole = list(islice(answers(standing, trigger, WIDE, {}, size, never, count(1)), stages))
    interrupted = flown(standing, trigger, first=first, stop=lambda stage: stage == 1)
    other = next(answers(standing, over_the_wall(3, stamp_ns=8), WIDE, {}, size, never, count(1)))
    again = list(islice(answers(standing, trigger, WIDE, {}, size, never, count(1)), stages))
    afresh = list(
        islice(answers(stand_on(standing.ground, standing.scene), trigger, WIDE, {}, size, never, count(1)), stages)
    )
    assert len(whole) == len(again) == stages and len(interrupted) == 1
    assert [bits(a) for a in again] == [bits(a) for a in whole] == [bits(a) for a in afresh]
    assert bits(interrupted[0]) == bits(whole[0]) != bits(other)


@pytest.mark.skipif(len(ENGINES) < 2, reason="numba is not installed: there is one engine only")
def test_both_engines_give_the_same_bits(tmp_path):
    each = [
        flown(pit_standing(tmp_path, engine, "target: {most_rocks: 40}"), over_the_wall(4), first=40)
        for engine in ENGINES
    ]
    assert [bits(a) for a in each[0]] == [bits(a) for a in each[1]]


def test_releases_that_are_drawn_at_once_are_those_that_are_drawn_one_by_one(tmp_path):
    standing, trigger = pit_standing(tmp_path), over_the_wall(4)
    over = released.released_over(standing, trigger, WIDE)
    draw = released.drawn_for(standing, over, ([3, 0, 5, 7], [9, 0, 25, 8]))
    some = [range(5, 25, 3), np.array([3, 8]), range(0), range(7, 8)], np.array([2, 0, 1, 3])
    one, other = draw(*some), released.releases_of(standing, over, some[0], standing.scene.seed, some[1])
    assert one.source.tolist() == [2] * 7 + [0] * 2 + [3]
    for name in ("source", "rock", "x", "v", "mass", "radius"):
        assert getattr(one, name).tobytes() == getattr(other, name).tobytes(), name


@pytest.mark.parametrize("of_ground", [0.5, "{prior: {min: 0.4, max: 0.6}}"])
def test_an_answer_does_not_depend_on_how_its_releases_are_drawn(tmp_path, of_ground, monkeypatch):
    """Each source is a cluster; stages after the first have several blocks, or fly one parameter set after another."""
    more = "target: {half_width: 1.0e-4, most_rocks: 6000}\n"
    standing = pit_standing(tmp_path, more=more, R_n=of_ground)
    assert (standing.sets is None) == (of_ground == 0.5)
    size, trigger, each = EnsembleSize(1500, 0, 0.0), over_the_wall(4), []
    for at_once in (0, 10**6):
        monkeypatch.setattr(released, "AT_ONCE", at_once)
        each.append([bits(a) for a in islice(answers(standing, trigger, WIDE, {}, size, never, count(1)), 2)])
    assert each[0] == each[1] and len(each[0]) == 2


def test_another_seed_gives_another_answer(tmp_path):
    standing, trigger = pit_standing(tmp_path, more=TARGET), over_the_wall(5)
    other = stand_on(standing.ground, standing.scene.model_copy(update={"seed": 2}))
    assert bits(flown(standing, trigger)[0]) != bits(flown(other, trigger)[0])


def test_sources_off_the_terrain_or_under_it_are_left_out_and_named_and_the_others_keep_their_draws(tmp_path):
    standing, good = pit_standing(tmp_path, more=TARGET), over_the_wall(5)
    bad = np.array([[9000.0, 0.0, 10.0], [0.0, 0.0, -50.0]])
    mixed = trigger_of(
        np.concatenate([good.positions, bad]), np.concatenate([good.velocities, np.zeros((2, 3))]), None, 7
    )
    seen = ReleaseSpread(position=2.0)
    alone, beside = (flown(standing, trigger, seen, first=100)[0] for trigger in (good, mixed))
    assert beside.sources == 5 and beside.rocks == 100
    assert "1 of 7 sources is off the terrain: source 5 at (9000.000, 0.000, 10.000)" in beside.left_out
    assert (
        "1 of 7 sources is under the ground: source 6 at (0.000, 0.000, -50.000), 50 m under the ground"
        in beside.left_out
    )
    assert bits(alone) == bits(beside)


def test_a_trigger_of_which_no_source_can_be_released_is_refused_with_the_reason(tmp_path):
    nowhere = trigger_of(np.array([[9000.0, 0.0, 10.0]]), np.zeros((1, 3)), None, 1)
    with pytest.raises(InputError, match="1 of 1 sources is off the terrain"):
        flown(pit_standing(tmp_path, more=TARGET), nowhere, ReleaseSpread())


def test_no_sources_are_an_answer_too_and_it_says_that_nothing_is_reached(tmp_path):
    standing = pit_standing(tmp_path, more=TARGET)
    flown(standing, over_the_wall(5))
    (answer,) = flown(standing, trigger_of(np.empty((0, 3)), np.empty((0, 3)), None, 9))
    assert (answer.rocks, answer.sources, answer.complete, len(answer.maps.cells.cell)) == (0, 0, True, 0)
    assert len(answer.flights.deposits.rock) == 0


def test_rocks_spread_around_their_source_at_its_height_above_the_ground(tmp_path):
    standing = pit_standing(tmp_path, more=TARGET)
    trigger = over_the_wall(1, height=20.0)
    (answer, *_) = flown(standing, trigger, ReleaseSpread(position=15.0), first=300)
    place = standing.ground.terrain.frame.points_to_local(trigger.positions)[0]
    release = answer.flights.deposits.release
    above = standing.ground.engine.ground_below(release)[:, 0]
    off = np.abs(release[:, :2] - place[:2])
    assert off.max() <= 15.0 and off.max(axis=0).min() > 13.0
    assert np.ptp(release[:, 2]) > 1.0, "the ground is level here: nothing is shown"
    assert above == pytest.approx(np.full(300, standing.ground.engine.ground_below(place[None])[0, 0]), abs=1e-6)


def test_the_map_of_heights_has_rocks_that_start_over_higher_ground_than_their_source():
    y, x = np.mgrid[0:61, 0:81].astype(float)
    standing = standing_over(np.stack([x, y, np.where(x < 20.0, 31.0, 0.0)], axis=-1))
    trigger = trigger_of(np.array([[22.0, 30.0, 1.0]]), np.array([[3.0, 0.0, 0.0]]), None, 7)
    *_, answer = flown(standing, trigger, ReleaseSpread(position=10.0, above_ground=15.0), first=500)
    height = answer.maps.cells.height
    known = np.isfinite(height.p95)
    assert height.p95[known].max() > 36.0, "rocks start 15 m above the wall of 31 m, and fly over the foot"
    assert (height.p95 <= height.largest)[known].all()


def test_without_a_spread_every_rock_starts_where_its_source_was_seen(tmp_path):
    standing, trigger = pit_standing(tmp_path, more=TARGET), over_the_wall(3)
    (answer, *_) = flown(standing, trigger, ReleaseSpread(), first=30)
    local = standing.ground.terrain.frame.points_to_local(trigger.positions)
    assert np.array_equal(answer.flights.deposits.release, np.repeat(local, 10, axis=0))


def test_a_source_tells_the_size_of_its_rocks_and_one_that_does_not_has_the_scenes(tmp_path):
    standing, trigger = pit_standing(tmp_path, more=TARGET), over_the_wall(3)
    sized = replace(trigger, diameters=np.array([0.5, np.nan, 2.0]))
    (answer, *_) = flown(standing, sized, ReleaseSpread(above_ground=2.0), first=30)
    mass = answer.flights.deposits.mass
    expected = 2700.0 * np.pi / 6.0 * np.array([0.5, 1.0, 2.0]) ** 3
    own = standing.scene.rock.diameter
    expected[1] = standing.scene.rock.density * np.pi / 6.0 * own**3
    assert mass == pytest.approx(np.repeat(expected, 10), rel=1e-12)


def test_live_areas_are_told_of_beside_the_scenes_own(tmp_path):
    standing, trigger = pit_standing(tmp_path, more=TARGET), over_the_wall(5)
    everywhere = [np.array([[-900.0, -900.0], [900.0, -900.0], [900.0, 900.0], [-900.0, 900.0]])]
    (answer, *_) = flown(standing, trigger, areas={"live_area": everywhere})
    assert answer.maps.area_names == ("east_side", "live_area")
    assert answer.maps.areas.everywhere(answer.maps.areas.rocks, 0)[1] == answer.rocks
    (without, *_) = flown(standing, trigger)
    assert without.maps.area_names == ("east_side",)
    assert without.maps.cells.rocks.tobytes() == answer.maps.cells.rocks.tobytes()


def test_a_first_stage_larger_than_most_rocks_flies_all_the_same():
    assert doubling_rounds([3, 3], 4) == [([0, 0], [3, 3])]
    assert doubling_rounds([1, 1], 8) == [([0, 0], [1, 1]), ([1, 1], [2, 2]), ([2, 2], [4, 4])]


@pytest.mark.parametrize(
    ("first", "most", "least", "stages"),
    [
        ([3, 3], 30, 0, [6, 12, 24]),
        ([3, 3], 30, 20, [6, 20]),
        ([3, 3], 90, 20, [6, 20, 40, 80]),
        ([3, 3], 30, 6, [6, 12, 24]),
        ([3], 4, 9, [3, 9]),
    ],
)
def test_stages_double_up_to_most_rocks_and_have_no_fewer_than_least_from_the_second_on(first, most, least, stages):
    plan = doubling_rounds(first, most, least)
    assert [sum(last) for _, last in plan] == stages
    assert all(done == last for (_, last), (done, _) in pairwise(plan)), "each goes on from the last"


def test_an_answer_is_complete_only_with_as_many_rocks_as_the_site_wants(tmp_path):
    standing = pit_standing(tmp_path, more="target: {half_width: 0.49, p95_energy: 10.0, most_rocks: 100000}")
    trigger = over_the_wall(1, height=20.0)
    few, enough = (
        [
            (answer.rocks, answer.complete)
            for answer in answers(standing, trigger, ReleaseSpread(), {}, EnsembleSize(100, least), never, count(1))
        ][-1]
        for least in (0, 1500)
    )
    assert few[0] < 1500 <= enough[0] < 3200
    assert few[1] and enough[1]


def test_a_ground_whose_zones_have_no_material_is_refused(tmp_path):
    scene = pit_scene(tmp_path)
    standing = stand_on(pit_standing(tmp_path).ground, scene)
    material = scene.materials["default"]
    with pytest.raises(InputError, match="no material"):
        stand_on(standing.ground, scene.model_copy(update={"materials": {"bench_1": material}}))
