"""Find the facets that rocks passed over: the facets that the lines of their paths cross in plan.

A flight is a straight line in plan, so cutting it into short line segments loses nothing; a slide is cut into chords.
Line segments of a bucket's size search only the buckets that they touch.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.ensemble.flights import Flights, FloatArray, IntArray
from rpf3d_core.ensemble.paths import sample_paths
from rpf3d_core.values import DEPOSITED

Flags = NDArray[np.bool_]

SEGMENTS_AT_ONCE = 20_000
"""Line segments whose buckets are looked up together."""

PAIRS_AT_ONCE = 200_000
"""Candidate pairs (segment, facet) tested together: about 100 MB, whatever the number of facets in a bucket."""


def hazard_facets(locator: BucketLocator, corners: FloatArray, flights: Flights, gravity: float) -> dict[str, IntArray]:
    """Return the facets (N,) that rocks stopped on ("stopped"), and the others that paths cross in plan ("passed").

    corners : (F, 9) m, `Facets.corners`; gravity : m/s^2. Only rocks whose paths were kept count as passing.
    """
    deposits, samples = flights.deposits, sample_paths(flights.paths, max_step=locator.cell, gravity=gravity)
    stopped = np.unique(deposits.facet[np.isin(deposits.outcome, DEPOSITED) & (deposits.facet >= 0)])
    same_rock = samples.row[1:] == samples.row[:-1]
    begin, end = samples.x[:-1, :2][same_rock], samples.x[1:, :2][same_rock]
    return {"passed": np.setdiff1d(passed_facets(locator, corners, begin, end), stopped), "stopped": stopped}


def passed_facets(locator: BucketLocator, corners: FloatArray, begin: FloatArray, end: FloatArray) -> IntArray:
    """Return the facets that line segments cross or touch in plan.

    Parameters
    ----------
    locator : BucketLocator
        Of the terrain.
    corners : (F, 9) m
        `Facets.corners`, local frame.
    begin, end : (S, 2) m
        Ends of the segments in plan, each no wider in x or y than a bucket.

    Returns
    -------
    (N,) int64
        Facet ids, ascending, each once. Facets above a rock count too, because only the plan is compared.
    """
    plan = corners.reshape(-1, 3, 3)[:, :, :2]
    found = np.zeros(len(plan), dtype=bool)
    for first in range(0, len(begin), SEGMENTS_AT_ONCE):
        some = slice(first, first + SEGMENTS_AT_ONCE)
        for segment, facet in _candidates(locator, begin[some], end[some]):
            new = ~found[facet]
            segment, facet = segment[new] + first, facet[new]
            crossed = touching(begin[segment], end[segment], plan[facet])
            found[facet[crossed]] = True
    return np.flatnonzero(found)


def touching(begin: FloatArray, end: FloatArray, triangles: FloatArray) -> Flags:
    """Return flags (N,): True where a segment, ends (N, 2) m, and a triangle (N, 3, 2) m touch in plan.

    Two convex figures are apart only if a line along one of their edges separates them (separating axes).
    """
    a, b, c = (triangles[:, k].T for k in range(3))
    p, q = begin.T, end.T
    apart = _same_side(_side(p, q, a), _side(p, q, b), _side(p, q, c))
    for first, second, third in ((a, b, c), (b, c, a), (c, a, b)):
        inside = np.sign(_side(first, second, third))
        beyond_p, beyond_q = _side(first, second, p) * inside, _side(first, second, q) * inside
        apart |= (beyond_p < 0.0) & (beyond_q < 0.0)
    return ~(apart | _boxes_apart(begin, end, triangles))


def _side(a: FloatArray, b: FloatArray, p: FloatArray) -> FloatArray:
    """Return twice the area (N,) of the triangle a, b, p, each (2, N); positive if p lies to the left of a -> b."""
    area: FloatArray = (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
    return area


def _same_side(a: FloatArray, b: FloatArray, c: FloatArray) -> Flags:
    return ((a > 0.0) & (b > 0.0) & (c > 0.0)) | ((a < 0.0) & (b < 0.0) & (c < 0.0))


def _boxes_apart(begin: FloatArray, end: FloatArray, triangles: FloatArray) -> Flags:
    """Return flags (N,): True where the boxes are apart. Decides for figures without area: vertical facets, points."""
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    flags: Flags = ((np.maximum(begin, end) < low) | (np.minimum(begin, end) > high)).any(axis=1)
    return flags


def _candidates(locator: BucketLocator, begin: FloatArray, end: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield pairs (segment, facet) of every segment with the facets of its buckets, `PAIRS_AT_ONCE` at a time."""
    segment, bucket = _buckets(locator, begin, end)
    first, count = locator.starts[bucket], locator.starts[bucket + 1] - locator.starts[bucket]
    last_pair = np.cumsum(count)
    for begun in range(0, int(count.sum()), PAIRS_AT_ONCE):
        pair = np.arange(begun, min(begun + PAIRS_AT_ONCE, last_pair[-1]))
        entry = np.searchsorted(last_pair, pair, side="right")
        place = first[entry] + pair - (last_pair[entry] - count[entry])
        yield segment[entry], locator.ids[place].astype(np.int64)


def _buckets(locator: BucketLocator, begin: FloatArray, end: FloatArray) -> tuple[IntArray, IntArray]:
    """Return pairs (segment, bucket) of every segment with the at most four buckets that its box touches."""
    low, high = _cells(locator, np.minimum(begin, end)), _cells(locator, np.maximum(begin, end))
    wide, deep = (low != high).T
    everywhere = np.ones(len(low), dtype=bool)
    corners = ((low, low, everywhere), (high, low, wide), (low, high, deep), (high, high, wide & deep))
    segment = np.concatenate([np.flatnonzero(new) for _, _, new in corners])
    bucket = np.concatenate([(x[:, 0] + locator.nx * y[:, 1])[new] for x, y, new in corners])
    return segment, bucket


def _cells(locator: BucketLocator, points: FloatArray) -> IntArray:
    """Return column and row (S, 2) of the buckets of points (S, 2) m; outside the grid, of the nearest bucket."""
    cell = np.floor((points - np.array([locator.x, locator.y])) / locator.cell).astype(np.int64)
    inside: IntArray = np.clip(cell, 0, np.array([locator.nx - 1, locator.ny - 1]))
    return inside
