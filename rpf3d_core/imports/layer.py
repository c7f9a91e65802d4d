"""Write areas, lines or points of a file as GeoJSON, in another reference system if wanted: `rpf3d import layer`."""

import json
from pathlib import Path
from typing import Literal

from rpf3d_core.errors import InputError
from rpf3d_core.formats.features import features_of
from rpf3d_core.formats.mine.vector_files import VECTOR_EXTENSIONS, VectorLayer, read_vector
from rpf3d_core.formats.polygons import geometries
from rpf3d_core.formats.reference_system import stated_reference_system
from rpf3d_core.formats.transformation import feature_collection

Kind = Literal["polygon", "line", "point"]
TYPES: dict[str, tuple[str, ...]] = {
    "polygon": ("Polygon", "MultiPolygon"),
    "line": ("LineString", "MultiLineString"),
    "point": ("Point", "MultiPoint"),
}
"""GeoJSON types of the geometries of each kind."""


def import_layer(
    path: Path, out: Path, kind: Kind = "polygon", layer: str = "", begin: str | None = None, end: str | None = None
) -> int:
    """Write the geometries of one kind in the file `path` as GeoJSON to the new file `out`; return their number.

    Points keep their heights. Lines and areas lose their heights, unless `path` is a GeoJSON file.

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
    return len(found)


def _read(path: Path, kind: Kind, layer: str) -> VectorLayer:
    """Return the geometries of one kind in a file, and the reference system that the file states.

    layer : as in `import_layer`
    """
    if path.suffix.lower() in VECTOR_EXTENSIONS:
        return read_vector(path, kind, layer)
    if layer and (path.suffix.lower() != ".dxf" or kind == "point"):
        raise InputError(f"{path}: only a GeoPackage, and lines of a DXF file, have layers; leave --layer out")
    found = list(geometries(path, features_of(path, kind, layer=layer), TYPES[kind]))
    if not found:
        raise InputError(f"{path}: holds no {kind}")
    return VectorLayer(found, stated_reference_system(path))
