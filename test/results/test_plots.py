"""Tests that pictures are made from the right numbers and show them."""

import csv
import re
from dataclasses import replace

import numpy as np
import pytest
from flights.flights_on_a_floor import FRAMES, SIDE, SOURCES, SURVEY, UNMOVED, floor, none_thrown, thrown
from matplotlib.image import imread

from rpf3d_core.ensemble.colours import OUTCOME_COLOURS, zone_colours
from rpf3d_core.ensemble.paths import sample_paths
from rpf3d_core.results.plots import hazard as plots_hazard
from rpf3d_core.results.plots import map as plots_map
from rpf3d_core.results.plots import profiles as plots_profiles
from rpf3d_core.results.plots.map import rocks_window, write_map
from rpf3d_core.results.plots.path_profiles import profile_of, terrain_below, typical_rows
from rpf3d_core.results.plots.profiles import write_profile_plots
from rpf3d_core.results.plots.shading import shaded
from rpf3d_core.results.plots.sheet import MOST_RELEASES, round_length, starts_of, whole_window
from rpf3d_core.results.plots.style import RESOLUTION
from rpf3d_core.results.shown import MapContent, RunCounts
from rpf3d_core.results.tables import runout
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.plan_view import Window, seen_from_above
from rpf3d_core.values import STANDARD_GRAVITY, Outcome

ROUNDING = 1e-9
"""Largest rounding error (m) of survey coordinates of 4.5e6 m in float64."""

LEGEND_INCHES = 3
"""Width (inches) of the map's column for the legend."""

MARKER_PIXELS = 8
"""Least number of pixels in a marker's colour: it is 7 pixels wide, with a white border and smoothed edges."""

SAME_COLOUR = 2
"""Largest error of a colour component, in steps of 1/255, after conversions to and from floats."""


ALL = RunCounts(6, 6, {Outcome.STOPPED: 5, Outcome.LEFT_TERRAIN: 1})
"""Counts of the rocks of `thrown`."""
PARTIAL = RunCounts(6000, 8000, {Outcome.STOPPED: 5584, Outcome.LEFT_TERRAIN: 415, Outcome.FAILED: 1})
"""Counts of many rocks, of which only those of `thrown` are drawn."""


def texts(legend) -> list[str]:
    return [text.get_text() for text in legend.get_texts()]


@pytest.fixture
def figures(monkeypatch):
    """Return a dictionary that collects the saved figures by file name, instead of files."""
    saved = {}
    for module in (plots_map, plots_profiles, plots_hazard):
        monkeypatch.setattr(module, "save", lambda figure, path: saved.update({path.name: figure}))
    return saved


def stairs() -> Terrain:
    """Return two level areas; the eastern one is 3 m higher and extends 2 m over the western one."""
    low = [(0, 0, 0), (10, 0, 0), (10, 10, 0), (0, 10, 0)]
    high = [(8, 0, 3), (20, 0, 3), (20, 10, 3), (8, 10, 3)]
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]], dtype=np.int32)
    return Terrain(np.array(low + high, float), triangles, np.array([0, 0, 1, 1], np.int32), ("floor", "bench_1"))


def lines_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def pixels_like(picture, colour):
    return int((np.abs(picture[..., :3] * 255 - colour) <= SAME_COLOUR).all(axis=-1).sum())


def test_a_pixel_shows_the_uppermost_facet_below_its_centre():
    view = seen_from_above(stairs(), Window(0, 20, 0, 10), pixels=40)
    assert view.facet.shape == (20, 40)
    x, y = np.meshgrid(np.arange(0.25, 20, 0.5), np.arange(0.25, 10, 0.5))
    on_high = np.where(y * 12 < (x - 8) * 10, 2, 3)
    on_low = np.where(y < x, 0, 1)
    expected = np.where(x > 8, on_high, on_low)
    on_a_diagonal = np.isclose(y * 12, (x - 8) * 10) | np.isclose(x, y)
    assert np.all((view.facet == expected) | on_a_diagonal)


