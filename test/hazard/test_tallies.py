"""Tests of tallies: each cell and each statistic is compared with a recomputation from stored paths."""

import dataclasses
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from flights import scenes_of_facets as made
from hazards.hazard_by_force import by_force, passages
from hazards.hazard_layers import laid_out, laid_out_maps
from hazards.hazard_tallied import MASS, MEMORY, flown, numbers, over, rocks_above, rough

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.ensemble import batches, flight_order
from rpf3d_core.hazard import layers as layers_module
from rpf3d_core.hazard import tallies as tallies_module
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import Binning, bin_edges, bin_of, relative_error, scales_of
from rpf3d_core.hazard.maps import FEWEST_ROCKS, PERCENTILES, Raster
from rpf3d_core.hazard.partial import add_packed, packed, packed_tallies, unpacked
from rpf3d_core.hazard.tallies import tallies_over
from rpf3d_core.hazard.walks.ground import ground_over
from rpf3d_core.terrain.facets import facets_of

EXACT = 1e-9
"""Largest relative and absolute error of times and speeds: the same formulas, evaluated in another order."""
FLOAT32 = 1e-6
"""Largest relative error of statistics, which are stored as float32."""


def assert_same(one, other):
    """Assert that two maps are equal to the last bit."""
    for (name, a), (_, b) in zip(numbers(one), numbers(other), strict=True):
        assert np.array_equal(a, b, equal_nan=True), name


def assert_layers(layers, stays, with_passages=True):
    """Assert that each cell and each statistic of layers follows from the stays of all rocks."""
    layers, cells = laid_out(layers), {}
    for (_, cell), found in stays.items():
        cells.setdefault(cell, []).append(found)
    reached = np.zeros(len(layers.rocks), dtype=np.int64)
    for cell, found in cells.items():
        reached[cell] = len(found)
        assert layers.impacts[cell] == sum(s.impacts for s in found)
        assert layers.deposits[cell] == sum(s.deposits for s in found)
        first = min(t for s in found for t, _ in s.times)
        assert layers.first_arrival[cell] == pytest.approx(first, rel=FLOAT32, abs=EXACT)
        if with_passages:
            assert layers.passages[cell] == sum(passages(s.times) for s in found)
        for quantity in ("energy", "speed", "height"):
            assert_spread(getattr(layers, quantity), cell, sorted(getattr(s, quantity) for s in found), layers)
    assert np.array_equal(layers.rocks, reached), "no other cell was reached"
    nowhere = reached == 0
    assert np.isnan(layers.first_arrival[nowhere]).all() and np.isnan(layers.energy.mean[nowhere]).all()


def assert_spread(spread, cell, values, layers):
    close = {"rel": FLOAT32, "abs": 1e-5 * max(values[-1], 1e-3)}  # heights of rocks on the ground are rounding errors
    assert spread.largest[cell] == pytest.approx(values[-1], **close)
    assert spread.mean[cell] == pytest.approx(np.mean(values), **close)
    for p in PERCENTILES:
        told = getattr(spread, f"p{p}")[cell]
        if len(values) < FEWEST_ROCKS:
            assert math.isnan(told)
        else:
            expected = values[math.ceil(p * len(values) / 100) - 1]
            assert told == pytest.approx(expected, rel=layers.percentiles_within, abs=1e-3 * values[-1])


@pytest.mark.parametrize("engine", made.ENGINES)
@pytest.mark.parametrize("model", ["none", "sliding"])
def test_every_cell_and_statistic_is_what_stored_paths_say(engine, model):
    terrain = rough()
    tallies = over(terrain, compiled=engine == "compiled")
    flights = flown(terrain, tallies, engine, 150, model)
    maps = tallies.maps(150, ())
    squares, facets, zones = by_force(flights, tallies.ground.facets, tallies.ground.raster, MASS)
    assert_layers(maps.cells, squares)
    assert_layers(maps.facets, facets)
    assert_layers(maps.zones, zones, with_passages=False)
    assert maps.cells.rocks.max() >= FEWEST_ROCKS, "some cells have percentiles"
    assert maps.cells.percentiles_within < 0.05


@pytest.mark.parametrize("few", [0, 10**9], ids=["the loop", "NumPy"])
def test_percentiles_are_the_same_whichever_way_they_are_looked_for(monkeypatch, few):
    tallies = over(rough())
    flown(rough(), tallies, "compiled", 150)
    usual = tallies.maps(150, ())
    monkeypatch.setattr(layers_module, "FEW", few)
    assert np.isfinite(usual.zones.energy.p95).any() and np.isfinite(usual.cells.height.p50).any()
    assert_same(usual, tallies.maps(150, ()))


