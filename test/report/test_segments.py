"""Tests of energy and height at a place, from impacts: equal to those of paths, and exact for one parabola."""

import math
from pathlib import Path

import numpy as np
import pytest
from scenes.benches_fallen_from import fallen

from rpf3d_core.report.elements import Text, unbroken
from rpf3d_core.report.fences_part import fences_part
from rpf3d_core.report.passing import _reach, passing, places_beyond, segments_at
from rpf3d_core.report.run_files import ImpactRows, RunFiles, read_run
from rpf3d_core.report.segments import (
    IMPACTS,
    KEPT,
    Segments,
    _flights,
    _from_impacts,
    _from_paths,
    _to_the_ends,
    first_passages,
    largest_speeds_at_impacts,
    segments_of,
)
from rpf3d_core.report.toe import FAR, STEP, beyond_toe
from rpf3d_core.report.words import UNKNOWN, height, interval, kilojoules, metres
from rpf3d_core.runs.run import run_scene
from rpf3d_core.scene.key_paths import with_values
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.values import STANDARD_GRAVITY

BENCH = Path(__file__).parents[2] / "config" / "scenes" / "bench_15m.yaml"


@pytest.fixture
def one_friction(tmp_path: Path) -> Path:
    """Return the result folder of 128 rocks over ground with one friction angle.

    Over ground of unknown friction, two of 126 passages are at places where the speed is far from linear between two
    points of the path: there the path is off by up to 81 J.
    """
    scene = with_values(read_scene(BENCH), {"materials.default.friction_angle_deg": 30.0})
    run_scene(scene, tmp_path / "run", 128, "reference")
    return tmp_path / "run"


def test_a_table_keeps_a_number_and_its_unit_on_one_line() -> None:
    assert unbroken("172 kJ to 1,410 kJ") == "172\u00a0kJ to 1,410\u00a0kJ"
    assert unbroken("10 m high, 5 %, 3 m/s, 40 of 50") == "10\u00a0m high, 5\u00a0%, 3 m/s, 40 of 50"


def test_impacts_of_all_rocks_give_what_their_paths_give(one_friction: Path) -> None:
    run = read_run(one_friction)
    impacts, paths = _from_impacts(run), _from_paths(run)
    assert impacts is not None and impacts.source == IMPACTS and impacts.rocks == paths.rocks == 128
    beyond, compared = beyond_toe(run), 0
    for distance in (0.0, 5.0, 10.0, 20.0):
        rows, energy, over = passing(run, beyond, impacts, distance)
        same, on_path, over_path = passing(run, beyond, paths, distance)
        assert rows.tolist() == same.tolist()
        flies = over < FAR
        slides = np.isclose(over, 0.0, atol=0.01)
        # Between two points of a path, heights and speeds are linear. The arc of a small bounce rises over that line by
        # a few centimetres, and the path's energy is too large by as much potential energy.
        arc = over - over_path
        assert arc[flies].min() > -0.001 and arc[flies].max() < 0.04
        reach, along = _reach(run, beyond, distance)
        struck, struck_on_path = (
            largest_speeds_at_impacts(each, run.ends.release[:, :2], along, reach, STEP)[rows]
            for each in (impacts, paths)
        )
        np.testing.assert_allclose(struck, struck_on_path, rtol=1e-6, err_msg="both have the same recorded speeds")
        mass = run.ends.mass[rows]
        rest = np.maximum(on_path - STANDARD_GRAVITY * mass * arc, 0.5 * mass * struck_on_path**2)
        assert energy[flies & ~slides] == pytest.approx(rest[flies & ~slides], rel=0.01, abs=60.0)
        assert (energy >= 0.98 * np.where(flies, rest, on_path) - 60.0).all(), "a slide is never slower than it was"
        compared += int((flies & ~slides).sum())
    assert compared > 100


def test_all_kept_paths_are_preferred_and_impacts_stand_in_for_missing_ones(unknown_ground) -> None:
    run = read_run(unknown_ground)
    assert [each.source for each in segments_of(run)] == [KEPT]
    assert [each.source for each in segments_of(with_few_paths(run))] == [IMPACTS, KEPT]


def with_few_paths(run: RunFiles) -> RunFiles:
    """Return the result files with the paths of the first 25 rocks only."""
    starts = run.paths.starts[:26]
    return run._replace(paths=run.paths._replace(
        key=run.paths.key[:25], starts=starts, x=run.paths.x[: starts[-1]], speed=run.paths.speed[: starts[-1]],
    ))  # fmt: skip


