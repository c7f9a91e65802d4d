"""Checks of polyhedra that share no code with rpf3d_core/shapes: closed surfaces, and integrals over a solid."""

from collections import Counter

import numpy as np
from scipy.spatial import Delaunay


def edge_count(faces):
    """Return the number of edges of a closed surface; fail unless each edge has exactly one face on each side.

    faces : vertex numbers of each face, counter-clockwise
    """
    sides = Counter((a, b) for face in faces for a, b in zip(face, (*face[1:], face[0]), strict=True))
    assert set(sides.values()) == {1}, "two faces run along an edge in the same direction"
    assert all((b, a) in sides for a, b in sides), "an edge has one face only"
    return len(sides) // 2


def assert_is_a_closed_convex_solid(body, tolerance=1e-9):
    """Fail unless a body is closed and convex, with plane and anticlockwise faces and unit normals.

    tolerance : distance from the plane of a face that counts as zero, as a share of the body's largest coordinate
    """
    assert len(body.corners) - edge_count(body.faces) + len(body.faces) == 2, "Euler's formula"
    used = [corner for face in body.faces for corner in face]
    assert list(dict.fromkeys(used)) == list(range(len(body.corners))), "corners in the order of first use"
    assert np.allclose(np.linalg.norm(body.normals, axis=1), 1.0, rtol=0, atol=1e-14)
    size = np.abs(body.corners).max()
    for face, normal in zip(body.faces, body.normals, strict=True):
        height = (body.corners - body.corners[face[0]]) @ normal
        assert height.max() <= tolerance * size
        assert height[list(face)].min() >= -tolerance * size
        sides = np.diff(body.corners[[*face, face[0], face[1]]], axis=0)
        assert (np.cross(sides[:-1], sides[1:]) @ normal > 0.0).all(), "every corner of a face turns left"


def integrals(points):
    """Return volume, centre of mass (3,) and inertia per unit of mass (3, 3) of the convex hull of points (P, 3).

    The hull is divided into Delaunay's tetrahedra.
    """
    points = np.asarray(points, float)
    tetrahedra = points[Delaunay(points).simplices]
    volumes = np.abs(np.linalg.det(tetrahedra[:, 1:] - tetrahedra[:, :1])) / 6
    centre = volumes @ tetrahedra.mean(axis=1) / volumes.sum()
    second = np.zeros((3, 3))
    for corners, volume in zip(tetrahedra - centre, volumes, strict=True):
        total = corners.sum(axis=0)
        second += volume / 20 * (corners.T @ corners + np.outer(total, total))
    return volumes.sum(), centre, (np.trace(second) * np.eye(3) - second) / volumes.sum()


def chirality(points):
    """Return a number (-) that stays the same if points (P, 3) rotate about the origin; a mirror changes its sign."""
    length = np.linalg.norm(points, axis=1)
    length = length / length.max()
    moments = [(points * length[:, None] ** power).mean(axis=0) for power in (1, 3, 6)]
    return np.linalg.det(moments / np.linalg.norm(moments, axis=1)[:, None])