def slid(speed, friction, squares, angle=35.0, length=80.0):
    """Fly a rock that slides down an incline from the origin.

    speed : m/s, at the start; friction, angle : degrees; squares : m, side of a cell; length : m, of the incline

    Return the map cells of the rock, their raster, the acceleration along the slope (m/s2), and the x component of the
    unit vector down the slope.
    """
    terrain = made.incline(angle, down=length)
    down, normal = made.down_the_slope(angle)
    low = terrain.vertices.min(axis=0)
    tallies = over(terrain)
    raster = Raster(float(low[0]), float(low[1]), squares, int(90 / squares), int(20 / squares))
    tallies = dataclasses.replace(tallies, ground=tallies.ground._replace(raster=raster))
    physics = made.flight(made.surface(0.0, 1.0, friction, 0.0), "sliding")
    made.fly(made.engine_over("compiled", terrain), physics, 1e-12 * normal, speed * down, watch=tallies)
    a = 9.81 * (math.sin(math.radians(angle)) - math.tan(math.radians(friction)) * math.cos(math.radians(angle)))
    return laid_out(tallies.maps(1, ()).cells), raster, a, down[0]


@pytest.mark.parametrize(("speed", "friction"), [(0.0, 30.0), (4.0, 30.0), (9.0, 37.0), (9.0, 35.0)])
def test_a_slide_is_in_each_square_when_and_as_fast_as_its_closed_form_says(speed, friction):
    """Along the slope, v^2 = v_0^2 + 2 a s where the rock enters and leaves a cell."""
    cells, raster, a, along = slid(speed, friction, 5.0)
    reached = np.flatnonzero(cells.rocks)
    assert len(reached) > 10
    for cell in reached:
        begin, end = (max(raster.x + (cell % raster.nx + k) * raster.cell, 0.0) / along for k in (0, 1))
        end = min(end, 80.0)
        entry = math.sqrt(max(speed**2 + 2.0 * a * begin, 0.0))
        fastest = math.sqrt(max(speed**2 + 2.0 * a * (end if a > 0.0 else begin), 0.0))
        assert cells.speed.largest[cell] == pytest.approx(fastest, rel=FLOAT32, abs=1e-4)
        arrival = 2.0 * begin / (speed + entry) if begin > 0.0 else 0.0
        assert cells.first_arrival[cell] == pytest.approx(arrival, rel=FLOAT32, abs=1e-4)


def test_heights_of_rocks_are_the_largest_above_what_lies_straight_below():
    terrain = rough()
    tallies = over(terrain)
    flights = flown(terrain, tallies)
    squares, _, _ = by_force(flights, tallies.ground.facets, tallies.ground.raster, MASS)
    for row, told in enumerate(flights.deposits.max_height):
        assert told == pytest.approx(max(s.height for (rock, _), s in squares.items() if rock == row), rel=EXACT)


def test_maps_do_not_depend_on_engine_threads_batches_or_room(monkeypatch):
    terrain, areas = rough(), {"middle": [np.array([[6.0, 6.0], [12.0, 7.0], [9.0, 13.0]])]}
    first = over(terrain, areas=areas)
    flown(terrain, first, count=200)
    expected = first.maps(200, ("middle",))
    assert expected.areas.rocks[0] > 0
    for threads in (1, 2, 5):
        again = over(terrain, areas=areas)
        flown(terrain, again, count=200, threads=threads)
        assert_same(again.maps(200, ("middle",)), expected)
    plain = over(terrain, areas=areas, compiled=False)
    flown(terrain, plain, "reference", count=200)
    assert_same(plain.maps(200, ("middle",)), expected)
    for name, module, value in (
        ("LARGEST_BATCH", flight_order, 7), ("ROOM", batches, 50), ("ROOM", tallies_module, 3),
    ):  # fmt: skip
        with monkeypatch.context() as patch:
            patch.setattr(module, name, value)
            again = over(terrain, areas=areas)
            flown(terrain, again, count=200)
        assert_same(again.maps(200, ("middle",)), expected)


