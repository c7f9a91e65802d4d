"""Make random meshes (pieces) that cut through other ground, and check that no rock passes through a facet.

A piece is a heap with a buried rim, a closed body, a sheet with an open rim, or a second survey of the same ground. The
check shares no code with the contact search. For the path of each rock and every facet, it computes in NumPy when the
rock is above and when it is below the facet's plane. A rock that goes from above to below within the facet has passed
through the facet.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

Draw = np.random.Generator
Piece = tuple[np.ndarray, np.ndarray]
"""Vertices (V, 3) m and triangles (F, 3) of a mesh that cuts through other ground."""
ON_TOP = 1e-9
"""Distance in plan (m) within which a place counts as over a facet, if a rock is put onto the highest facet there."""


# --- pieces -----------------------------------------------------------------------------------------------------------


def heap(draw: Draw, ground: np.ndarray) -> Piece:
    """Return an open heap of three to nine sides, such as a muck pile, with its rim 1 m below the lowest ground.

    ground : (F, 3, 3) m, facets of the ground that the heap cuts
    """
    centre, count = _place(draw, ground), int(draw.integers(3, 10))
    top = centre + np.array([0.0, 0.0, draw.uniform(0.2, 4.0)])
    depth = top[2] - ground[:, :, 2].min() + 1.0
    turn = draw.choice([0.0, 0.25 * math.pi, draw.uniform(0.0, 7.0)])
    angles = turn + 2.0 * math.pi * (np.arange(count) + draw.uniform(-0.3, 0.3, count) * draw.integers(0, 2)) / count
    reach = depth * draw.choice([0.1, 0.7, 1.0, 1.5, draw.uniform(0.05, 2.0)])
    rim = top + reach * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], 1) - np.array([0.0, 0.0, depth])
    a = np.arange(count)
    if draw.uniform() < 0.5:
        return np.vstack([top, rim]), np.stack([0 * a, 1 + a, 1 + (a + 1) % count], 1)
    ring = 0.5 * (top + rim) + draw.uniform(0.0, 0.3, (count, 1)) * np.array([0.0, 0.0, depth])
    inner, outer, after = 1 + a, 1 + count + a, (a + 1) % count
    sides = np.stack([inner, outer, 1 + count + after, inner, 1 + count + after, 1 + after], 1).reshape(-1, 3)
    return np.vstack([top, ring, rim]), np.vstack([np.stack([0 * a, inner, 1 + after], 1), sides])


def body(draw: Draw, ground: np.ndarray) -> Piece:
    """Return a closed box or octahedron of random size and direction, such as a boulder or a thin wall, in the ground.

    ground : (F, 3, 3) m, facets of the ground
    """
    corners = np.array([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    sides = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    triangles = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    if draw.uniform() < 0.3:
        corners = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], dtype=float)
        triangles = np.array([(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)])
    axes = np.diag(10.0 ** draw.uniform(-1.5, 0.5, 3))
    if draw.uniform() < 0.7:
        axes = axes @ np.linalg.qr(draw.normal(size=(3, 3)))[0]
    vertices = corners @ axes
    if np.einsum("ij,ij->", vertices[triangles[:, 0]], np.cross(*vertices[triangles[:, 1:]].swapaxes(0, 1))) < 0.0:
        triangles = triangles[:, ::-1]
    return vertices + _place(draw, ground) + np.array([0.0, 0.0, draw.uniform(-0.5, 0.5)]), triangles


def blade(draw: Draw, ground: np.ndarray) -> Piece:
    """Return an open sheet that faces up and cuts the ground: level or inclined, of one or several square cells.

    ground : (F, 3, 3) m, facets of the ground
    """
    cells, width, length = int(draw.integers(1, 4)), draw.uniform(0.3, 4.0), draw.uniform(0.3, 4.0)
    x, y = (v.ravel() for v in np.meshgrid(*2 * [np.linspace(-1.0, 1.0, cells + 1)], indexing="ij"))
    slope = draw.choice([0.0, 1.0]) * draw.normal(0.0, 0.7, 2)
    turn = draw.choice([0.0, draw.uniform(0.0, 7.0)])
    plan = np.stack([width * x, length * y], 1) @ [
        (math.cos(turn), math.sin(turn)),
        (-math.sin(turn), math.cos(turn)),
    ]
    return np.column_stack([plan, plan @ slope]) + _place(draw, ground), _cells(cells)


def tile(draw: Draw, ground: np.ndarray) -> Piece:
    """Return a second survey of a part of the ground: a grid of other facets over the same surface, with noise.

    ground : (F, 3, 3) m, facets of the ground
    """
    cells, half, place = int(draw.integers(2, 9)), draw.uniform(1.0, 4.0), _place(draw, ground)[:2]
    low, high = ground[:, :, :2].min(axis=(0, 1)), ground[:, :, :2].max(axis=(0, 1))
    begin, end = np.maximum(place - half, low + 0.05), np.minimum(place + half, high - 0.05)
    x, y = (v.ravel() for v in np.meshgrid(*np.linspace(begin, end, cells + 1).T, indexing="ij"))
    noise = 10.0 ** draw.uniform(-9.0, -1.0) * draw.uniform(-1.0, 1.0, len(x))
    plan = np.column_stack([x, y])
    return np.column_stack([plan, highest(ground, plan) + noise]), _cells(cells)


PIECES: tuple[Callable[[Draw, np.ndarray], Piece], ...] = (heap, body, blade, tile)


def within(ground: np.ndarray, vertices: np.ndarray, triangles: np.ndarray) -> Piece:
    """Return a piece, moved and made smaller in plan if necessary, so that it lies within the extent of the ground.

    ground : (F, 3, 3) m, facets of the ground; vertices : (V, 3) m; triangles : (F, 3)
    """
    low, high = ground[:, :, :2].min(axis=(0, 1)), ground[:, :, :2].max(axis=(0, 1))
    begin, end = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
    if (begin >= low).all() and (end <= high).all():
        return vertices, triangles
    middle = np.clip(0.5 * (begin + end), low + 0.1 * (high - low), high - 0.1 * (high - low))
    room = np.minimum(middle - low, high - middle) * 0.99
    share = min(1.0, float((room / (0.5 * (end - begin))).min()))
    plan = middle + share * (vertices[:, :2] - 0.5 * (begin + end))
    return np.column_stack([plan, vertices[:, 2]]), triangles


def _place(draw: Draw, ground: np.ndarray) -> np.ndarray:
    """Return a random place (3,) m on the ground: a vertex, or a place within a facet."""
    facet = ground[draw.integers(len(ground))]
    return np.asarray(facet[0] if draw.uniform() < 0.3 else draw.dirichlet([1.0, 1.0, 1.0]) @ facet)


def _cells(cells: int) -> np.ndarray:
    """Return the triangles (F, 3) of a square grid with `cells` cells on each side; points are numbered along y."""
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b, c, d = a + cells + 1, a + cells + 2, a + 1
    return np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def highest(facets: np.ndarray, plan: np.ndarray) -> np.ndarray:
    """Return the height (N,) m of the highest of facets (F, 3, 3) m at places (N, 2) m in plan; -inf if none."""
    top = np.full(len(plan), -np.inf)
    for facet in facets:
        u, w, r = facet[1] - facet[0], facet[2] - facet[0], plan - facet[0, :2]
        twice = u[0] * w[1] - u[1] * w[0]
        if abs(twice) < 1e-12:
            continue
        s, t = (r[:, 0] * w[1] - r[:, 1] * w[0]) / twice, (u[0] * r[:, 1] - u[1] * r[:, 0]) / twice
        slack = ON_TOP * max(np.linalg.norm(u[:2]), np.linalg.norm(w[:2])) / abs(twice)
        over = (s >= -slack) & (t >= -slack) & (s + t <= 1.0 + slack)
        top = np.where(over, np.maximum(top, facet[0, 2] + s * u[2] + t * w[2]), top)
    return top


def meeting_points(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return places (N, 3) m where the edges of facets (F, 3, 3) m pass through facets (G, 3, 3) m, and vice versa."""
    found = [np.empty((0, 3))]
    for sides, facets in ((first, second), (second, first)):
        begin, end = sides.reshape(-1, 3), np.roll(sides, -1, axis=1).reshape(-1, 3)
        for facet in facets:
            n = np.cross(facet[1] - facet[0], facet[2] - facet[0])
            above, below = (begin - facet[0]) @ n, (end - facet[0]) @ n
            some = np.flatnonzero(above * below < 0.0)
            points = (
                begin[some] + (above / np.where(above == below, 1.0, above - below))[some, None] * (end - begin)[some]
            )
            found.append(points[_within(facet, points, 0.0)])
    return np.concatenate(found)


