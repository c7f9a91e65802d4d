"""Read a terrain mesh from a file of any known format, chosen by the file name extension."""

from collections.abc import Callable
from pathlib import Path

from rpf3d_core.formats.ply import read_ply
from rpf3d_core.formats.stl import is_ascii_stl, read_binary_stl
from rpf3d_core.formats.surface import FileMesh


def read_stl(path: Path) -> FileMesh:
    """Return the facets of an STL file, whether the file is ASCII or binary."""
    return _read_ascii_stl(path) if is_ascii_stl(path) else read_binary_stl(path)


# The import of VTK takes 0.2 s, so VTK is imported only to read a file with VTK.


def _read_ascii_stl(path: Path) -> FileMesh:
    from rpf3d_core.formats.vtk_files import read_ascii_stl

    return read_ascii_stl(path)


def _read_obj(path: Path) -> FileMesh:
    from rpf3d_core.formats.vtk_files import read_obj

    return read_obj(path)


def _read_vtk(path: Path) -> FileMesh:
    from rpf3d_core.formats.vtk_files import read_vtk

    return read_vtk(path)


MESH_READERS: dict[str, Callable[[Path], FileMesh]] = {
    ".stl": read_stl,
    ".ply": read_ply,
    ".obj": _read_obj,
    ".vtp": _read_vtk,
    ".vtk": _read_vtk,
}
"""The function that reads each mesh format, by file name extension."""