def test_impacts_show_a_place_where_rocks_fly_although_they_slide_elsewhere(unknown_ground: Path) -> None:
    run = with_few_paths(read_run(unknown_ground))
    beyond = beyond_toe(run)
    impacts, kept = segments_of(run)

    def sources(choices: list[Segments]) -> list[str]:
        return [each.source for each in segments_at(run, beyond, choices, -10.0)]

    assert sources([impacts, kept]) == [IMPACTS, IMPACTS], "before the toe, all rocks fly"
    assert sources([kept]) == [KEPT, KEPT]
    here = slow_rocks(run, impacts, 1.0)
    assert (here.time > 0.0).mean() > 0.5, "most rocks fly elsewhere"
    assert sources([here, kept]) == [KEPT, KEPT]


def slow_rocks(run: RunFiles, impacts: Segments, share: float) -> Segments:
    """Return segments in which a share (-) of the rocks do not fly past the place 10 m before the toe."""
    reach, along = (each[impacts.row] for each in _reach(run, beyond_toe(run), -10.0))
    start = run.ends.release[impacts.row, :2]
    first, last = (((x[:, :2] - start) * along).sum(axis=1) for x in (impacts.begin, impacts.end))
    slow = (first < reach) & (last >= reach) & (impacts.row < share * len(run.ends.key))
    return impacts._replace(time=np.where(slow, np.nan, impacts.time))


@pytest.mark.parametrize(("share", "sources"), [(0.0, [IMPACTS, IMPACTS]), (0.08, [IMPACTS, KEPT]), (0.2, [KEPT] * 2)])
def test_a_place_with_some_slides_has_its_height_from_kept_paths(
    unknown_ground: Path, share: float, sources: list[str]
) -> None:
    """With 5 % of unknown heights, which count as larger than all others, the p95 height is unknown."""
    run = with_few_paths(read_run(unknown_ground))
    beyond = beyond_toe(run)
    impacts, kept = segments_of(run)
    choices = [slow_rocks(run, impacts, share), kept]
    place = next(iter(places_beyond(run, beyond._replace(toe=beyond.toe - 10.0), choices)))
    assert [place.source, place.height_source] == sources
    assert place.energy.value is not None and place.height.value is not None and place.height.value < FAR
    note = next(each.text for each in fences_part(run, [place], choices, beyond, [])
                if isinstance(each, Text) and each.text.startswith("Energies"))  # fmt: skip
    assert ("Heights for 0.0 m are from kept paths (25 of 128 rocks)" in note) == (share == 0.08)


def test_a_report_gives_the_true_reason_for_figures_from_kept_paths(unknown_ground: Path) -> None:
    run = with_few_paths(read_run(unknown_ground))
    beyond = beyond_toe(run)
    impacts, kept = segments_of(run)
    slides = impacts._replace(time=np.full(len(impacts.row), np.nan))

    def note(choices: list[Segments]) -> str:
        places = places_beyond(run, beyond, choices)
        found = [each.text for each in fences_part(run, places, choices, beyond, []) if isinstance(each, Text)]
        return next(text for text in found if text.startswith("Energies"))

    assert "from kept paths: 25 of 128 rocks. Kept paths are used where fewer than 90 %" in note([slides, kept])
    assert "result has no impacts (`outputs.impacts`)" in note([kept])
    assert "outputs" not in note([impacts, kept]) and "from impacts of all rocks: 128 of 128" in note([impacts, kept])
    away = np.linalg.norm((impacts.end - run.ends.release[impacts.row])[:, :2], axis=1)
    mixed = slides._replace(time=np.where(away < np.median(away), impacts.time, np.nan))
    assert {place.source for place in places_beyond(run, beyond, [mixed, kept])} == {IMPACTS, KEPT}
    assert "rocks), and for " in note([mixed, kept])


