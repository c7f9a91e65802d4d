"""Fixtures of the ROS tests: discovery on loopback only, one domain per test, a log folder, checked message fields."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from diagnostic_msgs.msg import DiagnosticArray
from messages.live_peer import PATIENCE, LivePeer
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from rpf3d_ros.demo.domains import free_domain
from rpf3d_ros.demo.processes import node_process
from rpf3d_ros.interface.qos import EVENTS, LATCHED
from rpf3d_ros.interface.recorded_topics import EVENT, TOPICS
from rpf3d_ros.messages.health import healths_of

ENDS_WITHIN = 120.0
"""Time (s) after which an interrupted node that still runs is killed; on an idle machine it ends within 2 s."""

KINDS = {name: topic.message_class for name, topic in TOPICS.items()} | {"/clock": Clock}
PASSING = {name for name, topic in TOPICS.items() if topic.offered == EVENT} | {"/clock"}
"""Names of the topics that are not latched."""


@pytest.fixture(scope="session", autouse=True)
def ros_environment(tmp_path_factory):
    """Set the ROS environment variables before any context is initialised; child processes inherit them."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
    os.environ["ROS_LOG_DIR"] = str(tmp_path_factory.mktemp("ros_log"))


class Peer:
    """A ROS node that publishes on the topics `publishes` and keeps every message of the topics `subscribes`."""

    def __init__(self, publishes=(), subscribes=()):
        self.received = {topic: [] for topic in subscribes}
        self.health = {}
        self.context = Context()
        self.context.init()
        self.node = Node("rpf3d_peer", context=self.context)
        self.publishers = {
            topic: self.node.create_publisher(KINDS[topic], topic, EVENTS if topic in PASSING else LATCHED)
            for topic in publishes
        }
        for topic in subscribes:
            qos = EVENTS if topic in PASSING else LATCHED
            self.node.create_subscription(KINDS[topic], topic, self.received[topic].append, qos)
        self.node.create_subscription(DiagnosticArray, "/diagnostics", self._note_health, EVENTS)
        self.executor = SingleThreadedExecutor(context=self.context)
        self.executor.add_node(self.node)

    def _note_health(self, array):
        self.health.update({health.name: health for health in healths_of(array)})

    def wait(self, condition, what):
        """Spin until `condition()` is true, return its value; fail after PATIENCE seconds, naming `what`."""
        deadline = time.monotonic() + PATIENCE
        while not (answer := condition()):
            assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {what}; health: {self.health}"
            self.executor.spin_once(timeout_sec=0.05)
        return answer

    def wait_for_subscribers(self, count=1):
        """Spin until each topic that this peer publishes has at least `count` subscribers."""
        for topic, publisher in self.publishers.items():
            self.wait(lambda p=publisher: p.get_subscription_count() >= count, f"{count} subscribers of {topic}")

    def wait_for_health(self, name, sentence):
        """Spin until the message of the status `name` contains `sentence`; return this status."""
        return self.wait(
            lambda: name in self.health and sentence in self.health[name].message and self.health[name],
            f"{name} to say {sentence!r}",
        )

    def send(self, topic, message):
        """Publish a message, or bytes in its place, on a topic."""
        self.publishers[topic].publish(message)

    def call(self, kind, service, request):
        """Call a service of type `kind`; return its response."""
        client = self.node.create_client(kind, service)
        self.wait(client.service_is_ready, f"the service {service}")
        future = client.call_async(request)
        self.wait(future.done, f"the answer of {service}")
        self.node.destroy_client(client)
        return future.result()

    def close(self):
        """Destroy the node of this peer and shut down its context."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


class Stage:
    """A ROS domain that no other test uses, with the processes and peers of a test."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.processes, self.peers = [], []
        domain, self.lock = free_domain()
        os.environ["ROS_DOMAIN_ID"] = str(domain)

    def node(self, module, **parameters):
        """Start the node program `module` with parameters; return its process. Its output is in the file MODULE.out."""
        given = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
        self.processes.append(node_process(module, given, self.folder))
        return self.processes[-1]

    def named_node(self, name, module, **parameters):
        """Start one of several processes of `module`; `output("name/module")` returns what the process printed."""
        whole, self.folder = self.folder, self.folder / name
        self.folder.mkdir()
        try:
            return self.node(module, **parameters)
        finally:
            self.folder = whole

    def peer(self, publishes=(), subscribes=()):
        """Return a new `Peer` in this domain."""
        self.peers.append(Peer(publishes, subscribes))
        return self.peers[-1]

    def live_peer(self, clock=False):
        """Return a new `LivePeer` in this domain: it plays the mine around a live simulator."""
        self.peers.append(LivePeer(clock))
        return self.peers[-1]

    def output(self, module):
        """Return what a node has printed so far."""
        return (self.folder / f"{module}.out").read_text()

    def clear(self):
        """Close all peers and end all processes; return the exit codes of the processes, the first started first."""
        for peer in self.peers:
            peer.close()
        codes = [_ended(process) for process in self.processes]
        self.lock.close()
        return codes


def _ended(process):
    """Send SIGINT to a node and return its exit code; kill the node if it still runs after ENDS_WITHIN seconds."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


@pytest.fixture
def stage(tmp_path):
    """Yield a `Stage` for one test."""
    made = Stage(tmp_path)
    yield made
    made.clear()


@pytest.fixture
def node(stage):
    """Yield a plain rclpy node in the domain of the test, with a separate context."""
    context = Context()
    context.init()
    made = Node("plain", context=context)
    yield made
    made.destroy_node()
    context.try_shutdown()


@pytest.fixture(scope="module")
def shared_stage(tmp_path_factory):
    """Yield a `Stage` that all tests of a module share."""
    made = Stage(tmp_path_factory.mktemp("stage"))
    yield made
    made.clear()
