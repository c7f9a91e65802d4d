"""Tests that the level is `fault` if rocks leave the survey before a road, or the road is not surveyed."""

from dataclasses import replace

import numpy as np
import pytest
from live_sites.watched_road import ON_THE_SLOPE, ROAD, decided_on, last_answer, road_site, slope, standing_over

from rpf3d_core.alerts.levels import Level
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.live.areas import circles_around, outlines_for_places
from rpf3d_core.live.coverage import grounds_of
from rpf3d_core.live.leaving import LeavingTally
from rpf3d_core.values import Outcome


def strip_before_the_road():
    points = slope()
    points[:, 41:44] = np.nan
    return points


def hole_before_the_road():
    points = slope()
    points[12:29, 41:43] = np.nan
    return points


SURVEYS = {
    "a strip of holes before the road": (strip_before_the_road, "and may reach the area"),
    "a hole before the road": (hole_before_the_road, "and may reach the area"),
    "a survey that ends before the road": (lambda: slope()[:, :39], "has no terrain"),
    "a survey that ends on the road": (lambda: slope()[:, :51], "has no terrain"),
}


def test_over_a_whole_survey_the_road_is_restricted_and_nothing_is_unknown():
    alert = decided_on(last_answer(standing_over(slope()), [ON_THE_SLOPE]))
    assert (alert.level, alert.faults) == (Level.RESTRICT, ())


@pytest.mark.parametrize("name", SURVEYS)
def test_what_the_survey_does_not_show_is_a_fault(name):
    survey, sentence = SURVEYS[name]
    answer = last_answer(standing_over(survey()), [ON_THE_SLOPE])
    alert = decided_on(answer, road_site(most_unfinished=1.0))
    assert alert.level == Level.FAULT
    assert any(sentence in fault for fault in alert.faults), alert.faults


def test_a_road_without_survey_is_unknown_also_while_nothing_is_seen():
    standing = standing_over(slope()[:, :39])
    assert decided_on(last_answer(standing, [])).level == Level.FAULT
    assert decided_on(last_answer(standing_over(slope()), [])).level == Level.NORMAL


def test_rocks_that_leave_the_survey_beyond_the_road_are_no_fault():
    answer = last_answer(standing_over(slope()[:, :54]), [ON_THE_SLOPE])
    assert answer.outcomes[Outcome.LEFT_TERRAIN] > 50
    assert decided_on(answer).faults == ()


def test_few_rocks_that_left_are_a_fault_where_they_would_raise_the_level():
    answer = last_answer(standing_over(slope()), [ON_THE_SLOPE])
    (area,) = answer.evidence
    few = area._replace(reached=5, low=0.0, high=0.019, left=4, flown=1000)
    calm = road_site(most_left=0.5, reach_probability_is="share")

    def level_with(**facts):
        changed = few._replace(**facts)
        return decided_on(type(answer)(**{**vars(answer), "evidence": (changed,)}), calm).level

    assert level_with() == Level.NORMAL, "9 of 1,000 are below every limit"
    assert level_with(left=20) == Level.FAULT, "25 of 1,000 would be watch"


def gone(*path, v=(0.0, 0.0, 0.0), outcome=Outcome.LEFT_TERRAIN, spin=None):
    """Return the batch of one rock with a path through points (x, y, z) m.

    v : velocity (3,) m/s; outcome : how the rock ended; spin : rad/s, None for a rock without spin
    """
    points, none = np.array(path, dtype=float), np.empty(0, dtype=np.int64)
    spins = np.zeros((len(path), 0)) if spin is None else np.full((len(path), 2), spin)
    pieces = np.hstack([np.zeros((len(path), 1)), points, np.tile(v, (len(path), 2)), spins])
    return Batch(
        rows=np.zeros(1, dtype=np.int64), impacts=np.empty((0, 9 if spin is None else 10)), facets=none, pieces=pieces,
        modes=np.zeros(len(path), dtype=np.int64), first=np.array([[0, 0], [0, len(path)]]),
        finals=np.zeros((1, 8)), counts=np.array([[outcome, 0, 0, 0]]),
    )  # fmt: skip


def counted(rock, lowest=0.0, rings=(ROAD,), displace=None, radius=0.5):
    tally = LeavingTally(outlines_for_places({"road": rings}), [lowest], 9.81)
    tally.count(rock, np.array([radius]), displace)
    return tally.counts.tolist()[0]


