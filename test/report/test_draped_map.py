"""A draped map colours all ground that rocks reached, with at least the values of its cells."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import rasterio

from rpf3d_core.hazard.scales import FEW_WORDS, round_values
from rpf3d_core.report import draped_map, view
from rpf3d_core.report.draped_map import CAPTION, FEW, FEW_CAPTION, caption_of, draped_facets, largest_touched
from rpf3d_core.report.run_files import HazardGrid, read_hazard, read_run
from rpf3d_core.report.view import Seen, draped, terrain_seen, view_html, with_few

INSIDE = np.linspace(0.05, 0.95, 4)
"""Places of points in a cell, as shares (-) of its side."""


def uneven(facet: float, number: int) -> Seen:
    """Return uneven ground of number x number squares, each of two facets with sides of `facet` (m) and shifted."""
    rng = np.random.default_rng(1)
    x, y = np.meshgrid(np.arange(number + 1.0), np.arange(number + 1.0))
    plan = facet * (np.stack([x, y], axis=-1) + rng.uniform(-0.3, 0.3, (number + 1, number + 1, 2)))
    vertices = np.concatenate([plan, rng.uniform(0.0, 20.0, (number + 1, number + 1, 1))], axis=2).reshape(-1, 3)
    corner = (np.arange(number)[:, None] * (number + 1) + np.arange(number)).ravel()
    right, up = corner + 1, corner + number + 1
    triangles = np.concatenate([np.stack([corner, right, up], axis=1), np.stack([right, up + 1, up], axis=1)])
    return Seen(vertices=vertices, triangles=triangles.astype(np.int32), of=len(triangles))


def contain(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return flags (N,): True for triangles (N, 3, 3) that contain a point (2,) in plan."""
    a, b = corners[:, :, :2], np.roll(corners[:, :, :2], -1, axis=1)
    side = (b - a)[..., 0] * (point - a)[..., 1] - (b - a)[..., 1] * (point - a)[..., 0]
    return np.asarray((side >= 0.0).all(axis=1) | (side <= 0.0).all(axis=1))


@pytest.mark.parametrize(("most", "south"), [(100, False), (1000, True), (40_000, False)])
def test_no_reached_cell_is_without_a_colour_of_at_least_its_value(
    monkeypatch: pytest.MonkeyPatch, most: int, south: bool
) -> None:
    """The facets are larger than the cells, and may be too many to be cut; south : the rows go from north to south."""
    monkeypatch.setattr(draped_map, "MOST_DRAPED", most)
    monkeypatch.setattr(view, "raised_by", lambda _: 0.0)
    rng = np.random.default_rng(2)
    values = np.where(rng.random((40, 40)) < 0.1, rng.lognormal(size=(40, 40)), np.nan)
    grid = HazardGrid(values=values, x=-2.0, y=38.0 if south else -2.0, dx=1.0, dy=-1.0 if south else 1.0)
    seen = uneven(facet=6.0, number=6)
    corners, drawn = draped(seen, grid)
    checked = 0
    for row, column in np.argwhere(np.isfinite(values)):
        for across in INSIDE:
            for along in INSIDE:
                point = np.array([grid.x + (column + across) * grid.dx, grid.y + (row + along) * grid.dy])
                if contain(seen.vertices[seen.triangles], point).any():
                    here = contain(corners, point)
                    assert here.any() and (drawn[here] >= values[row, column]).all()
                    checked += 1
    assert checked > 1000
    assert np.nanmax(drawn) <= np.nanmax(values)


def with_one_large_facet(seen: Seen) -> np.ndarray:
    """Return the corners (N, 3, 3) m of a terrain and of one large facet west of the terrain."""
    large = np.array([[[-41.0, -1.0, 0.0], [-1.0, -1.0, 0.0], [-1.0, 39.0, 0.0]]])
    return np.concatenate([seen.vertices[seen.triangles], large])


@pytest.mark.parametrize("small", [True, False], ids=["many small facets and a large one", "few large facets"])
def test_no_ground_far_from_a_value_has_its_colour(monkeypatch: pytest.MonkeyPatch, small: bool) -> None:
    monkeypatch.setattr(draped_map, "MOST_DRAPED", 2500 if small else 40_000)
    rng = np.random.default_rng(3)
    values = np.where(rng.random((42, 84)) < 0.05, rng.lognormal(size=(42, 84)), np.nan)
    values[:, 42:] = np.where(rng.random((42, 42)) < 0.7, rng.lognormal(size=(42, 42)), np.nan)
    grid = HazardGrid(values=values, x=-42.0, y=-2.0, dx=1.0, dy=1.0)
    corners = with_one_large_facet(uneven(facet=0.8, number=48) if small else uneven(facet=20.0, number=2))
    assert not small or len(corners) > draped_map.MOST_DRAPED
    fine, drawn = draped_facets(grid, corners)
    assert len(fine) <= len(corners) + draped_map.MOST_DRAPED
    padded = np.pad(np.nan_to_num(values), 9)
    column, row = (np.floor(fine[:, :, :2] - (grid.x, grid.y)).astype(np.int64) + 9).transpose(2, 0, 1)
    steps = range(-2, 3)
    nearby = np.max([padded[row + up, column + right] for up in steps for right in steps], axis=0)
    assert (nearby >= drawn[:, None]).all(), "every corner of a coloured facet is within two cells of its value"