def test_facets_smaller_than_a_pixel_and_vertical_ones_are_no_trouble():
    terrain = floor(cells=120)
    wall = np.array([[0, 1, len(terrain.vertices)]], dtype=np.int32)
    vertices = np.vstack([terrain.vertices, terrain.vertices[0] + (0, 0.1, 5)])
    vertices[-1, :2] = vertices[0, :2]
    both = Terrain(vertices, np.vstack([terrain.triangles, wall]), np.append(terrain.zone, 0), terrain.zones)
    view = seen_from_above(both, whole_window(both), pixels=50)
    assert (view.facet >= 0).all()
    assert len(terrain.triangles) not in view.facet


def test_what_is_not_terrain_is_clear():
    picture = shaded(stairs(), seen_from_above(stairs(), Window(-5, 20, 0, 10), pixels=50))
    assert (picture[:, :10, 3] == 0).all() and (picture[:, 10:, 3] == 255).all()


def test_level_ground_has_the_plain_colour_of_its_zone():
    picture = shaded(stairs(), seen_from_above(stairs(), Window(0, 20, 0, 10), pixels=40))
    colours = zone_colours(("floor", "bench_1")).astype(int)
    assert np.abs(picture[10, 2, :3].astype(int) - colours[0]).max() <= SAME_COLOUR
    assert np.abs(picture[10, 30, :3].astype(int) - colours[1]).max() <= SAME_COLOUR


def test_terrain_below_a_point_is_the_first_one_down_from_it():
    points = np.array([[9.0, 5.0, 9.0], [9.0, 5.0, 1.0], [4.0, 5.0, 0.0], [19.0, 5.0, 3.0], [30.0, 5.0, 3.0]])
    np.testing.assert_allclose(terrain_below(stairs(), points), [3.0, 0.0, 0.0, 3.0, np.nan], atol=ROUNDING)


def test_terrain_below_a_point_on_an_edge_is_known():
    """Without a tolerance, rounding makes some lines pass between both facets of an edge."""
    rng = np.random.default_rng(1)
    terrain = floor(cells=20)
    vertices = terrain.vertices + rng.uniform(-0.2, 0.2, terrain.vertices.shape)
    terrain = Terrain(vertices, terrain.triangles, terrain.zone, terrain.zones)
    a, b = vertices[terrain.triangles[:, 0]], vertices[terrain.triangles[:, 1]]
    share = rng.random((len(a), 1))
    points = np.concatenate([a, share * a + (1.0 - share) * b])
    found = terrain_below(terrain, np.add(points, (0.0, 0.0, 1.0)))
    np.testing.assert_allclose(found, points[:, 2], atol=ROUNDING)


def test_typical_rows_are_the_shortest_median_and_longest_runout_of_those_at_rest():
    deposits = thrown(floor(), 6).deposits
    deposits.outcome[5] = Outcome.LEFT_TERRAIN
    length = np.array([4.0, 1.0, 3.0, 2.0, 5.0, 99.0])
    assert list(typical_rows(deposits, np.arange(6), length)) == [1, 2, 4]
    assert list(typical_rows(deposits, np.array([3]), length)) == [3]
    assert list(typical_rows(deposits, np.array([5]), length)) == [5]


@pytest.mark.parametrize("frame", FRAMES)
def test_a_profile_is_distance_in_plan_height_in_the_input_and_speed(frame):
    flights = thrown(floor(frame))
    samples = sample_paths(flights.paths)
    profile = profile_of(floor(frame), samples)
    ends = np.append(samples.starts[1:], len(samples.row)) - 1
    vertical = 2 if frame.up == "z" else 1
    np.testing.assert_array_equal(profile.distance[samples.starts], 0.0)
    # These throws run straight in plan, so the distance travelled is the runout.
    np.testing.assert_allclose(profile.distance[ends], runout(flights.deposits), atol=ROUNDING)
    np.testing.assert_allclose(profile.elevation, frame.points_to_input(samples.x)[:, vertical], atol=ROUNDING)
    np.testing.assert_array_equal(profile.speed, samples.speed)


