"""Test whether a received mesh needs repair, and repair only such a mesh: most surveys are welded and consistent.

Where a mesh is not welded, neighbouring facets share no edge, so the vertices to be joined lie on borders. Therefore
only border vertices are compared with each other. Exception: a facet with a side shorter than the tolerance that is
surrounded by other facets stays unchanged, although `weld` would collapse the facet. The winding is consistent if no
side occurs twice in the same direction; to test this, the sides are listed by the vertex at which they start.
"""

import math
from typing import Any

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.jit.memory import Memory, Share, fresh, halves, one_by_one
from rpf3d_core.terrain.facets import IntArray, area_vector, vertex
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.grid_rows import Mesh, origin_of
from rpf3d_core.terrain.mesh.mesh_pieces import turn_wrong_pieces
from rpf3d_core.terrain.mesh.welding import weld
from rpf3d_core.terrain.mesh.zero_area import NO_AREA
from rpf3d_core.terrain.survey import mesh_terrain
from rpf3d_core.vectors import dot, subtract

UP, DOWN, MIXED = 1, -1, 0
"""Direction of the facets of a mesh: no facet faces down, all facets face down, or neither."""
FACING = "z must point up, and the corners of a facet must run counter-clockwise as seen from above"
FLAT = "this cannot be a terrain: no facet has an area, because the corners of each facet lie on one line"


def ready_mesh(
    vertices: FloatArray, triangles: IntArray, zone: str, weld_tolerance: float, memory: Memory = fresh,
    share: Share = one_by_one, must_face_up: bool = False,
) -> Mesh:  # fmt: skip
    """Return a mesh that a simulation can use, from the vertices (V, 3) m and triangles (F, 3) of a survey.

    `survey.mesh_terrain` repairs a mesh that is not welded, or whose windings disagree. In any other mesh, only
    components that face the wrong side are turned over. Raises TerrainError in the same cases as `mesh_terrain`, and if
    a triangle refers to a vertex that does not exist.

    zone : name of the only zone; weld_tolerance : m, vertices at most this far apart become one vertex
    memory : allocates the arrays; share : runs the work in parallel
    must_face_up : True to raise a TerrainError if more facets face down than up; False to accept such a mesh, whose
        facets are then turned over
    """
    if len(triangles) == 0:
        raise TerrainError("the terrain has no triangles; it needs at least one")
    mesh = _moved(vertices, triangles, memory, share)
    looks = _looks(mesh, share, must_face_up)
    starts, to = _sides(mesh, memory, share)
    if not _is_sound(mesh, starts, to, weld_tolerance, memory, share):
        return _repaired(vertices, triangles, zone, weld_tolerance, memory)
    if looks == DOWN:
        _turn(mesh.triangles)
    elif looks == MIXED:
        turn_wrong_pieces(mesh.vertices, mesh.triangles, starts, to, memory, share)
    return mesh


def _moved(vertices: FloatArray, triangles: IntArray, memory: Memory, share: Share) -> Mesh:
    """Return a copy of a mesh with coordinates relative to a local origin, which is part of the result.

    vertices : (V, 3) m; triangles : (F, 3)

    Raises TerrainError if a vertex is not finite, or if a triangle refers to a vertex that does not exist.
    """
    vertices = np.ascontiguousarray(vertices, dtype=np.float64)
    parts, boxes = halves(len(vertices)), np.empty((2, 2, 3))
    share([lambda k=k, a=a, b=b: _box_of(vertices, a, b, boxes[k]) for k, (a, b) in enumerate(parts)])  # type: ignore[misc]
    origin = origin_of(boxes)
    local = memory("vertices", 3 * len(vertices), np.float64).reshape(-1, 3)
    share([lambda a=a, b=b: _move(vertices, a, b, *origin, local) for a, b in parts])  # type: ignore[misc]
    corners = memory("triangles", 3 * len(triangles), np.int32).reshape(-1, 3)
    corners[:] = triangles
    if int(corners.min()) < 0 or int(corners.max()) >= len(local):
        raise TerrainError(f"a triangle names a vertex that does not exist; the mesh has {len(local):,} vertices")
    return Mesh(vertices=local, triangles=corners, origin=origin)


