"""Find the ground straight below each release, to refuse rocks that start under the ground."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.closest import closest_facet
from rpf3d_core.detection.fallen import COLUMNS, FIRST, STEEPEST
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.vectors import dot, subtract

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEAST_AROUND = 2.0
"""Least distance from a release to the four vertical lines searched around it, in crack widths (`Facets.crack`).

The edge band of a facet is at most one crack width wide.
"""
LEAST_HEIGHT = 4.0
"""Least height of a release above ground, in crack widths, at which vertical lines around the release are searched.

A lower rock still hits the facet whose edge the vertical line through the release misses.
"""
INSIDE = 1e-6
"""Relative tolerance (-) for the test that the closest point of a facet lies inside the facet.

There, the distance to the facet equals the distance to the facet's plane.
"""


def ground_below_releases(engine: Engine, x: FloatArray) -> FloatArray:
    """Return height above ground (m), facet and side (R, 3) straight below releases x (R, 3) m.

    The result has the columns of `Reference.ground_below`. The facet is below 0 without ground below the release. The
    side is 1 for the free side of the facet, -1 for the back.

    A rock that starts inside the ground, above an overhang, has the back of an overhanging facet below it. But the back
    of a facet excludes the facet's edges (`detection.narrow_phase`). A vertical line through an edge of the overhang
    may therefore miss the back, and meet only the ground under the overhang.

    So four more vertical lines around such a release are searched. If at least one of them meets the back of a facet,
    this facet is the result in two cases: all four lines start in the ground, or the release lies behind the facet that
    is closest to the release. The second case is needed above the foot of an overhang, where one of the four lines may
    also miss the back, because it passes through the same edge as the line below the release.
    """
    found = engine.ground_below(x)
    some = _to_look_around(engine, found)
    if not len(some):
        return found
    height, crack = found[some, 0], float(engine.facets.crack)
    around = np.clip(height / STEEPEST, LEAST_AROUND * crack, FIRST * crack)
    beside = np.stack([_below(engine, x[some], around, column) for column in COLUMNS[1:]])
    backs = _meet_a_back(beside, height)
    for i in np.flatnonzero(backs.any(0)):
        if _all_in_the_ground(beside[:, i], backs[:, i]) or _closest_shows_its_back(engine, x[some[i]], height[i]):
            found[some[i]] = beside[backs[:, i].argmax(), i]
    return found


def _to_look_around(engine: Engine, found: FloatArray) -> IntArray:
    """Return the rows (N,) of the releases around which further vertical lines are searched.

    These releases lie at least LEAST_HEIGHT crack widths above the free side of a facet. On terrain without overhangs
    the result is empty, because no facet shows its back to a rock above.
    found : (R, 3) height (m), facet and side of the ground below each release, from `Engine.ground_below`
    """
    if (np.asarray(engine.facets.normals)[:, 2] >= 0.0).all():
        return np.empty(0, dtype=np.int64)
    high = found[:, 0] >= LEAST_HEIGHT * float(engine.facets.crack)
    return np.flatnonzero((found[:, 1] >= 0) & (found[:, 2] > 0) & high)


def _below(engine: Engine, x: FloatArray, around: FloatArray, column: tuple[float, float]) -> FloatArray:
    """Return the ground (N, 3) below points next to x (N, 3) m, as from `Engine.ground_below`.

    around : (N,) m, horizontal distance of each point from x; column : (2,) direction in plan from x to the points
    """
    return engine.ground_below(np.ascontiguousarray(x + around[:, None] * np.array([*column, 0.0])))


def _meet_a_back(found: FloatArray, height: FloatArray) -> NDArray[np.bool_]:
    """Return flags (4, N): True if a vertical line meets the back of a facet, less than twice `height` below its start.

    found : (4, N, 3) height (m), facet and side of the ground below the starts of the lines
    height : (N,) m, of the release above the ground below it
    The factor 2 allows for steep facets.
    """
    return (found[:, :, 1] >= 0) & (found[:, :, 2] < 0) & (found[:, :, 0] < 2.0 * height)


def _all_in_the_ground(found: FloatArray, backs: NDArray[np.bool_]) -> bool:
    """Return True if all lines around a release start in the ground: each meets the back of a facet, or no facet.

    found : (4, 3) height, facet (below 0 for none) and side of the ground below the start of each line
    backs : (4,) True for a line that meets the back of a facet
    """
    return bool((backs | (found[:, 1] < 0)).all())


def _closest_shows_its_back(engine: Engine, x: FloatArray, radius: float) -> bool:
    """Return True if a point x (3,) m lies behind its closest facet, deeper than LEAST_AROUND crack widths.

    Only a closest point inside the facet counts: at an edge, the side of one facet does not show where the ground is.
    radius : m, facets farther away are not searched
    """
    place = (float(x[0]), float(x[1]), float(x[2]))
    distance, facet = closest_facet(engine.locator, engine.facets, place, float(radius))
    if facet < 0:
        return False
    depth = -dot(stored_normal(engine.facets, facet), subtract(place, corner(engine.facets, facet, 0)))
    return bool(depth > LEAST_AROUND * engine.facets.crack and depth > (1.0 - INSIDE) * distance)
