"""Find the ground straight below each release, to refuse rocks that start under the ground."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.fallen import COLUMNS, FIRST, STEEPEST
from rpf3d_core.simulation.engines import Engine

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LEAST_AROUND = 2.0
"""Least distance from a release to the vertical lines around it, in crack widths: the widest edge band is one crack."""


def ground_below_releases(engine: Engine, x: FloatArray) -> FloatArray:
    """Return height (m), facet and side of the ground below releases (R, 3) m, (R, 3), as `Engine.ground_below` does.

    A rock that starts in the ground, above an overhang, sees the back of the overhanging facets below it. The back of a
    facet excludes the facet's edges (`detection.narrow_phase`), so a vertical line through an edge of an overhang may
    meet only the ground in front of the overhang. Therefore the result is also the back of a facet, or no facet, if
    this holds for vertical lines on all four sides of the release.
    """
    found = engine.ground_below(x)
    some = _to_look_around(engine, found)
    if not len(some):
        return found
    farthest = FIRST * float(engine.facets.crack)
    around = np.minimum(found[some, 0] / STEEPEST, farthest)
    beside = [_below(engine, x[some], around, column) for column in COLUMNS[1:]]
    inside = np.all([_in_the_ground(lines, found[some, 0]) for lines in beside], axis=0)
    found[some[inside]] = beside[0][inside]
    return found


def _to_look_around(engine: Engine, found: FloatArray) -> IntArray:
    """Return the rows of the releases that lie high enough above the ground found below them to look around them.

    The lines must be farther away than an edge band, and STEEPEST times closer than the ground below: at the bottom of
    a funnel, lines farther away would start in its walls. Without overhangs, no facet below a rock shows its back.
    """
    if (np.asarray(engine.facets.normals)[:, 2] >= 0.0).all():
        return np.empty(0, dtype=np.int64)
    high = found[:, 0] >= STEEPEST * LEAST_AROUND * float(engine.facets.crack)
    return np.flatnonzero((found[:, 1] >= 0) & (found[:, 2] > 0) & high)


def _below(engine: Engine, x: FloatArray, around: FloatArray, column: tuple[float, float]) -> FloatArray:
    """Return `Engine.ground_below` of places (N, 3) m, moved in the direction of a column by distances (N,) m."""
    return engine.ground_below(np.ascontiguousarray(x + around[:, None] * np.array([*column, 0.0])))


def _in_the_ground(found: FloatArray, height: FloatArray) -> NDArray[np.bool_]:
    """Return flags (N,): a line meets no facet, or the back of one about as far below as the ground, or nearer.

    height : (N,) m above the ground found straight below; the back of a steep facet may lie up to as far below it again
    """
    return (found[:, 1] < 0) | ((found[:, 2] < 0) & (found[:, 0] < 2.0 * height))
