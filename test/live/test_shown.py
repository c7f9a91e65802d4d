"""Tests of the shown parts of hazard maps: cells with ground, zones of facets with outlines, areas of interest."""

import numpy as np
import pytest

from rpf3d_core.hazard.maps import CellStatistics, HazardMaps, Layers, Raster
from rpf3d_core.live.cells import cells_over, cover
from rpf3d_core.live.shown_areas import MOST_STEPS, shown_areas
from rpf3d_core.live.zones import outer_edges, shown_zones
from rpf3d_core.terrain.grid_triangles import grid_triangles
from rpf3d_core.terrain.survey import mesh_terrain

SIDE = 5
"""Number of points, 1 m apart, along each side of a square floor: 4 x 4 squares, 32 facets."""


def terrain(hole=None, origin=(0.0, 0.0, 0.0), height=lambda x, y: 0.1 * x):
    y, x = np.mgrid[0:SIDE, 0:SIDE].astype(float)
    points = np.stack([x, y, height(x, y)], axis=-1) + np.array(origin)
    there = np.ones((SIDE, SIDE), dtype=bool)
    if hole:
        there[hole] = False
    return mesh_terrain(points[there], grid_triangles(there), "terrain", None)


def layers(count, cell, rocks):
    """Return layers of `count` cells with `rocks` rocks in the cells `cell`; all other values are placeholders."""
    n = len(cell)
    spread = CellStatistics(*[np.full(n, np.nan, dtype=np.float32)] * 6)
    zeros = np.zeros(n, dtype=np.int64)
    return Layers(
        count, np.array(cell), np.array(rocks), zeros, zeros, zeros, np.ones(n, dtype=np.float32), spread, spread,
        spread, 0.05,
    )  # fmt: skip


def maps(flown, facets, facet, rocks, raster=None):
    raster = raster or Raster(0.0, 0.0, 1.0, 4, 4)
    cells, none = layers(raster.nx * raster.ny, [], []), layers(1, [], [])
    return HazardMaps(flown, raster, cells, layers(facets, facet, rocks), none, none, ())


def local_raster(ground, cell=1.0, wider=0):
    """Return the raster over a floor; wider : number of additional cells on each side."""
    x, y = ground.vertices[:, :2].min(axis=0) - wider * cell
    n = round((SIDE - 1) / cell) + 2 * wider
    return Raster(float(x), float(y), cell, n, n)


@pytest.mark.parametrize("covering", [cover, cover.py_func], ids=["compiled", "plain"])
@pytest.mark.parametrize("cell", [0.25, 0.5, 1.0])
def test_cells_over_ground_have_its_height_and_others_none(covering, cell):
    ground = terrain(origin=(5e5, 4.5e6, 100.0))
    raster = local_raster(ground, cell, wider=2)
    covered, height = np.zeros(raster.nx * raster.ny, dtype=bool), np.full(raster.nx * raster.ny, np.nan, np.float32)
    covering(ground.vertices, ground.triangles, raster, covered, height)
    inner = np.zeros((raster.ny, raster.nx), dtype=bool)
    inner[2:-2, 2:-2] = True
    assert np.array_equal(covered.reshape(inner.shape), inner)
    x = raster.x + (np.arange(raster.nx) + 0.5) * cell - ground.vertices[:, 0].min()
    expected = 0.1 * np.broadcast_to(x, inner.shape)[inner] + ground.vertices[:, 2].min()
    assert np.allclose(height.reshape(inner.shape)[inner], expected, atol=1e-6)  # float32 of numbers below 1


def test_a_hole_is_no_ground_and_its_rim_has_a_height_near_by():
    ground = terrain(hole=(2, 2))
    cells = cells_over(ground, local_raster(ground))
    covered = cells.covered.reshape(4, 4)
    assert covered.sum() == 12 and not covered[1:3, 1:3].any()
    assert np.isfinite(cells.height.reshape(4, 4)[covered]).all()


def test_the_highest_ground_counts_where_several_lie_above_each_other():
    low, high = terrain(), terrain(height=lambda x, y: 7.0 + 0.0 * x)
    vertices = np.concatenate([low.vertices, low.vertices + np.array([0.0, 0.0, 7.0])])
    triangles = np.concatenate([low.triangles, low.triangles + len(low.vertices)])
    for order in (triangles, triangles[::-1]):
        both = type(low)(**{**vars(low), "vertices": vertices, "triangles": order, "zone": np.zeros(len(order), int)})
        cells = cells_over(both, local_raster(low))
        assert cells.height.min() > high.vertices[:, 2].min() + 6.0 - 0.5


def test_facets_of_a_zone_are_those_of_its_level_and_below_the_next():
    ground = terrain()
    zones = shown_zones(maps(100, 32, [0, 1, 2, 3], [1, 9, 10, 60]), ground, (0.01, 0.1, 0.5))
    assert [zone.name for zone in zones] == ["0.01", "0.1", "0.5"]
    for zone, facets in zip(zones, ([0, 1], [2], [3]), strict=True):
        assert np.allclose(zone.corners, ground.frame.points_to_input(ground.vertices[ground.triangles[facets]]))


