"""Read geometries in plan from GeoJSON, GeoPackage, Shapefile, DXF and Surpac files as the content of a GeoJSON file.

The content has the form of GeoJSON (RFC 7946), but with the plan coordinates (m) of the input.
"""

import json
from pathlib import Path
from typing import Any

from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import FloatArray

FEATURE_EXTENSIONS = (".geojson", ".json", ".gpkg", ".shp", ".dxf", ".str")
"""Extensions of the known formats; a file with any other extension is also read as GeoJSON."""
FORMATS = "GeoJSON (.geojson, .json), GeoPackage (.gpkg), Shapefile (.shp), DXF (.dxf) or Surpac strings (.str)"
"""The formats of files of polygons, lines and points that `features_of` reads, for messages."""


def features_of(path: Path, family: str, heights: bool = False, layer: str = "") -> Any:
    """Return the geometries of a file as the content of a GeoJSON file; GeoJSON is returned without checks.

    family : kind of geometry that the scene needs: "polygon", "line" or "point"
    heights : True to keep the heights of lines; points always keep their heights, and GeoJSON keeps all heights
    layer : name of the layer of a DXF file whose lines are wanted; "" for all layers, and for files of other formats

    Raises
    ------
    InputError
        The file cannot be read, has no line on `layer`, or has a line that is not closed where polygons are needed.
    """
    extension = path.suffix.lower()
    if extension in (".gpkg", ".shp"):
        from rpf3d_core.formats.mine.vector_files import read_vector

        return _collection(read_vector(path, family, heights=heights).geometries)
    if extension == ".dxf":
        return _collection(_dxf(path, family, heights, layer))
    if extension == ".str":
        return _collection(_strings(path, family, heights))
    return _geojson(path, family)


def _geojson(path: Path, family: str) -> Any:
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, ValueError, RecursionError) as fault:
        if path.suffix.lower() not in FEATURE_EXTENSIONS:
            kind = f"{path.suffix} files" if path.suffix else "files without an extension"
            raise InputError(f"{path}: {family}s are not read from {kind}; save them as {FORMATS}") from fault
        raise InputError(f"{path}: cannot be read as GeoJSON ({fault})") from fault


def _collection(geometries: list[dict[str, Any]]) -> dict[str, Any]:
    return {"type": "GeometryCollection", "geometries": geometries}


def _dxf(path: Path, family: str, heights: bool, layer: str) -> list[dict[str, Any]]:
    from rpf3d_core.formats.mine.dxf_lines import layers_with_lines, read_dxf_lines, read_dxf_points

    if family == "point":
        return [{"type": "Point", "coordinates": place} for place in read_dxf_points(path).tolist()]
    lines = read_dxf_lines(path, layer)
    if layer and not lines:
        names = ", ".join(layers_with_lines(path)) or "no layer"
        raise InputError(f"{path}: has no line on layer {layer!r}; there are lines on {names}")
    return [
        _line(path, _kept(line.points, heights), line.closed, family, f"on layer {line.layer!r}") for line in lines
    ]


def _strings(path: Path, family: str, heights: bool) -> list[dict[str, Any]]:
    from rpf3d_core.formats.mine.surpac import read_strings, string_segments

    segments = string_segments(read_strings(path))
    if family == "point":
        return [{"type": "Point", "coordinates": place} for segment in segments for place in segment.tolist()]
    return [
        _line(path, _kept(segment, heights), False, family, f"number {number} (from 1)")
        for number, segment in enumerate(segments, start=1)
    ]


def _kept(points: FloatArray, heights: bool) -> list[list[float]]:
    """Return the coordinates of points (P, 3) m as lists: x, y and z if heights are needed, else x and y."""
    found: list[list[float]] = points[:, : 3 if heights else 2].tolist()
    return found


def _line(path: Path, points: list[list[float]], closed: bool, family: str, where: str) -> dict[str, Any]:
    """Return a line as a GeoJSON line, or as a polygon if polygons are needed.

    points : (N, 2 or 3) m, with heights only for lines; closed : True if the last point is connected to the first
    family : wanted kind of geometry, "polygon" or "line"; where : place of the line in the file, for messages
    """
    if closed and points and points[0][:2] != points[-1][:2]:
        points = [*points, points[0]]
    if family == "line":
        return {"type": "LineString", "coordinates": points}
    if len(points) < 4 or points[0] != points[-1]:
        raise InputError(f"{path}: the line {where} is not closed, but an area needs closed lines; close or remove it"
                         f"{_other_layers(path)}")  # fmt: skip
    return {"type": "Polygon", "coordinates": [points]}


def _other_layers(path: Path) -> str:
    """Return the end of a message that names the layers of a DXF file with several; "" for other files."""
    if path.suffix.lower() != ".dxf":
        return ""
    from rpf3d_core.formats.mine.dxf_lines import layers_with_lines

    names = layers_with_lines(path)
    return f", or write one layer with `rpf3d import layer --layer` ({', '.join(names)})" if len(names) > 1 else ""