@pytest.mark.parametrize("limit", [MEMORY, 60_000.0])
def test_eight_parts_together_are_the_same_bits_as_one_run(limit):
    terrain = rough()
    x, v = rocks_above(160)
    physics = made.flight(made.surface(0.6, 0.85, 25.0))
    engine = made.engine_over("compiled", terrain)
    whole, joined = over(terrain, limit=limit), over(terrain, limit=limit)
    made.fly(engine, physics, x, v, watch=whole)
    for part in range(8):
        mine = over(terrain, limit=limit)
        made.fly(engine, physics, x[20 * part : 20 * part + 20], v[20 * part : 20 * part + 20], watch=mine)
        joined.add(mine)
    assert_same(joined.maps(160, ()), whole.maps(160, ()))
    assert (whole.maps(160, ()).cells.percentiles_within > 0.05) == (limit < MEMORY), "less memory, wider bins"


@pytest.mark.parametrize("limit", [MEMORY, 600.0])
def test_more_rocks_than_a_byte_holds_are_counted_in_parts_and_packed(limit):
    """A thousand equal rocks fall into one bin, so its byte overflows several times, also when parts are joined."""
    terrain, one = made.floor(10.0, cells=2), np.array([[1.3, 2.1, 4.0]])
    engine, physics = made.engine_over("compiled", terrain), made.flight(made.surface(0.3, 0.5), "none")
    whole, joined = over(terrain, limit=limit), over(terrain, limit=limit)
    made.fly(engine, physics, np.repeat(one, 1000, axis=0), watch=whole)
    for rocks in (300, 5, 695):
        part = over(terrain, limit=limit)
        made.fly(engine, physics, np.repeat(one, rocks, axis=0), watch=part)
        add_packed(joined, packed_tallies(part))
    for tally in (whole.squares, joined.squares, unpacked(packed(whole.squares))):
        bins = np.concatenate(list(tally.bins_found()))
        assert bins.max() == 1000 and bins.sum() == 2000 * tally.used, "one bin of energy, one of height"
    assert_same(joined.maps(1000, ()), whole.maps(1000, ()))


def test_bins_merged_for_want_of_memory_still_keep_their_promise():
    terrain = rough()
    tight = over(terrain, limit=60_000.0)
    flights = flown(terrain, tight, count=150)
    maps = tight.maps(150, ())
    assert 0.05 < maps.cells.percentiles_within < 0.5
    squares, _, _ = by_force(flights, tight.ground.facets, tight.ground.raster, MASS)
    assert_layers(maps.cells, squares)


@pytest.mark.parametrize("engine", made.ENGINES)
def test_under_a_roof_a_rock_passes_the_floor_and_over_it_the_roof(engine):
    floor, roof = made.floor(10.0, cells=4), made.rough_grid(3, 8.0, 0.0, 0.0, centred=True, z=5.0)
    terrain = made.joined(floor, roof)
    tallies = over(terrain, compiled=engine == "compiled")
    physics = made.flight(made.surface(0.0, 0.0), "none")
    x, v = [(-8.0, 0.3, 4.0), (-3.0, 0.4, 8.0)], [(10.0, 0.1, 0.0), (2.0, 0.1, 0.0)]
    flights = made.fly(made.engine_over(engine, terrain), physics, x, v, watch=tallies)
    assert flights.deposits.max_height == pytest.approx([4.0, 3.0], rel=EXACT), "above what lies straight below"
    zones = laid_out(tallies.maps(2, ()).zones)
    assert zones.rocks.tolist() == [1, 1]
    assert zones.deposits.tolist() == [1, 1]


@pytest.mark.parametrize(("edge", "highest"), [(2.0, 12.0), (4.0, 12.0)])
def test_over_a_step_in_what_is_below_each_part_of_an_arc_counts_above_its_own_ground(edge, highest):
    floor, slab = made.floor(20.0), made.floor(20.0, z=10.0)
    slab.vertices[:, 0] += edge + 20.0
    terrain = made.joined(floor, slab)
    tallies = over(terrain)
    physics = made.flight(made.surface(0.0, 0.0), "none")
    engine = made.engine_over("compiled", terrain)
    flights = made.fly(engine, physics, (0.5, 1.0, 12.0), (10.0, 0.0, 0.0), watch=tallies)
    assert flights.deposits.max_height == pytest.approx([highest], rel=EXACT), "it begins 12 m above the floor"
    maps = laid_out_maps(tallies.maps(1, ()))
    fallen = 0.5 * 9.81 * ((edge - 0.5) / 10.0) ** 2
    assert maps.zones.height.largest == pytest.approx([highest, 2.0 - fallen], rel=FLOAT32)
    assert maps.zones.first_arrival == pytest.approx([0.0, (edge - 0.5) / 10.0], rel=FLOAT32, abs=EXACT)