def test_a_flight_is_exact_between_its_ends() -> None:
    g, v0, time = 9.81, np.array([6.0, 0.0, 4.0]), 1.5
    end = v0 * time - [0.0, 0.0, 0.5 * g * time**2]
    landed = v0 - [0.0, 0.0, g * time]
    times, speeds = _flights(np.zeros((1, 3)), end[None], np.array([time]), np.array([np.linalg.norm(v0)]),
                             np.array([np.linalg.norm(landed)]), g)  # fmt: skip
    assert times.tolist() == [time]
    piece = Segments(row=np.zeros(1, dtype=int), begin=np.zeros((1, 3)), end=end[None], time=times, speed=speeds,
                     gravity=g, rocks=1, source=IMPACTS)  # fmt: skip
    for t in (0.3, 0.9, 1.4):
        found = first_passages(piece, np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.array([6.0 * t]))
        assert found.x[0] == pytest.approx(v0 * t - [0.0, 0.0, 0.5 * g * t**2])
        assert found.speed[0] == pytest.approx(np.linalg.norm(v0 - [0.0, 0.0, g * t]))


def test_a_slide_is_no_flight_and_its_height_is_not_known() -> None:
    times, speeds = _flights(np.zeros((1, 3)), np.array([[10.0, 0.0, -3.0]]), np.array([4.0]), np.array([2.0]),
                             np.array([5.0]), 9.81)  # fmt: skip
    assert math.isnan(times[0]) and speeds.tolist() == [[5.0, 5.0]]
    piece = Segments(row=np.zeros(1, dtype=int), begin=np.zeros((1, 3)), end=np.array([[10.0, 0.0, -3.0]]), time=times,
                     speed=speeds, gravity=9.81, rocks=1, source=IMPACTS)  # fmt: skip
    found = first_passages(piece, np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.array([5.0]))
    assert math.isnan(found.x[0, 2]) and found.speed.tolist() == [5.0]


def test_an_impact_at_the_end_of_a_slide_has_its_own_speeds() -> None:
    """The rock slides down a slope at up to 20 m/s, and is slow where it strikes the ground and where it stops."""
    struck = ImpactRows(row=np.zeros(2, dtype=int), t=np.array([0.0, 4.0]), x=np.array([[0.0, 0, 9], [10, 0, 0]]),
                        speed_in=np.array([20.0, 3.0]), speed_out=np.array([20.0, 2.0]))  # fmt: skip
    _, speed = _flights(struck.x[:1], struck.x[1:], np.array([4.0]), struck.speed_out[:1], struck.speed_in[1:], G)
    slide = Segments(row=np.zeros(1, dtype=int), begin=struck.x[:1], end=struck.x[1:], time=np.array([math.nan]),
                     speed=speed, gravity=G, rocks=1, source=IMPACTS, impacts=struck)  # fmt: skip
    assert speed.tolist() == [[20.0, 20.0]]

    def at(distance: float) -> list[float]:
        along = np.array([[1.0, 0.0]])
        return largest_speeds_at_impacts(slide, np.zeros((1, 2)), along, np.array([distance]), 0.25).tolist()

    assert at(10.0) == [3.0] and at(9.8) == [3.0] and at(0.1) == [20.0] and at(5.0) == [0.0]


G, V0 = 9.81, np.array([8.0, 0.0, 3.0])


def ended(on_ground: bool, impacts: bool, at: float = 0.0, max_speed: float = 20.0) -> Segments:
    """Return the way to the end of a rock that flies off the ground and ends after 1.2 s, at 9.6 m.

    impacts : True if it bounced at its release; at : s of this impact
    """
    run = fallen([9.6])
    end = V0 * 1.2 - [0.0, 0.0, 0.5 * G * 1.2**2]
    ends = run.ends._replace(
        release=np.zeros((1, 3)), end=end[None], t=np.array([1.2 + at]), on_ground=np.array([on_ground]),
        at_rest=np.array([on_ground]), max_speed=np.array([max_speed]),
    )  # fmt: skip
    one = np.zeros(1, dtype=int) if impacts else np.zeros(0, dtype=int)
    some = ImpactRows(row=one, t=np.full(len(one), at), x=np.zeros((len(one), 3)), speed_in=np.full(len(one), 9.0),
                      speed_out=np.full(len(one), np.linalg.norm(V0)))  # fmt: skip
    return _to_the_ends(ends, some, G)


def passed(segments: Segments, distance: float):
    return first_passages(segments, np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.array([distance]))


@pytest.mark.parametrize("at", [0.0, 3.0])
def test_a_rock_that_left_the_terrain_flies_to_its_end(at: float) -> None:
    found = passed(ended(on_ground=False, impacts=True, at=at), 4.0)
    assert found.x[0] == pytest.approx(V0 * 0.5 - [0.0, 0.0, 0.5 * G * 0.25]), "in mid-air, not on a straight line"
    assert found.speed[0] == pytest.approx(np.linalg.norm(V0 - [0.0, 0.0, G * 0.5]))


