"""Write a terrain as a mesh file (.vtp, .stl, .ply, .obj), in the input's own coordinates.

STL, PLY and OBJ are written here, not by VTK. VTK's PLY and OBJ writers report no error if the disk is full, write no
file if the extension is in capitals, and keep only six figures (OBJ) or float32 (PLY) of a survey coordinate.
"""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.flights import Impacts
from rpf3d_core.errors import InputError
from rpf3d_core.formats.stl import RECORD
from rpf3d_core.results.trace_map import write_terrain
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray

FACE = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
"""The bytes of one triangle in a binary PLY file."""


def write_mesh(path: Path, terrain: Terrain) -> None:
    """Write a terrain to a mesh file; the extension chooses the format.

    If writing fails, no new file is left, and an earlier file of this name stays unchanged.

    Raises
    ------
    InputError
        The path is refused (see `check_mesh_path`), or the file could not be written.
    """
    extension = check_mesh_path(path)
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        WRITERS[extension](part, terrain)
        part.replace(path)
    except OSError as fault:
        reason = f" ({fault.strerror})" if fault.strerror else ""  # an error of the VTP writer has no reason
        raise InputError(f"{path}: could not be written{reason}") from fault
    finally:
        part.unlink(missing_ok=True)


def check_mesh_path(path: Path) -> str:
    """Check that a mesh may be written to a path, and return the extension of the path in lower case, such as ".stl".

    Call this function before long work, so that a wrong path is refused before this work.

    Raises
    ------
    InputError
        The extension is unknown, the path is a folder, or its parent folder does not exist.
    """
    extension = path.suffix.lower()
    if extension not in WRITERS:
        raise InputError(f"{path}: the extension must be one of {', '.join(WRITERS)}")
    if path.is_dir():
        raise InputError(f"{path}: is a folder; the mesh needs the path of a file")
    if not path.parent.is_dir():
        raise InputError(f"{path}: there is no folder {path.parent}")
    return extension


def _points(terrain: Terrain) -> FloatArray:
    """Return the vertices (V, 3) m of a terrain in the input's coordinates, as mesh files have them."""
    return np.ascontiguousarray(terrain.frame.points_to_input(terrain.vertices))


def _write_vtp(path: Path, terrain: Terrain) -> None:
    """Write a terrain as .vtp: the facets with their zones, like a trace map without impacts."""
    none, at = np.empty(0, dtype=np.int64), np.empty((0, 3))
    write_terrain(path, terrain, Impacts(none, at[:, 0], at, none, at, at[:, 0], at[:, 0]))


def _write_stl(path: Path, terrain: Terrain) -> None:
    """Write a terrain as binary STL (`formats/stl.py`): float32, without zones.

    Normals are written as zero; readers then compute normals from the winding of the vertices.
    """
    records = np.zeros(len(terrain.triangles), RECORD)
    records["corners"] = _points(terrain)[terrain.triangles]
    with path.open("wb") as file:
        file.write(b"rpf3d".ljust(80) + np.uint32(len(records)).tobytes())
        file.write(records.tobytes())


def _write_ply(path: Path, terrain: Terrain) -> None:
    """Write a terrain as binary PLY (Turk 1994): float64, without zones."""
    faces = np.empty(len(terrain.triangles), FACE)
    faces["count"], faces["corners"] = 3, terrain.triangles
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {len(terrain.vertices)}\nproperty double x\n"
        f"property double y\nproperty double z\nelement face {len(faces)}\nproperty list uchar int vertex_indices\n"
        "end_header\n"
    )
    with path.open("wb") as file:
        file.write(header.encode("ascii"))
        file.write(_points(terrain).astype("<f8").tobytes())
        file.write(faces.tobytes())


def _write_obj(path: Path, terrain: Terrain) -> None:
    """Write a terrain as Wavefront OBJ: text with all digits of float64, without zones; vertices count from 1."""
    with path.open("w", encoding="ascii") as file:
        np.savetxt(file, _points(terrain), fmt="v %.17g %.17g %.17g")
        np.savetxt(file, terrain.triangles + 1, fmt="f %d %d %d")


WRITERS: dict[str, Callable[[Path, Terrain], None]] = {
    ".vtp": _write_vtp,
    ".stl": _write_stl,
    ".ply": _write_ply,
    ".obj": _write_obj,
}
"""The function that writes each mesh format, by extension. Only .vtp keeps the zones; STL rounds to float32."""
