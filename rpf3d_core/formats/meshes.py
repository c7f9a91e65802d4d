"""Read a terrain mesh from a file of any known format, chosen by the file name extension."""

from collections.abc import Callable
from pathlib import Path

from rpf3d_core.formats.ply import read_ply
from rpf3d_core.formats.stl import is_ascii_stl, read_binary_stl
from rpf3d_core.formats.surface import FileMesh


def read_stl(path: Path) -> FileMesh:
    """Return the facets of an STL file, whether the file is ASCII or binary."""
    return _read_ascii_stl(path) if is_ascii_stl(path) else read_binary_stl(path)


# The import of VTK takes 0.2 s, so the functions below import the readers of VTK only when they are called.


def _read_ascii_stl(path: Path) -> FileMesh:
    from rpf3d_core.formats.vtk_files import read_ascii_stl

    return read_ascii_stl(path)


def _read_obj(path: Path) -> FileMesh:
    from rpf3d_core.formats.vtk_files import read_obj

    return read_obj(path)


def _read_vtk(path: Path) -> FileMesh:
    from rpf3d_core.formats.vtk_files import read_vtk

    return read_vtk(path)


def _read_dxf(path: Path) -> FileMesh:
    from rpf3d_core.formats.mine.dxf import read_dxf

    return read_dxf(path)


def _read_landxml(path: Path) -> FileMesh:
    from rpf3d_core.formats.mine.landxml import read_landxml

    return read_landxml(path)


def _read_dtm(path: Path) -> FileMesh:
    from rpf3d_core.formats.mine.surpac import read_dtm

    return read_dtm(path)


def _read_omf(path: Path) -> FileMesh:
    from rpf3d_core.formats.mine.omf import read_omf

    return read_omf(path)


def _read_cloud(path: Path) -> FileMesh:
    from rpf3d_core.formats.mine.clouds import read_cloud_surface

    return read_cloud_surface(path)


MESH_READERS: dict[str, Callable[[Path], FileMesh]] = {
    ".stl": read_stl,
    ".ply": read_ply,
    ".obj": _read_obj,
    ".vtp": _read_vtk,
    ".vtk": _read_vtk,
    ".dxf": _read_dxf,
    ".xml": _read_landxml,
    ".landxml": _read_landxml,
    ".dtm": _read_dtm,
    ".omf": _read_omf,
    ".las": _read_cloud,
    ".laz": _read_cloud,
    ".e57": _read_cloud,
    ".xyz": _read_cloud,
    ".csv": _read_cloud,
    ".txt": _read_cloud,
}
"""The function that reads each mesh format, by file name extension."""

LAYERED = (".dxf", ".xml", ".landxml", ".dtm", ".omf")
"""Extensions of the formats with layers, surfaces or objects, which become zones."""


def companion_of(path: Path) -> Path | None:
    """Return the path of the .str file with the points of a Surpac .dtm file.

    The result is None for a file of another format, or if the .str file is missing.
    """
    if path.suffix.lower() != ".dtm":
        return None
    from rpf3d_core.formats.mine.surpac import strings_of

    return strings_of(path)


EXPORTS = {
    ".dwg": "save the drawing as DXF",
    ".00t": "export the triangulation from Vulcan as DXF",
    ".dm": "export the wireframe from Datamine as DXF",
    ".str": "the triangles of a Surpac surface are in the .dtm file; `rpf3d import cloud` reads strings as points",
    ".msh": "export the surface from Leapfrog as OMF 1 or DXF",
    ".glb": "export a PLY, OBJ or DXF file",
    ".gltf": "export a PLY, OBJ or DXF file",
    ".shp": "a Shapefile can be an area, a line or points; export the surface as DXF",
    ".gpkg": "a GeoPackage can be an area, a line or points; export the surface as DXF",
}
"""Advice to the user for each known format that cannot be read as a terrain, by file name extension."""
