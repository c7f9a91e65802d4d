"""Find the place on the terrain under the mouse, from the ray that the browser sends."""

import numpy as np

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray

AT_ONCE = 250_000
"""Number of facets that are compared with a ray in one step, to save memory."""
PARALLEL = 1e-30
"""Determinant (m^3) up to which a ray counts as parallel to a facet."""


def place_on(terrain: Terrain, near: FloatArray, far: FloatArray) -> FloatArray | None:
    """Return the first place (3,) m where a ray meets the terrain, local frame; None if the ray misses the terrain.

    Source: Moeller and Trumbore (1997), Fast, minimum storage ray/triangle intersection.

    near, far : (3,) m, start of the ray, and a farther point of the ray
    """
    start, along = np.asarray(near, dtype=float), np.asarray(far, dtype=float) - np.asarray(near, dtype=float)
    parts = (terrain.triangles[i : i + AT_ONCE] for i in range(0, len(terrain.triangles), AT_ONCE))
    t = min((_first(terrain.vertices[part], start, along) for part in parts), default=np.inf)
    return None if np.isinf(t) else start + t * along


def _first(corners: FloatArray, start: FloatArray, along: FloatArray) -> float:
    """Return the smallest t >= 0 at which start + t * along is on one of the triangles (N, 3, 3) m; inf for none."""
    a, first, second = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    normal = np.cross(along, second)
    determinant = np.einsum("ij,ij->i", first, normal)
    meets = np.abs(determinant) > PARALLEL
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=meets)
    from_a = start - a
    u = np.einsum("ij,ij->i", from_a, normal) * inverse
    across = np.cross(from_a, first)
    v = (across @ along) * inverse
    t = np.einsum("ij,ij->i", second, across) * inverse
    inside = meets & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0) & (t >= 0.0)
    return float(t[inside].min()) if inside.any() else np.inf
