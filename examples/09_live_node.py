"""The live node in a script.

The script starts the simulator node, publishes a terrain and a source in place of survey and radar, and prints the
alert level and the largest reach probability of a cell. It needs the extra `ros`. Its messages stay on this machine.
"""

import os
import signal
import subprocess
import sys
from pathlib import Path

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, PoseArray
from nav_msgs.msg import OccupancyGrid
from rclpy.qos import DurabilityPolicy, QoSProfile
from shape_msgs.msg import Mesh, MeshTriangle

import rpf3d_core as rpf3d

SCENES, OUT = Path(__file__).parent / "scenes", Path("out/live_node")
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)

os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
given = {"scene": SCENES / "road.yaml", "site_file": SCENES / "road_site.yaml", "decision_log": OUT / "decisions"}
given |= {"terrain_durability": "transient_local", "release_speed": 5.0, "above_ground": 0.5}
command = [sys.executable, "-m", "rpf3d_ros.nodes.simulator_node", "--ros-args"]  # the command `rpf3d_simulator`
command += [word for name, value in given.items() for word in ("-p", f"{name}:={value}")]

rclpy.init()
node = rclpy.create_node("mine")
survey = node.create_publisher(Mesh, "terrain/mesh", LATCHED)
radar = node.create_publisher(PoseArray, "sources", 10)
sites, grids = [{"level": "fault"}], []  # fault: the danger is unknown
node.create_subscription(
    DiagnosticArray, "alerts", lambda m: sites.append({v.key: v.value for v in m.status[0].values}), LATCHED
)
node.create_subscription(OccupancyGrid, "hazard/grid", grids.append, LATCHED)
simulator = subprocess.Popen(command, stdout=sys.stderr)  # its log is printed as it comes
try:
    pit, _ = rpf3d.read_terrain(rpf3d.read_scene(SCENES / "road.yaml"))
    corners = [Point(x=x, y=y, z=z) for x, y, z in pit.frame.points_to_input(pit.vertices).tolist()]
    survey.publish(Mesh(vertices=corners, triangles=[MeshTriangle(vertex_indices=t) for t in pit.triangles.tolist()]))
    seen = PoseArray(poses=[Pose(position=Point(x=-178.0, y=0.0, z=60.0))])  # thrown along its x axis, to the east
    seen.header.frame_id = "map"
    for _ in range(6000):  # at most ten minutes: the first start on a machine compiles for a minute or more
        if (sites[-1]["level"] != "fault" and grids) or simulator.poll() is not None:
            break
        rclpy.spin_once(node, timeout_sec=0.1)
        if radar.get_subscription_count() and not seen.header.stamp.sec:
            seen.header.stamp = node.get_clock().now().to_msg()
            radar.publish(seen)
    if sites[-1]["level"] == "fault" or not grids:
        sys.exit("the simulator has not answered")
    print(f"level of the site: {sites[-1]['level']}; {sites[-1]['reason.0']}")
    print(f"hazard map: up to {max(grids[-1].data)} % of the rocks reach a cell of {grids[-1].info.resolution:g} m")
finally:
    simulator.send_signal(signal.SIGINT)
    print(f"the simulator has ended with exit code {simulator.wait(30)}")
