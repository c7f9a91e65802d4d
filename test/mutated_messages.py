"""Small sound messages of every kind that is converted, and their conversions."""

from collections.abc import Callable
from typing import Any

import numpy as np
from geometry_msgs.msg import Point, PoseArray
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh, MeshTriangle
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from rpf3d_ros.cloud_messages import cloud_of_columns, cloud_of_grid
from rpf3d_ros.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.map_frame import MapFrame
from rpf3d_ros.marker_messages import hazard_markers, trajectory_markers
from rpf3d_ros.marker_reading import facets_of_markers, strips_of_markers
from rpf3d_ros.source_messages import poses_of_sources, sources_of_poses
from rpf3d_ros.terrain_messages import GridSurvey, grid_of_cloud, mesh_of_cdr

MAP, HEADER = MapFrame(), Header(frame_id="map")
POINTS = np.arange(60.0).reshape(20, 3)

Case = tuple[Any, type, Callable[[Any], object]]
"""A sound message, what the conversion takes (a message class, or bytes), and the conversion."""


def _grid() -> Case:
    points = np.stack([*np.mgrid[0:4, 0:5].astype(float), np.ones((4, 5))], axis=-1)
    return cloud_of_grid(HEADER, GridSurvey(points)), PointCloud2, lambda cloud: grid_of_cloud(cloud, MAP)


def _mesh() -> Case:
    triangles = [MeshTriangle(vertex_indices=np.array([i, i + 1, i + 2], dtype=np.uint32)) for i in range(18)]
    vertices = [Point(x=x, y=y, z=z) for x, y, z in POINTS.tolist()]
    return Mesh(triangles=triangles, vertices=vertices), bytes, lambda data: mesh_of_cdr(data, MAP, "map")


def _positions() -> Case:
    return _cloud(), PointCloud2, positions_of_cloud


def _columns() -> Case:
    return _cloud(), PointCloud2, lambda cloud: columns_of_cloud(cloud, ("rock", "x", "speed"))


def _cloud() -> PointCloud2:
    x, y, z = POINTS.T
    return cloud_of_columns(HEADER, {"x": x, "y": y, "z": z, "rock": np.arange(20, dtype=np.int32), "speed": x})


def _sources() -> Case:
    poses = poses_of_sources(HEADER, POINTS, POINTS[::-1])
    return poses, PoseArray, lambda message: sources_of_poses(message, MAP)


def _markers() -> Case:
    x, y, z = POINTS.T
    columns = {"rock": np.repeat([0, 1], 10), "x": x, "y": y, "z": z, "speed": x}
    lines = trajectory_markers(HEADER, columns, 2, 10).markers
    facets = hazard_markers(HEADER, {"passed": POINTS[:18].reshape(-1, 3, 3)}).markers

    def convert(array: MarkerArray) -> object:
        return strips_of_markers(array, MAP), facets_of_markers(array, MAP)

    return MarkerArray(markers=[*lines, *facets]), MarkerArray, convert


CONVERSIONS: dict[str, Callable[[], Case]] = {
    "terrain grid": _grid, "terrain mesh": _mesh, "positions": _positions, "columns": _columns, "sources": _sources,
    "markers": _markers,
}  # fmt: skip
