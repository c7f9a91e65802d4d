"""Compute how deep convex bodies and triangles overlap, with separating axes in NumPy, without code of the engines.

A convex body and a triangle are apart if and only if a plane at right angles to one of these axes separates them: a
normal of a face of the body, the triangle's normal, or the cross product of an edge of each. Otherwise the smallest
overlap along these axes is the depth of the overlap: the shortest movement of the body that separates both.
Source: Gottschalk, Lin & Manocha 1996, SIGGRAPH 96:171.
"""

from typing import NamedTuple

import numpy as np

from rpf3d_core.shapes.polyhedron import Polyhedron

PAIRS = 4_000
"""Number of pairs of a pose and a triangle that are computed at once, to limit the memory."""
PARALLEL = 1e-9
"""Length of the cross product of two unit vectors below which the vectors count as parallel."""


class Solid(NamedTuple):
    """A convex body in its own axes: corners (C, 3) m, face normals (F, 3), offsets (F,) m, edge directions (E, 3)."""

    corners: np.ndarray
    normals: np.ndarray
    offsets: np.ndarray
    edges: np.ndarray


def solid_of(shape: Polyhedron) -> Solid:
    """Return the corners, face normals and edge directions of a polyhedron as a `Solid`."""
    pairs = {tuple(sorted((f[i], f[i - 1]))) for f in shape.faces for i in range(len(f))}
    a, b = np.array(sorted(pairs)).T
    edges = unit(shape.corners[b] - shape.corners[a])
    edges *= np.where((edges @ (0.61, 0.31, 0.73)) < 0.0, -1.0, 1.0)[:, None]
    first = np.array([shape.corners[f[0]] for f in shape.faces])
    offsets = np.einsum("fi,fi->f", first, shape.normals)
    return Solid(shape.corners, shape.normals, offsets, np.unique(edges.round(12), axis=0))


def unit(a: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) scaled to length 1; zero vectors stay zero."""
    length = np.linalg.norm(a, axis=-1, keepdims=True)
    return np.asarray(a / np.where(length > 0.0, length, 1.0))


def matrices(q: np.ndarray) -> np.ndarray:
    """Return the rotation matrices (S, 3, 3) of orientations (S, 4), from the body's axes to those of the triangles."""
    w, x, y, z = (q / np.linalg.norm(q, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.array(rows).transpose(2, 0, 1)


def near_pairs(solid: Solid, x: np.ndarray, triangles: np.ndarray, band: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the pairs of a pose and a triangle that are near each other: numbers of poses (P,) and triangles (P,).

    A pair is near if the triangle's box is within the body's largest radius plus `band` (m) of the body's centre.
    x : centres (S, 3) m; triangles : (N, 3, 3) m
    """
    reach = np.linalg.norm(solid.corners, axis=1).max() + band
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    poses, facets = [], []
    for first in range(0, len(x), 500):
        some = x[first : first + 500]
        away = np.maximum(np.maximum(low[None] - some[:, None], some[:, None] - high[None]), 0.0)
        i, k = np.nonzero((away * away).sum(-1) <= reach * reach)
        poses.append(i + first)
        facets.append(k)
    return np.concatenate(poses), np.concatenate(facets)


def gaps(solid: Solid, x: np.ndarray, q: np.ndarray, triangles: np.ndarray, band: float = 0.0) -> np.ndarray:
    """Return the smallest gap (S,) m between a body and triangles (N, 3, 3) m for each pose; inf if none is near.

    The gap to one triangle is the largest gap along all axes. Minus a negative gap is the depth of an overlap. A
    positive gap is at most the distance, and equals it if a nearest point lies inside a face, or both lie inside edges.
    Gaps above `band` (m) may be missing or too small. x : centres (S, 3) m; q : orientations (S, 4)
    """
    poses, facets = near_pairs(solid, x, triangles, band)
    least, turns = np.full(len(x), np.inf), matrices(q)
    for first in range(0, len(poses), PAIRS):
        i, k = poses[first : first + PAIRS], facets[first : first + PAIRS]
        local = np.einsum("pvi,pij->pvj", triangles[k] - x[i][:, None], turns[i])
        gap = _by_faces(solid, local)
        closer = np.flatnonzero(gap < band + 1e-12)
        for part in np.array_split(closer, max(len(closer) // 300, 1)):
            if len(part):
                gap[part] = np.maximum(gap[part], _by_edges(solid, local[part]))
        np.minimum.at(least, i, gap)
    return least


def _by_faces(solid: Solid, local: np.ndarray) -> np.ndarray:
    """Return the largest gap (P,) m between the body and each of triangles (P, 3, 3) m along the normals of both.

    local : triangles in the body's axes
    """
    heights = np.einsum("pvi,fi->pvf", local, solid.normals).min(axis=1) - solid.offsets
    n = unit(np.cross(local[:, 1] - local[:, 0], local[:, 2] - local[:, 0]))
    along = np.einsum("ci,pi->pc", solid.corners, n) - np.einsum("pi,pi->p", local[:, 0], n)[:, None]
    real = (n != 0.0).any(axis=1)
    own = np.where(real, np.maximum(along.min(axis=1), -along.max(axis=1)), -np.inf)
    return np.asarray(np.maximum(heights.max(axis=1), own))


def _by_edges(solid: Solid, local: np.ndarray) -> np.ndarray:
    """Return the largest gap (P,) m between the body and each of triangles (P, 3, 3) m along cross products of edges.

    local : triangles in the body's axes
    """
    sides = unit(np.roll(local, -1, axis=1) - local)
    axes = np.cross(solid.edges[None, :, None], sides[:, None]).reshape(len(local), -1, 3)
    length = np.linalg.norm(axes, axis=-1)
    axes = axes / np.where(length > PARALLEL, length, 1.0)[..., None]
    body, facet = axes @ solid.corners.T, np.einsum("pai,pvi->pav", axes, local)
    gap = np.maximum(body.min(-1) - facet.max(-1), facet.min(-1) - body.max(-1))
    return np.asarray(np.where(length > PARALLEL, gap, -np.inf).max(axis=1))