def test_a_wall_that_leans_by_rounding_only_tells_no_height():
    walls = made.terrain_of(
        [(-20, -20, 0), (20, -20, 0), (20, 20, 0), (-20, 20, 0), (3, 0.1, 0), (3 + 1e-9, 4.7, 0), (3, 2.2, 30)],
        [(0, 1, 2), (0, 2, 3), (4, 5, 6)],
    )
    tallies = over(walls)
    physics = made.flight(made.surface(0.0, 0.0), "none")
    x = [(3.0 + 1e-10, y, 29.0) for y in (1.0, 2.0, 3.0)]
    flights = made.fly(made.engine_over("compiled", walls), physics, x, (0.0, 0.3, 0.0), watch=tallies)
    assert (flights.deposits.max_height <= 29.0 + 1e-6).all()


def test_a_release_on_a_corner_of_squares_visits_none_that_it_only_touches():
    terrain = made.floor(8.0, cells=4)
    tallies = over(terrain, cell=1.0)
    raster = tallies.ground.raster._replace(x=-8.0, y=-8.0, nx=16, ny=16)
    tallies = dataclasses.replace(tallies, ground=tallies.ground._replace(raster=raster))
    physics = made.flight(made.surface(0.0, 0.0), "none")
    made.fly(made.engine_over("compiled", terrain), physics, (2.0, 2.0, 5.0), (-0.3, -0.7, 0.0), watch=tallies)
    row, column = np.divmod(tallies.maps(1, ()).cells.cell, raster.nx)
    visited = set(zip((column - 8).tolist(), (row - 8).tolist(), strict=True))
    assert visited == {(2, 2), (1, 1)}, "(1, 2) is touched at its corner only"


@pytest.mark.parametrize(
    ("x", "v", "inside_s"),
    [
        ((0.0, 5.0), (-4.0, 0.0), None),
        ((5.0, 0.0), (0.0, -4.0), None),
        ((10.0, 5.0), (-4.0, 0.0), 0.0),
        ((5.0, 5.0), (4.0, 0.0), 0.0),
    ],
)
def test_a_track_that_begins_on_the_outline_of_an_area_is_in_it_only_where_it_is(x, v, inside_s):
    terrain = made.floor(40.0)
    square = {"square": [np.array([[0.0, 0.0], [10.0, 0.0], [10.0, 10.0], [0.0, 10.0]])]}
    tallies = over(terrain, areas=square)
    physics = made.flight(made.surface(0.0, 0.0), "none")
    made.fly(made.engine_over("compiled", terrain), physics, (*x, 20.0), (*v, 0.0), watch=tallies)
    areas = laid_out(tallies.maps(1, ("square",)).areas)
    assert areas.rocks[0] == (inside_s is not None)
    if inside_s is not None:
        assert areas.first_arrival[0] == pytest.approx(inside_s, abs=EXACT)


def test_rocks_that_find_no_room_among_the_areas_are_counted_in_them_all_the_same(monkeypatch):
    monkeypatch.setattr(tallies_module, "ROOM", 64)
    ring = np.array([[-20.0, -20.0], [40.0, -20.0], [40.0, 40.0], [-20.0, 40.0]])
    tallies = over(rough(), areas={f"area_{k}": [ring] for k in range(6)})
    flights = flown(rough(), tallies, count=128)
    stopped = int((flights.deposits.outcome == 0).sum())
    areas = laid_out(tallies.maps(128, tuple(f"area_{k}" for k in range(6))).areas)
    assert areas.rocks.tolist() == [128] * 6 and areas.deposits.tolist() == [stopped] * 6


@pytest.mark.parametrize("flipped", [False, True])
def test_the_first_arrival_in_a_zone_does_not_depend_on_the_order_of_its_facets(flipped):
    terrain = made.floor(10.0)
    if flipped:
        terrain.triangles[:] = terrain.triangles[::-1].copy()
    tallies = over(terrain)
    physics = made.flight(made.surface(0.0, 0.0), "none")
    made.fly(made.engine_over("compiled", terrain), physics, (-5.0, 3.0, 8.0), (6.0, -1.0, 0.0), watch=tallies)
    zones = laid_out(tallies.maps(1, ()).zones)
    assert zones.first_arrival[0] == 0.0 and zones.passages[0] == 0


