"""Make a small valid message of each kind that the nodes convert, with the function that converts the message."""

from collections.abc import Callable
from typing import Any

import numpy as np
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Point32, PointStamped, Polygon, PolygonStamped, PoseArray
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh, MeshTriangle
from std_msgs.msg import Header
from visualization_msgs.msg import MarkerArray

from rpf3d_core.live.survey import GridSurvey
from rpf3d_core.live.zones import ShownZone
from rpf3d_ros.messages.area_messages import rings_of_equipment, rings_of_polygon
from rpf3d_ros.messages.cloud_messages import cloud_of_columns, cloud_of_grid
from rpf3d_ros.messages.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_messages import trajectory_markers, zone_markers
from rpf3d_ros.messages.marker_reading import facets_of_markers, strips_of_markers
from rpf3d_ros.messages.result_messages import ResultFacts, facts_of, results_message
from rpf3d_ros.messages.source_messages import poses_of_sources, sources_of_cloud, sources_of_point, sources_of_poses
from rpf3d_ros.messages.terrain_messages import check_cloud, check_mesh, mesh_of_cdr, survey_of_cloud

MAP, HEADER = MapFrame(), Header(frame_id="map")
MOST = 1000
"""Largest number of points of a terrain in these tests."""
POINTS = np.arange(60.0).reshape(20, 3)

Case = tuple[Any, type, Callable[[Any], object]]
"""A valid message, the type that its conversion receives (a message class, or bytes), and the conversion."""


def _grid() -> Case:
    points = np.stack([*np.mgrid[0:4, 0:5].astype(float), np.ones((4, 5))], axis=-1)
    return cloud_of_grid(HEADER, GridSurvey(points)), PointCloud2, _survey


def _survey(cloud: PointCloud2) -> object:
    """Convert a cloud to a survey as the node does: first the quick check, then the points."""
    check_cloud(cloud, MAP, MOST)
    return survey_of_cloud(cloud, MAP, MOST)


def _scattered() -> Case:
    x, y, z = POINTS.T
    return cloud_of_columns(HEADER, {"x": x, "y": y, "z": z}), PointCloud2, _survey


def _mesh() -> Case:
    triangles = [MeshTriangle(vertex_indices=np.array([i, i + 1, i + 2], dtype=np.uint32)) for i in range(18)]
    vertices = [Point(x=x, y=y, z=z) for x, y, z in POINTS.tolist()]
    return Mesh(triangles=triangles, vertices=vertices), bytes, _mesh_survey


def _mesh_survey(data: bytes) -> object:
    check_mesh(data, MOST)
    return mesh_of_cdr(data, MAP, "map", MOST)


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


def _clicked_point() -> Case:
    point = PointStamped(header=HEADER, point=Point(x=1.0, y=2.0, z=3.0))
    return point, PointStamped, lambda message: sources_of_point(message, MAP)


def _source_cloud() -> Case:
    x, y, z = POINTS.T
    names = ("x", "y", "z", "diameter", "vx", "vy", "vz")
    columns = dict(zip(names, (x, y, z, 1.0 + x, y, z, x), strict=True))
    return cloud_of_columns(HEADER, columns), PointCloud2, lambda cloud: sources_of_cloud(cloud, MAP)


def _polygon() -> Case:
    corners = [Point32(x=x, y=y) for x, y in ((0.0, 0.0), (9.0, 0.0), (9.0, 5.0), (4.0, 7.0), (0.0, 5.0))]
    message = PolygonStamped(header=HEADER, polygon=Polygon(points=corners))
    return message, PolygonStamped, lambda polygon: rings_of_polygon(polygon, MAP)


def _equipment() -> Case:
    poses = poses_of_sources(HEADER, POINTS, POINTS[::-1])
    return poses, PoseArray, lambda message: rings_of_equipment(message, MAP, 15.0)


def _results() -> Case:
    facts = ResultFacts(7, 1, False, 400, 20, 1, 0.25, "0" * 64, "1" * 64, {"stopped": 390, "left_terrain": 10})
    return results_message(HEADER, facts), DiagnosticArray, facts_of


def _markers() -> Case:
    x, y, z = POINTS.T
    columns = {"rock": np.repeat([0, 1], 10), "x": x, "y": y, "z": z, "speed": x}
    zone = ShownZone("0.1", POINTS[:18].reshape(-1, 3, 3), POINTS[:8].reshape(-1, 2, 3))
    lines = deserialize_message(trajectory_markers(HEADER, columns, 2, 10), MarkerArray).markers
    facets = deserialize_message(zone_markers(HEADER, [zone]), MarkerArray).markers

    def convert(array: MarkerArray) -> object:
        return strips_of_markers(array, MAP), facets_of_markers(array, MAP)

    return MarkerArray(markers=[*lines, *facets]), MarkerArray, convert


CONVERSIONS: dict[str, Callable[[], Case]] = {
    "terrain grid": _grid, "terrain cloud": _scattered, "terrain mesh": _mesh, "positions": _positions,
    "columns": _columns, "sources": _sources, "clicked point": _clicked_point, "source cloud": _source_cloud,
    "polygon": _polygon, "equipment": _equipment, "results": _results, "markers": _markers,
}  # fmt: skip
