"""Tests of releases: places uniform over true area, directions within a cone, sizes, and equal bits in all blocks."""

import itertools
import math

import numpy as np
import pytest
from flights.scenes_of_facets import box, engine_over, floor, rough_grid, strip

from rpf3d_core.ensemble.release_triangles import release_triangles
from rpf3d_core.ensemble.releases import Releases, Source, check_above_ground, ranges_of, releases_in, releases_of
from rpf3d_core.ensemble.sizes import DrawnRock
from rpf3d_core.ensemble.throws import Throw, axes_of, thrown
from rpf3d_core.materials.distributions import FEW, fixed, truncated_normal, truncated_power_law, uniform_between
from rpf3d_core.materials.streams import MANY
from rpf3d_core.terrain.clipping import areas_of, facets_within
from rpf3d_core.terrain.facets import WORLD, Terrain
from rpf3d_core.values import Rock

ROCK = Rock(1000.0, 0.5)
ROUNDING = 1e-12
"""Largest relative rounding error of areas of tens of square metres."""
ON_THE_GROUND = 1e-9
"""Largest error (m) of places that are computed from coordinates of tens of metres."""
FOLDED = [(0.0, 10.0), (10.0, 10.0), (12.0, 0.0), (12.0, -8.0), (30.0, -8.0)]
"""Profile (x, z) in m of a bench, a face of 79 degrees, a vertical wall and a floor."""
SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], dtype=float)


def rectangle(west: float, south: float, east: float, north: float) -> np.ndarray:
    """Return the two triangles (2, 3, 2) m of a rectangle in plan."""
    return np.array([west, south]) + SQUARE * np.array([east - west, north - south])


def corners_of(terrain: Terrain) -> np.ndarray:
    return terrain.vertices[terrain.triangles]


def released(source: Source, terrain: Terrain | None = None, rock=ROCK, seed: int = 1) -> Releases:
    return releases_of([source], rock, seed, engine_over("reference", floor() if terrain is None else terrain))


# --- areas ------------------------------------------------------------------------------------------------------------


def test_places_are_even_over_the_true_area_of_a_folded_surface() -> None:
    surface = strip(FOLDED, half_width=5.0, across=3)
    source = Source("all", np.empty((0, 3)), 60_000, triangles=release_triangles(corners_of(surface)))
    x = released(source, surface).x
    # Bins have equal length along the profile; in plan the wall would have no area and the face a fifth of its share.
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(FOLDED, axis=0).T))])
    ends = np.array(FOLDED)
    along = np.full(len(x), np.nan)
    for i, (begin, end) in enumerate(itertools.pairwise(ends)):
        step = end - begin
        share = ((x[:, ::2] - begin) @ step) / (step @ step)
        off = np.abs((x[:, ::2] - begin) @ np.array([-step[1], step[0]])) / np.hypot(*step)
        here = np.isnan(along) & (off < ON_THE_GROUND) & (share >= 0) & (share <= 1)
        along[here] = s[i] + share[here] * (s[i + 1] - s[i])
    assert not np.isnan(along).any(), "every place lies on the surface"
    counts = np.histogram2d(along, x[:, 1], [np.linspace(0, s[-1], 21), np.linspace(-5, 5, 6)])[0]
    chi_squared = ((counts - 600.0) ** 2 / 600.0).sum()
    assert 58.0 < chi_squared < 149.0  # 99 degrees of freedom: outside in fewer than 1 of 1,000
    assert np.abs(x[:, 1]).max() <= 5.0


def test_a_polygon_cuts_facets_exactly_and_counts_walls_by_their_true_area() -> None:
    surface = corners_of(strip(FOLDED, half_width=5.0, across=3))
    parts = facets_within(surface, rectangle(4.0, -2.5, 20.0, 1.25))
    length = 6.0 + math.hypot(2.0, 10.0) + 8.0 + 8.0
    assert areas_of(parts).sum() == pytest.approx(3.75 * length, rel=ROUNDING)
    assert parts[..., 0].min() == 4.0 and parts[..., 1].max() == 1.25
    assert parts[..., 0].max() == 20.0 and parts[..., 1].min() == -2.5


