"""Compute digests of the files of a results folder: of all numbers, all names and their order.

These parts are not digested: pictures and run.rrd, which show the same numbers; inputs.json, which repeats the scene;
versions, engine and wall times in summary.json; and all sentences for users, that is, all strings with a blank.
"""

import hashlib
import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
import rasterio
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

DIGITS = 16
"""Hex digits of a SHA-256 that are kept: enough to distinguish results, and short enough to read."""
SUMMARY = "summary.json"
DRAWN = (".png", ".rrd")
"""Suffixes of the files that are not digested: pictures and recordings."""
INPUTS = "inputs.json"
"""The file that repeats the scene and the warnings; it is not digested either, because it has no result of its own."""
LEFT_OUT = (
    "versions", "engine", "read_s", "index_s", "wall_s", "compile_s", "fly_s", "rocks_per_s", "write_s", "total_s",
)  # fmt: skip
"""Keys of the summary that describe the program run, not its result."""
SENTENCE = "a sentence"
"""Text that replaces every sentence: the digest depends on the presence of a sentence, but not on its words."""


def digest_of(*values: Any) -> str:
    """Return the digest of numbers, strings, bytes, arrays, and of mappings and sequences of these; order counts."""
    digest = hashlib.sha256()
    for value in values:
        _feed(digest.update, value)
    return digest.hexdigest()[:DIGITS]


def _feed(update: Callable[[bytes], None], value: Any) -> None:
    """Pass a value to `update` as bytes; different values give different bytes."""
    if isinstance(value, np.ndarray):
        update(f"array {value.dtype.str} {value.shape}:".encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, bytes | bytearray | memoryview):
        update(f"bytes {len(value)}:".encode() + bytes(value))
    elif isinstance(value, Mapping):
        update(f"mapping {len(value)}:".encode())
        for pair in value.items():
            _feed(update, pair)
    elif isinstance(value, list | tuple):
        update(f"sequence {len(value)}:".encode())
        for each in value:
            _feed(update, each)
    else:
        update(_scalar(value))


def _scalar(value: Any) -> bytes:
    """Return a number, string, truth value or None as bytes; a NumPy number counts as a Python number."""
    plain = value.item() if isinstance(value, np.generic) else value
    if plain is not None and not isinstance(plain, bool | int | float | str):
        raise TypeError(f"no rule to digest a {type(plain).__name__}")
    text = repr(plain).encode()  # the repr of a float determines its bits
    return f"{type(plain).__name__} {len(text)}:".encode() + text


def without_sentences(value: Any) -> Any:
    """Return a value with SENTENCE in place of each string with a blank, and the file name in place of each path."""
    if isinstance(value, Mapping):
        return {key: without_sentences(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [without_sentences(item) for item in value]
    if not isinstance(value, str):
        return value
    return SENTENCE if " " in value else value.rpartition("/")[2]


def digests_of(folder: Path) -> dict[str, str]:
    """Return a dictionary from path in the folder to digest, for the digested files of a results folder, by name.

    Raises KeyError for a suffix without an entry in READERS.
    """
    there = (path for path in folder.rglob("*") if path.is_file() and path.name != INPUTS)
    files = sorted(path for path in there if path.suffix not in DRAWN)
    return {path.relative_to(folder).as_posix(): digest_of(READERS[path.suffix](path)) for path in files}


def digest_of_scene(folder: Path) -> str:
    """Return the digest of the scene of a results folder; the scene includes the engine, so this is a separate part."""
    summary = json.loads((folder / SUMMARY).read_text(encoding="utf-8"))
    return digest_of(summary["scene"]["digest"])


def _of_json(path: Path) -> Any:
    """Return the content of a JSON file; the summary is without the keys LEFT_OUT and the digest of the scene."""
    content = json.loads(path.read_text(encoding="utf-8"))
    if path.name == SUMMARY:
        content = {key: value for key, value in content.items() if key not in LEFT_OUT}
        del content["scene"]["digest"]
    return without_sentences(content)


def _of_parquet(path: Path) -> Any:
    """Return name, type, metadata and values of each column, in order."""
    table = pyarrow.parquet.read_table(path)
    return [(f.name, str(f.type), f.metadata or {}, _of_column(table.column(f.name))) for f in table.schema]


def _of_column(column: pa.ChunkedArray) -> Any:
    """Return flags, True for known values, and the values, 0 if unknown; for a dictionary column, return the names."""
    if pa.types.is_dictionary(column.type):
        return column.cast(column.type.value_type).to_pylist()
    known = column.is_valid().combine_chunks().to_numpy(zero_copy_only=False)
    return known, column.fill_null(0).to_numpy()


def _of_raster(path: Path) -> Any:
    """Return types, nodata, transform, reference system and tags of a raster; names, units and values of its bands."""
    with rasterio.open(path) as file:
        system = None if file.crs is None else file.crs.to_string()
        where = file.dtypes, file.nodata, tuple(file.transform), system
        tags = without_sentences(dict(sorted(file.tags().items())))
        return where, file.descriptions, file.units, tags, file.read()


def _of_poly_data(path: Path) -> Any:
    """Return points, cells and all arrays of a .vtp file, as VTK reads them."""
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    data = reader.GetOutput()
    cells = [data.GetVerts(), data.GetLines(), data.GetPolys(), data.GetStrips()]
    places = [
        (vtk_to_numpy(each.GetOffsetsArray()), vtk_to_numpy(each.GetConnectivityArray()))
        for each in cells
        if each.GetNumberOfCells()
    ]
    fields = [_of_arrays(each) for each in (data.GetPointData(), data.GetCellData(), data.GetFieldData())]
    return vtk_to_numpy(data.GetPoints().GetData()), places, fields


def _of_arrays(data: Any) -> list[Any]:
    """Return name and values of each array."""
    arrays = [data.GetAbstractArray(number) for number in range(data.GetNumberOfArrays())]
    return [(array.GetName(), _of_array(array)) for array in arrays]


def _of_array(array: Any) -> Any:
    """Return the values of a VTK array of numbers or strings."""
    if array.IsA("vtkStringArray"):
        return [array.GetValue(number) for number in range(array.GetNumberOfValues())]
    return vtk_to_numpy(array)


READERS: dict[str, Callable[[Path], Any]] = {
    ".csv": Path.read_bytes,
    ".json": _of_json,
    ".geojson": _of_json,
    ".parquet": _of_parquet,
    ".tif": _of_raster,
    ".vtp": _of_poly_data,
}
"""Suffix -> function that returns the content of a file that is digested."""