def test_profiles_are_pictures_with_the_drawn_points_beside_them(tmp_path):
    terrain = floor(SURVEY)
    flights = thrown(terrain)
    samples = sample_paths(flights.paths, [0, 2, 4, 5])
    write_profile_plots(tmp_path, SOURCES, terrain, flights, samples, STANDARD_GRAVITY, ALL)
    overview, sections = lines_of(tmp_path / "overview.csv"), lines_of(tmp_path / "sections.csv")
    assert list(overview[0]) == ["source", "rock", "piece", "t", "distance", "elevation", "speed"]
    assert list(sections[0]) == ["source", "rock", "piece", "t", "distance", "elevation", "speed", "terrain"]
    assert len(overview) == len(samples.row)
    assert {line["source"] for line in overview} == set(SOURCES)
    assert {float(line["terrain"]) for line in sections} == {SURVEY.origin[2]}
    assert float(overview[0]["elevation"]) == pytest.approx(SURVEY.origin[2] + 5.0)
    picture = imread(tmp_path / "overview.png")
    assert pixels_like(picture, (255, 255, 255)) < picture.shape[0] * picture.shape[1]
    for outcome in (Outcome.STOPPED, Outcome.LEFT_TERRAIN):  # at least in the legend
        assert pixels_like(picture, OUTCOME_COLOURS[outcome]) > 10
    assert imread(tmp_path / "sections.png").shape[0] > 500


@pytest.mark.parametrize("frame", FRAMES)
def test_the_map_shows_zones_and_deposits_by_outcome(frame, tmp_path):
    terrain = floor(frame)
    flights = thrown(terrain)
    square = np.array([[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]])
    areas = {"ramp": [square]}
    write_map(
        tmp_path / "map.png", MapContent("floor", terrain, areas, ALL), flights.deposits, sample_paths(flights.paths)
    )
    picture = imread(tmp_path / "map.png")
    for colour in zone_colours(terrain.zones):
        assert pixels_like(picture, colour) > 1000
    beside_the_legend = picture[:, : picture.shape[1] - LEGEND_INCHES * RESOLUTION]
    for outcome in (Outcome.STOPPED, Outcome.LEFT_TERRAIN):
        assert pixels_like(beside_the_legend, OUTCOME_COLOURS[outcome]) >= MARKER_PIXELS


@pytest.mark.parametrize("outcome", Outcome, ids=lambda outcome: outcome.name.lower())
def test_the_map_draws_rocks_of_every_outcome(outcome, figures, tmp_path):
    terrain, flights = floor(), thrown(floor())
    deposits = replace(flights.deposits, outcome=np.full(6, int(outcome), dtype=np.int64))
    content = MapContent("floor", terrain, {}, ALL._replace(outcomes={outcome: 6}))
    write_map(tmp_path / "map.png", content, deposits, sample_paths(flights.paths))
    named = texts(figures["map.png"].axes[1].get_legend())
    assert outcome.name.lower().replace("_", " ") + " (6)" in named


def test_pictures_count_all_rocks_and_say_how_many_are_drawn_and_that_a_run_is_partial(figures, tmp_path):
    terrain, flights = floor(), thrown(floor())
    samples = sample_paths(flights.paths, [0, 5])
    write_map(tmp_path / "map.png", MapContent("pit", terrain, {}, PARTIAL), flights.deposits, samples)
    main, side = figures["map.png"].axes[:2]
    assert main.get_title(loc="left") == "pit: 6,000 of 8,000 rocks, partial"
    told = texts(side.get_legend())
    assert told[:6] == [
        "release", "stopped (5,584)", "left terrain (415)", "failed (1)", "ends (6 of 6,000 drawn)",
        "path (2 of 6,000 drawn)",
    ]  # fmt: skip
    write_profile_plots(tmp_path, SOURCES, terrain, flights, samples, STANDARD_GRAVITY, PARTIAL)
    title = figures["overview.png"].axes[0].get_title(loc="left")
    scale = "heights are drawn [0-9.]+ times as large as lengths"
    assert re.fullmatch(f"Paths of 2 of 6,000 rocks, partial; {scale}", title)
    upper, lower = figures["sections.png"].axes
    assert (upper.get_ylabel(), lower.get_ylabel()) == ("elevation (m)", "speed (m/s)")
    assert lower.get_xlabel() == "horizontal distance travelled (m)" and "heights" in upper.get_title(loc="left")
    (legend,) = figures["sections.png"].legends
    title = " ".join(legend.get_title().get_text().split())
    assert title.startswith("Shortest, median and longest runout of 2 of 6,000 rocks, partial")
    assert title.endswith("of those that came to rest")
    write_map(tmp_path / "map.png", MapContent("pit", terrain, {}, ALL), flights.deposits, sample_paths(flights.paths))
    assert texts(figures["map.png"].axes[1].get_legend())[:4] == ["release", "stopped (5)", "left terrain (1)", "path"]


