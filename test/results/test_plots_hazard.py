"""Tests that hazard pictures show each cell in its place and in the colour of its value."""

from dataclasses import replace

import numpy as np
import pytest
from flights.flights_on_a_floor import FRAMES, SURVEY, SURVEY_Y_UP, floor
from hazards.hazard_layers import Points, laid_out, lines_of_rocks, maps_of
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.image import imread

from rpf3d_core.hazard.maps import FEWEST_ROCKS, reach_probability
from rpf3d_core.hazard.scales import Scale, colours_at, places
from rpf3d_core.results.plots import hazard as module
from rpf3d_core.results.plots.hazard import write_hazard_pictures
from rpf3d_core.results.plots.hazard_colour_bar import arrow_ends, norm_of
from rpf3d_core.results.plots.hazard_themes import themes
from rpf3d_core.results.plots.shading import hillshade
from rpf3d_core.results.plots.sheet import whole_window
from rpf3d_core.results.shown import MapContent, RunCounts
from rpf3d_core.terrain.obstacles import NO_OBSTACLES
from rpf3d_core.terrain.plan_view import Window, seen_from_above

PICTURES = {"reach_probability.png", "energy_p95.png", "height_p95.png"}
CELL = 2.0
STEP = 3
"""Largest error of a colour component, in steps of 1/255: a colour map of 256 steps, and rounding."""

FLOWN = RunCounts(300, 400, {})
SQUARE = np.array([[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]])


@pytest.fixture(params=FRAMES, ids=lambda frame: f"{frame.up}-up at {frame.origin[0]:.0f}")
def terrain(request):
    return floor(request.param)


def maps_over(terrain):
    return maps_of(terrain, lines_of_rocks(terrain), CELL)


def nobody():
    none = np.empty(0)
    return Points(none.astype(int), np.empty((0, 2)), none, none, none, none.astype(bool))


def releases(count=1):
    return np.tile([-15.0, 0.0, 1.0], (count, 1))


def drawn(terrain, maps, name, areas=None, obstacles=NO_OBSTACLES):
    """Return a picture (H, W, 3), and a function of local plan points (N, 2) m that returns their rows and columns."""
    ground = module._ground(terrain, maps, releases(0), areas or {})
    figure = module.hazard_figure("title", themes(maps)[name], ground, maps, releases(0), areas or {}, obstacles)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    picture = np.asarray(canvas.buffer_rgba())[..., :3].astype(float)
    axes = figure.axes[0]

    def pixels_of(plan):
        at = axes.transData.transform(plan + np.array(terrain.frame.origin[:2]))
        return len(picture) - 1 - np.floor(at[:, 1]).astype(int), np.floor(at[:, 0]).astype(int)

    return picture, pixels_of


def centres(raster):
    row, column = np.divmod(np.arange(raster.nx * raster.ny), raster.nx)
    return np.stack([raster.x + (column + 0.5) * CELL, raster.y + (row + 0.5) * CELL], axis=1)


@pytest.mark.long
def test_there_are_three_pictures(tmp_path, terrain):
    content = MapContent("floor", terrain, {"ramp": [SQUARE]}, FLOWN)
    write_hazard_pictures(tmp_path, content, maps_over(terrain), releases())
    assert {path.name for path in tmp_path.iterdir()} == PICTURES
    assert all(imread(path).shape[0] > 800 for path in tmp_path.iterdir())


@pytest.mark.parametrize("name", ["reach_probability", "energy_p95", "height_p95"])
def test_each_cell_has_the_colour_of_its_value_over_the_grey_of_the_ground(terrain, name, monkeypatch):
    monkeypatch.setattr(module, "OPACITY", 1.0)
    maps = maps_over(terrain)
    theme = themes(maps)[name]
    picture, pixels_of = drawn(terrain, maps, name)
    inside = (np.abs(centres(maps.raster)) < 19.0).all(axis=1)
    rows, columns = pixels_of(centres(maps.raster))
    known = inside & np.isfinite(theme.values)
    expected = colours_at(places(theme.scale, theme.values[known]))
    assert known.sum() > 30
    assert np.abs(picture[rows[known], columns[known]] - expected).max() <= STEP
    few = inside & (laid_out(maps.cells).rocks > 0) & ~np.isfinite(theme.values)
    assert few.any() == (name != "reach_probability")
    blue = [int(module.FEW[i : i + 2], 16) for i in (1, 3, 5)]
    assert np.abs(picture[rows[few], columns[few]] - blue).max(initial=0.0) <= STEP
    nobody = inside & (laid_out(maps.cells).rocks == 0)
    assert np.ptp(picture[rows[nobody], columns[nobody]], axis=1).max() == 0.0


def test_what_is_drawn_are_shares_and_percentiles_in_the_units_of_the_bar():
    maps = maps_over(floor())
    reach, energy, height = themes(maps).values()
    cells = laid_out(maps.cells)
    reached = cells.rocks > 0
    np.testing.assert_array_equal(reach.values[reached], reach_probability(maps.cells, maps.flown))
    assert np.isnan(reach.values[~reached]).all() and reach.per_unit == 0.01 and "%" in reach.unit
    np.testing.assert_array_equal(energy.values, cells.energy.p95)
    assert energy.per_unit == 1000.0 and "kJ" in energy.unit
    np.testing.assert_array_equal(height.values, cells.height.p95)
    assert "(m)" in height.unit
    assert np.isnan(height.values[cells.rocks < FEWEST_ROCKS]).all()


