"""Read the terrain in a DXF file: faces, meshes and closed polylines of three or four corners; layers become zones.

The entities 3DFACE and MESH are read, and of POLYLINE: polyface meshes, grids, and closed 3D polylines with three or
four corners. A remark counts the other entities, such as blocks and solids.
"""

from collections import Counter
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.mine.dxf_drawing import (
    CLOSED,
    CURVE_3D,
    MESH_2D,
    POLYFACE,
    UNITS,
    DxfDrawing,
    Ids,
    read_drawing,
)
from rpf3d_core.formats.surface import MOST_TRIANGLES, FileMesh
from rpf3d_core.terrain.frame import FloatArray

CORNERS = tuple(10 * axis + corner for corner in range(4) for axis in (1, 2, 3))
"""Group codes of the corners of a 3DFACE: 10, 20, 30 of the first, to 13, 23, 33 of the fourth."""
LOCATION, FACE = 64, 128
"""Flags of a VERTEX of a polyface mesh: LOCATION marks a point; FACE without LOCATION marks a face."""
MOST_LAYERS = 6
"""Largest number of layers that a remark names."""
WITHOUT_CONTENT = ("VERTEX", "SEQEND", "ENDSEC", "SECTION", "EOF")


class DxfTriangles(NamedTuple):
    """Triangles of some entities of a drawing.

    corners : (T, 3, 3), in the unit of the drawing; entity : (T,) number of the entity that each triangle belongs to
    """

    corners: FloatArray
    entity: Ids


class Polylines(NamedTuple):
    """The P POLYLINE entities of a drawing, and their V points, in the order of the polylines.

    heads : (P,) number of the entity; flags : (P,) group code 70
    points : (V, 3); begin : (P + 1,) row of each polyline's first point in `points`, and V at the end
    """

    heads: Ids
    flags: Ids
    begin: Ids
    points: FloatArray

    def points_of(self, number: int) -> FloatArray:
        """Return the points (N, 3) of one polyline; number : from 0."""
        return self.points[self.begin[number] : self.begin[number + 1]]


def read_dxf(path: Path) -> FileMesh:
    """Return the triangles of a DXF file; each layer with triangles is a zone.

    Raises
    ------
    TerrainError
        The file is damaged, or has no faces; the message names the line or the entity.
    """
    drawing = read_drawing(path)
    parts = [_faces(path, drawing), *_polylines(path, drawing), *_meshes(path, drawing)]
    corners = np.concatenate([part.corners for part in parts])
    entity = np.concatenate([part.entity for part in parts])
    order = np.argsort(entity, kind="stable")
    remarks = (*_not_read(path, drawing, np.unique(entity), len(corners)), *_closed_polylines(path, drawing, entity))
    zone, zones = _layers(drawing, entity[order])
    unit = UNITS.get(drawing.unit)
    return FileMesh(corners[order].reshape(-1, 3), zone=zone, zones=zones, remarks=remarks, unit=unit)


def _faces(path: Path, drawing: DxfDrawing) -> DxfTriangles:
    """Return the triangles of all 3DFACE entities; a face of four corners is cut from the first to the third corner."""
    faces = drawing.numbers_of("3DFACE")
    corners = drawing.table(faces, CORNERS).reshape(-1, 4, 3)
    three = np.asarray(np.isnan(corners[:, 3]).all(axis=1))
    corners[three, 3] = corners[three, 2]
    _refuse_missing(path, corners, "3DFACE")
    square = (corners[:, 3] != corners[:, 2]).any(axis=1)
    return DxfTriangles(
        corners=np.concatenate([corners[:, :3], corners[square][:, [0, 2, 3]]]),
        entity=np.concatenate([faces, faces[square]]),
    )


def _refuse_missing(path: Path, corners: FloatArray, what: str) -> None:
    wrong = np.flatnonzero(np.isnan(corners).any(axis=tuple(range(1, corners.ndim))))
    if len(wrong):
        raise TerrainError(f"{path}: the {what} number {wrong[0]} (from 0) lacks a coordinate, as {len(wrong)} in all")