def test_a_facet_below_every_level_is_in_no_zone():
    zones = shown_zones(maps(1000, 32, [0], [9]), terrain(), (0.01, 0.1))
    assert all(len(zone.corners) == len(zone.outline) == 0 for zone in zones)


def test_the_outline_goes_around_everything_of_at_least_its_level():
    ground = terrain()
    plan = ground.vertices[:, :2] - ground.vertices[:, :2].min(axis=0)
    square = np.flatnonzero((plan[ground.triangles] < 2.1).all(axis=(1, 2))).tolist()
    zones = shown_zones(maps(10, 32, square, [1] * 7 + [9]), ground, (0.1, 0.5))
    assert len(square) == 8
    lengths = [np.linalg.norm(np.diff(zone.outline[..., :2], axis=1)[:, 0], axis=1).sum() for zone in zones]
    assert np.isclose(lengths[0], 8.0)
    assert np.isclose(lengths[1], 2.0 + np.sqrt(2.0))


def test_an_edge_is_outer_if_one_facet_has_it():
    assert len(outer_edges(np.array([[0, 1, 2]]))) == 3
    edges = {tuple(sorted(edge)) for edge in outer_edges(np.array([[0, 1, 2], [2, 1, 3]])).tolist()}
    assert edges == {(0, 1), (0, 2), (1, 3), (2, 3)}
    assert outer_edges(np.empty((0, 3), dtype=np.int32)).shape == (0, 2)


def test_zones_are_told_in_the_coordinates_of_the_survey():
    zone = shown_zones(maps(1, 32, [0], [1]), terrain(origin=(300.0, 400.0, 50.0)), (0.5,))[0]
    assert (zone.corners.min(axis=(0, 1)) >= [300.0, 400.0, 50.0]).all()


def ring(*corners):
    return {"ramp": [np.array(corners, dtype=float)]}


def test_the_outline_of_an_area_follows_the_ground_in_the_map_frame():
    origin = (5e5, 4.5e6, 100.0)
    ground = terrain(origin=origin)
    raster = local_raster(ground, 0.25)
    x, y = ground.vertices[:, :2].min(axis=0)
    square = ring((x + 0.5, y + 0.5), (x + 3.5, y + 0.5), (x + 3.5, y + 3.5), (x + 0.5, y + 3.5))
    (line,) = shown_areas(square, cells_over(ground, raster), raster, ground.frame)["ramp"]
    assert np.array_equal(line[0], line[-1])
    assert line[:, :2].min(axis=0) == pytest.approx(np.array(origin[:2]) + 0.5)
    assert line[:, :2].max(axis=0) == pytest.approx(np.array(origin[:2]) + 3.5)
    assert np.hypot(*np.diff(line[:, :2], axis=0).T).max() <= 0.25 + 1e-9
    assert line[:, 2] == pytest.approx(origin[2] + 0.1 * (line[:, 0] - origin[0]), abs=0.1 * 0.25)


def test_a_ring_that_is_closed_already_is_the_same_line():
    ground = terrain()
    raster = local_raster(ground)
    x, y = ground.vertices[:, :2].min(axis=0)
    corners = [(x + 1.0, y + 1.0), (x + 3.0, y + 1.0), (x + 3.0, y + 3.0)]
    lines = [
        shown_areas(ring(*some), cells_over(ground, raster), raster, ground.frame)["ramp"][0]
        for some in (corners, [*corners, corners[0]])
    ]
    assert np.array_equal(*lines)


def test_an_outline_beyond_the_ground_is_as_high_as_beside_it_and_one_off_it_is_left_out():
    ground = terrain(height=lambda x, y: np.full_like(x, 7.0))
    raster = local_raster(ground)
    x, y = ground.vertices[:, :2].min(axis=0)
    cells = cells_over(ground, raster)
    out = ring((x + 2.0, y + 2.0), (x + 50.0, y + 2.0), (x + 50.0, y + 3.0))
    (line,) = shown_areas(out, cells, raster, ground.frame)["ramp"]
    assert line[:, 0].max() - line[:, 0].min() == pytest.approx(48.0)
    assert line[:, 2] == pytest.approx(np.full(len(line), 7.0))
    off = ring((x + 50.0, y), (x + 51.0, y), (x + 51.0, y + 1.0))
    assert shown_areas(off, cells, raster, ground.frame) == {"ramp": []}


def test_a_long_outline_has_so_many_points_at_most():
    ground = terrain()
    raster = local_raster(ground, 0.25)
    x, y = ground.vertices[:, :2].min(axis=0)
    long = ring((x + 1.0, y + 1.0), (x + 1e6, y + 1.0), (x + 1e6, y + 2.0))
    (line,) = shown_areas(long, cells_over(ground, raster), raster, ground.frame)["ramp"]
    assert len(line) <= MOST_STEPS + 4
