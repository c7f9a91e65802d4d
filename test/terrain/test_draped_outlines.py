"""Tests that outlines of areas are drawn on the ground of the area, not up the faces at its borders."""

import numpy as np

from rpf3d_core.terrain.draped_outlines import INSIDE, STEP, draped_outlines
from rpf3d_core.terrain.facets import Terrain


def bench(face: float) -> Terrain:
    """Return a floor at 0 m for x > 0, a face of width `face` (m) in plan, and a bench at 15 m, in few large facets."""
    x, z = np.array([-40.0, -face, 0.0, 40.0]), np.array([15.0, 15.0, 0.0, 0.0])
    vertices = np.array([(x[i], y, z[i]) for i in range(4) for y in (-50.0, 50.0)])
    triangles = np.array([t for i in (0, 2, 4) for t in ((i, i + 2, i + 3), (i, i + 3, i + 1))], dtype=np.int32)
    return Terrain(vertices, triangles, np.zeros(len(triangles), dtype=np.int32), ("ground",))


def closed(*corners: tuple[float, float]) -> np.ndarray:
    return np.array([*corners, corners[0]], dtype=float)


def test_an_outline_along_a_toe_does_not_climb_the_face() -> None:
    """The points of the toe have errors of 0.3 m, and the nearest vertex of many of them is on the crest."""
    noisy = [(0.3 * (-1) ** i, float(y)) for i, y in enumerate(range(-40, 41, 4))]
    for face in (5.5, 1e-3, 0.0):
        (line,) = draped_outlines(bench(face), [closed((20, 40), (20, -40), *noisy)])
        assert np.abs(line[:, 2]).max() < 0.01


def test_an_outline_on_a_face_is_on_the_face_with_points_at_short_distances() -> None:
    (line,) = draped_outlines(bench(20.0), [closed((-30, -20), (10, -20), (10, 20), (-30, 20))], raised=0.5)
    np.testing.assert_allclose(line[:, 2], np.interp(line[:, 0], (-20.0, 0.0), (15.0, 0.0)) + 0.5, atol=0.3)
    assert np.linalg.norm(np.diff(line[:, :2], axis=0), axis=1).max() < 1.5 * STEP
    np.testing.assert_array_equal(line[0], line[-1])


def test_lines_are_inside_the_area_also_around_its_holes() -> None:
    outer = closed((5, -20), (35, -20), (35, 20), (5, 20))
    hole = closed((15, -5), (25, -5), (25, 5), (15, 5))
    for turned in (outer, outer[::-1]):
        around, within = draped_outlines(bench(5.0), [turned, hole])
        assert around[:, 0].min() > 5.0 + 0.5 * INSIDE and around[:, 0].max() < 35.0 - 0.5 * INSIDE
        beyond = np.maximum(np.abs(within[:, 0] - 20.0), np.abs(within[:, 1])) - 5.0
        assert (beyond > 0.5 * INSIDE).all()


def test_an_area_too_narrow_to_move_into_keeps_its_outline() -> None:
    (line,) = draped_outlines(bench(5.0), [closed((10, 0), (10.2, 0), (10.2, 30), (10, 30))])
    assert line[:, 0].min() >= 10.0 - 1e-9 and line[:, 0].max() <= 10.2 + 1e-9


def test_parts_off_the_terrain_are_left_out() -> None:
    (line,) = draped_outlines(bench(5.0), [closed((60, 10), (20, 10), (20, -10), (60, -10))])
    assert 38.0 <= line[:, 0].max() <= 41.0 and np.isfinite(line).all()
    assert draped_outlines(bench(5.0), [closed((60, 10), (50, 10), (50, -10))]) == []
    assert draped_outlines(bench(5.0), []) == []
