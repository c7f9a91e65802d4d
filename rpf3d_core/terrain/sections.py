"""Find the ground at points and along lines in plan, exactly from the facets, to place objects on a terrain.

If several sheets of ground lie above each other, the highest sheet counts.
"""

from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray

AT_ONCE = 65_536
"""Number of facets that are processed together, to limit the memory."""
NEAR = 1e-9
"""Share of a facet's width in plan (-) by which the facet is widened: every point on an edge is then in a facet."""
SHORTEST = 1e-6
"""Longest part of a line (m) without ground that counts as a crack and not as a hole.

Facets whose heights (m) differ by less than this value count as equally high.
"""


class Section(NamedTuple):
    """The ground along a line in plan, as N segments in order, each over one facet.

    share : (N, 2) begin and end of each segment, as shares of the line's length (-)
    z : (N, 2) m, height of the ground at begin and end; facet : (N,) facet under each segment
    """

    share: FloatArray
    z: FloatArray
    facet: NDArray[np.int64]


def ground_at(terrain: Terrain, points: FloatArray) -> tuple[FloatArray, NDArray[np.int64]]:
    """Return the height (N,) m of the ground at points (N, 2) m in plan, and the facet (N,) at each point.

    Without ground the height is -inf and the facet is -1.
    """
    z, facet = np.full(len(points), -np.inf), np.full(len(points), -1, dtype=np.int64)
    for f, p in _pairs(terrain, points):
        corners = terrain.vertices[terrain.triangles[f]]
        height, inside = _height_in(corners, points[p])
        f, p, height = f[inside], p[inside], height[inside]
        order = np.lexsort((-f, height, p))  # for each point the highest is last; of equal heights the first facet
        f, p, height = f[order], p[order], height[order]
        last = np.append(p[1:] != p[:-1], True) if len(p) else np.empty(0, dtype=bool)
        f, p, height = f[last], p[last], height[last]
        higher = height > z[p]
        z[p[higher]], facet[p[higher]] = height[higher], f[higher]
    return z, facet


