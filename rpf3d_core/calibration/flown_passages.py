"""Compute values at a gate, and the places that rocks reached, from recorded paths, to compare with observations."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.observations import Directions
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.frame import FloatArray

HALVINGS = 40
"""Number of bisections of a path segment, after which the time of a passage is exact to rounding."""
STEP = 0.5
"""Largest distance (m) between neighbouring points of a path that are compared with an area."""


class Passages(NamedTuple):
    """The first passage of each of R rocks through a gate; NaN for a rock that did not pass.

    speed : (R,) m/s; height : (R,) m, of the rock's centre above the ground, also NaN over a hole
    """

    speed: FloatArray
    height: FloatArray

    @property
    def passed(self) -> NDArray[np.bool_]:
        """Flags (R,): True for a rock that passed."""
        return ~np.isnan(self.speed)


def passages(batch: Batch, directions: Directions, at: float, engine: Engine) -> Passages:
    """Return the first passage of each of R rocks through a gate, a vertical plane across the slope.

    Between its ends, a segment of flight is an exact parabola; a slide counts as motion with constant acceleration.

    at : m, distance of the gate along the slope, in the input's coordinates
    """
    rows = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 1]))
    first, last = _segments(rows)
    distance = directions.places(batch.pieces[:, 1:4])[:, 0] - at
    crossing = (distance[first] < 0.0) != (distance[last] < 0.0)
    _, earliest = np.unique(rows[first][crossing], return_index=True)
    begin, end = first[crossing][earliest], last[crossing][earliest]
    x, v = _at_plane(batch, begin, end, directions.axes[0], distance[begin])
    speed, height = np.full(len(batch.rows), np.nan), np.full(len(batch.rows), np.nan)
    speed[rows[begin]] = np.linalg.norm(v, axis=1)
    height[rows[begin]] = _above_ground(engine, x)
    return Passages(speed=speed, height=height)


def _segments(rows: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices (K,) of the events at the starts of K path segments, and the indices (K,) at their ends.

    Two successive events of the same rock are the ends of a path segment.

    rows : (S,) rock of each event
    """
    first = np.flatnonzero(rows[1:] == rows[:-1])
    return first, first + 1


def _at_plane(
    batch: Batch, begin: NDArray[np.int64], end: NDArray[np.int64], along: FloatArray, distance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return position (K, 3) m and velocity (K, 3) m/s of K rocks where a path segment crosses the plane of a gate.

    begin, end : (K,) rows of the event at the start and of the event at the end of the segment in `batch.pieces`
    along : (3,) unit normal of the plane; distance : (K,) m, from the plane to the start of the segment
    """
    x, v, v_end = batch.pieces[begin, 1:4], batch.pieces[begin, 4:7], batch.pieces[begin, 7:10]
    duration = np.maximum(batch.pieces[end, 0] - batch.pieces[begin, 0], 1e-12)
    acceleration = (v_end - v) / duration[:, None]
    speed, change = v @ along, 0.5 * acceleration @ along
    low, high, below = np.zeros(len(begin)), duration, distance < 0.0
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        same = (distance + t * (speed + change * t) < 0.0) == below
        low, high = np.where(same, t, low), np.where(same, high, t)
    t = (0.5 * (low + high))[:, None]
    return x + t * (v + 0.5 * acceleration * t), v + acceleration * t


def _above_ground(engine: Engine, x: FloatArray) -> FloatArray:
    """Return the heights (K,) m of points (K, 3) m above the highest ground at their places in plan.

    The height is NaN at a place without ground, for example over a hole.
    """
    if not len(x):
        return np.empty(0)
    top = np.array(x)
    top[:, 2] = engine.facets.high[2] + ABOVE_EVERYTHING
    drop, facet, _ = engine.ground_below(top).T
    return np.where(facet < 0, np.nan, x[:, 2] - (top[:, 2] - drop))


def visited(batch: Batch, inside: list[FloatArray]) -> NDArray[np.bool_]:
    """Return flags (R,): True for a rock that passed over an area in plan, or ended its flight there.

    inside : closed outlines (P, 2) m of the area, local frame; points on the paths are compared, see `path_points`
    """
    points, rocks = path_points(batch)
    found = np.zeros(len(batch.rows), dtype=bool)
    found[rocks[contained(points, inside)]] = True
    return found


def path_points(batch: Batch) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return points (P, 2) m in plan along the paths of R rocks, local frame, and the rock of each point (P,).

    The distance of neighbours on a path is at most STEP; the last point of each rock is the place where the rock ended.
    """
    rows = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 1]))
    first, last = _segments(rows)
    start, stop = batch.pieces[first, 1:3], batch.pieces[last, 1:3]
    steps = np.maximum(np.ceil(np.linalg.norm(stop - start, axis=1) / STEP).astype(np.int64), 1)
    before = np.repeat(np.cumsum(steps) - steps, steps)
    share = (np.arange(len(before)) - before) / np.repeat(steps, steps)
    points = np.repeat(start, steps, axis=0) + share[:, None] * np.repeat(stop - start, steps, axis=0)
    rocks = np.concatenate([np.repeat(rows[first], steps), np.arange(len(batch.rows))])
    return np.concatenate([points, batch.finals[:, 1:3]]), rocks


def contained(points: FloatArray, outlines: list[FloatArray]) -> NDArray[np.bool_]:
    """Return flags (N,): True for points (N, 2) m that lie in an area and not in a hole of the area.

    A point is inside if a ray from the point crosses the outlines an odd number of times.

    outlines : rings (P, 2) m of the area and of its holes
    """
    corners = np.concatenate(outlines)
    near = np.flatnonzero(((points >= corners.min(axis=0)) & (points <= corners.max(axis=0))).all(axis=1))
    x, y = points[near].T
    inside = np.zeros(len(near), dtype=bool)
    for ring in outlines:
        for (x0, y0), (x1, y1) in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            if y0 != y1:
                inside ^= ((y0 > y) != (y1 > y)) & (x < x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    flags = np.zeros(len(points), dtype=bool)
    flags[near[inside]] = True
    return flags
