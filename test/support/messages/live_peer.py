"""A peer of the simulator in tests with real processes: it publishes inputs and receives results and alerts."""

import resource
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Point32, Polygon, PolygonStamped, Pose, PoseArray, Quaternion
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from nav_msgs.msg import OccupancyGrid
from rcl_interfaces.srv import SetParameters
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Bool, Header
from std_srvs.srv import Trigger

from rpf3d_ros.interface.publishing import publishers_of
from rpf3d_ros.interface.qos import EVENTS, LATCHED, RESULTS
from rpf3d_ros.interface.recorded_topics import TOPICS
from rpf3d_ros.messages.alert_reading import ALERT
from rpf3d_ros.messages.cloud_messages import cloud_of_columns

NODE = "rpf3d_simulator"
CONFIGURE, SHUT_DOWN = Transition.TRANSITION_CONFIGURE, Transition.TRANSITION_UNCONFIGURED_SHUTDOWN
FOLLOWED = "may have reported other sources"
"""Words in the fault of a refused message if a later message of the same topic was understood."""

PATIENCE = 600.0
"""Longest wait for an expected event (s). Nodes compile before they subscribe: with an empty cache this takes 40 s of
CPU time, and 210 s of wall time if five other programs share the core."""

TURN = 0.02
"""Longest time (s) that a peer waits for a message before it checks its condition again."""

SECOND = 1_000_000_000
INPUTS = [name for name, topic in TOPICS.items() if topic.given]
SIDE, SLOPE_ENDS, DROP = 60, 40, 40.0
TOE = ((42.0, 20.0), (52.0, 20.0), (52.0, 40.0), (42.0, 40.0))
"""Corners (m) of an area at the toe that nearly every rock from the slope reaches."""

ON_THE_SLOPE = (10.0, 30.3, DROP - 10.0 + 2.0)
"""Place (x, y, z) m of a source two metres above the slope."""

SPACING = 1.0


class Said(NamedTuple):
    """The state of one part of a node, as received on /diagnostics.

    part : "node: part"; level : 0 OK, 1 WARN, 2 ERROR, 3 STALE; message : a sentence
    """

    part: str
    level: int
    message: str


def ramp(lowered=0.0):
    """Return points (61, 61, 3) m: a slope of 45 degrees from x = 0 to x = 40, and a level floor up to x = 60.

    lowered : length (m) that is subtracted from all heights
    """
    y, x = np.mgrid[0 : SIDE + 1, 0 : SIDE + 1].astype(float) * SPACING
    return np.stack([x, y, np.maximum(DROP - x, 0.0) - lowered], axis=-1)


def long_ramp():
    """Return points (61, 241, 3) m of the ramp with a floor so long that no rock leaves the survey."""
    y, x = np.mgrid[0 : SIDE + 1, 0 : 4 * SIDE + 1].astype(float) * SPACING
    return np.stack([x, y, np.maximum(DROP - x, 0.0)], axis=-1)


def ramp_of(side):
    """Return points (side, side, 3) m of the slope and floor of `ramp` at another resolution."""
    y, x = np.mgrid[0:side, 0:side] * (SIDE / (side - 1))
    return np.stack([x, y, np.maximum(DROP - x, 0.0)], axis=-1)


def cloud(points, stamp_ns, frame="map"):
    """Return an organised PointCloud2 of points (H, W, 3) m, or an unorganised PointCloud2 of points (N, 3) m."""
    return cloud_of_columns(header(stamp_ns, frame), {name: points[..., i] for i, name in enumerate("xyz")})


def poses(places, stamp_ns, frame="map"):
    """Return a PoseArray of positions (x, y, z) m, without rotation."""
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0)) for x, y, z in places]
    return PoseArray(header=header(stamp_ns, frame), poses=each)


def polygon(corners, stamp_ns, frame="map"):
    """Return a PolygonStamped of corners (x, y) m."""
    points = [Point32(x=x, y=y, z=0.0) for x, y in corners]
    return PolygonStamped(header=header(stamp_ns, frame), polygon=Polygon(points=points))