def _looks(mesh: Mesh, share: Share, must_face_up: bool) -> int:
    """Return the direction of a mesh's facets: UP if no facet faces down, DOWN if all facets face down, else MIXED.

    Facets without area do not count.

    Raises TerrainError if no facet has an area, or if `must_face_up` is true and more facets face down than up.
    """
    seen = share([lambda a=a, b=b: _look(mesh.vertices, mesh.triangles, a, b) for a, b in halves(len(mesh.triangles))])  # type: ignore[misc]
    up, down, level = (sum(counts) for counts in zip(*seen, strict=True))
    if up + down + level == 0:
        raise TerrainError(FLAT)
    if must_face_up and down > up:
        raise TerrainError(f"{down:,} of {up + down + level:,} facets face down; {FACING}")
    return UP if down == 0 else DOWN if up + level == 0 else MIXED


def _sides(mesh: Mesh, memory: Memory, share: Share) -> tuple[IntArray, IntArray]:
    """Return the sides of all facets, sorted by the vertex at which they start: `starts` (V + 1,) and `to`.

    to[starts[v] : starts[v + 1]] are the end vertices of the sides that start at vertex v.
    """
    count = len(mesh.vertices)
    starts, to = memory("out_starts", count + 1, np.int32), memory("out_to", 3 * len(mesh.triangles), np.int32)
    starts[:] = 0
    parts = halves(count)
    share([lambda a=a, b=b: _count_out(mesh.triangles, a, b, starts) for a, b in parts])  # type: ignore[misc]
    np.cumsum(starts, out=starts)
    cursor = memory("out_cursor", count + 1, np.int32)
    cursor[:] = starts
    share([lambda a=a, b=b: _fill_out(mesh.triangles, a, b, cursor, to) for a, b in parts])  # type: ignore[misc]
    return starts, to


def _is_sound(
    mesh: Mesh, starts: IntArray, to: IntArray, tolerance: float, memory: Memory, share: Share
) -> bool:  # fmt: skip
    """Return True if the mesh needs no repair: all windings agree, and no two border vertices would be welded.

    Border vertices would be welded if their distance is at most the tolerance.

    starts, to : the sides of all facets, from `_sides`; tolerance : m
    memory : allocates the arrays; share : runs the work in parallel
    """
    border = memory("border", len(mesh.vertices), np.bool_)
    border[:] = False
    parts = halves(len(mesh.vertices))
    if not all(share([lambda a=a, b=b: _sides_agree(starts, to, a, b, border) for a, b in parts])):  # type: ignore[misc]
        return False
    rim = mesh.vertices[border]
    return len(rim) == 0 or len(weld(rim, tolerance)[0]) == len(rim)


def _repaired(vertices: FloatArray, triangles: IntArray, zone: str, tolerance: float, memory: Memory) -> Mesh:
    """Return the mesh after the repairs of `mesh_terrain`, copied into arrays of `memory`.

    vertices : (V, 3) m; triangles : (F, 3); zone : name of the only zone
    tolerance : m, vertices at most this far apart become one vertex
    """
    terrain = mesh_terrain(vertices, triangles, zone, tolerance)
    local = memory("vertices", 3 * len(terrain.vertices), np.float64).reshape(-1, 3)
    corners = memory("triangles", 3 * len(terrain.triangles), np.int32).reshape(-1, 3)
    local[:], corners[:] = terrain.vertices, terrain.triangles
    return Mesh(vertices=local, triangles=corners, origin=terrain.frame.origin)