def test_a_wall_is_cut_along_its_foot() -> None:
    parts = facets_within(corners_of(box(half=5.0, height=10.0)), rectangle(4.0, -3.0, 6.0, 2.0))
    walls = parts[(parts[..., 0] == 5.0).all(axis=1)]
    assert areas_of(walls).sum() == pytest.approx(50.0, rel=ROUNDING)
    assert areas_of(parts).sum() == pytest.approx(50.0 + 5.0, rel=ROUNDING)


@pytest.mark.parametrize("along", [((-1, -1), (2, 2)), ((0, 0), (1, 1)), ((0, 0), (0, 1)), ((1, 0), (1, 1))])
@pytest.mark.parametrize("turned", [False, True])
def test_a_wall_on_an_edge_of_the_triangles_of_a_polygon_counts_once(along, turned: bool) -> None:
    begin, end = np.array(along, dtype=float)
    foot, top = ([*begin, 0.0], [*end, 0.0]), ([*end, 3.0], [*begin, 3.0])
    wall = np.array([[*foot, top[0]], [foot[0], *top]])
    parts = facets_within(wall, SQUARE[:, ::-1] if turned else SQUARE)
    inside = np.hypot(*(end - begin)) / (3.0 if along[0] == (-1, -1) else 1.0)
    assert areas_of(parts).sum() == pytest.approx(3.0 * inside, rel=ROUNDING)


@pytest.mark.parametrize("turned", [False, True])
def test_a_polygon_that_is_cut_into_more_triangles_covers_the_same_area(turned: bool) -> None:
    ground = corners_of(rough_grid(20, 10.0, 0.7, 0.4, seed=3))
    angles = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    rim = 5.0 + 3.0 * np.stack([np.cos(angles), np.sin(angles)], 1)
    fan = np.stack([np.full_like(rim, 5.0), rim, np.roll(rim, -1, 0)], 1)
    ears = np.stack([np.broadcast_to(rim[0], rim[1:-1].shape), rim[1:-1], rim[2:]], 1)
    one, other = (areas_of(facets_within(ground, p[:, ::-1] if turned else p)).sum() for p in (fan, ears))
    assert one == pytest.approx(other, rel=ROUNDING)
    low = areas_of(ground[np.abs(ground[..., :2] - 5.0).max(axis=(1, 2)) < 2.0]).sum()
    assert low < one < areas_of(ground).sum()


def test_a_polygon_beside_the_terrain_finds_nothing() -> None:
    assert facets_within(corners_of(floor(5.0)), rectangle(5.5, -1.0, 7.0, 1.0)).shape == (0, 3, 3)
    assert facets_within(corners_of(floor(5.0)), np.empty((0, 3, 2))).shape == (0, 3, 3)


@pytest.mark.parametrize("terrain", [box(), strip(FOLDED, 5.0, 3), rough_grid(20, 10.0, 2.0, 0.4)], ids=str)
@pytest.mark.parametrize("above", [None, 0.25])
def test_rocks_on_a_surface_are_never_under_it(terrain: Terrain, above: float | None) -> None:
    source = Source(
        "area", np.empty((0, 3)), 2_000, triangles=release_triangles(corners_of(terrain)), above_ground=above
    )
    engine = engine_over("compiled", terrain)
    releases = releases_of([source], ROCK, 1, engine)
    check_above_ground(releases, ["area"], engine, WORLD)


def test_above_ground_lifts_rocks_from_their_own_place_and_not_from_the_top_of_a_wall() -> None:
    triangles = release_triangles(corners_of(box(half=5.0, height=10.0)))
    low, high = (
        released(Source("wall", np.empty((0, 3)), 500, triangles=triangles, above_ground=above), box()).x
        for above in (None, 0.5)
    )
    np.testing.assert_allclose(high - low, np.broadcast_to([0.0, 0.0, 0.5], low.shape), atol=ON_THE_GROUND)