def _polylines(path: Path, drawing: DxfDrawing) -> list[DxfTriangles]:
    """Return the triangles of polyface meshes, grids, and closed 3D polylines of three or four corners."""
    heads = drawing.numbers_of("POLYLINE")
    if not len(heads):
        return []
    vertices = drawing.numbers_of("VERTEX")
    parent = np.searchsorted(heads, vertices) - 1
    vertices, parent = vertices[parent >= 0], parent[parent >= 0]
    flags = _whole(drawing.table(heads, (70,))[:, 0])
    places = drawing.table(vertices, (10, 20, 30))
    own = _whole(drawing.table(vertices, (70,))[:, 0])
    is_place = (flags[parent] & POLYFACE == 0) | (own & LOCATION != 0)
    _refuse_missing(path, places[is_place], "VERTEX")
    count = np.bincount(parent[is_place], minlength=len(heads))
    begin = np.concatenate([[0], np.cumsum(count)])
    lines = Polylines(heads=heads, flags=flags, begin=begin, points=places[is_place])
    parts = [_polyface(path, drawing, lines, vertices[~is_place], parent[~is_place])]
    for i in np.flatnonzero((flags & MESH_2D != 0) & (flags & POLYFACE == 0)).tolist():
        parts.append(_grid(path, drawing, int(heads[i]), int(flags[i]), lines.points_of(i)))
    ring = (flags & CLOSED != 0) & (flags & CURVE_3D != 0) & (count >= 3) & (count <= 4)
    for corners in (3, 4):
        chosen = np.flatnonzero(ring & (count == corners))
        for second in range(1, corners - 1):
            index = begin[chosen][:, None] + np.array([0, second, second + 1])
            parts.append(DxfTriangles(corners=lines.points[index], entity=heads[chosen]))
    return parts


def _polyface(path: Path, drawing: DxfDrawing, lines: Polylines, faces: Ids, parent: Ids) -> DxfTriangles:
    """Return the triangles of all polyface meshes.

    A face lists its corners by their numbers in the mesh, from 1.

    faces : (F,) VERTEX entities that are faces; parent : (F,) index in `lines` of the mesh of each face
    """
    begin, points, heads = lines.begin, lines.points, lines.heads
    chosen = lines.flags[parent] & POLYFACE != 0
    faces, parent = faces[chosen], parent[chosen]
    index = np.abs(_whole(drawing.table(faces, (71, 72, 73, 74))))  # a negative number marks a hidden edge
    count = begin[parent + 1] - begin[parent]
    if (index > count[:, None]).any() or (index[:, :3] == 0).any():
        wrong = int(np.flatnonzero((index > count[:, None]).any(axis=1) | (index[:, :3] == 0).any(axis=1))[0])
        raise TerrainError(f"{path}: the face number {wrong} (from 0) of the polyface meshes names a missing VERTEX")
    at = begin[parent][:, None] + index - 1
    square = index[:, 3] > 0
    return DxfTriangles(
        corners=np.concatenate([points[at[:, :3]], points[at[square][:, [0, 2, 3]]]]),
        entity=np.concatenate([heads[parent], heads[parent][square]]),
    )


def _grid(path: Path, drawing: DxfDrawing, head: int, flags: int, points: FloatArray) -> DxfTriangles:
    """Return the triangles of a POLYLINE that is a grid of M rows of N vertices.

    If the flags close rows or columns, the strips that close them are included.

    head : number of the POLYLINE entity; flags : its group code 70, with bits for closed rows and closed columns
    points : (M * N, 3)
    """
    rows, columns = (int(n) for n in _whole(drawing.table(np.array([head]), (71, 72)))[0])
    if rows < 2 or columns < 2 or rows * columns != len(points):
        raise TerrainError(f"{path}: a mesh of POLYLINE announces {rows} x {columns} vertices, but has {len(points):,}")
    number = np.arange(rows * columns).reshape(rows, columns)
    if flags & CLOSED:
        number = np.concatenate([number, number[:1]])
    if flags & 32:  # closed in the direction of N
        number = np.concatenate([number, number[:, :1]], axis=1)
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    index = np.stack([a, b, c, a, c, d], axis=-1).reshape(-1, 3)
    return DxfTriangles(corners=points[index], entity=np.full(len(index), head))


def _meshes(path: Path, drawing: DxfDrawing) -> list[DxfTriangles]:
    """Return the triangles of each MESH entity, without subdivision."""
    return [_mesh(path, drawing, entity) for entity in drawing.numbers_of("MESH").tolist()]


def _mesh(path: Path, drawing: DxfDrawing, entity: int) -> DxfTriangles:
    code, value = drawing.pairs_of(entity)
    try:
        first = int(np.flatnonzero(code == 93)[0])
        after = np.flatnonzero(code[first:] == 94)
        last = first + int(after[0]) if len(after) else len(code)
        points = np.stack([value[:first][code[:first] == axis] for axis in (10, 20, 30)], axis=1)
        index = _whole(value[first:last][code[first:last] == 90])
        triangles = _fans(index, int(value[first]), len(points))
    except (ValueError, IndexError, OverflowError) as fault:
        raise TerrainError(f"{path}: a MESH does not hold the vertices and faces it announces ({fault})") from fault
    return DxfTriangles(corners=points[triangles], entity=np.full(len(triangles), entity))