# --- the check --------------------------------------------------------------------------------------------------------


def parts_of(triangles: np.ndarray) -> list[np.ndarray]:
    """Return the numbers of the facets of each component, one array each; facets of a component share vertices.

    triangles : (F, 3). The components are in the order of their smallest vertex number.
    """
    label = np.arange(triangles.max() + 1)
    while True:
        least = label[triangles].min(axis=1)
        after = label.copy()
        for k in range(3):
            np.minimum.at(after, triangles[:, k], least)
        if (after == label).all():
            break
        label = after
    each = label[triangles[:, 0]]
    return [np.flatnonzero(each == name) for name in np.unique(each)]


def is_closed(triangles: np.ndarray) -> bool:
    """Return True if triangles (F, 3) form a closed surface: every side occurs exactly once in each direction."""
    sides = {(t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3)}
    return len(sides) == 3 * len(triangles) and all((b, a) in sides for a, b in sides)


def rim_of(triangles: np.ndarray) -> np.ndarray:
    """Return the numbers of the vertices at the open rim of triangles (F, 3)."""
    sides = {(t[k], t[(k + 1) % 3]) for t in triangles.tolist() for k in range(3)}
    return np.unique([v for side in sides if side[::-1] not in sides for v in side]).astype(int)


@dataclass(frozen=True)
class Legs:
    """The legs of all paths, grouped by rock: each leg is an arc or a straight line.

    row : (N,) number of the rock; x : (N, 3) m and v : (N, 3) m/s at the start; t : (N,) s, duration
    gravity : (N,) m/s^2; 0 if the leg is straight
    """

    row: np.ndarray
    x: np.ndarray
    v: np.ndarray
    t: np.ndarray
    gravity: np.ndarray

    def places(self, k: int, t: float) -> np.ndarray:
        """Return the place (3,) m of the rock on leg k after t seconds."""
        return np.asarray(self.x[k] + t * self.v[k] - (0.0, 0.0, 0.5 * self.gravity[k] * t * t))