@loop
def _box_of(vertices: Any, begin: int, end: int, box: Any) -> None:
    """Write the bounding box of the vertices from `begin` to `end` - 1 into `box` (2, 3) m: lowest, highest corner.

    The box has a NaN if a vertex has a NaN coordinate.

    vertices : (V, 3) m
    """
    for axis in range(3):
        box[0, axis], box[1, axis] = np.inf, -np.inf
    for v in range(begin, end):
        for axis in range(3):
            x = vertices[v, axis]
            if x != x:
                box[0, axis], box[1, axis] = x, x
                return
            box[0, axis], box[1, axis] = min(box[0, axis], x), max(box[1, axis], x)


@loop
def _move(vertices: Any, begin: int, end: int, x: float, y: float, z: float, local: Any) -> None:
    """Write the coordinates of the vertices from `begin` to `end` - 1, relative to the origin x, y, z, into `local`."""
    for v in range(begin, end):
        local[v, 0], local[v, 1], local[v, 2] = vertices[v, 0] - x, vertices[v, 1] - y, vertices[v, 2] - z


@loop
def _look(vertices: Any, triangles: Any, begin: int, end: int) -> tuple[int, int, int]:
    """Return the numbers of upward, downward and vertical facets among the facets from `begin` to `end` - 1.

    Facets without area do not count.

    vertices : (V, 3) m; triangles : (F, 3)
    """
    up, down, level = 0, 0, 0
    for f in range(begin, end):
        a, b, c = (vertex(vertices, triangles[f, 0]), vertex(vertices, triangles[f, 1]),
                   vertex(vertices, triangles[f, 2]))  # fmt: skip
        n, ab, bc, ca = area_vector(a, b, c), subtract(b, a), subtract(c, b), subtract(a, c)
        if 2.0 * math.sqrt(dot(n, n)) <= NO_AREA * max(dot(ab, ab), dot(bc, bc), dot(ca, ca)):
            continue
        if n[2] > 0.0:
            up += 1
        elif n[2] < 0.0:
            down += 1
        else:
            level += 1
    return up, down, level


@loop
def _turn(triangles: Any) -> None:
    """Turn all facets (F, 3) over so that they face the other side; each facet keeps its first corner."""
    for f in range(len(triangles)):
        triangles[f, 1], triangles[f, 2] = triangles[f, 2], triangles[f, 1]


@loop
def _count_out(triangles: Any, begin: int, end: int, starts: Any) -> None:
    """Count the facet sides that start at each vertex v from `begin` to `end` - 1, and add the count to starts[v + 1].

    The counts are needed to list the sides by vertex.

    triangles : (F, 3); starts : (V + 1,), changed
    """
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if a != b and b != c and c != a:
            for v in (a, b, c):
                if begin <= v < end:
                    starts[v + 1] += 1


@loop
def _fill_out(triangles: Any, begin: int, end: int, cursor: Any, to: Any) -> None:
    """Write the end vertices of the sides of facets into `to`, sorted by the vertex at which the sides start.

    triangles : (F, 3); begin, end : only sides that start at vertices `begin` to `end` - 1
    cursor : (V + 1,) for each vertex, the next free index in `to`; changed
    """
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if a != b and b != c and c != a:
            for v, w in ((a, b), (b, c), (c, a)):
                if begin <= v < end:
                    to[cursor[v]] = w
                    cursor[v] += 1


@loop
def _sides_agree(starts: Any, to: Any, begin: int, end: int, border: Any) -> bool:
    """Return True if the windings agree at all sides that start at vertices `begin` to `end` - 1; mark border vertices.

    The windings agree if no side occurs twice in the same direction. A side without an opposite side lies on a border:
    both of its vertices are marked in `border`.

    starts, to : the sides of all facets, from `_sides`; border : (V,), changed
    """
    for v in range(begin, end):
        for e in range(starts[v], starts[v + 1]):
            w, back = to[e], False
            for other in range(starts[v], e):
                if to[other] == w:
                    return False
            for other in range(starts[w], starts[w + 1]):
                if to[other] == v:
                    back = True
                    break
            if not back:
                border[v], border[w] = True, True
    return True
