"""Reading a mesh file of any known kind."""

from collections.abc import Callable
from pathlib import Path

from rpf3d_core.io import vtk_files
from rpf3d_core.io.ply import read_ply
from rpf3d_core.io.stl import is_ascii_stl, read_binary_stl
from rpf3d_core.io.surface import Surface


def read_stl(path: Path) -> Surface:
    """The facets of an STL file, ASCII or binary."""
    return vtk_files.read_ascii_stl(path) if is_ascii_stl(path) else read_binary_stl(path)


MESH_READERS: dict[str, Callable[[Path], Surface]] = {
    ".stl": read_stl,
    ".ply": read_ply,
    ".obj": vtk_files.read_obj,
    ".vtp": vtk_files.read_vtk,
    ".vtk": vtk_files.read_vtk,
}
"""Reader by file name extension."""