# --- directions -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("azimuth", "elevation", "direction"),
    [(0, 0, (0, 1, 0)), (90, 0, (1, 0, 0)), (180, 0, (0, -1, 0)), (90, 90, (0, 0, 1)), (270, -45, (-1, 0, -1))],
)
def test_azimuths_count_clockwise_from_north_and_elevations_up(azimuth: float, elevation: float, direction) -> None:
    throw = Throw(fixed(3.0), math.radians(azimuth), math.radians(elevation), 0.0)
    v = released(Source("thrown", np.zeros((1, 3)), 2, throw=throw)).v
    np.testing.assert_allclose(v, np.tile(3.0 * np.array(direction) / np.linalg.norm(direction), (2, 1)), atol=1e-15)


def test_the_axes_of_a_throw_are_at_right_angles() -> None:
    axes = np.array(axes_of(Throw(fixed(1.0), 1.1, -0.4, 0.2)))
    np.testing.assert_allclose(axes @ axes.T, np.eye(3), atol=1e-15)


@pytest.mark.parametrize("spread", [10.0, 90.0, 180.0])
def test_directions_are_even_over_their_cone(spread: float) -> None:
    throw = Throw(uniform_between(2.0, 6.0), math.radians(70.0), math.radians(20.0), math.radians(spread))
    v = released(Source("thrown", np.zeros((1, 3)), 20_000, throw=throw)).v
    speed = np.linalg.norm(v, axis=1)
    assert speed.min() >= 2.0 and speed.max() <= 6.0 and speed.mean() == pytest.approx(4.0, abs=0.04)
    ahead, right, up = (v @ axis / speed for axis in axes_of(throw))
    least = math.cos(math.radians(spread))
    assert ahead.min() >= least - 1e-15
    # Uniform over the solid angle: the cosine and the angle about the axis are both uniform.
    turn = np.arctan2(up, right)
    counts = np.histogram2d(ahead, turn, [np.linspace(least, 1.0, 11), np.linspace(-np.pi, np.pi, 11)])[0]
    chi_squared = ((counts - 200.0) ** 2 / 200.0).sum()
    assert 58.0 < chi_squared < 150.0  # 99 degrees of freedom


def test_many_directions_have_the_bits_of_few() -> None:
    throw = Throw(fixed(3.0), 0.3, 0.2, 0.5)
    columns = np.random.default_rng(1).uniform(size=(3, FEW + 50))
    np.testing.assert_array_equal(thrown(throw, *columns)[-50:], thrown(throw, *columns[:, -50:]))


# --- sizes ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("measure", ["diameter", "mass", "volume"])
def test_a_drawn_rock_is_a_sphere_of_its_size(measure: str) -> None:
    drawn = DrawnRock(2700.0, measure, uniform_between(0.5, 2.0))
    rocks = released(Source("crest", np.zeros((1, 3)), 500), rock=drawn)
    volume = 4.0 / 3.0 * math.pi * rocks.radius**3
    size = {"diameter": 2.0 * rocks.radius, "mass": rocks.mass, "volume": volume}[measure]
    np.testing.assert_allclose(rocks.mass, 2700.0 * volume, rtol=ROUNDING)
    assert 0.5 <= size.min() < 0.52 and 1.98 < size.max() <= 2.0 * (1.0 + ROUNDING)


def test_many_sizes_have_the_bits_of_few() -> None:
    drawn = DrawnRock(2700.0, "volume", truncated_power_law(0.5, 0.01, 8.0))
    source = Source("crest", np.zeros((1, 3)), MANY + 100)
    engine = engine_over("reference", floor())
    every = releases_of([source], drawn, 1, engine)
    few = releases_of([source], drawn, 1, engine, first=MANY, count=100)
    np.testing.assert_array_equal(every.mass[-100:], few.mass)
    np.testing.assert_array_equal(every.radius[-100:], few.radius)


# --- the same bits ----------------------------------------------------------------------------------------------------


