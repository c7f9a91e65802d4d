"""Read lines, closed lines and points of a DXF file, for areas, crest lines, berms and sources."""

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.formats.mine.dxf_drawing import CLOSED, MESH_2D, POLYFACE, DxfDrawing, read_drawing
from rpf3d_core.formats.mine.dxf_pairs import BULGE, ELEVATION
from rpf3d_core.terrain.frame import FloatArray

CURVES = ("ARC", "CIRCLE", "ELLIPSE", "SPLINE", "HELIX")
CURVE_3D = 8
"""Flag of a POLYLINE whose vertices have their own heights; other polylines lie in a plane."""
KEPT = 4
"""Number of results of `_lines` (one file, one layer or all layers) that are kept in memory."""
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)


class Line(NamedTuple):
    """A line of a DXF file.

    points : (P, 3), in the unit of the file; closed : True if the last point is connected to the first
    layer : name of the layer that the line belongs to
    """

    points: FloatArray
    closed: bool
    layer: str


def read_dxf_lines(path: Path, layer: str = "") -> list[Line]:
    """Return all lines of a DXF file or of one layer: its LINE, LWPOLYLINE and POLYLINE entities, except meshes.

    The lines of the last files are kept in memory, because several steps of a run read the same file.

    layer : name of the layer whose lines are returned; "" for the lines of all layers

    Raises
    ------
    InputError
        The file cannot be read, is damaged, or has one of these on a wanted layer: a curve (arc, circle, ellipse,
        spline, helix), or a polyline with bulges or in a plane that is not level.
    """
    try:
        state = path.stat()
    except OSError as fault:
        raise InputError(f"{path}: cannot be read ({fault.strerror or fault})") from fault
    return list(_lines(path, layer, (state.st_mtime_ns, state.st_size)))


@lru_cache(maxsize=KEPT)
def _lines(path: Path, layer: str, _: tuple[int, int]) -> tuple[Line, ...]:
    """Return the lines of a DXF file, from memory if the file has not changed since it was last read.

    The third argument (time of change, size) is only part of the cache key. Errors as in `read_dxf_lines`.
    """
    drawing = read_drawing(path)
    curves = drawing.numbers_of(*CURVES)
    if layer:
        curves = curves[np.array(drawing.layer_names(curves), dtype=object) == layer]
    if len(curves):
        name = drawing.pairs.texts[drawing.kind[curves[0]]]
        raise InputError(f"{path}: has curves ({len(curves):,}, the first a {name}); convert curves to polylines")
    return (*_straight(drawing, layer), *_light(path, drawing, layer), *_heavy(path, drawing, layer))


def layers_with_lines(path: Path) -> tuple[str, ...]:
    """Return the names, sorted, of the layers of a DXF file with lines that `read_dxf_lines` can return.

    A file with curves is not refused here, because only the names of the layers are needed.

    Raises
    ------
    InputError
        As `read_drawing`.
    """
    drawing = read_drawing(path)
    heads = drawing.numbers_of("POLYLINE")
    flags = np.nan_to_num(drawing.table(heads, (70,))[:, 0]).astype(np.int64)
    lines = (drawing.numbers_of("LINE", "LWPOLYLINE"), heads[(flags & (POLYFACE | MESH_2D)) == 0])
    return tuple(sorted({name for some in lines for name in drawing.layer_names(some)}))


def read_dxf_points(path: Path) -> FloatArray:
    """Return the places (N, 3) of all POINT entities of a DXF file, in the unit of the file.

    Raises
    ------
    InputError
        As `read_drawing`, or a point lacks a coordinate.
    """
    drawing = read_drawing(path)
    places = drawing.table(drawing.numbers_of("POINT"), (10, 20, 30))
    if not np.isfinite(places).all():
        raise InputError(f"{path}: a POINT lacks a coordinate")
    return places


def _straight(drawing: DxfDrawing, wanted: str) -> Iterator[Line]:
    """Yield each LINE entity of a drawing as a line; wanted : name of the layer, "" for all layers."""
    entities = drawing.numbers_of("LINE")
    ends = drawing.table(entities, (10, 20, 30, 11, 21, 31)).reshape(-1, 2, 3)
    for points, layer in zip(ends, drawing.layer_names(entities), strict=True):
        if wanted in ("", layer):
            yield Line(points=points, closed=False, layer=layer)


def _light(path: Path, drawing: DxfDrawing, wanted: str) -> Iterator[Line]:
    """Yield each LWPOLYLINE entity of a drawing as a line; all its points have the entity's elevation as height.

    wanted : name of the layer, "" for all layers
    """
    entities = drawing.numbers_of("LWPOLYLINE")
    flags = np.nan_to_num(drawing.table(entities, (70,))[:, 0]).tolist()
    for entity, flag, layer in zip(entities.tolist(), flags, drawing.layer_names(entities), strict=True):
        if wanted not in ("", layer):
            continue
        code, value = drawing.pairs_of(entity)
        x, y = value[code == 10], value[code == 20]
        if len(x) != len(y):
            raise InputError(f"{path}: a LWPOLYLINE on layer {layer!r} has {len(x)} x and {len(y)} y")
        _refuse_arcs(path, value[code == BULGE], layer)
        height = value[code == ELEVATION][-1:] if (code == ELEVATION).any() else np.zeros(1)
        points = np.column_stack([x, y, np.broadcast_to(height, len(x))])
        yield Line(points=_turned(path, drawing, entity, points), closed=bool(int(flag) & CLOSED), layer=layer)


def _heavy(path: Path, drawing: DxfDrawing, wanted: str) -> Iterator[Line]:
    """Yield each POLYLINE entity of a drawing as a line, except meshes; wanted : name of the layer, "" for all."""
    heads, vertices = drawing.numbers_of("POLYLINE"), drawing.numbers_of("VERTEX")
    flags = np.nan_to_num(drawing.table(heads, (70,))[:, 0]).astype(np.int64)
    places, bulges = drawing.table(vertices, (10, 20, 30)), drawing.table(vertices, (BULGE,))[:, 0]
    begins = np.append(np.searchsorted(vertices, heads), len(vertices))
    for i, layer in enumerate(drawing.layer_names(heads)):
        if flags[i] & (POLYFACE | MESH_2D) or wanted not in ("", layer):
            continue
        own = slice(begins[i], begins[i + 1])
        _refuse_arcs(path, bulges[own], layer)
        points = places[own] if flags[i] & CURVE_3D else _turned(path, drawing, int(heads[i]), places[own])
        yield Line(points=points, closed=bool(flags[i] & CLOSED), layer=layer)


def _refuse_arcs(path: Path, bulges: FloatArray, layer: str) -> None:
    if (np.nan_to_num(bulges) != 0.0).any():
        raise InputError(f"{path}: a polyline on layer {layer!r} has arcs (bulges); convert them to straight segments")


def _turned(path: Path, drawing: DxfDrawing, entity: int, points: FloatArray) -> FloatArray:
    """Return points (P, 3) of an entity in world coordinates; raise an InputError if the entity's plane is not level.

    points : (P, 3) in the coordinates of the entity's plane
    """
    normal = tuple(drawing.table(np.array([entity]), (210, 220, 230))[0].tolist())
    if np.isnan(normal).any() or normal == UP:
        return points
    if normal != DOWN:
        raise InputError(f"{path}: a polyline lies in a plane that is not level; draw it as a 3D polyline")
    return np.asarray(points * np.array([-1.0, 1.0, -1.0]))
