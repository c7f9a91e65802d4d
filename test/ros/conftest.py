"""Isolation of the ROS tests: loopback only, a domain and a log folder of their own, message fields checked."""

import os
import signal
import subprocess
import time
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from diagnostic_msgs.msg import DiagnosticArray
from live_peer import PATIENCE, LivePeer
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
"""Seconds until a node that was interrupted is killed; it ends within two on an idle machine."""

KINDS = {name: topic.message_class for name, topic in TOPICS.items()} | {"/clock": Clock}
PASSING = {name for name, topic in TOPICS.items() if topic.offered == EVENT} | {"/clock"}
"""Topics that are not latched."""


@pytest.fixture(scope="session", autouse=True)
def ros_environment(tmp_path_factory):
    """Set before any context is initialised; child processes inherit it."""
    os.environ["ROS_AUTOMATIC_DISCOVERY_RANGE"] = "LOCALHOST"
    os.environ["ROS_PYTHON_CHECK_FIELDS"] = "1"
    os.environ["ROS_LOG_DIR"] = str(tmp_path_factory.mktemp("ros_log"))


class Peer:
    """What stands at the other end of the topics: publishes anything, keeps all that it receives."""

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
        """Spin until the condition holds and return what it gave."""
        deadline = time.monotonic() + PATIENCE
        while not (answer := condition()):
            assert time.monotonic() < deadline, f"waited {PATIENCE:g} s for {what}; health: {self.health}"
            self.executor.spin_once(timeout_sec=0.05)
        return answer

    def wait_for_subscribers(self, count=1):
        """Spin until everything that is published has this number of subscribers."""
        for topic, publisher in self.publishers.items():
            self.wait(lambda p=publisher: p.get_subscription_count() >= count, f"{count} subscribers of {topic}")

    def wait_for_health(self, name, sentence):
        """Spin until a part of a node says something; its health."""
        return self.wait(
            lambda: name in self.health and sentence in self.health[name].message and self.health[name],
            f"{name} to say {sentence!r}",
        )

    def send(self, topic, message):
        """Publish a message, or bytes that claim to be one."""
        self.publishers[topic].publish(message)

    def call(self, kind, service, request):
        """Call a service; its response."""
        client = self.node.create_client(kind, service)
        self.wait(client.service_is_ready, f"the service {service}")
        future = client.call_async(request)
        self.wait(future.done, f"the answer of {service}")
        self.node.destroy_client(client)
        return future.result()

    def close(self):
        """Leave the domain."""
        self.executor.shutdown()
        self.node.destroy_node()
        self.context.try_shutdown()


class Stage:
    """A ROS domain of its own, with the processes and peers of a test."""

    def __init__(self, folder: Path):
        self.folder = folder
        self.processes, self.peers = [], []
        domain, self.lock = free_domain()
        os.environ["ROS_DOMAIN_ID"] = str(domain)

    def node(self, module, **parameters):
        """Start a node as a process."""
        given = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
        self.processes.append(node_process(module, given, self.folder))
        return self.processes[-1]

    def named_node(self, name, module, **parameters):
        """Start a node as a process, one of several of a module: its output is that of `name/module`."""
        whole, self.folder = self.folder, self.folder / name
        self.folder.mkdir()
        try:
            return self.node(module, **parameters)
        finally:
            self.folder = whole

    def peer(self, publishes=(), subscribes=()):
        """Join as a peer."""
        self.peers.append(Peer(publishes, subscribes))
        return self.peers[-1]

    def live_peer(self, clock=False):
        """Join as the mine around a live simulator."""
        self.peers.append(LivePeer(clock))
        return self.peers[-1]

    def output(self, module):
        """What a node has printed."""
        return (self.folder / f"{module}.out").read_text()

    def clear(self):
        """End everything that was started; their exit codes."""
        for peer in self.peers:
            peer.close()
        codes = [_ended(process) for process in self.processes]
        self.lock.close()
        return codes


def _ended(process):
    """End a node by SIGINT; its exit code, that of a kill if it takes longer than anything may."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
    try:
        return process.wait(ENDS_WITHIN)
    except subprocess.TimeoutExpired:
        process.kill()
        return process.wait()


@pytest.fixture
def stage(tmp_path):
    """A domain for one test."""
    made = Stage(tmp_path)
    yield made
    made.clear()


@pytest.fixture
def node(stage):
    """A plain node in the domain of the test, in a context of its own."""
    context = Context()
    context.init()
    made = Node("plain", context=context)
    yield made
    made.destroy_node()
    context.try_shutdown()


@pytest.fixture(scope="module")
def shared_stage(tmp_path_factory):
    """A domain for all tests of a module."""
    made = Stage(tmp_path_factory.mktemp("stage"))
    yield made
    made.clear()
