"""Tests that crests of surveys with noise are found along their whole length, in one piece, also at the top.

The tests share no code with the search for crests. A survey has rows of points along a profile of benches, moved by
noise in all directions; the true crests are known from the profile.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pytest

from rpf3d_core.imports.crests import Crest, crests_of, listed
from rpf3d_core.terrain.facets import Terrain

HEIGHT, BERM, FLOOR, LENGTH, RADIUS = 15.0, 8.0, 30.0, 150.0, 150.0
"""Height of a face, width of berms and floor, length of the wall, radius of a curved wall in front of it (m)."""
RUN = HEIGHT / math.tan(math.radians(70.0))
ROAD = 35.0
"""Width (m) of a road above the wall."""
NEAR = 1.5
"""Distance (m) in plan within which a found crest covers a point of a true crest."""


class Survey(NamedTuple):
    """A wall and its survey.

    noise : sd (m) in each direction; spacing : of points (m); behind : level ground (m) behind the top crest
    turn : of the wall in plan (rad); curved : whether the wall is curved in plan; benches : their number
    cut : height (m) of a cut in the soil behind a road of width ROAD above the wall; 0 for none
    """

    noise: float = 0.1
    spacing: float = 1.0
    benches: int = 3
    behind: float = 20.0
    curved: bool = False
    turn: float = 0.5
    cut: float = 0.0


def profile(survey: Survey) -> np.ndarray:
    """Return the profile (P, 2) m: horizontal distance from the top crest and height, every `spacing` and at edges."""
    top = survey.benches * HEIGHT
    corners = [(-survey.behind, top), (0.0, top)]
    if survey.cut:
        cut = [(-ROAD - 1.5 - survey.behind, top + survey.cut), (-ROAD - 1.5, top + survey.cut), (-ROAD, top)]
        corners[:1] = cut
    for below in range(survey.benches)[::-1]:
        corners.append((corners[-1][0] + RUN, below * HEIGHT))
        corners.append((corners[-1][0] + (BERM if below else FLOOR), below * HEIGHT))
    points = []
    for one, other in zip(np.array(corners[:-1]), np.array(corners[1:]), strict=True):
        count = max(1, round(float(np.hypot(*(other - one))) / survey.spacing))
        points.append(one + np.arange(count)[:, None] / count * (other - one))
    return np.vstack([*points, corners[-1:]])


def placed(survey: Survey, along: np.ndarray, down: np.ndarray, height: np.ndarray) -> np.ndarray:
    """Return points (..., 3) m of the wall, which is straight or curves around a pit, turned by `turn`.

    along, down, height : (...) m, along the wall, away from the top crest, and up
    """
    out = RADIUS - down
    plan = (out * np.cos(along / RADIUS), out * np.sin(along / RADIUS)) if survey.curved else (along, -down)
    cosine, sine = math.cos(survey.turn), math.sin(survey.turn)
    return np.stack([cosine * plan[0] - sine * plan[1], sine * plan[0] + cosine * plan[1], height], axis=-1)


def wall(survey: Survey) -> Terrain:
    rows = profile(survey)
    u = np.linspace(0.0, LENGTH, round(LENGTH / survey.spacing) + 1)
    along, down = np.meshgrid(u, rows[:, 0], indexing="ij")
    points = placed(survey, along, down, np.broadcast_to(rows[:, 1], along.shape))
    points = points + np.random.default_rng(1).normal(0.0, survey.noise, points.shape)
    number = np.arange(along.size).reshape(along.shape)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    halves = np.concatenate([np.stack(half, -1).reshape(-1, 3) for half in ((a, c, b), (a, d, c))]).astype(np.int32)
    if survey.curved:
        halves = halves[:, ::-1]
    return Terrain(points.reshape(-1, 3), np.ascontiguousarray(halves), np.zeros(len(halves), np.int32), ("wall",))


def true_crests(survey: Survey) -> list[np.ndarray]:
    """Return the plan (N, 2) m of each true crest, the top one first, with points every 0.5 m."""
    u = np.arange(0.0, LENGTH + 0.1, 0.5)
    return [placed(survey, u, np.full_like(u, i * (RUN + BERM)), u)[:, :2] for i in range(survey.benches)]


def every_half_metre(crest: Crest) -> np.ndarray:
    plan = crest.points[:, :2]
    places = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(plan, axis=0).T))])
    at = np.arange(0.0, places[-1], 0.5)
    return np.column_stack([np.interp(at, places, plan[:, 0]), np.interp(at, places, plan[:, 1])])


def covered(points: np.ndarray, by: np.ndarray) -> float:
    """Return the share (-) of points (N, 2) m that have a point of `by` (M, 2) m within NEAR."""
    return float(np.mean([(np.hypot(*(by - point).T) <= NEAR).any() for point in points]))


def shares(survey: Survey, crests: Sequence[Crest]) -> tuple[list[float], float]:
    """Return the share (-) of each true crest that found crests cover, and the share of these on true crests."""
    found, true = np.vstack([every_half_metre(crest) for crest in crests]), true_crests(survey)
    return [covered(crest, found) for crest in true], covered(found, np.vstack(true))


@pytest.mark.parametrize("curved", [False, True])
@pytest.mark.parametrize(
    ("noise", "spacing"), [(0.0, 1.0), (0.05, 0.5), (0.1, 1.0), (0.2, 2.0), (0.3, 1.0), (0.3, 3.0)]
)
def test_each_crest_of_a_noisy_wall_is_one_candidate_along_its_whole_length(
    noise: float, spacing: float, curved: bool
) -> None:
    survey = Survey(noise=noise, spacing=spacing, curved=curved)
    crests = crests_of(wall(survey))
    assert len(crests) == survey.benches
    each, right = shares(survey, crests)
    assert min(each) > 0.95
    assert right > 0.97


def test_much_noise_on_close_points_leaves_crests_whole() -> None:
    """Noise of 0.3 m on points 0.5 m apart causes facets of 45 degrees on level ground, and overhangs on faces."""
    survey = Survey(noise=0.3, spacing=0.5)
    crests = crests_of(wall(survey))
    assert len(crests) == 3
    each, right = shares(survey, crests)
    assert min(each) > 0.85 and right > 0.9


@pytest.mark.parametrize("behind", [1.5, 4.0])
def test_the_top_crest_is_found_before_narrow_ground(behind: float) -> None:
    survey = Survey(noise=0.1, behind=behind, turn=1.1)
    each, _ = shares(survey, crests_of(wall(survey)))
    assert each[0] > 0.95


def test_the_edge_of_a_survey_without_ground_behind_is_no_crest() -> None:
    survey = Survey(noise=0.0, behind=0.3)
    each, _ = shares(survey, crests_of(wall(survey)))
    assert each[0] == 0.0 and min(each[1:]) > 0.95


@pytest.mark.parametrize("noise", [0.05, 0.3])
def test_one_bench_has_one_crest(noise: float) -> None:
    survey = Survey(noise=noise, benches=1)
    (crest,) = crests_of(wall(survey))
    assert shares(survey, [crest])[0][0] > 0.95
    assert crest.height == pytest.approx(HEIGHT, abs=1.0)


def test_the_highest_crest_is_listed_among_larger_ones() -> None:
    def crest(height: float, z: float) -> Crest:
        return Crest(points=np.array([[0.0, 0.0, z], [50.0, 0.0, z]]), length=50.0, height=height, fall=height)

    found = [*(crest(20.0 + i, 100.0 - i) for i in range(6)), crest(5.0, 300.0)]
    assert [each.height for each in listed(found, 3)] == [25.0, 24.0, 5.0]
    assert [each.height for each in listed(found, 7)] == [25.0, 24.0, 23.0, 22.0, 21.0, 20.0, 5.0]
    assert listed([], 3) == []


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_the_first_crest_is_that_of_the_longest_fall_and_each_has_its_fall(noise: float) -> None:
    crests = crests_of(wall(Survey(noise=noise)))
    assert np.median(crests[0].points[:, 2]) == pytest.approx(3 * HEIGHT, abs=2.0)
    assert sorted(crest.fall for crest in crests) == pytest.approx([HEIGHT, 2 * HEIGHT, 3 * HEIGHT], abs=2.0)


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_the_crest_of_a_cut_behind_a_road_is_not_the_first(noise: float) -> None:
    """The line from the cut to the toe of the wall is steep enough, but the road between them stops the rocks."""
    crests = crests_of(wall(Survey(noise=noise, benches=4, cut=4.0)))
    assert np.median(crests[0].points[:, 2]) == pytest.approx(4 * HEIGHT, abs=1.5)
    assert crests[0].fall == pytest.approx(4 * HEIGHT, abs=2.0)
    (cut,) = (crest for crest in crests if crest.points[:, 2].mean() > 4 * HEIGHT + 2.0)
    assert cut.fall == pytest.approx(4.0, abs=1.5)


def test_a_deep_spike_of_the_survey_does_not_change_the_falls() -> None:
    terrain = wall(Survey())
    terrain.vertices[:, 2][np.argmin(np.hypot(*terrain.vertices[:, :2].T))] -= 20_000.0
    falls = sorted(crest.fall for crest in crests_of(terrain))
    assert falls == pytest.approx([HEIGHT, 2 * HEIGHT, 3 * HEIGHT], abs=2.0)


def test_a_short_crest_is_not_the_first_although_its_fall_is_the_longest() -> None:
    def crest(length: float, fall: float) -> Crest:
        return Crest(points=np.array([[0.0, 0.0, fall], [length, 0.0, fall]]), length=length, height=10.0, fall=fall)

    found = [crest(300.0, 50.0), crest(20.0, 120.0), crest(80.0, 115.0), crest(90.0, 115.3)]
    assert [each.length for each in listed(found, 4)] == [90.0, 300.0, 80.0, 20.0]
    assert [each.length for each in listed(found[1:2], 2)] == [20.0], "there is no longer one"
