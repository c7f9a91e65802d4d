"""Write .vtp files (VTK XML, polygonal data): binary arrays in compressed blocks, for example the trace map.

VTK's writer is not used, because VTK needs all arrays complete in memory: a map of millions of facets has 25 arrays,
and rocks may reach only a thousandth of the facets. If an array has one value nearly everywhere, a block of this value
is compressed once and written for all equal blocks. (Format: VTK file formats, "XML File Formats", docs.vtk.org.)
"""

import html
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

BLOCK = 2**15
"""Size (bytes) of the parts of an array that are compressed separately; the same as in VTK's writer."""
CODEC = pa.Codec("lz4_raw")
WIDEST = 2**63
"""Placeholder for an offset that is not yet known, with the largest possible number of digits."""


class Scattered(NamedTuple):
    """An array (cells,) in which nearly all numbers are equal, stored as the few other numbers and their positions.

    cells : length of the array; elsewhere : the number that nearly all cells have
    cell : (S,) cells with other numbers, ascending; values : (S,) the numbers of these cells
    """

    cells: int
    cell: NDArray[Any]
    values: NDArray[Any]
    elsewhere: float


Array = NDArray[Any] | Scattered


class PolyData(NamedTuple):
    """The content of a .vtp file: points, the polygons or lines between them, and data by name.

    points : (N, 3) m; kind : "Polys" or "Lines"
    ends, corners : cell i connects the points corners[ends[i - 1] : ends[i]]; the first cell starts at corners[0]
    point_data, cell_data : arrays (N,) for the points and (C,) for the C cells, by name; the first array of each is the
        active array in VTK
    names : lists of texts by name, written as field data
    """

    points: FloatArray
    kind: str
    ends: NDArray[np.int32]
    corners: NDArray[np.int32]
    point_data: Mapping[str, Array]
    cell_data: Mapping[str, Array]
    names: Mapping[str, Sequence[str]]


def write_poly_data(path: Path, data: PolyData) -> None:
    """Write points, polygons or lines and their data to a .vtp file. Integers of 64 bits are written with 32 bits.

    Raises
    ------
    OSError
        The file could not be written.
    """
    arrays = _arrays(data)
    try:
        with path.open("wb") as file:
            # The header states the offset of each array. Offsets are known only after compression, so space for the
            # header is reserved.
            room = len(_header(data, arrays, [WIDEST] * len(arrays)))
            file.write(b" " * room + b'<AppendedData encoding="raw">\n_')
            begin, offsets = file.tell(), []
            for values in arrays:
                offsets.append(file.tell() - begin)
                _write_array(file, values)
            file.write(b"\n</AppendedData>\n</VTKFile>\n")
            file.seek(0)
            file.write(_header(data, arrays, offsets).ljust(room))
    except OSError as fault:
        raise OSError(f"{path}: could not be written ({fault.strerror or fault})") from fault


def _arrays(data: PolyData) -> list[Array]:
    """Return all arrays of a .vtp file in the order in which `_header` describes them."""
    attributes = [*data.point_data.values(), *data.cell_data.values()]
    return [_narrow(values) for values in (*attributes, data.points, data.corners, data.ends)]


def _narrow(values: Array) -> Array:
    if isinstance(values, Scattered):
        return values._replace(values=_narrow_array(values.values))
    return _narrow_array(values)


def _narrow_array(values: NDArray[Any]) -> NDArray[Any]:
    return values.astype(np.int32) if values.dtype == np.int64 else values


