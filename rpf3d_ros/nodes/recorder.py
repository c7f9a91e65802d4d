"""The node rpf3d_recorder: records terrain, sources, results, alerts and diagnostics in a .rrd file."""

from collections import Counter
from functools import partial
from pathlib import Path
from typing import Any

from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from rclpy.serialization import deserialize_message

from rpf3d_core.errors import InputError
from rpf3d_ros.interface.declared_parameters import declare
from rpf3d_ros.interface.health_report import HealthReport
from rpf3d_ros.interface.parameters import RecorderParameters
from rpf3d_ros.interface.qos import OVERRIDABLE, recorded_qos
from rpf3d_ros.interface.recorded_topics import topics_with
from rpf3d_ros.interface.tf_buffer import TfTransforms
from rpf3d_ros.interface.transforms import InputFrames
from rpf3d_ros.messages.health import ERROR, OK, WARN
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.nodes.configuring import watch_clock
from rpf3d_ros.recording import file_writer
from rpf3d_ros.recording.alert_entries import COUNT_OF_RECORDED
from rpf3d_ros.recording.files import FAULTS, RecordingFiles, Rotation
from rpf3d_ros.recording.incident_bag import IncidentBag
from rpf3d_ros.recording.message_log import MessageLog, Reading
from rpf3d_ros.recording.thinning import Thinning
from rpf3d_ros.recording.viewer_feed import NONE, Viewer, ViewerFeed
from rpf3d_ros.recording.waiting import Read

NAME = "rpf3d_recorder"

RECORDING = COUNT_OF_RECORDED.removeprefix(f"{NAME}: ")
"""Name of the part of /diagnostics with the number of recorded messages of each topic."""

FILE, BAG, VIEWER = "file", "bag", "viewer"
"""Names of the parts of /diagnostics for the recording's file, the bag and the viewer."""

DIAGNOSTICS, MESH = "/diagnostics", "terrain/mesh"

LOOK_AFTER = 1.0
"""Time (s) between two checks whether a new file must begin, and whether the viewer receives the recording."""

LEAVING = 1.0
"""Time (s) that a viewer has to disconnect."""