def test_a_rock_without_an_impact_is_not_missing() -> None:
    fastest = np.linalg.norm(V0 - [0.0, 0.0, G * 1.2])
    found = passed(ended(on_ground=False, impacts=False, max_speed=fastest), 4.0)
    assert found.x[0] == pytest.approx(V0 * 0.5 - [0.0, 0.0, 0.5 * G * 0.25])
    unknown = passed(ended(on_ground=False, impacts=False, max_speed=20.0), 4.0)
    assert math.isnan(unknown.x[0, 2]) and unknown.speed[0] == 20.0, "no flight has this largest speed"


def test_times_that_show_no_flight_are_on_the_safe_side() -> None:
    segments = ended(on_ground=False, impacts=True)
    run = fallen([9.6])
    ends = run.ends._replace(release=np.zeros((1, 3)), end=segments.end, t=np.array([math.nan]),
                             on_ground=np.array([False]))  # fmt: skip
    impacts = ImpactRows(row=np.zeros(1, dtype=int), t=np.zeros(1), x=np.zeros((1, 3)), speed_in=np.ones(1),
                         speed_out=np.ones(1))  # fmt: skip
    found = passed(_to_the_ends(ends, impacts, G), 4.0)
    assert math.isnan(found.x[0, 2]) and found.speed[0] == 20.0


def test_a_rock_that_stopped_is_on_the_ground_after_its_last_impact() -> None:
    found = passed(ended(on_ground=True, impacts=True), 4.8)
    assert found.x[0, 2] == pytest.approx(0.5 * (V0[2] * 1.2 - 0.5 * G * 1.2**2)), "half of the straight way"
    assert found.speed[0] == pytest.approx(np.linalg.norm(V0))


def test_unknown_ends_are_named() -> None:
    assert height(1e9) == UNKNOWN and metres(1e9) == "farther than known"
    assert interval((1.2, None), height) == "at least 1.2 m"
    assert interval((1.2, 1e9), height) == "at least 1.2 m"
    assert interval((1.2, 1e9), metres) == "1.2 m to farther than known"
    assert interval((0.0, None), height) == interval((0.04, 1e9), height) == UNKNOWN, "a height is never below 0"
    assert interval((0.0, None), kilojoules) == UNKNOWN, "an energy is never below 0"
    for end, words in ((None, "at least {} m"), (1e9, "{} m to farther than known")):
        assert interval((0.0, end), metres) == words.format("0.0"), "a rock may stop before the toe, at less than 0 m"
        assert interval((-0.5, end), metres) == words.format("-0.5")
    assert interval((None, 3.0), height) == "at most 3.0 m"
    assert interval((None, None), height) == UNKNOWN
    assert interval((1.0, 2.0), height) == "1.0 m to 2.0 m"


BREAKING = """
terrain: {benches: {}}
materials: {default: {normal_restitution: 0.4, tangential_restitution: 0.85, friction_angle_deg: 30}}
rock: {density: 2700, diameter: 1.0}
sources: [{name: top, zone: face_1, rocks: 12, above_ground: 6, velocity: [3, 0, 0]}]
effects: {fragmentation: {}}
outputs: {pictures: false, recording: false}
"""


def test_a_fragment_is_released_when_its_rock_breaks(tmp_path: Path) -> None:
    """With times from the release of the whole rock, the first flight of a fragment would be too long and too fast."""
    (tmp_path / "scene.yaml").write_text(BREAKING)
    run_scene(read_scene(tmp_path / "scene.yaml"), tmp_path / "run")
    run = read_run(tmp_path / "run")
    fragments = np.array([piece > 0 for _, _, piece in run.ends.key])
    assert (run.ends.since[fragments] > 0.0).all() and (run.ends.since[~fragments] == 0.0).all()
    segments = _from_impacts(run)
    assert segments is not None
    first = np.append(True, segments.row[1:] != segments.row[:-1]) & fragments[segments.row]
    assert first.sum() > 20
    fastest = run.ends.max_speed[segments.row[first]]
    assert (segments.speed[first].max(axis=1) <= 1.001 * fastest + 0.001).all()