@pytest.mark.parametrize(("path", "counts"), [
    ([(0.0, 50.0, 40.0), (40.0, 50.0, 0.0)], 1),
    ([(60.0, 50.0, 9.0), (70.0, 50.0, 0.0)], 1),
    ([(60.0, 50.0, 9.0), (60.0, 50.0, 0.0)], 1),
    ([(60.0, 50.0, 9.0)], 1),
    ([(20.0, 50.0, 9.0), (20.0, 170.0, 0.0)], 1),
    ([(0.0, 50.0, 40.0), (48.0, 50.0, 0.0)], 0),
    ([(0.0, 50.0, 40.0), (60.0, 50.0, 0.0)], 0),
    ([(0.0, 50.0, 40.0), (48.0, 50.0, 0.0), (40.0, 50.0, 0.0)], 0),
    ([(40.0, 50.0, 40.0), (44.0, 50.0, 0.0)], 1),
], ids=["before", "away", "down", "at once", "along", "inside", "beyond", "out of it", "at the rim"])  # fmt: skip
def test_a_rock_that_left_counts_in_whatever_direction_unless_it_was_in_the_area(path, counts):
    assert counted(gone(*path)) == counts
    assert counted(gone(*path, outcome=Outcome.LOST_TO_HOLE)) == counts
    assert counted(gone(*path, outcome=Outcome.STOPPED)) == 0


def test_a_rock_that_left_counts_unless_its_energy_does_not_lift_it_to_the_lowest_ground_of_the_area():
    low = ((0.0, 50.0, 0.0), (40.0, 50.0, -20.0))
    assert counted(gone(*low)) == 0
    assert counted(gone(*low, v=(0.0, -15.0, -12.0))) == 0, "369 / (2 g) is 18.8 m"
    assert counted(gone(*low, v=(0.0, -15.0, -13.0))) == 1, "394 / (2 g) is 20.1 m"
    assert counted(gone(*low, v=(0.0, -15.0, -12.0), spin=20.0)) == 1, "the spin adds 2 m"
    assert counted(gone(*low), lowest=-np.inf) == 1, "the ground of the area is not known"


def test_a_hole_of_an_area_is_not_the_area_and_a_displaced_path_must_have_reached_it_too():
    hole = np.array([[46.0, 40.0], [50.0, 40.0], [50.0, 60.0], [46.0, 60.0]])
    inside = gone((47.0, 50.0, 9.0), (49.0, 50.0, 0.0))
    assert (counted(inside), counted(inside, rings=(ROAD, hole))) == (0, 1)
    away = lambda batch: replace(batch, pieces=batch.pieces + 30.0)  # noqa: E731
    assert counted(inside, displace=away) == 1
    assert counted(gone((5.0, 50.0, 9.0), (9.0, 50.0, 0.0)), displace=away) == 1


def dump(is_cut):
    """Return the points (121, 121, 3) m of a dump, 40 m high, in a ring-shaped ditch that falls to the west.

    is_cut : whether the survey lacks the ground east of the dump
    """
    y, x = np.mgrid[-60:61, -60:61].astype(float)
    r, ditch = np.hypot(x, y), -25.0 * np.abs(np.arctan2(y, x))
    walls = [40.0 - r, 10.0 + (ditch - 10.0) * (r - 30.0) / 3.0, ditch, ditch + (20.0 - ditch) * (r - 37.0) / 4.0]
    points = np.stack([x, y, np.select([r < 30.0, r < 33.0, r < 37.0, r < 41.0], walls, 20.0)], axis=-1)
    if is_cut:
        points[(r > 29.5) & (x > 12.0)] = np.nan
    return points


SMOOTH = {"materials.default.friction_angle_deg": 10.0, "materials.default.tangential_restitution": 0.95}
WEST = np.array([[-44.0, -14.0], [-31.0, -14.0], [-31.0, 14.0], [-44.0, 14.0]])


