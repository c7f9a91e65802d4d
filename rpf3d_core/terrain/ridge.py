"""Make the shape of a berm along a line in plan: convex polygons with heights above the ground."""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.frame import FloatArray

SHARPEST = 0.2
"""Least value of 1 + cos(angle) at a bend of a berm's line: the line may bend by at most 143 degrees."""


class Ridge(NamedTuple):
    """A berm as K convex polygons in plan, each with heights above the ground at its corners.

    corners : K arrays (N, 2) m, one for each polygon with N corners, counter-clockwise in plan
    heights : K arrays (N,) m above the ground, at these corners
    """

    corners: tuple[FloatArray, ...]
    heights: tuple[FloatArray, ...]


def ridge_along(line: FloatArray, height: float, width: float, crest: float) -> Ridge | None:
    """Return the shape of a berm along a line (P, 2) m in plan.

    The result is None if the line bends too sharply for the berm's width.

    height : m, above the ground; width, crest : m, width at the foot and at the top, 0 <= crest < width

    At both ends of the line the berm has its full height. Beyond the ends the berm slopes down, as on its sides.
    """
    way = np.diff(line, axis=0)
    along = way / np.hypot(way[:, 0], way[:, 1])[:, None]
    left = np.stack([-along[:, 1], along[:, 0]], axis=1)
    bend = 1.0 + (left[1:] * left[:-1]).sum(axis=1)
    if (bend < SHARPEST).any():
        return None
    across = np.concatenate([left[:1], (left[1:] + left[:-1]) / bend[:, None], left[-1:]])
    inner, outer = 0.5 * crest, 0.5 * width
    for side in (-1.0, 1.0):
        foot = line + side * outer * across
        if ((np.diff(foot, axis=0) * along).sum(axis=1) <= 0.0).any():
            return None
    pieces = list(_sides(line, across, inner, outer, height))
    pieces += _end(line[0], -along[0], inner, outer, height) + _end(line[-1], along[-1], inner, outer, height)
    return Ridge(tuple(corners for corners, _ in pieces), tuple(heights for _, heights in pieces))


def _sides(
    line: FloatArray, across: FloatArray, inner: float, outer: float, height: float
) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield the top and both slopes of a berm along each straight part of its line: corners (4, 2), heights (4,) m.

    line : (P, 2) m; across : (P, 2) (-), vector from each point of the line to the parallel line 1 m to the left
    inner, outer : m, distances of the edges of the crest and of the foot from the line; height : m, of the crest
    """
    edges = [line + offset * across for offset in (-outer, -inner, inner, outer)]
    rises = (0.0, height, height, 0.0)
    for i in range(len(line) - 1):
        for (right, low), (left, high) in pairwise(zip(edges, rises, strict=True)):
            corners = np.array([right[i], right[i + 1], left[i + 1], left[i]])
            if not np.array_equal(right[i], left[i]):
                yield corners, np.array([low, low, high, high])


def _end(
    end: FloatArray, onward: FloatArray, inner: float, outer: float, height: float
) -> list[tuple[FloatArray, FloatArray]]:
    """Return the three slopes of a berm beyond an end of its line: one ahead, and one on each side.

    Each slope is given by corners (N, 2) m in plan and heights (N,) m above the ground.

    end : (2,) m; onward : (2,) unit, along the line and away from the berm
    inner, outer : m, distances of the edges of the crest and of the foot from the line; height : m, of the crest
    """
    left = np.array([-onward[1], onward[0]])
    tip = end + (outer - inner) * onward
    a, b, c, d = end + inner * left, end - inner * left, tip - outer * left, tip + outer * left
    front = [a, b, c, d] if inner > 0.0 else [a, c, d]
    rises = [height, height, 0.0, 0.0] if inner > 0.0 else [height, 0.0, 0.0]
    beside = (np.array([b, end - outer * left, c]), np.array([a, d, end + outer * left]))
    return [(np.array(front), np.array(rises)), *((corners, np.array([height, 0.0, 0.0])) for corners in beside)]


def height_at(ridge: Ridge, points: FloatArray, slack: float) -> FloatArray:
    """Return the height (N,) m of a ridge above the ground at points (N, 2) m in plan; 0 outside the ridge.

    slack : m, distance outside a polygon within which a point counts as inside the polygon
    """
    height = np.zeros(len(points))
    for corners, heights in zip(ridge.corners, ridge.heights, strict=True):
        inside = np.ones(len(points), dtype=bool)
        for k in range(len(corners)):
            edge = corners[(k + 1) % len(corners)] - corners[k]
            inside &= left_of(points, corners[k], edge) >= -slack
        u, w = corners[1] - corners[0], corners[-1] - corners[0]
        area = u[0] * w[1] - u[1] * w[0]
        s = ((points[:, 0] - corners[0, 0]) * w[1] - (points[:, 1] - corners[0, 1]) * w[0]) / area
        t = ((points[:, 1] - corners[0, 1]) * u[0] - (points[:, 0] - corners[0, 0]) * u[1]) / area
        here = heights[0] + s * (heights[1] - heights[0]) + t * (heights[-1] - heights[0])
        height = np.where(inside, np.maximum(height, np.clip(here, 0.0, heights.max())), height)
    return height


def left_of(points: FloatArray, begin: FloatArray, edge: FloatArray) -> FloatArray:
    """Return the distances (N,) m of points (N, 2) m from a line in plan: positive on its left, negative on its right.

    begin : (2,) m, a point of the line; edge : (2,) direction of the line, of any length
    """
    return np.asarray(
        (edge[0] * (points[..., 1] - begin[1]) - edge[1] * (points[..., 0] - begin[0])) / np.hypot(edge[0], edge[1])
    )
