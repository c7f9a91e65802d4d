"""Read polygons, lines and points of GeoPackages and Shapefiles with pyogrio (GDAL), in a separate process.

A command needs the content of a file several times, and a separate process takes 0.4 s to start. So the content of a
file is kept in memory until the file changes.
"""

import json
import shlex
import sqlite3
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

from rpf3d_core.errors import InputError, TerrainError
from rpf3d_core.formats.apart import Arrays, read_apart
from rpf3d_core.formats.commands import path_in_a_command
from rpf3d_core.formats.mine.need import needed

State = tuple[tuple[int, int] | None, ...]
"""Time of the last change (ns) and size (bytes) of a file and of each companion; None for a missing file."""

VECTOR_EXTENSIONS = (".gpkg", ".shp")
MOST_FEATURES = 1_000_000
"""Largest number of features of a layer that is read."""
FAMILIES = {"polygon": "polygons", "line": "lines", "point": "points"}
"""Plural of each kind of geometry, for messages."""
MOST_KEPT = 2**24
"""Largest total size (bytes) of the layers that are kept in memory; the layers read last are kept."""
MOST_ENTRIES = 64
"""Largest number of layers that are kept in memory."""
COMPANIONS = {".shp": (".shx", ".prj", ".dbf", ".cpg"), ".gpkg": (".gpkg-wal",)}
"""Extensions of the companion files of each kind of file; a companion may change while the file stays the same."""

_kept: dict[tuple[Path, str, str], tuple[State, Arrays]] = {}
"""The content of each layer that is kept in memory, by path, kind of geometry and name of the layer.

An entry has the state of the file when the layer was read, and the arrays of the layer (`vector_arrays`).
"""


class VectorLayer(NamedTuple):
    """A layer of a GeoPackage or Shapefile.

    geometries : in the form of GeoJSON; crs : the coordinate reference system that the layer states, None if it states
        none
    """

    geometries: list[dict[str, Any]]
    crs: str | None


def read_vector(path: Path, family: str, layer: str = "", heights: bool = False) -> VectorLayer:
    """Return the geometries of a layer and its reference system; points keep their heights.

    family : "polygon", "line" or "point", the kind of geometry of the wanted layer
    layer : name of the layer; "" for the only layer with geometries of this kind
    heights : True to keep the heights of lines and polygons, too

    Raises
    ------
    InputError
        The library is missing, the file is damaged or has no such layer, or `layer` is "" and several layers fit.
    """
    needed(path, "pyogrio")
    arrays = _arrays(path, family, layer)
    content, ends = arrays["content"].tobytes(), np.cumsum(arrays["lengths"]).tolist()
    parts = [content[begin:end] for begin, end in pairwise([0, *ends])]
    read = np.asarray(shapely.from_wkb(parts), dtype=object)
    shapes = read if heights or family == "point" else shapely.force_2d(read)
    found = [json.loads(text) for text in shapely.to_geojson(shapes[~shapely.is_empty(shapes)])]
    return VectorLayer(found, str(arrays["crs"]) or None)


def vector_crs(path: Path, family: str) -> str | None:
    """Return the reference system of the only layer with the wanted kind of geometry; None if the layer states none.

    The result is also None if the file cannot be read, or has no such layer or several such layers.

    family : wanted kind of geometry, "polygon", "line" or "point"; layers of a GeoPackage may have different systems
    """
    try:
        needed(path, "pyogrio")
        return str(_arrays(path, family, "")["crs"]) or None
    except TerrainError:
        return None


def _arrays(path: Path, family: str, layer: str) -> Arrays:
    """Return the arrays of `vector_arrays`: from memory, or from a separate process if the file is new or changed."""
    state, key = _state(path), (path, family, layer)
    then, arrays = _kept.get(key, ((), {}))
    if then == state:
        return arrays
    arrays = read_apart(path, "rpf3d_core.formats.mine.vector_files:vector_arrays", family, layer)
    _kept.pop(key, None)
    if _size(arrays) <= MOST_KEPT:
        _kept[key] = state, arrays
        _forget()
    return arrays