def header(stamp_ns, frame="map"):
    """Return a header with a stamp (ns) and a frame."""
    return Header(stamp=Time(sec=stamp_ns // SECOND, nanosec=stamp_ns % SECOND), frame_id=frame)


def nanoseconds(stamp):
    """Return the time (ns) of a stamp."""
    return stamp.sec * SECOND + stamp.nanosec


def resident(pid):
    """Return the resident memory (MB) of a process."""
    return int(Path(f"/proc/{pid}/statm").read_text().split()[1]) * resource.getpagesize() / 1e6


class LivePeer:
    """Publishes every input of a simulator, and keeps its results, alerts and diagnostics.

    said : received states (`Said`), in order; health : the last status of each part, by name of the part
    results, alerts, alarms, grids : received messages of `results`, `alerts`, `alarm` (as bool) and `hazard/grid`
    """

    def __init__(self, clock=False):
        """Create the node and join the ROS domain; clock : True to create a publisher of /clock."""
        self.said, self.health, self.results, self.alerts, self.alarms, self.grids = [], {}, [], [], [], []
        self.context = Context()
        self.context.init()
        self.node = Node("mine", context=self.context, parameter_overrides=[Parameter("use_sim_time", value=False)])
        self.publishers = publishers_of(self.node, INPUTS)
        if clock:
            self.publishers["/clock"] = self.node.create_publisher(Clock, "/clock", EVENTS)
        for topic, kind, take, qos in (
            ("/diagnostics", DiagnosticArray, self._note, EVENTS),
            ("results", DiagnosticArray, self.results.append, RESULTS),
            ("alerts", DiagnosticArray, self.alerts.append, RESULTS),
            ("alarm", Bool, lambda message: self.alarms.append(message.data), LATCHED),
            ("hazard/grid", OccupancyGrid, self.grids.append, LATCHED),
        ):
            self.node.create_subscription(kind, topic, take, qos)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)
        self._last_stamp, self._clock = 0, None

    def _note(self, array):
        for status in array.status:
            self.said.append(Said(status.name, status.level[0], status.message))
            self.health[status.name] = status

    def now(self):
        """Return the time (ns) of this peer's clock; each call returns a later time."""
        now = time.time_ns() if self._clock is None else self._clock()
        self._last_stamp = max(now, self._last_stamp + 1)
        return self._last_stamp

    def run_clock(self, from_ns):
        """Start /clock at a time (ns), at the rate of the wall clock; it is published while this peer receives."""
        began = time.monotonic_ns()
        self._clock, self._last_stamp = lambda: from_ns + time.monotonic_ns() - began, 0

    def spin(self, seconds=0.0, until_something_is_said=False):
        """Receive messages for some seconds; until_something_is_said : True to end as soon as a state is received."""
        until, said = time.monotonic() + seconds, len(self.said)
        self._turn(0.0)
        while (left := until - time.monotonic()) > 0 and not (until_something_is_said and len(self.said) > said):
            self._turn(left)

    def _turn(self, longest):
        if self._clock is not None:
            self.send("/clock", Clock(clock=header(self._clock()).stamp))
        self.executor.spin_once(timeout_sec=min(longest, TURN))

    def wait(self, condition, what):
        """Receive messages until a condition is true, and return its value; after PATIENCE seconds the test fails.

        what : description of the condition, for the error message
        """
        deadline = time.monotonic() + PATIENCE
        while not (answer := condition()):
            assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {what}; said: {self.said[-12:]}"
            self._turn(TURN)
        return answer

    def wait_for_simulator(self):
        """Receive messages until every topic of this peer has a subscriber and the simulator has published a state."""
        for topic, publisher in self.publishers.items():
            self.wait(lambda p=publisher: p.get_subscription_count() >= 1, f"a subscriber of {topic}")
        self.wait(lambda: any(said.part.startswith(NODE) for said in self.said), "a word of the simulator")

    def send(self, topic, message):
        """Publish a message on a topic; message : a ROS message, or its CDR bytes."""
        self.publishers[topic].publish(message)

    def wait_for_sentence(self, sentence, after=0, node=NODE):
        """Receive messages until a node publishes a state whose message contains a sentence, and return this state.

        after : number of earlier states that are skipped
        """

        def found():
            return next((s for s in self.said[after:] if s.part.startswith(node) and sentence in s.message), None)

        return self.wait(found, f"{node} to say {sentence!r}")

    def refused(self, topic, message, sentence):
        """Publish a message, wait for a state of the simulator that contains a sentence, and return the state."""
        before = len(self.said)
        self.send(topic, message)
        return self.wait_for_sentence(sentence, before)

    def stand_on_ramp(self, lowered=0.0, stamp_ns=None):
        """Publish the ramp as terrain, and return its stamp (ns); lowered : as in `ramp`."""
        stamp_ns = stamp_ns or self.now()
        self.send("terrain/points", cloud(ramp(lowered), stamp_ns))
        return stamp_ns

    def watch_toe(self):
        """Publish the area TOE as the live area."""
        self.send("areas/polygon", polygon(TOE, self.now()))

    def see_rocks_reach_the_toe(self):
        """Publish ramp, area and sources, and wait for the level `evacuate`; return the values in `results`."""
        self.stand_on_ramp()
        self.watch_toe()
        values = self.answered()
        self.wait_for_alert("evacuate")
        return values

    def answered(self, places=(ON_THE_SLOPE,), stamp_ns=None):
        """Publish sources and wait for their answer; return the values of its message of `results`."""
        stamp_ns = stamp_ns or self.now()
        self.send("sources", poses(places, stamp_ns))
        return self.wait_for_answer(stamp_ns)

    def answered_again(self, places=(ON_THE_SLOPE,)):
        """Publish sources every second until a message is answered; return the values of the answer's `results`.

        One message may not be enough: a node that has just started may not have discovered this peer yet, and a topic
        with a damaged message may receive nothing for a moment.
        """
        sent = []

        def found():
            if not sent or time.monotonic() - sent[-1][0] > 1.0:
                sent.append((time.monotonic(), self.now()))
                self.send("sources", poses(places, sent[-1][1]))
            stamps = {stamp_ns for _, stamp_ns in sent}
            return next((r for r in self.results if nanoseconds(r.header.stamp) in stamps), None)

        status = self.wait(found, "an answer to sources that are published every second").status[0]
        return {pair.key: pair.value for pair in status.values}

    def wait_for_answer(self, stamp_ns):
        """Wait for the answer to the sources with a stamp (ns); return the values of its message of `results`."""

        def found():
            return next((r for r in self.results if nanoseconds(r.header.stamp) == stamp_ns), None)

        status = self.wait(found, f"an answer to the sources stamped {stamp_ns}").status[0]
        return {pair.key: pair.value for pair in status.values}

    def answer_values(self):
        """Return the values of the last received message of `results`."""
        return {pair.key: pair.value for pair in self.results[-1].status[0].values}

    def wait_for_alert(self, level, after=0, reason=""):
        """Wait for an alert of the site with a level (a word), and return its status.

        after : number of earlier alerts to skip; reason : text that its sentence must contain
        """

        def found():
            told = (status for array in self.alerts[after:] for status in array.status if status.name == ALERT)
            return next((s for s in told if s.message.startswith(f"{level}: ") and reason in s.message), None)

        what = f"an alert of level {level} {reason}".rstrip()
        return self.wait(found, f"{what}, not {[a.status[0].message for a in self.alerts[-3:]]}")

    def acknowledge_refusals(self, after=0):
        """Wait for an alert that is `normal` or contains FOLLOWED; in the second case, acknowledge the alert.

        after : number of earlier alerts to skip
        """

        def found():
            told = [status.message for array in self.alerts[after:] for status in array.status if status.name == ALERT]
            return next((each for each in told if each.startswith("normal: ") or FOLLOWED in each), None)

        if FOLLOWED in self.wait(found, "normal, or a refused message to acknowledge"):
            acknowledge_as(self, "A. Shift: looked at the slope")

    def state(self):
        """Return the name of the simulator's lifecycle state."""
        return self.call(GetState, f"{NODE}/get_state", GetState.Request()).current_state.label

    def change(self, transition):
        """Request a transition of the simulator (lifecycle_msgs/Transition); True if it succeeded."""
        request = ChangeState.Request()
        request.transition.id = transition
        return self.call(ChangeState, f"{NODE}/change_state", request).success

    def acknowledge(self):
        """Call the simulator's service ~/acknowledge, and return the response."""
        return self.call(Trigger, f"{NODE}/acknowledge", Trigger.Request())

    def call(self, kind, name, request):
        """Call a service and return its response; kind : type of the service; name : its name."""
        client = self.node.create_client(kind, name)
        self.wait(client.service_is_ready, f"the service {name}")
        future = client.call_async(request)
        self.wait(future.done, f"a response of {name}")
        return future.result()

    def close(self):
        """Destroy the node and leave the ROS domain."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


def acknowledge_as(peer, words):
    """Acknowledge an alert by the services of the simulator, and return the response of ~/acknowledge.

    peer : object with the method `call`, such as a `LivePeer`; words : "NAME: REASON"
    """
    parameter = Parameter("acknowledged_by", value=words).to_parameter_msg()
    peer.call(SetParameters, f"{NODE}/set_parameters", SetParameters.Request(parameters=[parameter]))
    return peer.call(Trigger, f"{NODE}/acknowledge", Trigger.Request())


SITE = """site: test pit
valid_s: 1
alarm_from: restrict
evidence:
  {{sources_max_age_s: {oldest}, terrain_max_age_s: 3600, clock_tolerance_s: 1, fewest_rocks: 100, most_unfinished: 1}}
areas:
  live_area*: {{restrict: {{reach_probability: 0.1}}, evacuate: {{reach_probability: 0.5}}}}
"""
FEW_ROCKS = {"ground": "sliding", "first_rocks": 200, "target.most_rocks": 400}
"""Parameters for answers that take milliseconds."""


def with_alerts(folder, oldest=3600):
    """Write a site file; return the parameters of a simulator that keeps its terrain and decisions in the same folder.

    oldest : age (s) above which sources are a fault
    """
    site = Path(folder) / "site.yaml"
    site.write_text(SITE.format(oldest=oldest))
    kept = {"site_file": site, "store": Path(folder) / "store", "decision_log": Path(folder) / "decisions"}
    return FEW_ROCKS | kept


def full_disk(pid, limit):
    """Limit the size of each file that a process writes, as on a full disk; limit : bytes, None for no limit."""
    hard = resource.prlimit(pid, resource.RLIMIT_FSIZE)[1]
    resource.prlimit(pid, resource.RLIMIT_FSIZE, (hard if limit is None else limit, hard))
