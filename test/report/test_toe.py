"""Tests of distances beyond the toe and of passages there, with known stops on a bench of known shape."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scenes.benches_fallen_from import HEIGHT, TOE, fallen, thrown

from rpf3d_core.report import toe
from rpf3d_core.report.passing import never_rising, passing, places_beyond, places_for, shares_beyond
from rpf3d_core.report.run_files import KeptPaths, _sets
from rpf3d_core.report.section import critical_section
from rpf3d_core.report.section_part import words_on_obliquity
from rpf3d_core.report.segments import KEPT, segments_of
from rpf3d_core.report.toe import BEYOND, FAR, beyond_toe, held_beyond
from rpf3d_core.report.words import FARTHER, UNKNOWN, interval, metres
from rpf3d_core.terrain.faces import foot_of_face
from rpf3d_core.terrain.height_image import height_image, heights_at
from rpf3d_core.unknowns.dealing import set_of_rock

STEP = 0.25
"""Largest error (m) of the found toe: the step of the search along a line."""


def test_heights_are_those_of_the_planes_of_the_bench() -> None:
    run = fallen([20.0])
    plan = np.array([(-5.0, 1.0), (0.5 * TOE, 2.0), (30.0, -3.0), (1e4, 0.0)])
    image = height_image(run.terrain, plan[:3], 5.0)
    assert heights_at(image, plan[:3]) == pytest.approx([HEIGHT, 0.5 * HEIGHT, 0.0], abs=1e-9)
    assert math.isnan(heights_at(image, plan)[3])


def test_the_toe_is_the_foot_of_the_face() -> None:
    beyond = beyond_toe(fallen(np.linspace(10.0, 60.0, 101)))
    assert beyond.toe == pytest.approx(np.full(101, TOE), abs=STEP)
    assert beyond.distance == pytest.approx(np.linspace(10.0, 60.0, 101) - TOE, abs=STEP)


def test_a_bump_on_the_crest_is_not_the_face() -> None:
    run = fallen(np.full(5, 30.0))
    bump = np.array(
        [(x, y, z) for x, z in ((-4.0, HEIGHT), (-3.5, HEIGHT + 0.5), (-3.1, HEIGHT)) for y in (-50.0, 50.0)]
    )
    triangles = np.array([(0, 2, 3), (0, 3, 1), (2, 4, 5), (2, 5, 3)], dtype=np.int32) + len(run.terrain.vertices)
    terrain = replace(run.terrain, vertices=np.concatenate([run.terrain.vertices, bump]),
                      triangles=np.concatenate([run.terrain.triangles, triangles]),
                      zone=np.zeros(10, dtype=np.int32))  # fmt: skip
    behind = run.ends._replace(release=run.ends.release - (5.0, 0.0, 0.0), runout=run.ends.runout + 5.0)
    beyond = beyond_toe(run._replace(terrain=terrain, ends=behind))
    assert beyond.toe == pytest.approx(np.full(5, TOE + 5.0), abs=STEP)


def test_far_rocks_do_not_make_the_toe_coarse() -> None:
    runouts = np.linspace(100.0, 190.0, 50)
    beyond = beyond_toe(fallen(runouts))
    assert beyond.distance == pytest.approx(runouts - TOE, abs=STEP)


def test_a_face_far_from_the_release_is_found() -> None:
    run = fallen(np.full(5, 100.0))
    behind = run.ends._replace(release=run.ends.release - (19.0, 0.0, 0.0), runout=run.ends.runout + 19.0)
    run = run._replace(ends=behind)
    for near in (1.0, 19.0, 20.0, 23.0, 25.0, 50.0):
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(toe, "NEAR", near)
            assert beyond_toe(run).toe == pytest.approx(np.full(5, TOE + 19.0), abs=STEP)


def test_a_rock_that_stays_on_the_face_is_before_the_toe() -> None:
    beyond = beyond_toe(fallen([2.0, *[30.0] * 20]))
    assert beyond.distance[0] == pytest.approx(2.0 - TOE, abs=STEP)


@pytest.mark.parametrize(
    ("ground", "foot"),
    [
        ([10, 10, 5, 0, 0, 0, 0], 3.0),  # one face
        ([10, 10, 5, 4.9, 0, 0, 0], 4.0),  # a ledge of a metre is part of the face
        ([10, 10, 5, 4.9, 4.8, 4.7, 0], 2.0),  # a wider one ends it
        ([10.3, 8.5, 8.4, 8.3, 8.2, 2.0, 0, 0], 6.0),  # a pebble before the face is no face
        ([10, 8, 7.9, 7.8, 7.7, 5.7, 5.7], math.nan),  # two steps, neither of them 3 m high
        ([10, 8, 7.9, 5.9, 5.9, 5.9, 5.9], 3.0),  # one face of two steps
        ([10, 10, 10, 10, 10, 10, 10], math.nan),
        ([10, 10, 10, 10, 10, 5, 0], math.nan),  # the line ends on the face
        ([10, 10, math.nan, 0, 0, 0, 0], math.nan),  # a hole hides it
    ],
)
def test_the_foot_of_a_face_is_where_flat_ground_begins(ground: list[float], foot: float) -> None:
    found = foot_of_face(np.arange(float(len(ground))), np.array(ground, dtype=float))
    assert math.isnan(found) if math.isnan(foot) else found == foot


def test_ninety_percent_stop_within_the_ninetieth_percentile() -> None:
    runouts = np.linspace(10.0, 110.0, 1001)
    beyond = beyond_toe(fallen(runouts))
    figure = held_beyond(beyond, 0, 90)
    assert figure.value == pytest.approx(100.0 - TOE, abs=STEP)
    assert figure.sampling is not None and figure.predictive is None
    low, high = figure.sampling
    assert low < figure.value < high and high - low == pytest.approx(2 * 1.96 * math.sqrt(0.09 / 1001) * 100.0, rel=0.1)


def test_rocks_that_did_not_stop_are_farther_than_all_others() -> None:
    at_rest = np.arange(1000) >= 150  # 15 % left the terrain
    beyond = beyond_toe(fallen(np.full(1000, 20.0), at_rest))
    assert np.count_nonzero(beyond.distance == BEYOND) == 150
    figure = held_beyond(beyond, 0, 90)
    assert figure.value is not None and figure.value > FAR
    assert metres(figure.value) == FARTHER
    assert [interval(ends, metres) for ends in ((BEYOND, BEYOND), (41.26, BEYOND), (None, BEYOND))] == [
        FARTHER, "41.2 m to farther than known", UNKNOWN,
    ]  # fmt: skip
    inner = held_beyond(beyond, 0, 75).value
    assert inner == pytest.approx(20.0 - TOE, abs=STEP)


def test_the_predictive_interval_holds_the_differences_between_sets() -> None:
    sets, each = 64, 50
    reach = np.linspace(10.0, 100.0, sets)  # each set stops its rocks elsewhere
    run = fallen(np.tile(reach, each), sets=sets)
    beyond = beyond_toe(run)
    figure = held_beyond(beyond, sets, 90)
    assert figure.sampling is not None and figure.predictive is not None
    assert figure.predictive[0] < 13.0 and figure.predictive[1] > 90.0 - TOE
    assert figure.predictive[1] - figure.predictive[0] > 5 * (figure.sampling[1] - figure.sampling[0])
    share = shares_beyond(beyond, sets, np.array([40.0]))[0]
    assert share.predictive is not None and share.sampling is not None
    assert share.predictive[0] <= share.sampling[0] and share.predictive[1] >= share.sampling[1]
    assert share.predictive == pytest.approx((0.0, 1.0), abs=0.05)


def test_lengths_have_three_significant_figures_and_at_most_one_decimal() -> None:
    assert [metres(value) for value in (0.0, 4.26, 41.26, 221.14, 1234.0)] == [
        "0.0 m", "4.3 m", "41.3 m", "221 m", "1,230 m",
    ]  # fmt: skip
    assert interval((99.96, 356.49), metres) == "99.9 m to 357 m"


def test_too_few_rocks_in_each_set_give_no_predictive_interval() -> None:
    run = fallen(np.linspace(10.0, 60.0, 128), sets=64)
    beyond = beyond_toe(run)
    assert held_beyond(beyond, 64, 90).predictive is None
    assert interval(None, metres) == UNKNOWN


def test_few_rocks_with_a_toe_say_nothing_about_the_others() -> None:
    """If only a few rocks of a run have a toe, the distance that holds 90 % of all rocks is unknown."""
    beyond = beyond_toe(fallen(np.linspace(10.0, 60.0, 101)))
    assert beyond.of == 101 and held_beyond(beyond, 0, 90).value is not None
    for few, of in ((6, 6400), (19, 101), (101, 6400), (0, 5)):
        some = beyond._replace(rows=beyond.rows[:few], distance=beyond.distance[:few], of=of)
        assert held_beyond(some, 0, 90) == (None, None, None), (few, of)
    assert held_beyond(beyond._replace(of=2000), 0, 90).value is not None


@pytest.mark.parametrize("seed", range(10))
def test_no_interval_of_a_share_beyond_rises_with_the_distance(seed: int) -> None:
    """Some sets of random rocks go far, the others do not; few rocks of each set reach the last distances."""
    rng = np.random.default_rng(seed)
    sets, rocks = 64, int(rng.integers(5, 50))
    farther = rng.exponential(np.where(rng.random(sets) < rng.random(), 5.0, 1.0), (rocks, sets)).T
    beyond = beyond_toe(fallen(TOE + 1.0 + farther.ravel()))
    number = np.repeat(np.arange(sets), rocks)[beyond.rows]
    beyond = beyond._replace(set=number, shift=rng.normal(size=len(number)))
    shares = shares_beyond(beyond, sets, np.linspace(-2.0, 40.0, 100))
    assert (np.diff([share.predictive for share in shares], axis=0) <= 0.0).all()


def test_ends_are_only_widened_and_unknown_ends_stay_unknown() -> None:
    low, high = never_rising(np.array([0.5, 0.2, np.nan, 0.3, 0.0]), np.array([0.8, 0.4, np.nan, 0.6, 0.1]))
    assert low == pytest.approx([0.5, 0.2, np.nan, 0.2, 0.0], nan_ok=True)
    assert high == pytest.approx([0.8, 0.6, np.nan, 0.6, 0.1], nan_ok=True)


def test_shares_beyond_count_the_rocks() -> None:
    beyond = beyond_toe(fallen(TOE + np.linspace(0.5, 99.5, 100)))
    shares = shares_beyond(beyond, 0, np.array([-1.0, 30.0, 80.0, 300.0]))
    assert [share.value for share in shares] == pytest.approx([1.0, 0.7, 0.2, 0.0], abs=0.011)
    for share in shares:
        assert share.sampling is not None and share.sampling[0] <= share.value <= share.sampling[1]


def test_energy_and_height_at_a_fence_are_those_of_the_path() -> None:
    run = thrown(fallen(np.full(40, 60.0)), speed=12.0, height=2.5)
    (segments,), beyond = segments_of(run), beyond_toe(run)
    assert (segments.source, segments.rocks) == (KEPT, 40)
    rows, energy, height = passing(run, beyond, segments, 20.0)
    assert rows.tolist() == list(range(40))
    assert energy == pytest.approx(np.full(40, 0.5 * 1000.0 * 12.0**2))
    assert height == pytest.approx(np.full(40, 2.5))
    assert len(passing(run, beyond, segments, 90.0)[0]) == 0, "no rock comes there"


@pytest.mark.parametrize("before", [0.2, -0.2])
def test_an_impact_at_the_toe_counts_with_the_larger_energy(before: float) -> None:
    """The place of the toe is accurate to 0.25 m, and most of the energy is lost in the impact."""
    run = fallen(np.full(40, 60.0))
    start, end = run.ends.release[:, None], run.ends.end[:, None]
    struck = start + (TOE - before) / 60.0 * (end - start)
    points = np.concatenate([start, struck, struck, end], axis=1)
    paths = KeptPaths(
        key=run.ends.key, starts=4 * np.arange(41), x=points.reshape(-1, 3), speed=np.tile([20.0, 20.0, 5.0, 5.0], 40)
    )
    run = run._replace(paths=paths)
    (segments,), beyond = segments_of(run), beyond_toe(run)
    beyond = beyond._replace(toe=np.full(40, TOE))
    for distance, speed in ((0.0, 20.0), (0.6, 5.0)):
        _, energy, _ = passing(run, beyond, segments, distance)
        assert energy == pytest.approx(0.5 * run.ends.mass * speed**2)


def test_a_fence_that_few_rocks_reach_has_no_figures() -> None:
    run = thrown(fallen([*[15.0] * 95, *[60.0] * 5]), speed=12.0, height=2.5)
    places = places_beyond(run, beyond_toe(run), segments_of(run))
    assert places[0].energy.value == pytest.approx(72_000.0) and places[0].crossed == 100
    far = next(place for place in places if place.distance >= 15.0)
    assert far.crossed == 5 and far.energy.value is None and far.height.value is None
    assert far.passed.value == pytest.approx(0.05)


def test_places_of_fences_are_round_and_few() -> None:
    distances = places_for(beyond_toe(fallen(np.linspace(10.0, 150.0, 500))))
    assert distances[0] == 0.0 and len(distances) <= 9
    assert np.unique(np.diff(distances)) == pytest.approx([20.0])


def test_without_a_face_there_is_no_toe() -> None:
    run = fallen(np.full(10, 15.0))
    floor = run.ends._replace(
        release=run.ends.release + np.array([50.0, 0.0, 0.0]), end=run.ends.end + np.array([50.0, 0.0, 0.0])
    )
    assert len(beyond_toe(run._replace(ends=floor)).rows) == 0


def test_the_critical_section_has_the_profile_of_the_bench() -> None:
    section = critical_section(thrown(fallen(np.linspace(10.0, 80.0, 50)), speed=5.0, height=1.0))
    assert section is not None
    assert section.runout == 80.0 and section.azimuth == pytest.approx(90.0)
    assert section.toe == pytest.approx(TOE, abs=STEP)
    assert np.nanmax(section.ground) == pytest.approx(HEIGHT) and np.nanmin(section.ground) == pytest.approx(0.0)
    assert section.paths and max(np.nanmax(path[:, 0]) for path in section.paths) == pytest.approx(80.0)


@pytest.mark.parametrize(("aside", "oblique"), [(0.0, 0.0), (40.0, 53.13)])
def test_a_section_that_crosses_the_face_at_an_angle_knows_it(aside: float, oblique: float) -> None:
    """All rocks end `aside` m to the side of the line of fall, 30 m from the crest; the ground falls to the east."""
    run = fallen(np.full(50, 30.0))
    end = run.ends.end + np.array([0.0, aside, 0.0])
    ends = run.ends._replace(end=end, runout=np.full(50, math.hypot(30.0, aside)))
    section = critical_section(run._replace(ends=ends))
    assert section is not None
    assert section.downhill == pytest.approx(90.0, abs=0.1)
    assert section.obliquity == pytest.approx(oblique, abs=0.1)
    assert ("faces fall towards 90 degrees" in words_on_obliquity(section)) == (oblique > 0.0)


def test_the_direction_of_faces_is_that_of_the_faces_that_the_section_crosses() -> None:
    """A slope of 40 degrees has no face. A wall 40 m to the side of the section does not count."""
    x, y = np.array([0.0, 60.0]), np.array([-20.0, 40.0, 60.0])
    height = np.array([[50.0, 50.0, 150.0], [0.0, 0.0, 100.0]])
    vertices = np.array([(x[i], y[j], height[i, j]) for i in range(2) for j in range(3)])
    triangles = np.array([(0, 3, 1), (3, 4, 1), (1, 4, 2), (4, 5, 2)], dtype=np.int32)
    run = fallen(np.full(50, 50.0))
    slope = replace(run.terrain, vertices=vertices, triangles=triangles, zone=np.zeros(4, dtype=np.int32))
    section = critical_section(run._replace(terrain=slope))
    assert section is not None and math.isnan(section.downhill) and math.isnan(section.obliquity)
    assert words_on_obliquity(section) == ""


def test_rocks_belong_to_the_sets_that_the_run_dealt() -> None:
    rocks = np.arange(500)
    source = rocks % 3
    found = _sets(source, rocks, 64)
    assert found.tolist() == [set_of_rock(int(rock), 64, int(s)) for rock, s in zip(rocks, source, strict=True)]