class RecorderNode(Node):
    """Receives messages as CDR, and records them.

    All entries that are due after a message are written to disk before the next message is handled.

    abandoned : (attribute) True if a thread could not be ended, so that only `os._exit` ends the process in time
    """

    def __init__(self) -> None:
        super().__init__(NAME)
        parameters = declare(self, RecorderParameters)
        self.now_ns = self._now_ns()
        thinning = Thinning(rocks=parameters.rocks_per_answer, maps_every=parameters.maps_every)
        frames = self._frames(parameters)
        sensors = parameters.recorded_sensors
        self.log = MessageLog(parameters.frame, parameters.mesh_frame, lambda: self.now_ns, thinning, frames, sensors)
        self.bag = IncidentBag(parameters.bag, sensors)
        viewer = Viewer(kind=parameters.viewer, bind=parameters.viewer_bind, port=parameters.viewer_port)
        viewer.check()
        self.files = _opened(parameters, self.bag)
        self.recorded: Counter[str] = Counter()
        self.health = HealthReport(self)
        self.feed = ViewerFeed(viewer, self.files.head) if viewer.kind != NONE else None
        self.abandoned = False
        self._record(Reading(topic=FILE, entries=self.log.begin))
        self._report_recorded()
        self.get_logger().info(f"recording into {self.files.path}")
        for topic, recorded in topics_with(sensors).items():
            qos = recorded_qos(recorded.offered, parameters.terrain_durability)
            self._subscribe(topic, recorded.message_class, qos)
        self.create_timer(LOOK_AFTER, self._look_after, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _frames(self, parameters: RecorderParameters) -> InputFrames:
        """Return the frames of the inputs. Raises InputError if `use_tf` is set and tf2 is not installed."""
        if not parameters.use_tf:
            return InputFrames(parameters.frame)
        transforms = TfTransforms(self)
        watch_clock(self, lambda seconds: transforms.clear())
        return InputFrames(parameters.frame, transforms, parameters.transforms_max_age_s)

    def _now_ns(self) -> int:
        return int(self.get_clock().now().nanoseconds)

    def _subscribe(self, topic: str, kind: Any, qos: Any) -> None:
        """Subscribe to a topic as CDR, so that a message that cannot be deserialized is refused like any other."""
        receive = partial(self._receive, topic, kind)
        self.create_subscription(kind, topic, receive, qos, qos_overriding_options=OVERRIDABLE, raw=True)

    def _receive(self, topic: str, kind: Any, data: bytes) -> None:
        self.now_ns = self._now_ns()
        self.bag.write(topic, self.resolve_topic_name(topic), self.now_ns, data)
        self._take(topic, (lambda: data) if topic == MESH else partial(_read, kind, data))

    def _take(self, topic: str, read: Read) -> None:
        """Record all messages that are due after a message was received, and count the received message.

        The received message is not counted if it is refused or cannot be written. A message that waits to be recorded
        later is counted now, although a newer message may replace it.

        topic : topic of the received message; read : returns the message
        """
        written = [self._record(reading) or reading.topic != topic for reading in self.log.received(topic, read)]
        if all(written):
            self._count(topic)

    def _record(self, reading: Reading) -> bool:
        """Write the entries of a message to file and viewer; return False if it was refused, or on a write error."""
        try:
            entries = reading.entries()
        except InputError as refusal:
            self.health.set(reading.topic, WARN, f"message refused: {refusal}")
            return False
        except Exception as error:  # no message may end the node
            self.health.set(reading.topic, ERROR, f"message refused: {type(error).__name__}: {error}")
            return False
        if self.feed is not None and entries:
            self.feed.offer(entries)
        try:
            self.files.write(entries)
        except FAULTS as error:
            self._report_fault(error)
            return False
        return True

    def _look_after(self) -> None:
        self.now_ns = self._now_ns()
        for reading in self.log.due():
            self._record(reading)
        try:
            self.files.check()
        except FAULTS as error:
            self._report_fault(error)
        else:
            self._report_recorded()
        if self.bag.folder is not None:
            level = ERROR if self.bag.fault else OK
            self.health.set(BAG, level, self.bag.fault or f"writing {self.bag.folder}")
        self._report_viewer()

    def _report_viewer(self) -> None:
        if self.feed is not None:
            lost = {"dropped": str(self.feed.dropped)}
            if self.feed.fault:
                self.health.set(VIEWER, WARN, f"no viewer receives the recording: {self.feed.fault}", lost)
            else:
                self.health.set(VIEWER, OK, "fed", lost)

    def _count(self, topic: str) -> None:
        if topic != DIAGNOSTICS:  # counting diagnostics would publish diagnostics each time
            self.recorded[topic] += 1
            self._report_recorded()

    def _report_recorded(self) -> None:
        counts = {topic: str(count) for topic, count in self.recorded.items()}
        self.health.set(RECORDING, OK, f"writing {self.files.path}", counts)
        if self.files.lost:
            self.health.set(FILE, WARN, f"the file is written again; entries lost before: {self.files.lost}")

    def _report_fault(self, error: Exception) -> None:
        sentence = f"{self.files.path} could not be written: {error}"
        self.health.set(FILE, ERROR, sentence, {"lost": str(self.files.lost)})
        self.health.set(RECORDING, ERROR, sentence)

    def destroy_node(self) -> None:
        """Record the waiting messages, close the recording and its bag, then destroy the node.

        A file that was not closed must be repaired (`rpf3d recover`) before `rerun rrd verify` accepts it.
        """
        for reading in self.log.rest():
            self._record(reading)
        self.health.closed = True
        for close, name in ((self.files.close, f"{self.files.path}"), (self.bag.close, f"{self.bag.folder}")):
            try:
                close()
            except FAULTS as error:
                self.get_logger().error(f"{name} could not be closed and may not verify: {error}")
        self.abandoned = (self.feed is not None and not self.feed.close(LEAVING)) or file_writer.any_left()
        super().destroy_node()


def _read(kind: Any, data: bytes) -> Any:
    """Return the message in received bytes. Raises MessageRefused if they are not a message of this class."""
    try:
        return deserialize_message(data, kind)
    except Exception as error:  # rclpy raises various exceptions of its C++ code
        raise MessageRefused(f"it is not a valid {kind.__name__}: {error}") from error


def _opened(parameters: RecorderParameters, bag: IncidentBag) -> RecordingFiles:
    """Begin the first file of the recording, and return the recording. Raises InputError if that fails."""
    path = Path(parameters.file)
    rotation = Rotation(megabytes=parameters.rotate_mb, minutes=parameters.rotate_minutes, keep=parameters.keep_files)
    try:
        return RecordingFiles(path, rotation, begun=bag.begin_with, forgotten=bag.forget)
    except FAULTS as error:
        raise InputError(f"{path}: the recording cannot be written: {error}") from error
