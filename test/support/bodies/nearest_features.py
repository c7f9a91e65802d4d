"""Compute the distance between a convex body and a triangle by comparing all pairs of features, in long doubles.

The features are corners, edges and faces.
"""

from typing import NamedTuple

import numpy as np
from scipy.spatial import ConvexHull

WIDE = np.longdouble


# --- bodies and facets ------------------------------------------------------------------------------------------------


def box(*lengths: float) -> np.ndarray:
    signs = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    return signs * lengths


def round_body(rng, count: int, *axes: float) -> np.ndarray:
    c = rng.normal(size=(count, 3))
    return c / np.linalg.norm(c, axis=1)[:, None] * axes


def prism(sides: int, height: float) -> np.ndarray:
    a = 2 * np.pi * np.arange(sides) / sides
    ring = np.column_stack((np.cos(a), np.sin(a)))
    return np.vstack([np.column_stack((ring, np.full(sides, z))) for z in (-height / 2, height / 2)])


def bodies() -> dict[str, np.ndarray]:
    rng = np.random.default_rng(5)
    return {
        "cube": box(1.0, 1.0, 1.0),
        "plate": box(2.0, 1.5, 0.1),
        "rod": box(3.0, 0.2, 0.2),
        "prism": prism(24, 0.5),
        "equant": round_body(rng, 40, 1.0, 0.9, 0.8),
        "flat": round_body(rng, 200, 1.0, 0.8, 0.2),
        "long": round_body(rng, 12, 1.5, 0.5, 0.4),
    }


BODIES = bodies()


class Hull(NamedTuple):
    """Corners (N, 3), faces (F, 3, 3) and edges (E, 2, 3) of a body, in extended precision.

    The corners of a face are counter-clockwise, seen from outside.
    """

    corners: np.ndarray
    faces: np.ndarray
    edges: np.ndarray


def hull_of(corners: np.ndarray) -> Hull:
    hull = ConvexHull(corners)
    wide = corners.astype(WIDE)
    out = hull.simplices.copy()
    for face, plane in zip(out, hull.equations, strict=True):
        a, b, c = corners[face]
        if np.cross(b - a, c - a) @ plane[:3] < 0:
            face[[1, 2]] = face[[2, 1]]
    pairs = {tuple(sorted((f[i], f[(i + 1) % 3]))) for f in out for i in range(3)}
    return Hull(wide, wide[out], wide[np.array(sorted(pairs))])


HULLS = {name: hull_of(corners) for name, corners in BODIES.items()}


# --- the distance by all pairs of features ----------------------------------------------------------------------------


def dots(a, b):
    return (a * b).sum(-1)


def wide_cross(a, b):
    return np.stack(
        [a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
         a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
         a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]], -1,
    )  # fmt: skip


def point_segment(p, a, b):
    """Return the points (..., 3) on the segments from a to b that are nearest to points p; arrays are broadcast."""
    d = b - a
    t = np.clip(dots(p - a, d) / dots(d, d), 0, 1)
    return a + t[..., None] * d


def point_triangle(p, a, b, c):
    """Return the points (..., 3) on the triangles a b c that are nearest to points p; arrays are broadcast."""
    n = wide_cross(b - a, c - a)
    inside = True
    for u, v in ((a, b), (b, c), (c, a)):
        inside = inside & (dots(wide_cross(v - u, p - u), n) >= 0)
    foot = p - (dots(p - a, n) / dots(n, n))[..., None] * n
    best = np.where(inside[..., None], foot, np.nan)
    for u, v in ((a, b), (b, c), (c, a)):
        q = point_segment(p, u, v)
        nearer = np.isnan(best[..., 0]) | (dots(p - q, p - q) < dots(p - best, p - best))
        best = np.where(nearer[..., None], q, best)  # also if inside, because the foot on a sliver is inexact
    return best


def crossing_lines(a, b, c, d):
    """Return the nearest points (..., 3) of the lines a b and c d if both lie within the segments, else a and c.

    `point_triangle` finds nearest points at the ends of segments. Arrays are broadcast.
    """
    u, v, w = b - a, d - c, c - a
    n = wide_cross(u, v)
    square = np.where(dots(n, n) > 0, dots(n, n), 1)
    s, t = dots(wide_cross(w, v), n) / square, dots(wide_cross(w, u), n) / square
    within = (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    s, t = np.where(within, s, 0), np.where(within, t, 0)
    return a + s[..., None] * u, c + t[..., None] * v


def pierced(a, b, faces) -> bool:
    """Return True if one of the segments from a to b, (S, 3) each, passes through one of faces (F, 3, 3)."""
    p, q, r = faces[:, 0], faces[:, 1], faces[:, 2]
    n = wide_cross(q - p, r - p)
    a, b = a[:, None], b[:, None]
    from_a, from_b = dots(a - p, n), dots(b - p, n)
    crosses = from_a * from_b <= 0
    share = from_a / np.where(crosses & (from_a != from_b), from_a - from_b, 1)
    x, inside = a + share[..., None] * (b - a), crosses
    for u, v in ((p, q), (q, r), (r, p)):
        inside = inside & (dots(wide_cross(v - u, x - u), n) >= 0)
    return bool(inside.any())


def by_features(hull: Hull, facet: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    """Return the distance between body and facet (3, 3), and the nearest points (3,) of the body and of the facet.

    If they overlap, the distance is 0, and both points are the facet's first corner.
    """
    f = facet.astype(WIDE)
    ring = np.roll(f, -1, axis=0)
    planes = wide_cross(hull.faces[:, 1] - hull.faces[:, 0], hull.faces[:, 2] - hull.faces[:, 0])
    inside = (dots(f[:, None] - hull.faces[:, 0], planes) <= 0).all(1).any()
    through = pierced(f, ring, hull.faces) or pierced(hull.edges[:, 0], hull.edges[:, 1], f[None])
    if inside or through:
        return 0.0, f[0], f[0]
    of_facet = point_triangle(hull.corners, f[0], f[1], f[2])
    of_faces = point_triangle(f[:, None], hull.faces[:, 0], hull.faces[:, 1], hull.faces[:, 2])
    on_edges, on_sides = crossing_lines(hull.edges[:, None, 0], hull.edges[:, None, 1], f, ring)
    at_corners = np.broadcast_to(f[:, None], of_faces.shape)
    body = np.concatenate([hull.corners, of_faces.reshape(-1, 3), on_edges.reshape(-1, 3)])
    ground = np.concatenate([of_facet, at_corners.reshape(-1, 3), on_sides.reshape(-1, 3)])
    square = dots(body - ground, body - ground)
    i = int(np.argmin(square))
    return float(np.sqrt(square[i])), body[i], ground[i]