def test_a_vertical_wall_is_visited_by_what_strikes_it():
    box = made.box()
    tallies = over(box)
    engine, physics = made.engine_over("compiled", box), made.flight(made.surface(0.5, 0.8))
    flights = made.fly(engine, physics, (0.1, 0.2, 5.0), (8.0, 0.3, 0.0), watch=tallies)
    struck = flights.impacts.facet[0]
    assert tallies.ground.facets.normals[struck, 2] == 0.0
    facets = laid_out(tallies.maps(1, ()).facets)
    assert (facets.rocks[struck], facets.passages[struck]) == (1, 1)
    assert facets.impacts[struck] == (flights.impacts.facet == struck).sum()
    assert facets.speed.largest[struck] == pytest.approx(flights.impacts.speed_in[0], rel=FLOAT32)


def test_a_symmetric_scene_gives_a_symmetric_map_within_its_intervals():
    """In a valley mirrored about its line, with rocks thrown evenly to both sides, mirrored cells differ by chance."""
    cells, size = 24, 48.0
    half = made.rough_grid(cells, size, 0.4, 0.3, seed=2)
    right = half.vertices * (1.0, 0.5, 1.0)
    right[:, 2] += 0.02 * right[:, 1] ** 2
    left = type(half)(right * (1.0, -1.0, 1.0), half.triangles[:, ::-1], half.zone, half.zones, half.frame)
    terrain = made.joined(type(half)(right, half.triangles, half.zone, half.zones, half.frame), left)
    facets = facets_of(terrain)
    raster = Raster(0.0, -size / 2, 2.0, cells, cells)
    scales = scales_of(100.0, 9.81, 12.0, MASS, MASS)
    ground = ground_over(facets, bucket_locator(facets), raster)
    tallies = tallies_over(ground, areas_of({}), 2, 9.81, Binning(scales, scales, MEMORY), True)
    random = np.random.default_rng(11)
    rocks = 4000
    x = np.stack([random.uniform(1.0, 3.0, rocks), random.uniform(-3.0, 3.0, rocks), np.full(rocks, 3.0)], 1)
    v = np.stack([random.uniform(0.0, 4.0, rocks), random.uniform(-4.0, 4.0, rocks), np.zeros(rocks)], 1)
    made.fly(made.engine_over("compiled", terrain), made.flight(made.surface(0.5, 0.9, 20.0)), x, v, watch=tallies)
    reached = laid_out(tallies.maps(rocks, ()).cells).rocks.reshape(cells, cells)
    left, right = reached[: cells // 2], reached[cells // 2 :][::-1]
    share = (left + right) / (2 * rocks)
    spread = np.sqrt(2 * rocks * share * (1 - share))
    away = np.abs(left - right)[spread > 0] / spread[spread > 0]
    assert (spread > 3).sum() > 50, "there is something to compare"
    assert away.max() < 4.5 and (away > 1.96).mean() < 0.10, "as chance makes them, in cells that hang together"


def as_bits(value):
    return int(np.float64(value).view(np.int64))


def test_bins_hold_their_values_and_no_bin_is_wider_than_promised():
    top, bins = 64.0, 96
    edges = bin_edges(top, bins, 8)
    assert relative_error(edges) < 0.05 and edges[-1] == top
    for value in np.exp(np.random.default_rng(1).uniform(math.log(edges[0]), math.log(top), 2000)):
        b = bin_of(as_bits(value / top), bins, 8)
        assert edges[b] * (1 - 1e-12) <= value <= edges[b + 1] * (1 + 1e-12)
    assert [bin_of(as_bits(v), bins, 8) for v in (0.0, edges[0] / top / 2, 10.0)] == [0, 0, bins - 1]


COMPILED = """
import numba
from hazards.hazard_tallied import flown, over, rough

terrain = rough()
tallies = over(terrain)
flown(terrain, tallies)
for loop, arguments in tallies.loops():
    assert loop.overloads.keys() == {tuple(map(numba.typeof, arguments))}, "compiled for nothing, and once more"
"""
"""Program that must run in a process in which no other code was compiled."""


def test_what_is_compiled_ahead_is_what_is_called():
    pytest.importorskip("numba", reason="numba is not installed: there is nothing to compile")
    paths = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(
        [sys.executable, "-c", COMPILED], env=paths, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