def _forget() -> None:
    """Remove the oldest layers from memory, until at most MOST_ENTRIES layers and MOST_KEPT bytes remain."""
    entries = [(key, _size(arrays)) for key, (_, arrays) in list(_kept.items())]  # other threads may read as well
    while len(entries) > MOST_ENTRIES or sum(size for _, size in entries) > MOST_KEPT:
        _kept.pop(entries.pop(0)[0], None)


def _size(arrays: Arrays) -> int:
    """Return the memory (bytes) that arrays occupy."""
    return sum(np.asarray(each).nbytes for each in arrays.values())


def _state(path: Path) -> State:
    """Return the state of a file: time of change (ns) and size (bytes) of the file and of each companion file."""
    found: list[tuple[int, int] | None] = []
    for file in (path, *(path.with_suffix(end) for end in COMPANIONS.get(path.suffix.lower(), ()))):
        try:
            known = file.stat()
            found.append((known.st_mtime_ns, known.st_size))
        except OSError:
            found.append(None)
    return tuple(found)


def vector_arrays(path: Path, family: str, layer: str = "") -> Arrays:
    """Return the geometries of a layer as arrays, read in this process.

    family : "polygon", "line" or "point"; layer : name of the layer, "" for the only layer with such geometries

    `content` has the bytes of all geometries in WKB, one after another; `lengths` (N,) has their sizes (bytes); `crs`
    is the reference system of the layer, "" if it has none.
    """
    pyogrio = needed(path, "pyogrio")
    _refuse_incomplete(path)
    try:
        layers = pyogrio.list_layers(path).tolist()
        name = _layer(path, layers, family, layer)
        if path.suffix.lower() == ".gpkg":
            _refuse_computed(path, name)
        known = pyogrio.read_info(path, layer=name, force_feature_count=True)
        count = int(known["features"])
        if count > MOST_FEATURES:
            raise TerrainError(f"{path}: layer {name!r} has {count:,} features, more than {MOST_FEATURES:,}; cut it")
        geometries = pyogrio.raw.read(path, layer=name, columns=[])[2]
        system = str(known["crs"] or "")
    except (InputError, MemoryError):
        raise
    except Exception as fault:
        kind = "GeoPackage" if path.suffix.lower() == ".gpkg" else "Shapefile"
        reason = str(fault).replace("\n", " ").partition("It might help")[0].rstrip(" ;.")  # no advice of GDAL
        raise TerrainError(f"{path}: cannot be read as a {kind} ({reason})") from fault
    parts = [part for part in geometries if part is not None]
    lengths = np.array([len(part) for part in parts], np.int64)
    return {"content": np.frombuffer(b"".join(parts), np.uint8), "lengths": lengths, "crs": system}


def _refuse_incomplete(path: Path) -> None:
    """Raise a TerrainError if a file is empty, or a Shapefile lacks its index; GDAL's own advice is for programmers."""
    if path.is_file() and not path.stat().st_size:
        raise TerrainError(f"{path}: is empty")
    index = path.with_suffix(".shx")
    if path.suffix.lower() == ".shp" and path.is_file() and not index.is_file():
        raise TerrainError(f"{path}: lacks its index, the file {index.name}: copy all files of the Shapefile together")


def _layer(path: Path, layers: list[list[Any]], family: str, wanted: str) -> str:
    """Return the name of the layer to read; raise a TerrainError if the file has no such layer, or several.

    layers : name and type of geometries of each layer, such as "MultiPolygon"
    family : wanted kind of geometry, "polygon", "line" or "point"; a layer of type "Unknown" fits every kind
    wanted : name of the wanted layer; "" for the only layer whose geometries are of the wanted kind
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
        f"rpf3d import layer {path_in_a_command(path)} --kind {family} --layer {shlex.quote(fitting[0])} "
        f"--out {path_in_a_command(path.with_name(fitting[0].replace('/', '_') + '.geojson'))}"
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
