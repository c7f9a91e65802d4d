"""Make a mesh from a survey given as unordered points (a cloud), by Delaunay triangulation in plan.

A triangle with a side longer than a given length spans a gap of the survey and is omitted: large gaps are holes. If
two points have the same place in plan, the first point counts.
"""

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.grid_rows import Mesh, origin_of

GAP = 10.0
"""Default largest side of a triangle in plan, divided by the median of the longest sides of all triangles (-).

A triangle with a longer side spans a gap of the survey.
"""
SLOTS = 2
"""Least number of slots of a hash table that finds points by their coordinates, divided by the number of points (-)."""


def cloud_mesh(
    points: FloatArray, longest_edge: float | None = None, origin: tuple[float, float, float] | None = None
) -> Mesh:
    """Return the mesh of a survey given as points (N, 3) m; points with a NaN coordinate are left out.

    All facets face up. Points without a facet are left out, too.

    longest_edge : m, longest allowed side of a triangle in plan; None for `GAP` times the median of the longest sides
        of all triangles
    origin : origin of the local frame (m); None for the middle of the points' box, in whole metres

    Raises TerrainError if fewer than three points or no triangle remain, or if a point is infinite.
    """
    there = points[~np.isnan(points).any(axis=1)]
    if len(there) < 3:
        raise TerrainError(f"the cloud has {len(there)} points that are no NaN; the terrain needs at least three")
    first = origin_of(np.stack([there.min(axis=0), there.max(axis=0)])[None])
    vertices = np.ascontiguousarray(there - np.array(first if origin is None else origin)) + 0.0  # turns -0.0 into 0.0
    plan = np.ascontiguousarray(vertices[:, :2])
    parts = shapely.get_coordinates(shapely.delaunay_triangles(shapely.linestrings(plan)))
    triangles = _numbers(plan, parts).reshape(-1, 4)[:, :3]
    kept = _looking_up(plan, triangles, longest_edge)
    if len(kept) == 0:
        raise TerrainError("the cloud has no triangle: its points lie on one line, or further apart than allowed")
    used, numbers = np.unique(kept, return_inverse=True)
    return Mesh(
        vertices=vertices[used],
        triangles=numbers.reshape(-1, 3).astype(np.int32),
        origin=first if origin is None else origin,
    )


def _looking_up(plan: FloatArray, triangles: IntArray, longest: float | None) -> IntArray:
    """Return the triangles (T, 3) without a side in plan longer than `longest` (m), all turned to face up.

    Triangles without area are left out.

    plan : (N, 2) m, the points; longest : None for `GAP` times the median of the longest sides of all triangles
    """
    a, b, c = (plan[triangles[:, k]] for k in range(3))
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    turned = np.where(area[:, None] < 0.0, triangles[:, [0, 2, 1]], triangles)
    side = np.sqrt(np.max([((q - p) ** 2).sum(axis=1) for p, q in ((a, b), (b, c), (c, a))], axis=0))
    most = GAP * float(np.median(side)) if longest is None and len(side) else longest or 0.0
    kept: IntArray = turned[(side <= most) & (area != 0.0)]
    return kept


def _numbers(plan: FloatArray, places: FloatArray) -> NDArray[np.int32]:
    """Return the number (M,) of the survey point at each of M corners of triangles, found by exact coordinates.

    plan : (N, 2) m, the points; places : (M, 2) m, the corners, each equal to a point bit for bit
    """
    table = np.full(1 << (SLOTS * len(plan)).bit_length(), -1, np.int32)
    keys, wanted = plan.view(np.int64), np.ascontiguousarray(places).view(np.int64)
    out = np.empty(len(places), np.int32)
    _enter(keys, table)
    _look_up(keys, table, wanted, out)
    return out


@kernel
def _slot(a: int, b: int, mask: int) -> int:
    """Return the slot of the hash table where the search for the point with coordinates a, b begins.

    a, b : x and y in plan, their 64 bits read as integers; mask : number of slots minus one

    The function uses bit shifts only, because products would overflow.
    """
    mixed = (a ^ (a >> 29)) ^ ((b >> 7) ^ (b >> 41))
    return int((mixed ^ (mixed >> 17) ^ (mixed >> 33)) & mask)


@loop
def _enter(keys: Any, table: Any) -> None:
    """Write the numbers of points into a hash table (open addressing); of points at the same place, only the first.

    keys : (N, 2) x and y of the points, their 64 bits read as integers
    table : the number of a point in each slot, -1 for an empty slot; all -1 before the call
    """
    mask = len(table) - 1
    for n in range(len(keys)):
        slot = _slot(keys[n, 0], keys[n, 1], mask)
        while table[slot] >= 0:
            other = table[slot]
            if keys[other, 0] == keys[n, 0] and keys[other, 1] == keys[n, 1]:
                break
            slot = (slot + 1) & mask
        if table[slot] < 0:
            table[slot] = n


@loop
def _look_up(keys: Any, table: Any, wanted: Any, out: Any) -> None:
    """Write the number of the point at each wanted place into `out` (M,); -1 if no point is exactly there.

    keys : (N, 2) x and y of the points, their 64 bits read as integers; table : hash table, filled by `_enter`
    wanted : (M, 2) x and y of the wanted places, their 64 bits read as integers
    """
    mask = len(table) - 1
    for n in range(len(wanted)):
        slot = _slot(wanted[n, 0], wanted[n, 1], mask)
        while True:
            other = table[slot]
            if other < 0 or (keys[other, 0] == wanted[n, 0] and keys[other, 1] == wanted[n, 1]):
                break
            slot = (slot + 1) & mask
        out[n] = other