def test_rocks_that_left_behind_a_dump_may_run_round_it_to_the_road():
    whole, cut = (
        last_answer(standing_over(dump(is_cut), **SMOOTH), [(18.0, 0.0, 22.5)], road=WEST) for is_cut in (False, True)
    )
    assert decided_on(whole).level > Level.NORMAL, "the ditch leads the rocks to the road"
    alert = decided_on(cut)
    assert cut.evidence[0].reached == 0 < cut.evidence[0].left
    assert alert.level == Level.FAULT
    assert any("left the terrain" in fault for fault in alert.faults), alert.faults


def test_the_lowest_ground_of_an_area_is_a_lower_bound_below_all_of_it():
    standing = standing_over(slope())
    across = np.array([[20.0, 20.0], [30.0, 20.0], [30.0, 30.0], [20.0, 30.0]])
    grounds = grounds_of(standing, standing.areas_with({"slope": [across], "road": [ROAD], "off": [across + 60.0]}))
    floor = -standing.ground.terrain.frame.origin[2]
    assert grounds["slope"].lowest == pytest.approx(10.0 + floor, abs=2.0)
    assert grounds["slope"].lowest <= 10.0 + floor
    assert floor - 2.0 < grounds["road"].lowest <= floor
    assert grounds["off"].lowest == -np.inf


def test_the_share_of_an_area_without_ground_is_that_of_its_surface_and_follows_the_ground():
    whole, cut = standing_over(slope()), standing_over(slope()[:, :47])
    hole = np.array([[45.0, 50.0], [51.0, 50.0], [51.0, 90.0], [45.0, 90.0]])
    thin = np.array([[47.0, 5.0], [47.001, 90.0], [47.0, 90.0]])
    areas = {"road": [ROAD], "ring": [ROAD, hole], "thin": [thin]}
    assert {ground.uncovered for ground in grounds_of(whole, whole.areas_with(areas)).values()} == {0.0}
    shares = {name: ground.uncovered for name, ground in grounds_of(cut, cut.areas_with(areas)).items()}
    assert shares["road"] == pytest.approx(6.0 / 8.0, abs=0.06)
    assert shares["ring"] == pytest.approx((6.0 * 156.0 - 5.0 * 40.0) / (8.0 * 156.0 - 6.0 * 40.0), abs=0.06)
    assert shares["thin"] == 1.0


MACHINES = [(float(x), float(y)) for x in (50, 60, 70) for y in range(10, 160, 20)]


def shares_of(standing, **areas):
    """Return the share without terrain of each area; areas : rings of the areas."""
    return {name: ground.uncovered for name, ground in grounds_of(standing, standing.areas_with(areas)).items()}


def box(west, south, east, north):
    return np.array([[west, south], [east, south], [east, north], [west, north]], dtype=float)


def test_one_machine_off_the_terrain_among_many_is_a_fault():
    standing = standing_over(slope())
    assert shares_of(standing, equipment=circles_around(np.array(MACHINES), 4.0)) == {"equipment": 0.0}
    lost = circles_around(np.array([*MACHINES, (-100.0, -100.0)]), 4.0)
    assert shares_of(standing, equipment=lost) == {"equipment": 1.0}
    alert = decided_on(last_answer(standing, [], rings=lost))
    assert alert.level == Level.FAULT
    assert any("or of one of its outlines, has no terrain" in fault for fault in alert.faults), alert.faults


def test_a_segment_of_a_road_counts_by_itself_once_most_of_it_has_no_terrain():
    standing = standing_over(slope()[:, :73])
    segments = [box(44.0, 2.0 + 7.0 * number, 52.0, 8.0 + 7.0 * number) for number in range(22)]
    assert shares_of(standing, road=[*segments, box(70.0, 2.0, 73.0, 8.0)])["road"] < 0.02, "a third of it"
    assert shares_of(standing, road=[*segments, box(69.0, 2.0, 77.0, 8.0)])["road"] == pytest.approx(0.62, abs=0.08)


def test_a_hole_of_an_area_needs_no_terrain_and_an_island_in_the_hole_does():
    points = slope()
    points[31:129, 46:70] = np.nan
    standing, loop, hole = standing_over(points), box(42.0, 10.0, 78.0, 150.0), box(45.0, 30.0, 71.0, 130.0)
    shares = shares_of(standing, loop=[loop, hole], island=[loop, hole, box(50.0, 70.0, 53.0, 73.0)])
    assert shares == {"loop": 0.0, "island": 1.0}