def test_areas_and_releases_are_drawn_and_the_title_tells_the_number_of_rocks(tmp_path):
    terrain = floor(SURVEY)
    maps = maps_over(terrain)
    without, pixels_of = drawn(terrain, maps, "height_p95")
    outlined, _ = drawn(terrain, maps, "height_p95", {"ramp": [SQUARE]})
    changed = np.abs(outlined - without).max(axis=-1) > 100
    rows, columns = pixels_of(SQUARE)
    assert changed[rows.min() : rows.max() + 1, columns.min() - 2 : columns.min() + 3].any()
    fence = replace(NO_OBSTACLES, lines=(("fence", np.column_stack([SQUARE, np.zeros(len(SQUARE))])),))
    fenced, _ = drawn(terrain, maps, "height_p95", obstacles=fence)
    changed = np.abs(fenced - without).max(axis=-1) > 100
    assert changed[rows.min() : rows.max() + 1, columns.min() - 2 : columns.min() + 3].any()
    ground = module._ground(terrain, maps, releases(), {})
    figure = module.hazard_figure("a", themes(maps)["height_p95"], ground, maps, releases(), {})
    assert figure.axes[0].get_title(loc="left") == "a"
    (points,) = [line for line in figure.axes[0].lines if line.get_linestyle() == "None"]
    np.testing.assert_allclose(points.get_xydata(), [[499_985.0, 4_500_000.0]])


def test_the_title_tells_how_many_rocks_there_are_and_that_the_run_is_partial(tmp_path, monkeypatch):
    titles = []
    monkeypatch.setattr(module, "save", lambda figure, _: titles.append(figure.axes[0].get_title(loc="left")))
    terrain = floor()
    write_hazard_pictures(tmp_path, MapContent("pit", terrain, {}, FLOWN), maps_over(terrain), releases())
    assert titles[0] == "pit: reach probability, 300 of 400 rocks, partial"


NO_VALUES = [(FEWEST_ROCKS - 1, "no cell was reached by\n20 rocks. More"), (0, "no rock")]


@pytest.mark.parametrize(("rocks", "why"), NO_VALUES, ids=["few rocks", "none"])
def test_a_picture_without_values_says_so_and_what_would_give_some(rocks, why):
    terrain = floor()
    maps = maps_of(terrain, lines_of_rocks(terrain, rocks) if rocks else nobody(), CELL)
    for name, empty in (("energy_p95", True), ("reach_probability", not rocks)):
        ground = module._ground(terrain, maps, releases(), {})
        figure = module.hazard_figure("title", themes(maps)[name], ground, maps, releases(), {})
        said = [text.get_text() for text in figure.axes[1].texts]
        bars = [axes for axes in figure.axes if axes.get_xlabel() == themes(maps)[name].unit]
        assert (any(why in text for text in said), len(bars)) == (empty, 0 if empty else 1)


def test_many_releases_are_dots_and_few_are_marks():
    assert module._release(module.MANY_RELEASES) is module.RELEASE
    assert module._release(module.MANY_RELEASES + 1) is module.DOT


def test_the_bar_is_pointed_where_values_lie_beyond_it():
    scale = Scale(1.0, 10.0, True)
    ends = [arrow_ends(scale, np.array(known)) for known in ([], [1.0, 10.0], [0.5], [20.0], [0.5, 20.0])]
    assert ends == ["neither", "neither", "min", "max", "both"]
    assert norm_of(scale)(np.sqrt(10.0)) == pytest.approx(0.5)
    assert norm_of(Scale(0.0, 10.0, False))(5.0) == pytest.approx(0.5)


def test_seen_from_above_a_terrain_whose_y_points_up_is_not_mirrored():
    upright, turned = floor(SURVEY), floor(SURVEY_Y_UP)
    one, _ = drawn(upright, maps_over(upright), "reach_probability")
    other, _ = drawn(turned, maps_over(turned), "reach_probability")
    middle = (slice(200, 800), slice(200, 800))
    np.testing.assert_array_equal(one[middle], other[middle])


def test_only_the_part_of_the_terrain_that_rocks_came_to_is_shown():
    terrain = floor()
    points = lines_of_rocks(terrain, 20)
    near = Points(points.rock, points.plan * 0.1, points.t, points.speed, points.height, points.touching)
    ground = module._ground(terrain, maps_of(terrain, near, 1.0), np.empty((0, 3)), {})
    assert ground.window.width < 0.5 * whole_window(terrain).width and ground.whole is not None
    both = np.array([[-19.0, -19.0, 0.0], [19.0, 19.0, 0.0]])
    far = module._ground(terrain, maps_of(terrain, near, 1.0), both, {})
    assert far.window == whole_window(terrain) and far.whole is None


def test_a_hillshade_is_grey_and_darker_away_from_the_light():
    terrain = floor()
    view = seen_from_above(terrain, Window(-25.0, 20.0, -20.0, 20.0), 90)
    level = hillshade(terrain, view)
    assert (level[:, :10, 3] == 0).all() and (level[:, 10:, 3] == 255).all()
    assert np.ptp(level[:, 10:, :3]) == 0
    tilted = floor()
    tilted.vertices[:, 2] = -tilted.vertices[:, 0]  # falls to the east, away from the light
    shade = hillshade(tilted, seen_from_above(tilted, whole_window(tilted), 90))
    assert shade[40, 40, 0] < level[40, 40, 0] < 255


def test_no_rocks_make_pictures_of_bare_ground(tmp_path):
    terrain = floor()
    content = MapContent("floor", terrain, {}, RunCounts(0, 0, {}))
    write_hazard_pictures(tmp_path, content, maps_of(terrain, nobody(), CELL), np.empty((0, 3)))
    assert {path.name for path in tmp_path.iterdir()} == PICTURES