def test_a_map_shows_the_whole_of_an_area_that_the_rocks_are_near_and_leaves_one_far_off_to_the_overview():
    terrain, flights = floor(), thrown(floor())
    wide, samples = Window(*(100 * side for side in whole_window(terrain))), sample_paths(flights.paths)
    near, far = (np.array([[x, 0.0], [300.0, 0.0], [300.0, 200.0]]) for x in (0.0, 250.0))
    window = rocks_window(wide, flights.deposits, samples, {"ramp": [near]})
    assert window.right > 300.0 and window.top > 200.0
    without = rocks_window(wide, flights.deposits, samples, {})
    assert rocks_window(wide, flights.deposits, samples, {"far": [far]}) == without


def test_where_very_many_rocks_start_a_few_of_the_places_are_drawn():
    spread = np.random.default_rng(1).uniform(0.0, 9.0, (10_000, 3))
    assert len(starts_of(spread)) == MOST_RELEASES
    assert len(starts_of(np.repeat(spread[:18], 500, axis=0))) == 18, "rocks from one place are one sign"
    assert starts_of(np.empty((0, 3))).shape == (0, 2)


def test_a_map_of_rocks_in_a_corner_shows_that_corner():
    terrain, flights = floor(), thrown(floor())
    samples = sample_paths(flights.paths)
    whole = whole_window(terrain)
    far = Window(*(10 * side for side in whole))
    window = rocks_window(far, flights.deposits, samples, {})
    assert window.width < 0.2 * far.width
    for places in (flights.deposits.x, flights.deposits.release, samples.x):
        assert window.left < places[:, 0].min() and places[:, 0].max() < window.right
        assert window.bottom < places[:, 1].min() and places[:, 1].max() < window.top
    assert rocks_window(whole, none_thrown().deposits, sample_paths(none_thrown().paths), {}) == whole


def test_no_rocks_make_empty_pictures(tmp_path):
    terrain, flights = floor(UNMOVED), none_thrown()
    samples = sample_paths(flights.paths)
    write_map(tmp_path / "map.png", MapContent("nothing", terrain, {}, RunCounts(0, 0, {})), flights.deposits, samples)
    write_profile_plots(tmp_path, SOURCES, terrain, flights, samples, STANDARD_GRAVITY, RunCounts(0, 0, {}))
    assert {path.name for path in tmp_path.iterdir()} == {
        "map.png", "overview.png", "overview.csv", "sections.png", "sections.csv",
    }  # fmt: skip


@pytest.mark.parametrize(("length", "rounded"), [(1.0, 1.0), (4.9, 2.0), (SIDE, 20.0), (0.07, 0.05), (999.0, 500.0)])
def test_a_scale_bar_has_a_round_length(length, rounded):
    assert round_length(length) == pytest.approx(rounded)


def test_a_title_tells_pieces_from_the_rocks_that_they_come_from():
    assert RunCounts(946, 946, {}, 746).describe() == "200 rocks and 746 pieces of them"
    assert RunCounts(946, 1000, {}, 746).describe() == "946 of 1,000 rocks and pieces, partial"
    assert RunCounts(1, 1, {}).describe() == "1 rock"
