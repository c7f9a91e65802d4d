"""Read ASCII STL, OBJ, VTP and legacy VTK files with VTK's readers.

After an error, VTK only prints a message, and returns a part of the data or no data. This module collects the messages,
and refuses the file if there is any message. VTP and legacy VTK are read in a separate process (`apart.py`).
"""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkTriangleFilter
from vtkmodules.vtkIOGeometry import vtkOBJReader, vtkSTLReader
from vtkmodules.vtkIOLegacy import vtkPolyDataReader
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.apart import Arrays, read_apart
from rpf3d_core.formats.stl import ascii_stl_corners, ascii_stl_fault
from rpf3d_core.formats.surface import FileMesh, refuse_wrong_indices

MOST_RECORDS_PER_BYTE = 10
"""Largest plausible number of points or cells for each byte of a file; a file that announces more is refused.

A record takes 6 bytes as text, and about 1 byte if it is compressed.
"""

_ANNOUNCED = re.compile(
    rb"""(?:Number\w+\s*=\s*["']\s*|(?:^|\s)(?:POINTS|POLYGONS|VERTICES|LINES|TRIANGLE_STRIPS)\s+)(\d+)(?:\s+(\d+))?""",
    re.IGNORECASE,
)


def read_ascii_stl(path: Path) -> FileMesh:
    """Return the facets of an ASCII STL, three points for each facet; raise a TerrainError that names a wrong line.

    VTK's reader only checks the file. The corners are read again from the text, because VTK uses float32, whose steps
    are half a metre at survey coordinates.
    """
    reader = vtkSTLReader()
    reader.MergingOff()
    try:
        data = _output(path, reader)
    except TerrainError as fault:
        raise TerrainError(f"{path}: {ascii_stl_fault(path)}") from fault
    return FileMesh(ascii_stl_corners(path, data.GetNumberOfPoints()))


def read_obj(path: Path) -> FileMesh:
    """Return the faces of an OBJ file as triangles; raise a TerrainError if VTK reports an error."""
    return _surface(path, _output(path, vtkOBJReader()))


def read_vtk(path: Path) -> FileMesh:
    """Return the polygons of a .vtp or .vtk file (DATASET POLYDATA) as triangles, read in a separate process.

    Raises
    ------
    TerrainError
        The file is truncated or damaged, or has facets with fewer than three corners or with missing points.
    """
    _refuse_impossible_counts(path)
    arrays = read_apart(path, "rpf3d_core.formats.vtk_files:read_here")
    return FileMesh(arrays["points"], arrays.get("triangles"))


def read_here(path: Path) -> Arrays:
    """Return the polygons of a .vtp or .vtk file, read in this process: `points` (N, 3) and `triangles` (F, 3).

    Points are in the unit of the file; errors are as in `read_vtk`.
    A file without polygons gives no points and no array `triangles`.
    """
    reader = vtkXMLPolyDataReader() if path.suffix.lower() == ".vtp" else vtkPolyDataReader()
    surface = _surface(path, _output(path, reader))
    arrays = {"points": surface.points, "triangles": surface.triangles}
    return {name: array for name, array in arrays.items() if array is not None}


def _output(path: Path, reader: Any) -> vtkPolyData:
    with _collected_messages() as messages:
        reader.SetFileName(str(path))
        reader.Update()
    complaint = _first_sentence(messages.GetOutput() or "")
    if complaint:
        raise TerrainError(f"{path}: is no complete {path.suffix.lower()} file; the reader says: {complaint}")
    data: vtkPolyData = reader.GetOutput()
    return data


@contextmanager
def _collected_messages() -> Iterator[Any]:
    """Collect VTK's messages instead of printing them, until the `with` block ends.

    Yield the object with the messages.
    """
    before, window = vtkOutputWindow.GetInstance(), vtkStringOutputWindow()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkOutputWindow.SetInstance(window)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield window
    finally:
        vtkLogger.SetStderrVerbosity(verbosity)
        vtkOutputWindow.SetInstance(before)


def _first_sentence(messages: str | bytes) -> str:
    """Return the first message of VTK as a sentence for the user, without source lines and memory addresses.

    VTK quotes the file in its messages. If the quoted part is not text, the messages are bytes.
    """
    messages = messages if isinstance(messages, str) else messages.decode("ascii", "replace")
    lines = [line.strip() for line in messages.splitlines() if line.strip()]
    wanted = [line for line in lines if not line.startswith(("ERROR: In ", "Warning: In ", "Generic Warning: In "))]
    return re.sub(r"^\w+ \((?:0x)?[0-9a-fA-F]+\): ", "", (wanted or lines or [""])[0])


def _surface(path: Path, data: vtkPolyData) -> FileMesh:
    """Return the triangles of data that VTK has read: polygons and strips are cut, lines and points are ignored."""
    if data.GetPoints() is None or data.GetNumberOfPolys() + data.GetNumberOfStrips() == 0:
        return FileMesh(np.empty((0, 3)))
    points = vtk_to_numpy(data.GetPoints().GetData())
    for cells in (data.GetPolys(), data.GetStrips()):
        _refuse_damaged_cells(path, cells, len(points))
    cut = vtkTriangleFilter()
    cut.PassLinesOff()
    cut.PassVertsOff()
    cut.SetInputData(data)
    cut.Update()
    corners: NDArray[Any] = vtk_to_numpy(cut.GetOutput().GetPolys().GetConnectivityArray())
    return FileMesh(points, corners.reshape(-1, 3).astype(np.int32))


def _refuse_damaged_cells(path: Path, cells: Any, points: int) -> None:
    """Raise a TerrainError for damaged cells, which would make VTK read outside its arrays and crash.

    cells : a vtkCellArray; points : number of points to which the cells may refer
    """
    if cells.GetNumberOfCells() == 0:
        return
    corners, offsets = vtk_to_numpy(cells.GetConnectivityArray()), vtk_to_numpy(cells.GetOffsetsArray())
    sizes = np.diff(offsets)
    if offsets[0] != 0 or offsets[-1] != len(corners) or (sizes < 0).any():
        raise TerrainError(f"{path}: the list of cells is damaged or truncated")
    if (sizes < 3).any():
        few = np.flatnonzero(sizes < 3)[0]
        raise TerrainError(f"{path}: facet number {few} (from 0) has {sizes[few]} corners; it must have 3 at least")
    refuse_wrong_indices(path, corners, points)


def _refuse_impossible_counts(path: Path) -> None:
    """Refuse a file that announces more points or cells than it can hold, before VTK allocates memory for them."""
    data = path.read_bytes()
    most = max((int(number) for match in _ANNOUNCED.finditer(data) for number in match.groups("0")), default=0)
    if most > MOST_RECORDS_PER_BYTE * len(data):
        raise TerrainError(
            f"{path}: announces {most:,} points or cells, more than {len(data):,} bytes can hold; "
            "it is truncated or damaged"
        )