def test_a_caption_gives_the_size_of_large_facets() -> None:
    facet = np.array([[[0.0, 0.0, 0.0], [3.0, 0.0, 5.0], [0.0, 4.0, 0.0]]])
    for maps in ([(facet, 3.0)], [], [(facet[:0], 3.0)]):
        assert caption_of(maps, few=False) == CAPTION
    large = caption_of([(facet, 3.0), (facet, 1.0)], few=False)
    assert large == f"{CAPTION} The edges of these facets are up to 5 m long."
    assert caption_of([(facet, 3.0)], few=True) == f"{CAPTION} {FEW_CAPTION}"


def test_a_facet_touches_the_cells_that_it_overlaps_and_a_wall_on_a_border_both_sides() -> None:
    grid = HazardGrid(values=np.arange(16.0).reshape(4, 4), x=0.0, y=0.0, dx=1.0, dy=1.0)
    lower = [[0, 0, 0], [3, 0, 0], [0, 3, 0]]  # its longest edge passes through corners of cells, without an overlap
    square = [[1, 1, 0], [2, 1, 0], [1, 2, 0]]
    wall = [[1, 2, 0], [1, 3, 0], [1, 2, 9]]
    away = [[9, 9, 0], [9, 8, 0], [8, 9, 0]]
    found = largest_touched(grid, np.array([lower, square, wall, away], dtype=float))
    np.testing.assert_array_equal(found, [8.0, 5.0, 9.0, np.nan])


def test_ground_that_too_few_rocks_reached_has_its_own_colour_and_words(known_ground: Path) -> None:
    run = read_run(known_ground)
    reached, energy = read_hazard(run, "reach_probability"), read_hazard(run, "energy_j", "p95")
    assert reached is not None and energy is not None
    few = np.isfinite(reached.values) & np.isnan(energy.values)
    whole = with_few(run, "energy_j", "p95")
    assert whole is not None and few.any() and (whole.values[few] == FEW).all()
    np.testing.assert_array_equal(np.isfinite(whole.values), np.isfinite(reached.values))
    seen = terrain_seen(run)
    assert (draped(seen, whole)[1] == FEW).any()
    html = view_html(run, seen, np.array([1.0, 0.0]))
    assert f"p95 energy: {FEW_WORDS}" in html and "rgb(125, 143, 179)" in html


def test_a_low_value_does_not_stand_for_a_cell_that_too_few_rocks_reached() -> None:
    """On a cell with rocks of an unknown, large energy, a colour of few kJ would show that the ground is safe."""
    values = np.full((5, 5), 5.0)
    values[2, 2] = FEW
    grid = HazardGrid(values=values, x=0.0, y=0.0, dx=1.0, dy=1.0)
    ground = np.array([[[0.0, 0.0, 0.0], [5.0, 0.0, 0.0], [0.0, 5.0, 0.0]], [[5, 5, 0], [0, 5, 0], [5, 0, 0]]])
    corners, drawn = draped_facets(grid, ground)
    middle = corners.mean(axis=1)
    inside = (np.floor(middle[:, :2]) == 2.0).all(axis=1)
    assert inside.any() and (drawn[inside] == FEW).all() and (drawn[~inside] == 5.0).all()


def test_a_map_without_the_band_is_left_out(known_ground: Path, tmp_path: Path) -> None:
    """Without the band, all ground would count as reached by too few rocks."""
    run = read_run(known_ground)._replace(folder=tmp_path)
    shutil.copytree(known_ground / "hazard", tmp_path / "hazard")
    with rasterio.open(tmp_path / "hazard" / "energy_j.tif", "r+") as file:
        assert with_few(run, "energy_j", "p95") is not None
        file.descriptions = ["p50"] * file.count
    assert with_few(run, "energy_j", "p95") is None and with_few(run, "reach_probability") is not None


def test_the_caption_says_which_value_a_facet_shows(report: tuple[Path, Path]) -> None:
    assert f"{CAPTION} {FEW_CAPTION}" in report[0].read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [(0.5, 5.0, [0.5, 1, 2, 5]), (1.0, 100.0, [1, 10, 100]), (0.02, 0.5, [0.02, 0.05, 0.1, 0.2, 0.5])],
)
def test_a_logarithmic_colour_bar_has_round_values_between_its_ends(low, high, ticks):
    assert round_values(low, high) == pytest.approx(ticks)