def every_kind_of_source(terrain: Terrain) -> list[Source]:
    points = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [3.0, 1.0, 0.0]])
    throw = Throw(truncated_normal(4.0, 1.0, 2.0, 6.0), 0.3, 0.2, 0.5)
    return [
        Source("points", points, 11, spread=(0.1, 0.0, 0.2), above_ground=1.0),
        Source("none", points, 0),
        Source("line", points, 7, line=True, velocity=(1.0, 0.0, 0.0), velocity_spread=(0.1, 0.2, 0.3)),
        Source("area", np.empty((0, 3)), 9, triangles=release_triangles(corners_of(terrain)), throw=throw),
    ]


def columns(releases: Releases) -> dict[str, np.ndarray]:
    """Return name -> column of the releases, without absent columns: points have no shape and no pose."""
    return {name: column for name, column in vars(releases).items() if column is not None}


@pytest.mark.parametrize("size", [1, 4, 26, 27, 100])
def test_releases_in_blocks_have_the_bits_of_the_whole(size: int) -> None:
    ground = rough_grid(8, 6.0, 0.3, 0.1)
    sources, engine = every_kind_of_source(ground), engine_over("reference", ground)
    drawn = DrawnRock(2700.0, "mass", uniform_between(1.0, 2.0))
    whole = releases_of(sources, drawn, 5, engine)
    parts = [releases_of(sources, drawn, 5, engine, first=i, count=size) for i in range(0, 27, size)]
    assert len(whole.x) == 27 and max(len(part.x) for part in parts) <= size
    for name, column in columns(whole).items():
        np.testing.assert_array_equal(np.concatenate([columns(part)[name] for part in parts]), column)


def test_a_range_may_go_on_beyond_the_number_of_a_source() -> None:
    ground = rough_grid(8, 6.0, 0.3, 0.1)
    sources, engine = every_kind_of_source(ground), engine_over("reference", ground)
    some = releases_in(sources, [range(9, 13), range(0), range(0), range(2, 3)], ROCK, 5, engine)
    assert (some.source.tolist(), some.rock.tolist()) == ([0, 0, 0, 0, 3], [9, 10, 11, 12, 2])
    whole = releases_of(sources, ROCK, 5, engine)
    np.testing.assert_array_equal(some.x[[0, 1, 4]], whole.x[[9, 10, 20]])


@pytest.mark.parametrize(
    ("first", "count", "expected"),
    [
        (0, None, [(0, 3), (0, 0), (0, 4)]),
        (2, 3, [(2, 3), (0, 0), (0, 2)]),
        (5, 9, [(3, 3), (0, 0), (2, 4)]),
        (7, 1, [(3, 3), (0, 0), (4, 4)]),
    ],
)
def test_rows_are_numbered_by_source_and_then_by_rock(first: int, count: int | None, expected) -> None:
    assert [(span.start, span.stop) for span in ranges_of([3, 0, 4], first, count)] == expected


def test_one_more_distribution_leaves_every_other_draw_as_it_was() -> None:
    ground = rough_grid(8, 6.0, 0.3, 0.1)
    engine, area = engine_over("reference", ground), every_kind_of_source(ground)[3]
    plain = Source("area", area.points, 9, velocity=(1.0, 0.0, 0.0), triangles=area.triangles)
    sized = DrawnRock(2700.0, "mass", uniform_between(1.0, 2.0))
    one, other = releases_of([plain], ROCK, 1, engine), releases_of([area], sized, 1, engine)
    np.testing.assert_array_equal(one.x, other.x)
    swapped = DrawnRock(2700.0, "mass", uniform_between(1.0, 2.0))
    np.testing.assert_array_equal(releases_of([plain], swapped, 1, engine).mass, other.mass)
    assert len(set(other.mass.tolist())) == 9 and len(set(np.linalg.norm(other.v, axis=1).tolist())) == 9


def test_a_source_without_a_spread_starts_exactly_at_its_points() -> None:
    x = np.array([[1.0, 2.0, 3.0]])
    rocks = released(Source("crest", x, 2, velocity=(0.5, 0.0, 0.0)))
    np.testing.assert_array_equal(rocks.x, np.tile(x, (2, 1)))
    np.testing.assert_array_equal(rocks.v, [[0.5, 0.0, 0.0]] * 2)