def _header(data: PolyData, arrays: Sequence[Array], offsets: Sequence[int]) -> bytes:
    """Return the XML header of a .vtp file; offsets : bytes from the start of the appended data to each array."""
    following = zip(arrays, offsets, strict=True)
    cells = f'NumberOfVerts="0" NumberOfStrips="0" NumberOf{data.kind}="{len(data.ends)}"'
    other = "Lines" if data.kind == "Polys" else "Polys"
    lines = [
        '<?xml version="1.0"?>',
        f'<VTKFile type="PolyData" version="1.0" byte_order="{sys.byteorder.capitalize()}Endian" header_type="UInt64" '
        'compressor="vtkLZ4DataCompressor">',
        "<PolyData>",
        *_section("FieldData", "", [_texts(name, texts) for name, texts in data.names.items()]),
        f'<Piece NumberOfPoints="{len(data.points)}" {cells} NumberOf{other}="0">',
    ]
    for section, attributes in (("PointData", data.point_data), ("CellData", data.cell_data)):
        active = f" Scalars={_quoted(next(iter(attributes)))}" if attributes else ""
        lines += _section(section, active, [_array(name, *next(following)) for name in attributes])
    lines += _section("Points", "", [_array("Points", *next(following))])
    lines += _section(data.kind, "", [_array(name, *next(following)) for name in ("connectivity", "offsets")])
    return "\n".join([*lines, "</Piece>", "</PolyData>\n"]).encode()


def _section(name: str, attributes: str, content: Sequence[str]) -> list[str]:
    return [f"<{name}{attributes}>", *content, f"</{name}>"]


def _array(name: str, values: Array, offset: int) -> str:
    kind = (values.values if isinstance(values, Scattered) else values).dtype
    word = {"f": "Float", "i": "Int", "u": "UInt"}[kind.kind]
    columns = values.shape[1] if isinstance(values, np.ndarray) and values.ndim == 2 else 1
    return (
        f'<DataArray type="{word}{8 * kind.itemsize}" Name={_quoted(name)} NumberOfComponents="{columns}" '
        f'format="appended" offset="{offset}"/>'
    )


def _texts(name: str, texts: Sequence[str]) -> str:
    """Return a list of texts as an XML element of a .vtp file: the byte codes of each text, and a 0 after each text."""
    codes = " ".join(str(code) for text in texts for code in (*text.encode(), 0))
    return f'<Array type="String" Name={_quoted(name)} NumberOfTuples="{len(texts)}" format="ascii">{codes}</Array>'


def _quoted(text: str) -> str:
    return f'"{html.escape(text)}"'


def _write_array(file: BinaryIO, values: Array) -> None:
    """Write an array in the form that VTK reads: a header with number and sizes of the blocks, then the blocks."""
    if isinstance(values, Scattered):
        size, blocks = values.cells * values.values.itemsize, list(_scattered_blocks(values))
    else:
        size, blocks = values.nbytes, list(_blocks(values))
    file.write(np.array([len(blocks), BLOCK, size % BLOCK, *map(len, blocks)], dtype=np.uint64).tobytes())
    file.writelines(blocks)


def _blocks(values: NDArray[Any]) -> Iterator[bytes]:
    """Yield the compressed blocks of an array, each of BLOCK bytes before compression."""
    if values.size:
        content = np.ascontiguousarray(values).reshape(-1).view(np.uint8)
        for begin in range(0, len(content), BLOCK):
            yield _compressed(content[begin : begin + BLOCK])


def _scattered_blocks(some: Scattered) -> Iterator[bytes]:
    """Yield the compressed blocks of a scattered array; a block with only equal numbers is compressed once for all."""
    step = BLOCK // some.values.itemsize
    same = np.full(step, some.elsewhere, dtype=some.values.dtype)
    whole = _compressed(same)
    begins = np.arange(0, some.cells, step)
    rows = np.searchsorted(some.cell, [*begins, some.cells])
    for begin, row, end in zip(begins.tolist(), rows[:-1].tolist(), rows[1:].tolist(), strict=True):
        length = min(step, some.cells - begin)
        if row == end:
            yield whole if length == step else _compressed(same[:length])
            continue
        block = same[:length].copy()
        block[some.cell[row:end] - begin] = some.values[row:end]
        yield _compressed(block)


def _compressed(content: Any) -> bytes:
    compressed: bytes = CODEC.compress(content, asbytes=True)
    return compressed