def passed_through(facets: np.ndarray, legs: Legs, deep: float, margin: float) -> np.ndarray:
    """Return the numbers of the rocks that pass through one of facets (F, 3, 3) m, from its free side to its back.

    A rock passes through a facet if the rock is first more than `deep` (m) above the facet's plane and later more than
    `deep` below the plane, and is inside the facet by more than `margin` (m) in between. At the start of its path, a
    rock counts as above unless the rock is more than `deep` below.
    """
    found, starts = set(), np.concatenate([[True], legs.row[1:] != legs.row[:-1]])
    for facet in facets:
        n = np.cross(facet[1] - facet[0], facet[2] - facet[0])
        length = np.linalg.norm(n)
        if length == 0.0:
            continue
        height = (legs.x - facet[0]) @ (n / length)
        sure = np.flatnonzero((np.abs(height) > deep) | starts)
        above, same = height[sure] >= -deep, legs.row[sure[:-1]] == legs.row[sure[1:]]
        down = np.flatnonzero(same & above[:-1] & ~above[1:])
        first, after = sure[down], sure[down + 1]
        near = (after - first > 1) | _boxes_meet(facet, legs.x[first], legs.x[after])
        first, after = first[near], after[near]
        for begin, end in zip(first, after, strict=True):
            if _is_within_between(facet, legs, (begin, end - 1), deep, margin):
                found.add(int(legs.row[begin]))
    return np.array(sorted(found), dtype=int)


def _boxes_meet(facet: np.ndarray, begin: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return flags (N,), True for legs whose box in plan meets the box of a facet (3, 3) m.

    begin, end : (N, 3) m, ends of the legs
    """
    low, high = np.minimum(begin, end)[:, :2], np.maximum(begin, end)[:, :2]
    return np.asarray(((low <= facet[:, :2].max(axis=0)) & (high >= facet[:, :2].min(axis=0))).all(axis=1))


def _is_within_between(facet: np.ndarray, legs: Legs, ends: tuple[int, int], deep: float, margin: float) -> bool:
    """Return True if a rock is inside a facet by `margin` (m) while the rock passes the facet's plane.

    The points are compared as seen along the facet's normal.

    ends : numbers of two legs: on the first leg, the rock leaves the upper side; on the second leg, the rock reaches
        the depth `deep` (m) below the plane
    """
    first, last = ends
    begin, end = _place_at(facet, legs, first, 0.0), _place_at(facet, legs, last, -deep)
    points = np.vstack([begin, legs.x[first + 1 : last + 1], end])
    return bool(_within(facet, points, margin).all())


def _place_at(facet: np.ndarray, legs: Legs, k: int, level: float) -> np.ndarray:
    """Return the place (3,) m on leg k where its height above a facet's plane last falls to a level (m)."""
    n = np.cross(facet[1] - facet[0], facet[2] - facet[0])
    n /= np.linalg.norm(n)
    a, b, c = -0.5 * legs.gravity[k] * n[2], n @ legs.v[k], n @ (legs.x[k] - facet[0]) - level
    root = math.sqrt(max(b * b - 4.0 * a * c, 0.0))
    t = 2.0 * c / (root - b) if b < 0.0 else -(b + root) / (2.0 * a) if a < 0.0 else legs.t[k]
    return legs.places(k, min(max(float(t), 0.0), float(legs.t[k])))


def _within(facet: np.ndarray, points: np.ndarray, margin: float) -> np.ndarray:
    """Return flags (N,), True for points (N, 3) m inside a facet, seen along its normal, by more than a margin (m)."""
    normal = np.cross(facet[1] - facet[0], facet[2] - facet[0])
    normal /= np.linalg.norm(normal)
    inside = np.ones(len(points), dtype=bool)
    for k in range(3):
        edge = facet[(k + 1) % 3] - facet[k]
        inside &= (points - facet[k]) @ (np.cross(normal, edge) / np.linalg.norm(edge)) > margin
    return inside
