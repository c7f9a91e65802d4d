"""The mine around a live simulator: sends it terrain, sources and areas, and hears all that it says."""

import itertools
import os
import resource
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Point32, PointStamped, Polygon, PolygonStamped, Pose, PoseArray, Quaternion
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import OccupancyGrid
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import PointCloud2
from shape_msgs.msg import Mesh
from std_msgs.msg import Bool, Header
from std_srvs.srv import Trigger

from rpf3d_ros.cloud_messages import cloud_of_columns
from rpf3d_ros.qos import EVENTS, LATCHED

NODE = "rpf3d_simulator"
PATIENCE = 60.0
"""Seconds until something that should happen is given up; a cold compiler cache and two busy cores take 20."""

SECOND = 1_000_000_000
INPUTS = {
    "terrain/points": PointCloud2,
    "terrain/mesh": Mesh,
    "terrain/update": PointCloud2,
    "sources": PoseArray,
    "/clicked_point": PointStamped,
    "source_cloud": PointCloud2,
    "areas/polygon": PolygonStamped,
    "areas/equipment": PoseArray,
}
LATCHED_INPUTS = ("terrain/points", "terrain/mesh")
SIDE, SLOPE_ENDS, DROP = 60, 40, 40.0
TOE = ((42.0, 20.0), (52.0, 20.0), (52.0, 40.0), (42.0, 40.0))
"""Corners (m) of an area at the toe that nearly every rock from the slope comes to."""

ON_THE_SLOPE = (10.0, 30.3, DROP - 10.0 + 2.0)
"""Two metres above the slope."""

SPACING = 1.0


class Said(NamedTuple):
    """A part of a node's state, as it was told once."""

    part: str
    level: int
    message: str


def ramp(lowered=0.0):
    """Points (61, 61, 3) m: a slope of 45 degrees from x = 0 down to x = 40, and a level floor from there to x = 60."""
    y, x = np.mgrid[0 : SIDE + 1, 0 : SIDE + 1].astype(float) * SPACING
    return np.stack([x, y, np.maximum(DROP - x, 0.0) - lowered], axis=-1)


def cloud(points, stamp_ns, frame="map"):
    """A PointCloud2 of points (H, W, 3) or (N, 3) m, organised or not."""
    return cloud_of_columns(header(stamp_ns, frame), {name: points[..., i] for i, name in enumerate("xyz")})


def poses(places, stamp_ns, frame="map"):
    """A PoseArray of places, not turned."""
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0)) for x, y, z in places]
    return PoseArray(header=header(stamp_ns, frame), poses=each)


def polygon(corners, stamp_ns, frame="map"):
    """A PolygonStamped of corners (x, y) m."""
    points = [Point32(x=x, y=y, z=0.0) for x, y in corners]
    return PolygonStamped(header=header(stamp_ns, frame), polygon=Polygon(points=points))


