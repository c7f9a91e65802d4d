"""Rocks that leave the survey before a road, and a road without survey: the level is a fault, not normal."""

import numpy as np
import pytest
from watched_road import ON_THE_SLOPE, ROAD, decided_on, last_answer, road_site, slope, standing_over

from rpf3d_core.alerts.levels import Level
from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.live.areas import outlines_for_places
from rpf3d_core.live.coverage import uncovered_shares
from rpf3d_core.live.leaving import left_ahead_of
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
    "a strip of holes before the road": (strip_before_the_road, "on the way to the area"),
    "a hole before the road": (hole_before_the_road, "on the way to the area"),
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


def ended(release, end, outcome=Outcome.LEFT_TERRAIN):
    """A rock that was released and ended at places in plan."""
    one, x = np.zeros(1), np.array([[*end, 0.0]])
    whole = np.zeros(1, dtype=np.int64)
    return Deposits(
        source=whole, rock=whole, outcome=np.array([outcome]), facet=whole, release=np.array([[*release, 0.0]]), x=x,
        t=one, path=one, impacts=whole, max_speed=one, max_energy=one, max_height=one, ground_speed=one, mass=one,
    )  # fmt: skip


@pytest.mark.parametrize(("release", "end", "counts"), [
    ((0.0, 50.0), (40.0, 50.0), 1),
    ((0.0, 50.0), (48.0, 50.0), 0),
    ((0.0, 50.0), (60.0, 50.0), 0),
    ((60.0, 50.0), (70.0, 50.0), 0),
    ((60.0, 50.0), (60.0, 50.0), 1),
    ((20.0, 50.0), (20.0, 170.0), 0),
    ((20.0, 50.0), (21.0, 5.0), 1),
])  # fmt: skip
def test_a_rock_that_left_counts_unless_it_was_in_the_road_or_had_it_behind(release, end, counts):
    areas = outlines_for_places({"road": [ROAD]})
    assert left_ahead_of(ended(release, end), areas).tolist() == [counts]
    assert left_ahead_of(ended(release, end, Outcome.STOPPED), areas).tolist() == [0]


def test_the_share_of_an_area_without_ground_is_that_of_its_surface_and_follows_the_ground():
    whole, cut = standing_over(slope()), standing_over(slope()[:, :47])
    hole = np.array([[45.0, 50.0], [51.0, 50.0], [51.0, 90.0], [45.0, 90.0]])
    thin = np.array([[47.0, 5.0], [47.001, 90.0], [47.0, 90.0]])
    areas = {"road": [ROAD], "ring": [ROAD, hole], "thin": [thin]}
    assert set(uncovered_shares(whole, whole.areas_with(areas)).values()) == {0.0}
    shares = uncovered_shares(cut, cut.areas_with(areas))
    assert shares["road"] == pytest.approx(6.0 / 8.0, abs=0.06)
    assert shares["ring"] == pytest.approx((6.0 * 156.0 - 5.0 * 40.0) / (8.0 * 156.0 - 6.0 * 40.0), abs=0.06)
    assert shares["thin"] == 1.0
