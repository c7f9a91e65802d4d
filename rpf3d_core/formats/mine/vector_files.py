"""Read polygons, lines and points of GeoPackages and Shapefiles with pyogrio (GDAL), in a separate process."""

import json
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.formats.apart import Arrays, read_apart
from rpf3d_core.formats.mine.need import needed

VECTOR_EXTENSIONS = (".gpkg", ".shp")
MOST_FEATURES = 1_000_000
"""Largest number of features of a file that is read."""
FAMILIES = {"polygon": "polygons", "line": "lines", "point": "points"}
"""Plural of each kind of geometry, for messages."""


def read_vector(path: Path, family: str, layer: str = "") -> list[dict[str, Any]]:
    """Return the geometries of a layer in the form of GeoJSON; only points keep their heights.

    family : "polygon", "line" or "point", the kind of geometry of the wanted layer
    layer : its name; "" for the only layer with such geometries

    Raises
    ------
    InputError
        The library is missing, the file is damaged or has no such layer, or `layer` is "" and several layers fit.
    """
    needed(path, "pyogrio")
    arrays = read_apart(path, "rpf3d_core.formats.mine.vector_files:vector_arrays", family, layer)
    content, ends = arrays["content"].tobytes(), np.cumsum(arrays["lengths"]).tolist()
    parts = [content[begin:end] for begin, end in zip([0, *ends[:-1]], ends, strict=True)]
    found = np.asarray(shapely.from_wkb(parts), dtype=object)
    shapes = found if family == "point" else shapely.force_2d(found)
    return [json.loads(text) for text in shapely.to_geojson(shapes[~shapely.is_empty(shapes)])]


def vector_crs(path: Path) -> str | None:
    """Return the coordinate reference system that a file states; None if it states none, or cannot be read."""
    try:
        needed(path, "pyogrio")
        return str(read_apart(path, "rpf3d_core.formats.mine.vector_files:vector_system")["crs"]) or None
    except TerrainError:
        return None


def vector_system(path: Path) -> Arrays:
    """Return the array `crs`, read in this process: the reference system of a file's first layer; "" if it has none."""
    pyogrio = needed(path, "pyogrio")
    try:
        first = str(pyogrio.list_layers(path)[0][0])
        return {"crs": str(pyogrio.read_info(path, layer=first)["crs"] or "")}
    except Exception as fault:
        raise TerrainError(f"{path}: cannot be read ({fault})") from fault


def vector_arrays(path: Path, family: str, layer: str = "") -> Arrays:
    """Return the geometries of a layer as arrays, read in this process; arguments are as in `read_vector`.

    `content` has the bytes of all geometries in WKB, one after another; `lengths` (N,) has their sizes (bytes).
    """
    pyogrio = needed(path, "pyogrio")
    try:
        name = _layer(path, pyogrio.list_layers(path).tolist(), family, layer)
        if path.suffix.lower() == ".gpkg":
            _refuse_computed(path, name)
        count = int(pyogrio.read_info(path, layer=name, force_feature_count=True)["features"])
        if count > MOST_FEATURES:
            raise TerrainError(f"{path}: layer {name!r} has {count:,} features, more than {MOST_FEATURES:,}; cut it")
        geometries = pyogrio.raw.read(path, layer=name, columns=[])[2]
    except (InputError, MemoryError):
        raise
    except Exception as fault:
        kind = "GeoPackage" if path.suffix.lower() == ".gpkg" else "Shapefile"
        raise TerrainError(f"{path}: cannot be read as a {kind} ({fault})".replace("\n", " ")) from fault
    parts = [part for part in geometries if part is not None]
    lengths = np.array([len(part) for part in parts], np.int64)
    return {"content": np.frombuffer(b"".join(parts), np.uint8), "lengths": lengths}


def _layer(path: Path, layers: list[list[Any]], family: str, wanted: str) -> str:
    """Return `wanted` if the file has this layer or, if `wanted` is "", the name of the only layer of a family.

    layers : name and kind of geometries of each layer
    """
    if wanted:
        if wanted not in [name for name, _ in layers]:
            raise TerrainError(f"{path}: has no layer {wanted!r}; it has {_listed(layers)}")
        return wanted
    fitting = [str(name) for name, kind in layers if kind and (family in kind.lower() or kind == "Unknown")]
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        raise TerrainError(f"{path}: has no layer of {FAMILIES[family]}; it has {_listed(layers) or 'no layers'}")
    raise TerrainError(
        f"{path}: has several layers of {FAMILIES[family]}: {', '.join(fitting)}; write one to a file of its own: "
        f"rpf3d import layer {path.name} --layer {fitting[0]} --out {fitting[0]}.geojson"
    )


def _listed(layers: list[list[Any]]) -> str:
    return ", ".join(f"{name} ({kind or 'no geometries'})" for name, kind in layers)


def _refuse_computed(path: Path, layer: str) -> None:
    """Raise a TerrainError if a layer of a GeoPackage is a view or has computed columns: its query may never end."""
    with sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True) as database:
        kind, text = next(database.execute("SELECT type, sql FROM sqlite_master WHERE name = ?", (layer,)), ("", ""))
        hidden = [row[6] for row in database.execute("SELECT * FROM pragma_table_xinfo(?)", (layer,))]
    database.close()
    if kind != "table" or not str(text).upper().startswith("CREATE TABLE") or any(hidden):
        raise TerrainError(f"{path}: the layer {layer!r} is computed (a view or such columns); export it as a table")
