"""Write small valid files in every input format, and damage the contents of files at random."""

import gzip
import random
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import rasterio
import shapely
from rasterio.transform import from_origin
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkIOGeometry import vtkOBJWriter
from vtkmodules.vtkIOLegacy import vtkPolyDataWriter
from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

from input_files.mine_files import write_dxf, write_e57, write_landxml, write_las, write_omf, write_surpac, write_vector
from input_files.terrain_files import ascii_stl, grid, scene_of, write_binary_stl
from rpf3d_core.formats.mine.clouds import read_cloud
from rpf3d_core.formats.mine.e57 import e57_arrays
from rpf3d_core.formats.mine.las import las_arrays, read_las
from rpf3d_core.formats.mine.vector_files import vector_arrays
from rpf3d_core.formats.points import read_points
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.formats.polylines import read_lines
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.terrain import read_terrain

VERTICES, TRIANGLES = grid(3, 4)
CORNERS = VERTICES[TRIANGLES]

NUMBERS = (
    b"-1", b"0", b"1", b"2", b"nan", b"inf", b"-inf", b"1e308", b"1e-320", b"4000000000", b"99999999999999999999999",
    b"-9223372036854775808", b"3.5", b"0x10", b"1_0",
)  # fmt: skip
WORDS = (b"", b"float", b"int", b"list", b"vertex", b"\0", b"\xff\xfe", b"'", b'"', b"<", b"{", b"[]", b"null", b"#")


def mutated(data: bytes, rng: random.Random) -> bytes:
    """Return the content of a file with one to three random kinds of damage."""
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        data = rng.choice((_cut, _bits, _bytes, _number, _number, _number, _word, _line, _twice))(data, rng)
    return data


def _cut(data: bytes, rng: random.Random) -> bytes:
    return data[: rng.randrange(len(data) + 1)]


def _bits(data: bytes, rng: random.Random) -> bytes:
    if not data:
        return data
    place = rng.randrange(len(data))
    return data[:place] + bytes([data[place] ^ 1 << rng.randrange(8)]) + data[place + 1 :]


