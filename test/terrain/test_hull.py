"""Tests of the convex hull in plan, with exact fractions, and of what a wrong hull did: caps through the ground."""

from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
import shapely

from rpf3d_core.simulation.capped import gap_facets
from rpf3d_core.terrain.facets import Terrain, facets_of
from rpf3d_core.terrain.plane.hull import convex_hull


def rotated_rim(rng):
    """Return points (P, 2) on the sides of a rotated rectangle, with one corner at the origin; and its area."""
    angle, wide, count = rng.uniform(0, 2 * np.pi), rng.uniform(20.0, 1000.0, 2), int(rng.integers(3, 14))
    along, start, end = np.arange(count) / count, np.zeros(count), np.ones(count)
    pairs = (along, start), (end, along), (1.0 - along, end), (start, 1.0 - along)
    rim = np.concatenate([np.stack(pair, axis=1) for pair in pairs])
    rotation = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return (rim * wide) @ rotation.T, float(np.prod(wide))


def turn(a, b, c):
    """Return twice the area of a triangle, exactly; positive if it turns left."""
    (ax, ay), (bx, by), (cx, cy) = ([Fraction(float(value)) for value in point] for point in (a, b, c))
    return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)


def is_hull(polygon, points):
    """Return True if the ring of a polygon turns right at every corner, with no point (P, 2) to the left of a side."""
    ring = shapely.get_coordinates(polygon)
    sharp = all(turn(a, b, c) < 0 for a, b, c in zip(ring[:-1], ring[1:], [*ring[2:], ring[1]], strict=True))
    return sharp and all(turn(a, b, c) <= 0 for a, b in pairwise(ring) for c in points)


def test_the_hull_of_points_on_straight_sides_up_to_rounding_is_exact():
    rng, others = np.random.default_rng(20), 0
    for case in range(1500):
        points, area = rotated_rim(rng)
        hull = convex_hull(points)
        assert hull.area == pytest.approx(area, rel=1e-12)
        others += shapely.convex_hull(shapely.multipoints(points)).area < (1.0 - 1e-9) * area
        if case < 40:
            assert is_hull(hull, points)
    assert others > 0, "the library's own hull is right in all cases: use it"


@pytest.mark.parametrize("scale", [1e-200, 1e-3, 1.0, 1e150])
def test_the_hull_of_scattered_points_is_exact(scale):
    rng = np.random.default_rng(21)
    for case in range(60):
        points = rng.normal(size=(int(rng.integers(3, 40)), 2))
        points = scale * (np.round(2 * points) / 2 if case % 2 else points)
        hull = convex_hull(points)
        if hull.geom_type == "Polygon":
            assert is_hull(hull, points)
        else:
            assert all(turn(points[0], points[1], c) == 0 for c in points)


def test_points_on_a_line_have_no_polygon():
    line = convex_hull(np.array([[0.0, 0.0], [2.0, 2.0], [1.0, 1.0], [-0.0, 0.0]]))
    assert line.geom_type == "LineString" and shapely.get_coordinates(line).tolist() == [[2.0, 2.0], [0.0, 0.0]]
    assert convex_hull(np.array([[3.0, 4.0], [3.0, 4.0]])) == shapely.Point(3.0, 4.0)


def test_no_cap_runs_through_a_rotated_rectangular_terrain():
    rng, cells = np.random.default_rng(22), 10
    i, j = (index.ravel() for index in np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij"))
    a = i * (cells + 1) + j
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    triangles = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    zone = np.zeros(len(triangles), np.int32)
    for _ in range(200):
        angle, wide = rng.uniform(0, 2 * np.pi), rng.uniform(50.0, 500.0, 2)
        x, y = (axis.ravel() for axis in np.meshgrid(*(np.linspace(0, w, cells + 1) for w in wide), indexing="ij"))
        turned = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
        terrain = Terrain(np.stack([*turned, -0.7 * x], axis=1), triangles, zone, ())
        caps = gap_facets(terrain, facets_of(terrain).tolerance)
        if caps is not None:
            around = shapely.polygons([(turned[0][k], turned[1][k]) for k in (0, cells, -1, -cells - 1)]).boundary
            middles = caps.facets.corners.reshape(-1, 3, 3)[:, :, :2].mean(axis=1)
            assert shapely.distance(around, shapely.points(middles)).max() < 1e-6