def header(stamp_ns, frame="map"):
    """A header of a time (ns)."""
    return Header(stamp=Time(sec=stamp_ns // SECOND, nanosec=stamp_ns % SECOND), frame_id=frame)


def nanoseconds(stamp):
    """The time (ns) of a stamp."""
    return stamp.sec * SECOND + stamp.nanosec


def resident(pid):
    """Memory (MB) that a process holds."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


class LivePeer:
    """Publishes every input of a simulator; keeps its results, alerts and diagnostics."""

    def __init__(self, clock=False):
        """clock : whether to publish /clock."""
        self.said, self.health, self.results, self.alerts, self.alarms, self.grids = [], {}, [], [], [], []
        self.context = Context()
        self.context.init()
        self.node = Node("mine", context=self.context, parameter_overrides=[Parameter("use_sim_time", value=False)])
        self.publishers = {
            topic: self.node.create_publisher(kind, topic, LATCHED if topic in LATCHED_INPUTS else EVENTS)
            for topic, kind in INPUTS.items()
        }
        if clock:
            self.publishers["/clock"] = self.node.create_publisher(Clock, "/clock", EVENTS)
        for topic, kind, take, qos in (
            ("/diagnostics", DiagnosticArray, self._note, EVENTS),
            ("results", DiagnosticArray, self.results.append, LATCHED),
            ("alerts", DiagnosticArray, self.alerts.append, EVENTS),
            ("alarm", Bool, lambda message: self.alarms.append(message.data), LATCHED),
            ("hazard/grid", OccupancyGrid, self.grids.append, LATCHED),
        ):
            self.node.create_subscription(kind, topic, take, qos)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._stamps = itertools.count(time.time_ns(), SECOND // 1000)

    def _note(self, array):
        for status in array.status:
            self.said.append(Said(status.name, status.level[0], status.message))
            self.health[status.name] = status

    def now(self):
        """A time (ns) that no message before had: now, or a millisecond after the last one."""
        return max(next(self._stamps), time.time_ns())

    def spin(self, seconds=0.0):
        """Take what comes for so long."""
        until = time.monotonic() + seconds
        self.executor.spin_once(timeout_sec=0.0)
        while (left := until - time.monotonic()) > 0:
            self.executor.spin_once(timeout_sec=left)

    def wait(self, condition, what):
        """Spin until the condition holds, and return what it gave."""
        deadline = time.monotonic() + PATIENCE
        while not (answer := condition()):
            assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {what}; said: {self.said[-12:]}"
            self.executor.spin_once(timeout_sec=0.05)
        return answer

    def wait_for_simulator(self):
        """Spin until a simulator listens to every topic and has said something."""
        for topic, publisher in self.publishers.items():
            self.wait(lambda p=publisher: p.get_subscription_count() >= 1, f"a subscriber of {topic}")
        self.wait(lambda: any(said.part.startswith(NODE) for said in self.said), "a word of the simulator")

    def send(self, topic, message):
        """Publish a message, or bytes that claim to be one."""
        self.publishers[topic].publish(message)

    def tick(self, at_ns):
        """Publish the time on /clock."""
        self.send("/clock", Clock(clock=Time(sec=at_ns // SECOND, nanosec=at_ns % SECOND)))

    def wait_for_sentence(self, sentence, after=0):
        """Spin until the simulator says a sentence that holds this one, after so many others; what it said."""
        def found():
            return next((s for s in self.said[after:] if s.part.startswith(NODE) and sentence in s.message), None)

        return self.wait(found, f"the simulator to say {sentence!r}")

    def refused(self, topic, message, sentence):
        """Send what has to be refused, and wait for the refusal."""
        before = len(self.said)
        self.send(topic, message)
        return self.wait_for_sentence(sentence, before)

    def stand_on_ramp(self, lowered=0.0, stamp_ns=None):
        """Send the ramp and wait until it is the ground; its stamp (ns)."""
        stamp_ns = stamp_ns or self.now()
        self.send("terrain/points", cloud(ramp(lowered), stamp_ns))
        return stamp_ns

    def answered(self, places=(ON_THE_SLOPE,), stamp_ns=None):
        """Send sources and wait for an answer to them: its status."""
        stamp_ns = stamp_ns or self.now()
        self.send("sources", poses(places, stamp_ns))
        return self.wait_for_answer(stamp_ns)

    def wait_for_answer(self, stamp_ns):
        """Wait for an answer to the sources of a stamp (ns): the values of its status."""
        def found():
            return next((r for r in self.results if nanoseconds(r.header.stamp) == stamp_ns), None)

        status = self.wait(found, f"an answer to the sources stamped {stamp_ns}").status[0]
        return {pair.key: pair.value for pair in status.values}

    def wait_for_alert(self, level, after=0):
        """Wait for an alert of a level (a word), after so many others: its status."""
        def found():
            told = (status for array in self.alerts[after:] for status in array.status)
            return next((status for status in told if level in status.message), None)

        return self.wait(found, f"an alert of level {level}, not {[a.status[0].message for a in self.alerts[-3:]]}")

    def state(self):
        """The simulator's lifecycle state, a word."""
        return self.call(GetState, f"{NODE}/get_state", GetState.Request()).current_state.label

    def change(self, transition):
        """Ask the simulator for a transition (lifecycle_msgs/Transition); whether it succeeded."""
        request = ChangeState.Request()
        request.transition.id = transition
        return self.call(ChangeState, f"{NODE}/change_state", request).success

    def acknowledge(self):
        """Call ~/acknowledge: its response."""
        return self.call(Trigger, f"{NODE}/acknowledge", Trigger.Request())

    def call(self, kind, name, request):
        """Call a service and wait for its response."""
        client = self.node.create_client(kind, name)
        self.wait(client.service_is_ready, f"the service {name}")
        future = client.call_async(request)
        self.wait(future.done, f"a response of {name}")
        return future.result()

    def close(self):
        """Leave the domain."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


def full_disk(pid, limit):
    """From now on no file of a process grows beyond a limit (bytes), as on a full disk; None lifts that again."""
    hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)[1]
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (hard if limit is None else limit, hard))


def logged(folder):
    """The lines of every file that a process has written to a folder."""
    return [line for path in sorted(Path(folder).iterdir()) for line in path.read_text().splitlines()]


os.environ.setdefault("ROS_PYTHON_CHECK_FIELDS", "1")