def _fans(index: Ids, announced: int, points: int) -> Ids:
    """Return the triangles (T, 3), as vertex numbers, of a list of faces.

    index : (K,) for each face, the number of its corners, followed by the vertex numbers of these corners
    announced : length K that the file states; points : number of vertices, for checks
    """
    if announced != len(index):
        raise ValueError(f"the list of faces has {len(index):,} numbers instead of {announced:,}")
    if len(index) % 4 == 0 and (index[::4] == 3).all():
        triangles = index.reshape(-1, 4)[:, 1:]
    else:
        triangles = _mixed_fans(index.tolist())
    if triangles.size and (triangles.min() < 0 or triangles.max() >= points):
        raise IndexError(f"a face names a vertex beyond the {points:,}")
    return triangles


def _mixed_fans(index: list[int]) -> Ids:
    found, i = [], 0
    while i < len(index):
        count = index[i]
        corners = index[i + 1 : i + 1 + count]
        if count < 3 or len(corners) < count:
            raise ValueError(f"a face has {count} corners")
        found += [(corners[0], corners[k], corners[k + 1]) for k in range(1, count - 1)]
        i += 1 + count
    return np.array(found, dtype=np.int64).reshape(-1, 3)


def _whole(values: FloatArray) -> Ids:
    """Return numbers of a DXF file as integers, rounded towards 0; 0 for NaN and for numbers that are too large."""
    sound = np.abs(values) < MOST_TRIANGLES
    return np.where(sound, values, 0.0).astype(np.int64)


def _layers(drawing: DxfDrawing, entity: Ids) -> tuple[NDArray[np.int32], tuple[str, ...]]:
    """Return the zone (T,) of each triangle, and the names of the zones.

    A zone is an index into the names. The names are those of the layers with triangles, in the order of the file.

    entity : (T,) number of the entity that each triangle belongs to
    """
    entities, inverse = np.unique(entity, return_inverse=True)
    names = drawing.layer_names(entities)
    zones = tuple(dict.fromkeys(names))
    number = {name: i for i, name in enumerate(zones)}
    return np.array([number[name] for name in names], np.int32)[inverse], zones


def _closed_polylines(path: Path, drawing: DxfDrawing, entity: Ids) -> list[str]:
    """Return a list with a remark that closed 3D polylines were read as ground, although they may outline areas.

    The list is empty if the file has no such polylines, or if its terrain consists of such polylines only.

    entity : (T,) number of the entity that each triangle belongs to
    """
    heads = np.intersect1d(drawing.numbers_of("POLYLINE"), entity)
    flags = _whole(drawing.table(heads, (70,))[:, 0])
    rings = heads[(flags & CURVE_3D != 0) & (flags & (POLYFACE | MESH_2D) == 0)]
    if not len(rings) or np.isin(entity, rings).all():
        return []
    layers = Counter(drawing.layer_names(rings))
    named = ", ".join(
        f"{layer}: {count:,} closed {'polyline' if count == 1 else 'polylines'}"
        for layer, count in layers.most_common(MOST_LAYERS)
    )
    more = ", ..." if len(layers) > MOST_LAYERS else ""
    verb, one, it = ("was", "it is an area", "it") if len(rings) == 1 else ("were", "they are areas", "them")
    return [
        f"{path.name}: {named}{more} {verb} read as ground; if {one}, remove {it} from this file, and name a separate "
        f"file with {it} in `areas_of_interest`"
    ]


def _not_read(path: Path, drawing: DxfDrawing, read: Ids, triangles: int) -> list[str]:
    """Return a list with one sentence that counts the entities that were not read; [] if there are none.

    Raise a TerrainError if the file has no triangles.

    read : (N,) numbers of the entities that gave triangles; triangles : number of all triangles
    """
    left = drawing.drawn.copy()
    left[read] = False
    names = [drawing.pairs.texts[i] for i in drawing.kind[left].tolist()]
    counts = Counter(name for name in names if name not in WITHOUT_CONTENT)
    listed = ", ".join(f"{count:,} {name}" for name, count in counts.most_common())
    if not triangles:
        raise TerrainError(
            f"{path}: holds no faces; a terrain needs 3DFACE, MESH, or polyface meshes"
            + (f", and the file has {listed}; explode blocks, and make a surface of lines" if listed else "")
        )
    return [f"{path.name}: not read as ground: {listed}" + " (explode blocks)" * ("INSERT" in counts)] if counts else []
