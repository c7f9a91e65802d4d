"""Write areas, lines or points of a file as GeoJSON, in another reference system if wanted: `rpf3d import layer`."""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple

from rpf3d_core.errors import InputError
from rpf3d_core.formats.features import features_of
from rpf3d_core.formats.mine.vector_files import VECTOR_EXTENSIONS, VectorLayer, read_vector
from rpf3d_core.formats.polygons import geometries
from rpf3d_core.formats.reference_system import short_name, stated_reference_system, unit_unlike_metre
from rpf3d_core.formats.transformation import feature_collection

Kind = Literal["polygon", "line", "point"]
TYPES: dict[str, tuple[str, ...]] = {
    "polygon": ("Polygon", "MultiPolygon"),
    "line": ("LineString", "MultiLineString"),
    "point": ("Point", "MultiPoint"),
}
"""GeoJSON types of the geometries of each kind."""


class ImportedLayer(NamedTuple):
    """The report of an imported layer: the number of geometries, and sentences on their heights for the user."""

    number: int
    notes: tuple[str, ...]


def import_layer(
    path: Path, out: Path, kind: Kind = "polygon", layer: str = "", begin: str | None = None, end: str | None = None
) -> ImportedLayer:
    """Write the geometries of one kind in the file `path` as GeoJSON to the new file `out`.

    Points and lines keep their heights. Areas lose their heights, unless `path` is a GeoJSON file: a note states this.

    kind : "polygon", "line" or "point"; layer : name of the layer; "" for the only layer with this kind of geometries,
        or, in a DXF file, for all layers
    begin : name of the reference system of the file; None for the reference system that the file states
    end : name of the reference system of the result; None to leave the coordinates unchanged

    Raises
    ------
    InputError
        The file is missing, refused or without geometries of this kind; `end` is given but the reference system of the
        file is unknown; or `out` exists, is not a .geojson file or cannot be written.
    """
    if out.suffix.lower() != ".geojson":
        raise InputError(f"{out}: must be the path of a new .geojson file")
    if out.exists():
        raise InputError(f"{out}: exists already; delete it or give another name")
    if not path.is_file():
        raise InputError(f"{path}: there is no such file")
    found, stated = _read(path, kind, layer)
    begin = begin or stated
    if end is not None and begin is None:
        raise InputError(f"{path}: states no coordinate reference system; name it with --from, such as EPSG:4326")
    content = feature_collection(path, found, begin, end)
    try:
        out.write_text(json.dumps(content), encoding="utf-8")
    except OSError as fault:
        raise InputError(f"{out}: could not be written ({fault.strerror or fault})") from fault
    return ImportedLayer(number=len(found), notes=tuple(_on_heights(path, kind, begin, end)))


def _on_heights(path: Path, kind: Kind, begin: str | None, end: str | None) -> Iterator[str]:
    """Yield sentences on heights that were left out, or that may now have another unit than the other coordinates.

    The arguments are as in `import_layer`, but `begin` is never None if the file states its reference system.
    """
    if kind == "polygon" and path.suffix.lower() in (*VECTOR_EXTENSIONS, ".dxf", ".str"):
        yield "areas are written in plan: heights of the file, if it has any, are left out"
    elif begin is not None and end is not None and (unit := unit_unlike_metre(begin)):
        yield (
            f"heights, if the file has any, did not change: if they are in {unit.name} like {short_name(begin)}, "
            f"convert them to the unit of {short_name(end)}"
        )


def _read(path: Path, kind: Kind, layer: str) -> VectorLayer:
    """Return the geometries of one kind in a file, and the reference system that the file states.

    kind : kind of the geometries; lines keep their heights; layer : as in `import_layer`

    Raises InputError if the file has no geometry of this kind, or if a layer is given for a file without layers.
    """
    heights = kind == "line"
    if path.suffix.lower() in VECTOR_EXTENSIONS:
        read = read_vector(path, kind, layer, heights=heights)
        return read._replace(geometries=[_with_all_heights(each) for each in read.geometries]) if heights else read
    if layer and (path.suffix.lower() != ".dxf" or kind == "point"):
        raise InputError(f"{path}: only a GeoPackage, and lines of a DXF file, have layers; leave --layer out")
    found = list(geometries(path, features_of(path, kind, heights=heights, layer=layer), TYPES[kind]))
    if not found:
        raise InputError(f"{path}: holds no {kind}")
    return VectorLayer(found, stated_reference_system(path))


def _with_all_heights(geometry: dict[str, Any]) -> dict[str, Any]:
    """Return a line of GeoJSON in which a missing height is NaN, if any of its points has a height.

    Shapely refuses a line if only some of its points have heights. Other geometries stay unchanged.
    """
    if geometry["type"] not in TYPES["line"]:
        return geometry
    is_one = geometry["type"] == "LineString"
    lines = [geometry["coordinates"]] if is_one else geometry["coordinates"]
    numbers = max((len(point) for line in lines for point in line), default=2)
    filled = [[[*point, *[math.nan] * (numbers - len(point))] for point in line] for line in lines]
    return {**geometry, "coordinates": filled[0] if is_one else filled}
