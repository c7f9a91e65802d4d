"""The survey and the radar of the example pit, for docs/tutorial/first-site.md: publishes a mesh once, then sources.

python examples/site/feed.py [--danger] [--ros-args -r __ns:=/pit_a]

Replace `surveyed` by your survey, and `seen_by_radar` by your radar. All coordinates are UTM coordinates (E, N, H).
"""

import contextlib
import sys
from pathlib import Path

import numpy as np
import rclpy
from geometry_msgs.msg import Point, Pose, PoseArray
from rclpy.executors import ExternalShutdownException
from rclpy.qos import DurabilityPolicy, QoSProfile
from shape_msgs.msg import Mesh, MeshTriangle

import rpf3d_core as rpf3d

UTM_OF_MAP = np.array([482000.0, 7401000.0, 400.0])  # map_origin of nodes.yaml
EVERY = 2.0  # s between two messages of the radar; shorter than sources_max_age_s of site.yaml
HARMLESS, DANGEROUS = (-20.0, 0.0, 0.0), (-178.0, 0.0, 60.0)  # on the floor; on the crest above the road
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def surveyed() -> Mesh:
    """Return the survey: a synthetic pit; the corners of each triangle turn counter-clockwise as seen from above.

    For a file with UTM coordinates, read a scene with `terrain: {files: [{path: pit.obj}]}`, and add nothing.
    """
    scene = rpf3d.read_scene(Path(__file__).parents[1] / "scenes" / "road.yaml")
    pit, _ = rpf3d.read_terrain(scene)
    corners = pit.frame.points_to_input(pit.vertices) + UTM_OF_MAP
    return Mesh(
        vertices=[Point(x=x, y=y, z=z) for x, y, z in corners.tolist()],
        triangles=[MeshTriangle(vertex_indices=three) for three in pit.triangles.tolist()],
    )


def seen_by_radar(is_dangerous: bool) -> PoseArray:
    """Return all sources that the radar sees now; a message without poses would mean that it sees none."""
    seen = PoseArray()
    seen.header.frame_id = "utm"
    x, y, z = ((DANGEROUS if is_dangerous else HARMLESS) + UTM_OF_MAP).tolist()
    towards_east = Pose(position=Point(x=x, y=y, z=z))  # thrown along its x axis; four zeros would mean: from rest
    towards_east.orientation.w = 1.0
    seen.poses.append(towards_east)
    return seen


def main() -> None:
    """Publish the survey, then the sources every two seconds until Ctrl-C."""
    rclpy.init()
    node = rclpy.create_node("feed")
    survey = node.create_publisher(Mesh, "terrain/mesh", LATCHED)
    radar = node.create_publisher(PoseArray, "radar_north/sources", 10)
    survey.publish(surveyed())
    is_dangerous = "--danger" in sys.argv

    def publish() -> None:
        seen = seen_by_radar(is_dangerous)
        seen.header.stamp = node.get_clock().now().to_msg()  # when the radar measured, not when the message is sent
        radar.publish(seen)

    node.create_timer(EVERY, publish)
    rclpy.spin(node)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):  # Ctrl-C
        main()
