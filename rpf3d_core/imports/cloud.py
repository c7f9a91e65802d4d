"""Make a terrain from clouds of points: `rpf3d import cloud`."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.mine.cloud import Cloud
from rpf3d_core.formats.mine.clouds import TEXTS, read_cloud
from rpf3d_core.formats.mine.xyz import CLASS_NAMES
from rpf3d_core.formats.precision import lost_precision
from rpf3d_core.formats.reference_system import IN_METRES, are_same, is_known, short_name, unit_unlike_metre
from rpf3d_core.formats.surface import FileMesh
from rpf3d_core.results.mesh_writer import check_mesh_path, write_mesh
from rpf3d_core.terrain.cloud_surface import DEFAULT, CloudChoice, CloudSurface, cloud_surface
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

ZONE = "terrain"


class ImportedCloud(NamedTuple):
    """A terrain made from clouds.

    sentences : for the user, on how the surface was made
    warnings : sentences on content that was not read, and on precision that reading and writing lost
    crs : the coordinate reference system that the files state; None if they state none
    """

    surface: CloudSurface
    sentences: tuple[str, ...]
    warnings: tuple[str, ...]
    crs: str | None


def import_cloud(files: Sequence[Path], out: Path, choice: CloudChoice = DEFAULT) -> ImportedCloud:
    """Make the surface of the ground from the points of some files, and write the surface as a mesh to `out`.

    Return the surface with sentences and warnings for the user.
    Classes of points are used only if all files have classes.

    Raises
    ------
    InputError
        A file is refused, the files have different reference systems, `choice` names classes but a file has none, no
        surface can be made from the points, or `out` cannot be written.
    """
    check_mesh_path(out)
    clouds = [read_cloud(path) for path in files]
    crs = _one_system(files, clouds)
    if choice.classes:
        _check_classes(files, clouds)
    classes = None if any(cloud.classes is None for cloud in clouds) else [cloud.classes for cloud in clouds]
    points = np.concatenate([cloud.points for cloud in clouds])
    surface = cloud_surface(points, None if classes is None else np.concatenate(classes), choice)  # type: ignore[arg-type]
    write_mesh(out, _terrain_of(surface))
    return ImportedCloud(
        surface=surface, sentences=(*surface.describe(), _system_in_words(crs)),
        warnings=tuple(_warnings(files, clouds, surface, out)), crs=crs,
    )  # fmt: skip


def _one_system(files: Sequence[Path], clouds: Sequence[Cloud]) -> str | None:
    """Return the reference system of all clouds, None if no file states one; raise a TerrainError if they differ."""
    stated = {path: cloud.crs for path, cloud in zip(files, clouds, strict=True) if cloud.crs is not None}
    if not stated:
        return None
    first, crs = next(iter(stated.items()))
    for path, other in stated.items():
        if not are_same(crs, other):
            raise TerrainError(f"{path}: is in {other!r}, but {first.name} in {crs!r}; reproject one")
    return crs


def _check_classes(files: Sequence[Path], clouds: Sequence[Cloud]) -> None:
    """Raise a TerrainError that names the first file whose points have no classes."""
    for path, cloud in zip(files, clouds, strict=True):
        if cloud.classes is None:
            column = "" if path.suffix.lower() not in TEXTS else (
                f" (a text file needs a header with one column named {' or '.join(CLASS_NAMES)})"
            )  # fmt: skip
            raise TerrainError(
                f"{path}: has no classes of points{column}; leave --classes out, or import the file separately"
            )


def _system_in_words(crs: str | None) -> str:
    """Return a sentence on the reference system that all clouds state, and on the keys that the scene needs.

    crs : name of the system, None if the files state none; it may be unknown, or in feet
    """
    if crs is None:
        return "the files state no coordinate reference system; name it in the scene as `terrain: {crs: ...}`"
    if not is_known(crs):
        return (f"the files state {short_name(crs)}, which is no known coordinate reference system; name yours in the "
                "scene as `terrain: {crs: ...}`")  # fmt: skip
    unit = unit_unlike_metre(crs)
    if unit is None:
        return f"coordinate reference system {crs}; name it in the scene as `terrain: {{crs: {crs!r}}}`"
    sentence = (f"the files state {short_name(crs)}, which is in {unit.name}: if they are, so are the lengths above, "
                "--cell and --widest")  # fmt: skip
    if unit.key is None:
        return f"{sentence}; reproject the files to a system in metres"
    return (f"{sentence}; give the mesh `unit: {unit.key}` in the scene, and name {IN_METRES}, as `terrain: "
            "{crs: ...}`")  # fmt: skip


def _terrain_of(surface: CloudSurface) -> Terrain:
    x, y, z = np.round(0.5 * (surface.points.min(axis=0) + surface.points.max(axis=0))).tolist()
    frame = Frame((x, y, z))
    return Terrain(
        vertices=frame.points_to_local(surface.points), triangles=surface.triangles,
        zone=np.zeros(len(surface.triangles), np.int32), zones=(ZONE,), frame=frame,
    )  # fmt: skip


def _warnings(files: Sequence[Path], clouds: Sequence[Cloud], surface: CloudSurface, out: Path) -> list[str]:
    """Return sentences on content that was not read, and on precision lost in reading and writing."""
    found = [remark for cloud in clouds for remark in cloud.remarks]
    classified = [cloud.classes is not None for cloud in clouds]
    if any(classified) and not all(classified):
        found.append("some files have classes and others have none, so classes were not used")
    single = surface.points.astype(np.float32)
    for path, cloud in zip(files, clouds, strict=True):
        if cloud.single and (lost := lost_precision(path, FileMesh(single, surface.triangles))):
            found.append(lost)
    if out.suffix.lower() == ".stl" and (lost := lost_precision(out, FileMesh(single, surface.triangles))):
        found.append(lost)
    return found