def _bytes(data: bytes, rng: random.Random) -> bytes:
    """Return the data with four or eight bytes replaced by an extreme integer, zeros or NaN."""
    what = rng.choice((b"\xff\xff\xff\xff", b"\0\0\0\0", b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\0\0\xc0\x7f" * 2))
    place = rng.randrange(len(data) + 1)
    return data[:place] + what + data[place + len(what) :]


def _number(data: bytes, rng: random.Random) -> bytes:
    return _exchanged(data, rb"[-+]?\d[\d.e+-]*", NUMBERS, rng)


def _word(data: bytes, rng: random.Random) -> bytes:
    return _exchanged(data, rb"[A-Za-z_]\w*", WORDS, rng)


def _line(data: bytes, rng: random.Random) -> bytes:
    lines = data.splitlines(keepends=True)
    if lines:
        del lines[rng.randrange(len(lines))]
    return b"".join(lines)


def _twice(data: bytes, rng: random.Random) -> bytes:
    begin, end = sorted((rng.randrange(len(data) + 1), rng.randrange(len(data) + 1)))
    return data[:end] + data[begin:end] + data[end:]


def _exchanged(data: bytes, pattern: bytes, others: tuple[bytes, ...], rng: random.Random) -> bytes:
    found = list(re.finditer(pattern, data))
    if not found:
        return data
    # Headers affect the reader most, so half of the damage goes there.
    place = rng.choice(found[:20] if rng.random() < 0.5 else found)
    return data[: place.start()] + rng.choice(others) + data[place.end() :]


def _polygons() -> vtkPolyData:
    data, points, cells = vtkPolyData(), vtkPoints(), vtkCellArray()
    points.SetData(numpy_to_vtk(VERTICES.astype(np.float32), deep=True))
    offsets = np.arange(0, TRIANGLES.size + 1, 3, dtype=np.int64)
    cells.SetData(*(numpy_to_vtkIdTypeArray(a.astype(np.int64), deep=True) for a in (offsets, TRIANGLES.ravel())))
    data.SetPoints(points)
    data.SetPolys(cells)
    return data


def _by_vtk(writer_of: Callable[[], object], binary: bool | None) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        writer = writer_of()
        writer.SetInputData(_polygons())
        writer.SetFileName(str(path))
        if writer_of is vtkXMLPolyDataWriter:
            writer.SetDataMode(writer.Appended if binary else writer.Ascii)
        elif binary is not None:
            writer.SetFileType(2 if binary else 1)
        assert writer.Write()

    return write


def _ply(order: str) -> Callable[[Path], None]:
    """Return a function that writes a PLY file; order : format in the header, such as `ascii`.

    One polygon of the file has four corners, the others have three.
    """
    sign = {"binary_little_endian": "<", "binary_big_endian": ">"}.get(order)
    faces = [[*TRIANGLES[0], 5], *TRIANGLES[1:].tolist()]
    header = (
        f"ply\nformat {order} 1.0\ncomment made\nelement vertex {len(VERTICES)}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    )

    def write(path: Path) -> None:
        if sign is None:
            rows = [*VERTICES.tolist(), *([len(face), *face] for face in faces)]
            body = "".join(" ".join(map(str, row)) + "\n" for row in rows).encode()
        else:
            lists = [bytes([len(face)]) + np.array(face, f"{sign}i4").tobytes() for face in faces]
            body = VERTICES.astype(f"{sign}f4").tobytes() + b"".join(lists)
        path.write_bytes(header.encode() + body)

    return write


DEM = b"ncols 3\nnrows 3\nxllcorner 100\nyllcorner 200\ncellsize 10\nNODATA_value -9999\n7 8 9\n4 5 6\n1 2 -9999\n"
GEOJSON = (
    b'{"type": "FeatureCollection", "features": [{"type": "Feature", "properties": {}, "geometry": '
    b'{"type": "Polygon", "coordinates": [[[0, 0], [4, 0], [4, 4], [0, 0]]]}}]}'
)
SCENE = b"""terrain: {pit: {triangles: 2000}, weld: 0.001}
zones: []
materials:
  default: {normal_restitution: 0.5, tangential_restitution: 0.8}
  floor: {normal_restitution: 0.4, tangential_restitution: 0.7, friction_angle_deg: 30}
sources:
  - {name: top, points: [[0, 0, 0]], rocks: 5}
  - {name: rim, line: [[0, 0, 0], [9, 1, 0]], rocks: 7, velocity: [1, 0, 0]}
rock: {density: 2600, diameter: 0.5}
seed: 3
"""


def _geotiff(path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        options = {"driver": "GTiff", "height": 4, "width": 5, "count": 1, "dtype": "float32", "crs": "EPSG:31287"}
        with rasterio.open(path, "w", transform=from_origin(100, 230, 10, 10), nodata=-9999, **options) as file:
            file.write(np.arange(20, dtype=np.float32).reshape(4, 5), 1)


def _areas(path: Path) -> None:
    """Write two rectangles; an existing file of the same name is replaced."""
    path.unlink(missing_ok=True)
    write_vector(path, [shapely.box(0, 0, 4, 4), shapely.box(9, 0, 12, 4)])


def _dxf_lines(path: Path) -> None:
    """Write an open and a closed polyline."""
    import ezdxf

    document = ezdxf.new("R12")
    document.modelspace().add_polyline3d([(0, 0, 1), (5, 0, 2), (5, 5, 3)])
    document.modelspace().add_polyline2d([(0, 0), (5, 0), (5, 5)], close=True)
    document.saveas(path)


STRINGS = b"crest,,,\n0,0,0,0,0,0,0\n1, 20, 10, 5,\n1, 21, 11, 5,\n0, 0, 0, 0,\n2, 0, 0, 1,\n2, 5, 0, 1,\n0,0,0,0,END\n"


def _terrain(path: Path) -> object:
    return read_terrain(scene_of(path))


READERS: dict[str, tuple[Callable[[Path], object], Callable[[Path], object]]] = {
    "stl binary": (lambda path: write_binary_stl(path, CORNERS), _terrain),
    "stl text": (lambda path: path.write_text(ascii_stl(CORNERS)), _terrain),
    "ply binary": (_ply("binary_little_endian"), _terrain),
    "ply big": (_ply("binary_big_endian"), _terrain),
    "ply text": (_ply("ascii"), _terrain),
    "obj text": (_by_vtk(vtkOBJWriter, None), _terrain),
    "vtp binary": (_by_vtk(vtkXMLPolyDataWriter, True), _terrain),
    "vtp text": (_by_vtk(vtkXMLPolyDataWriter, False), _terrain),
    "vtk binary": (_by_vtk(vtkPolyDataWriter, True), _terrain),
    "vtk text": (_by_vtk(vtkPolyDataWriter, False), _terrain),
    "asc text": (lambda path: path.write_bytes(DEM), _terrain),
    "asc.gz packed": (lambda path: path.write_bytes(gzip.compress(DEM)), _terrain),
    "tif tiles": (_geotiff, _terrain),
    "geojson text": (lambda path: path.write_bytes(GEOJSON), read_polygons),
    "xyz text": (lambda path: path.write_bytes(b"# x y z\n1, 2, 3\n4, 5, 6, more\n\n7, 8, 9\n"), read_points),
    "dxf faces": (lambda path: write_dxf(path, VERTICES, TRIANGLES), _terrain),
    "dxf lines": (_dxf_lines, read_lines),
    "xml tin": (lambda path: write_landxml(path, VERTICES, TRIANGLES), _terrain),
    "dtm surpac": (lambda path: write_surpac(path, VERTICES, TRIANGLES), _terrain),
    "str lines": (lambda path: path.write_bytes(STRINGS), read_lines),
    "omf surface": (lambda path: write_omf(path, VERTICES, TRIANGLES), _terrain),
    "csv cloud": (lambda path: np.savetxt(path, VERTICES, "%.3f", ",", header="x,y,z", comments=""), read_cloud),
    "las cloud": (lambda path: write_las(path, VERTICES), las_arrays),
    "laz cloud": (lambda path: write_las(path, VERTICES), read_las),
    "e57 cloud": (lambda path: write_e57(path, VERTICES), e57_arrays),
    "gpkg areas": (_areas, lambda path: vector_arrays(path, "polygon")),
    "shp areas": (_areas, lambda path: vector_arrays(path, "polygon")),
    "yaml text": (lambda path: path.write_bytes(SCENE), read_scene),
}
"""Format -> functions that write and read a valid file; the first word of a format is the extension of the file."""
