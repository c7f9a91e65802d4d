"""Tests of passages per metre: closed forms, independence of the cell size, and coverage of the intervals."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from flights import scenes_of_facets as made
from hazards.hazard_tallied import MASS, flown, over, rough

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE, Binning, scales_of
from rpf3d_core.hazard.maps import Raster, reach_probability
from rpf3d_core.hazard.partial import add_packed, packed_tallies
from rpf3d_core.hazard.passages import passage_per_metre, reached_over
from rpf3d_core.hazard.tallies import tallies_over, with_ways
from rpf3d_core.hazard.walks.ground import ground_over
from rpf3d_core.hazard.zones import Matrix, matrix_zones
from rpf3d_core.terrain.facets import facets_of

HALF, HEIGHT, SPEED = 40.0, 50.0, 10.0
REACH = SPEED * math.sqrt(2.0 * HEIGHT / 9.81)
"""Distance (m) that a rock flies when thrown horizontally; it stops where it hits the floor."""
CELLS = (1.0, 2.5, 5.0)
UNITS = 2.0**-20
"""Rounding of the length of a path in a cell, as a share of the cell size."""


def thrown(x, v, cell):
    """Return the maps of rocks thrown from x (m) with v (m/s) over a floor, with cells of side `cell` (m)."""
    terrain = made.floor(HALF)
    facets, count = facets_of(terrain), int(2 * HALF / cell)
    scales, fine = (scales_of(60.0, 9.81, 12.0, MASS, MASS, bins) for bins in (PER_OCTAVE, FINE))
    ground = ground_over(facets, bucket_locator(facets), Raster(-HALF, -HALF, cell, count, count))
    tallies = with_ways(tallies_over(ground, areas_of({}), 1, 9.81, Binning(scales, fine, 1e9), False))
    physics = made.flight(made.surface(0.0, 0.0, 60.0), "sliding")
    made.fly(made.engine_over("reference", terrain), physics, x, v, watch=tallies)
    return tallies.maps(len(x), ())


def laid_out(maps, values):
    """Return values of the reached cells as an image (ny, nx), with 0 in all other cells."""
    return maps.cells.everywhere(np.asarray(values), 0.0).reshape(maps.raster.ny, maps.raster.nx)


@pytest.mark.parametrize("cell", CELLS)
def test_parallel_tracks_over_a_front_pass_one_over_its_width_whatever_the_cell(cell):
    rocks, width = 40, 20.0
    y = -10.0 + (np.arange(rocks) + 0.5) * width / rocks
    x = np.stack([np.full(rocks, -15.0), y, np.full(rocks, HEIGHT)], 1)
    maps = thrown(x, (SPEED, 0.0, 0.0), cell)
    raster, image = maps.raster, laid_out(maps, passage_per_metre(maps).value)
    inside = slice(int((HALF - 15) / cell), int((HALF + 15) / cell)), slice(int((HALF - 10) / cell), int(50 / cell))
    assert image[inside[1], inside[0]] == pytest.approx(np.full(image[inside[1], inside[0]].shape, 1 / width), rel=1e-5)
    assert image.sum() * raster.cell**2 == pytest.approx(REACH, rel=1e-5), "the length of a track, per rock"
    middle = laid_out(maps, reach_probability(maps.cells, rocks))[int(HALF / cell), int(HALF / cell)]
    assert middle == pytest.approx(cell / width, abs=1e-9), "reach probability is of the cell"
    object_width = 4.0
    assert laid_out(maps, reached_over(maps, object_width))[int(HALF / cell), int(HALF / cell)] == pytest.approx(0.2)


@pytest.mark.parametrize("cell", CELLS)
def test_a_fan_passes_one_over_the_circle_at_each_distance_whatever_the_cell(cell):
    rocks = 360
    azimuth = 2.0 * math.pi * (np.arange(rocks) + 0.5) / rocks
    v = SPEED * np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(rocks)], 1)
    maps = thrown(np.tile([0.1, 0.2, HEIGHT], (rocks, 1)), v, cell)
    image = laid_out(maps, passage_per_metre(maps).value)
    fine = (np.arange(40) + 0.5) / 40
    for x0, y0 in ((5.0, 0.0), (0.0, 10.0), (10.0, 10.0), (-15.0, 5.0)):
        sx, sy = np.meshgrid(x0 + 5.0 * fine, y0 + 5.0 * fine)
        expected = (1.0 / (2.0 * math.pi * np.hypot(sx - 0.1, sy - 0.2))).mean()
        i, j, n = (int((HALF + x0) / cell), int((HALF + y0) / cell), int(5 / cell))
        assert image[j : j + n, i : i + n].mean() == pytest.approx(expected, rel=0.03)


@pytest.mark.long
def test_both_engines_and_parts_in_any_order_have_the_same_bits():
    terrain = rough()
    maps = []
    for engine in made.ENGINES:
        tallies = with_ways(over(terrain, compiled=engine == "compiled"))
        flown(terrain, tallies, engine, 60)
        maps.append(tallies.maps(60, ()))
    twice = with_ways(over(terrain))
    add_packed(twice, packed_tallies(tallies))
    add_packed(twice, packed_tallies(tallies))
    assert maps[0].cells.ways[:, 0].min() >= 0.0 and maps[0].cells.ways.max() > 1.0
    np.testing.assert_array_equal(maps[0].cells.ways, maps[1].cells.ways)
    np.testing.assert_array_equal(twice.maps(120, ()).cells.ways, 2.0 * maps[0].cells.ways)
    np.testing.assert_array_equal(passage_per_metre(twice.maps(120, ())).value, passage_per_metre(maps[0]).value)


def test_ways_are_those_of_the_stored_paths():
    """Each straight segment has 1,000 points; their share in a cell is the share of the length in this cell."""
    terrain = rough()
    tallies = with_ways(over(terrain, compiled=False))
    flights = flown(terrain, tallies, "reference", 30, "none")
    raster, paths, length = tallies.ground.raster, flights.paths, {}
    share = (np.arange(1000) + 0.5) / 1000
    for i in np.flatnonzero(paths.row[1:] == paths.row[:-1]):
        begin, end = paths.x[i, :2], paths.x[i + 1, :2]
        points = begin + share[:, None] * (end - begin)
        column, row = np.floor((points - (raster.x, raster.y)) / raster.cell).astype(int).T
        for cell, count in zip(*np.unique(row * raster.nx + column, return_counts=True), strict=True):
            length[cell] = length.get(cell, 0.0) + count / 1000 * np.linalg.norm(end - begin) / raster.cell
    maps = tallies.maps(30, ())
    told = dict(zip(maps.cells.cell.tolist(), maps.cells.ways[:, 0], strict=True))
    assert sum(told.values()) == pytest.approx(sum(length.values()), rel=1e-4)
    for cell, value in told.items():
        assert value == pytest.approx(length.get(cell, 0.0), abs=0.03)


def test_maps_without_ways_refuse_and_do_not_gather_them():
    terrain = rough()
    tallies = over(terrain, compiled=False)
    flown(terrain, tallies, "reference", 5)
    maps = tallies.maps(5, ())
    assert not maps.cells.has_ways and maps.cells.ways.size == 0
    with pytest.raises(ValueError, match="did not gather ways"):
        passage_per_metre(maps)


def few_maps(ways, rocks, cell=2.0):
    """Return maps with one cell, from path lengths (in cell sizes) of the rocks that reached it; rocks : flown."""
    sums = np.array([[ways.sum(), (ways**2).sum()]])
    cells = SimpleNamespace(ways=sums, has_ways=True)
    return SimpleNamespace(flown=rocks, raster=SimpleNamespace(cell=cell), cells=cells)


@pytest.mark.parametrize("share", [0.03, 0.3, 1.0])
def test_the_interval_holds_the_truth_as_often_as_it_says(share):
    random, rocks, held = np.random.default_rng(5), 300, 0
    truth = share * 0.8 / 2.0  # the mean path length is 0.8 cells of 2 m
    for _ in range(1000):
        passed = random.random(rocks) < share
        _, low, high = passage_per_metre(few_maps(random.uniform(0.2, 1.4, passed.sum()), rocks))
        held += bool(low[0] <= truth <= high[0])
    assert 0.92 < held / 1000 < 0.985


def test_alike_ways_have_the_interval_of_a_share_and_no_way_has_an_upper_end():
    from rpf3d_core.ensemble.statistics import wilson_interval

    _, low, high = passage_per_metre(few_maps(np.full(7, 1.0), 100))
    assert (low[0], high[0]) == pytest.approx([end / 2.0 for end in wilson_interval(7, 100)])
    value, low, high = passage_per_metre(few_maps(np.zeros(3), 100))
    assert (value[0], low[0]) == (0.0, 0.0)
    assert high[0] == pytest.approx(wilson_interval(0, 100)[1] / 2.0)


def test_classes_by_an_object_s_width_do_not_follow_the_cell():
    rocks = 40
    y = -10.0 + (np.arange(rocks) + 0.5) * 0.5
    x = np.stack([np.full(rocks, -15.0), y, np.full(rocks, HEIGHT)], 1)
    areas = {}
    for cell in CELLS:
        maps = thrown(x, (SPEED, 0.0, 0.0), cell)
        for width in (None, 4.0):
            (zone,) = matrix_zones(maps, Matrix((1.0,), (0.15,), ((None, None), (None, "high")), 95, width))
            areas[cell, width] = zone.cells.sum() * cell**2
            assert zone.object_width == width
    assert areas[1.0, None] == 0.0 and areas[5.0, None] > 500.0, "reach of a cell: 5 % at 1 m, 25 % at 5 m"
    assert min(areas[cell, 4.0] for cell in CELLS) > 500.0, "20 % of the rocks hit 4 m at any cell"
