"""Decide by brute force over all facets on which side of the ground points lie; shares no code with the simulator."""

import math

import numpy as np

DEEP = 1e-6
"""Depth (m) below a facet at which a rock counts as fallen through: 2.4 times 256 tolerances of the largest mesh."""
NEXT_TO = 1e-6
"""Distance (m) in plan from an edge within which a point counts as over the facets on both sides of the edge."""


def has_odd_above(facets: np.ndarray, points: np.ndarray, near: float = DEEP) -> np.ndarray:
    """Return flags (N,), True for points with an odd number of facets vertically above and no facet within `near`.

    The number must be odd at three places at the distance `near` from the point, because a vertical line through an
    edge may meet both facets of the edge, or none. facets : (F, 3, 3) m; points : (N, 3) m; near : m
    """
    below = np.ones(len(points), dtype=bool)
    for turn in (1.0, 3.1, 5.2):
        beside = points + near * np.array([math.cos(turn), math.sin(turn), 0.0])
        below &= sum(is_above(facet, beside).astype(int) for facet in facets) % 2 == 1
    some = np.flatnonzero(below)
    for facet in facets:
        some = some[~touches(facet, points[some], near)]
    return np.isin(np.arange(len(points)), some)


def is_above(facet: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return flags (N,), True for points (N, 3) m that have a facet (3, 3) m vertically above."""
    plan = [facet[(k + 1) % 3, :2] - facet[k, :2] for k in range(3)]
    sides = [e[0] * (points[:, 1] - p[1]) - e[1] * (points[:, 0] - p[0]) for e, p in zip(plan, facet, strict=True)]
    whole = sides[0] + sides[1] + sides[2]
    inside = np.min(sides, axis=0) * np.max(sides, axis=0) > 0.0
    weights = np.stack([sides[1], sides[2], sides[0]], 1) / np.where(inside, whole, 1.0)[:, None]
    return np.asarray(inside & (weights @ facet[:, 2] > points[:, 2]))


def touches(facet: np.ndarray, points: np.ndarray, near: float = DEEP) -> np.ndarray:
    """Return flags (N,), True for points (N, 3) m that are within `near` (m) of a facet (3, 3) m."""
    normal = np.cross(facet[1] - facet[0], facet[2] - facet[0])
    normal /= np.linalg.norm(normal)
    on = np.abs((points - facet[0]) @ normal) <= near
    for k in range(3):
        edge = facet[(k + 1) % 3] - facet[k]
        inward = np.cross(normal, edge) / np.linalg.norm(edge)
        on &= (points - facet[k]) @ inward >= -near
    return on
