"""Read a cloud of points from a file of any known format, and make a terrain surface from the cloud."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.mine.cloud import Cloud
from rpf3d_core.formats.mine.e57 import read_e57
from rpf3d_core.formats.mine.las import read_las
from rpf3d_core.formats.mine.surpac import read_strings
from rpf3d_core.formats.mine.xyz import read_xyz
from rpf3d_core.formats.reference_system import system_in_metres
from rpf3d_core.formats.surface import FARTHEST, FileMesh
from rpf3d_core.formats.whole_file import read_whole
from rpf3d_core.terrain.cloud_surface import cloud_surface


def _read_str(path: Path) -> Cloud:
    strings = read_strings(path)
    return Cloud(strings.points[strings.number != 0])


TEXTS = (".xyz", ".csv", ".txt")
"""Extensions of clouds in a text or CSV file."""
CLOUD_READERS: dict[str, Callable[[Path], Cloud]] = {
    ".las": read_las,
    ".laz": read_las,
    ".e57": read_e57,
    **dict.fromkeys(TEXTS, read_xyz),
    ".str": _read_str,
}
"""The function that reads each format of clouds, by file name extension."""


def read_cloud(path: Path) -> Cloud:
    """Return the cloud of points in a file, after a check of its coordinates.

    Raises
    ------
    TerrainError
        The file is missing, empty, damaged, of unknown format or in degrees, a point is not finite or too far from the
        origin, or the library for the format is not installed.
    """
    reader = CLOUD_READERS.get(path.suffix.lower())
    if reader is None:
        raise TerrainError(f"{path}: is of no known format of clouds; known are {', '.join(CLOUD_READERS)}")
    cloud = read_whole(path, reader)
    if not len(cloud.points):
        raise TerrainError(f"{path}: holds no points")
    if not all(column.min() >= -FARTHEST and column.max() <= FARTHEST for column in cloud.points.T):
        raise TerrainError(f"{path}: has a point that is not finite, or {FARTHEST:,.0f} m or more from the origin")
    crs, remarks = system_in_metres(path, cloud.crs, cloud.points)
    return cloud._replace(crs=crs, remarks=(*cloud.remarks, *remarks))


def read_cloud_surface(path: Path) -> FileMesh:
    """Return the surface of the ground made from the cloud in a file, as `rpf3d import cloud` does without options.

    Raises
    ------
    TerrainError
        As `read_cloud`, or no surface can be made from the points.
    """
    cloud = read_cloud(path)
    try:
        surface = cloud_surface(cloud.points, cloud.classes)
    except TerrainError as fault:
        raise TerrainError(f"{path}: {fault}") from fault
    points = surface.points.astype(np.float32) if cloud.single else surface.points
    made = f"{path.name}: a surface was made from its points: {'; '.join(surface.describe())}"
    return FileMesh(points, surface.triangles, remarks=(*cloud.remarks, made), crs=cloud.crs)