def _height_in(corners: FloatArray, points: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the height (N,) m of each facet at its point in plan, and flags (N,): true if the point lies in the facet.

    corners : (N, 3, 3) m, of the facets; points : (N, 2) m, one for each facet
    """
    a, u, w = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]
    flat = area == 0.0
    area = np.where(flat, 1.0, area)
    x, y = points[:, 0] - a[:, 0], points[:, 1] - a[:, 1]
    s, t = (x * w[:, 1] - y * w[:, 0]) / area, (u[:, 0] * y - u[:, 1] * x) / area
    inside = ~flat & (s >= -NEAR) & (t >= -NEAR) & (s + t <= 1.0 + NEAR)
    return a[:, 2] + s * u[:, 2] + t * w[:, 2], inside


def _pairs(terrain: Terrain, points: FloatArray) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Yield pairs of a facet and a point near the facet's box in plan: facets (P,) and points (P,).

    Only these pairs need the exact test whether the point lies in the facet. The points are sorted into rows of a grid,
    and by x in each row, so that the points near a box are found quickly.
    """
    if not len(points):
        return
    low, high = points.min(axis=0), points.max(axis=0)
    rows = max(int(np.sqrt(len(points))), 1)
    depth = (high[1] - low[1]) / rows or 1.0
    width = (high[0] - low[0]) or 1.0
    row = np.clip(((points[:, 1] - low[1]) / depth).astype(np.int64), 0, rows - 1)
    order = np.lexsort((points[:, 0], row))
    key = 2.0 * row[order] + (points[order, 0] - low[0]) / width  # in [2 row, 2 row + 1]
    for begin in range(0, len(terrain.triangles), AT_ONCE):
        corners = terrain.vertices[terrain.triangles[begin : begin + AT_ONCE].ravel()].reshape(-1, 3, 3)[..., :2]
        slack = NEAR * np.ptp(corners, axis=1).max(axis=1)
        left, right = corners[..., 0].min(axis=1) - slack, corners[..., 0].max(axis=1) + slack
        bottom, top = corners[..., 1].min(axis=1) - slack, corners[..., 1].max(axis=1) + slack
        near = np.flatnonzero((right >= low[0]) & (left <= high[0]) & (top >= low[1]) & (bottom <= high[1]))
        first = np.clip(np.floor((bottom[near] - low[1]) / depth).astype(np.int64), 0, rows - 1)
        last = np.clip(np.floor((top[near] - low[1]) / depth).astype(np.int64), 0, rows - 1)
        facet, within = _spread(near, last - first + 1)
        at_row = np.repeat(first, last - first + 1) + within
        # The fraction within a row has a rounding error of up to 2^-52 of the largest key.
        slip = 2.0**-50 * (2.0 * rows + 1.0)
        start = np.searchsorted(key, 2.0 * at_row + np.clip((left[facet] - low[0]) / width, 0.0, 1.0) - slip)
        stop = np.searchsorted(key, 2.0 * at_row + np.clip((right[facet] - low[0]) / width, 0.0, 1.0) + slip)
        f, number = _spread(facet, stop - start)
        yield f + begin, order[np.repeat(start, stop - start) + number]


def _spread(values: NDArray[np.int64], counts: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return values, each repeated as often as its count, and the number of each repetition from 0; both (M,).

    values, counts : (N,); M is the sum of the counts
    """
    ends = np.cumsum(counts)
    total = int(ends[-1]) if len(ends) else 0
    return np.repeat(values, counts), np.arange(total) - np.repeat(ends - counts, counts)


def section_of(terrain: Terrain, begin: FloatArray, end: FloatArray) -> Section | None:
    """Return the ground along a straight line in plan from `begin` to `end` (2,) m.

    The result is None if a part of the line longer than SHORTEST has no ground.
    """
    length = float(np.hypot(*(end - begin)))
    facets = _facets_near(terrain, begin, end)
    corners = terrain.vertices[terrain.triangles[facets]]
    first, last = _shares_over(corners, begin, end)
    over = last - first > 0.0
    facets, corners, first, last = facets[over], corners[over], first[over], last[over]
    edges = np.unique(np.concatenate([[0.0, 1.0], first, last]))
    edges = edges[np.append(True, np.diff(edges) * length > SHORTEST)]
    edges[-1] = 1.0
    pieces = []
    for share in pairwise(edges):
        there = np.flatnonzero((first <= 0.5 * sum(share)) & (last >= 0.5 * sum(share)))
        if not len(there):
            return None
        cuts = _crossings(corners[there], begin, end, share)
        for part in pairwise([share[0], *cuts[np.diff(cuts, prepend=share[0]) * length > SHORTEST], share[1]]):
            middle = begin + 0.5 * sum(part) * (end - begin)
            highest = there[np.argmax(_height_in(corners[there], np.tile(middle, (len(there), 1)))[0])]
            at = np.array([begin + s * (end - begin) for s in part])
            z, _ = _height_in(np.repeat(corners[[highest]], 2, axis=0), at)
            pieces.append((part, z, facets[highest]))
    shares, heights, numbers = zip(*pieces, strict=True)
    return Section(share=np.array(shares), z=np.array(heights), facet=np.array(numbers, dtype=np.int64))


def _crossings(corners: FloatArray, begin: FloatArray, end: FloatArray, share: tuple[float, float]) -> FloatArray:
    """Return the places (K,) on a part of a line where another facet becomes the highest, because two facets cross.

    A place is given as a share of the line's length, from 0 at `begin` to 1 at `end`; places are in ascending order.
    Facets whose heights differ by less than SHORTEST (m) at both ends of the part count as one facet.

    corners : (N, 3, 3) m, of the facets that lie under the whole part
    begin, end : (2,) m, ends of the line; share : the ends of the part, as shares of the line's length
    """
    both = [_height_in(corners, np.tile(begin + s * (end - begin), (len(corners), 1)))[0] for s in share]
    one, other = np.triu_indices(len(corners), 1)
    before, after = (z[one] - z[other] for z in both)
    cross = (before * after < 0.0) & (np.maximum(np.abs(before), np.abs(after)) > SHORTEST)
    at = before[cross] / (before[cross] - after[cross])
    highest = np.max(both[0] + at[:, None] * (both[1] - both[0]), axis=1, initial=-np.inf)
    z = both[0][one[cross]] + at * (both[1] - both[0])[one[cross]]
    return np.unique(share[0] + at[highest - z <= SHORTEST] * (share[1] - share[0]))


def _facets_near(terrain: Terrain, begin: FloatArray, end: FloatArray) -> NDArray[np.int64]:
    """Return the facets (N,) that a line may cross in plan; only these facets then need the exact test.

    A facet cannot cross the line if their boxes do not overlap, or if the facet lies entirely on one side of the line.

    begin, end : (2,) m, ends of the line
    """
    low, high = np.minimum(begin, end), np.maximum(begin, end)
    x, y = (terrain.vertices[:, k] for k in (0, 1))
    # One bit per side of the box and of the line: a bit that all three vertices share means that the facet is outside.
    side = (end[0] - begin[0]) * (y - begin[1]) - (end[1] - begin[1]) * (x - begin[0])
    off = (x < low[0]) + 2 * (x > high[0]) + 4 * (y < low[1]) + 8 * (y > high[1]) + 16 * (side < 0) + 32 * (side > 0)
    code = off.astype(np.uint8)
    return np.flatnonzero(np.bitwise_and.reduce(code[terrain.triangles], axis=1) == 0)


def _shares_over(corners: FloatArray, begin: FloatArray, end: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the places where a line enters and leaves facets (N, 3, 3) m in plan, as shares (N,), (N,) of its length.

    The second share is below the first share if the facet has no area in plan, or if the line does not cross the facet.
    Source: Cyrus and Beck 1978, Computers and Graphics 3:23-28.

    begin, end : (2,) m, ends of the line
    """
    plan = corners[..., :2]
    u, w = plan[:, 1] - plan[:, 0], plan[:, 2] - plan[:, 0]
    turn = np.sign(u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0])
    first, last = np.zeros(len(plan)), np.where(turn == 0.0, -1.0, 1.0)
    way = end - begin
    for k in range(3):
        edge = (plan[:, (k + 1) % 3] - plan[:, k]) * turn[:, None]
        inside = edge[:, 0] * (begin[1] - plan[:, k, 1]) - edge[:, 1] * (begin[0] - plan[:, k, 0])
        rate = edge[:, 0] * way[1] - edge[:, 1] * way[0]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = -inside / rate
        first = np.where(rate > 0.0, np.maximum(first, share), first)
        last = np.where(rate < 0.0, np.minimum(last, share), last)
        last = np.where((rate == 0.0) & (inside < 0.0), -1.0, last)
    return first, last
