"""Tests of what an input does before and after it converts a message, without a network."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import header
from rclpy.time import Time

from rpf3d_ros.engine.stamp_guards import StampGuards
from rpf3d_ros.interface.parameters import SimulatorParameters
from rpf3d_ros.interface.transforms import FoundTransform, InputFrames
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.nodes import inputs as inputs_module
from rpf3d_ros.nodes import recorder
from rpf3d_ros.nodes.frames_on_arrival import FramesOnArrival
from rpf3d_ros.nodes.inputs import Inputs
from rpf3d_ros.nodes.recorder import RecorderNode
from rpf3d_ros.nodes.simulator import SimulatorNode

S = 1_000_000_000
NOW = 1_000 * S


class Truck:
    """A provider whose only transform is that of a moving frame; it notes the calls of `lookup` and `clear`."""

    def __init__(self):
        self.calls = []

    def lookup(self, target, source, stamp_ns):
        self.calls.append("lookup")
        return FoundTransform((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), NOW)

    def clear(self):
        self.calls.append("clear")


class DryInputs(Inputs):
    """The inputs of a node without subscriptions; keeps the refusals, and the topics whose messages were accepted."""

    def __init__(self, truck, now_ns=NOW):
        self.refusals, self.understood = [], []
        self._now = lambda: now_ns
        self._notice_jump = lambda: truck.calls.append("notice")
        self._frames = FramesOnArrival(InputFrames(MapFrame(), truck, 1.0), is_patient=False)
        self._parameters = SimpleNamespace(mesh_frame="truck", most_points=10)
        self.guards = SimpleNamespace(check=lambda *stamps: None, note=lambda *stamps: None)
        self.publishers = SimpleNamespace(understood=self.understood.append)
        self._station = SimpleNamespace(input_understood=lambda topic, count: None)

    def _refuse(self, topic, why, published_ns, is_counted=False, stamp_ns=None):
        self.refusals.append(why)


def test_the_stamps_of_inputs_may_be_ahead_by_what_the_station_allows(monkeypatch):
    for name in ("LargeMessages", "PublisherReports", "SubscriptionEventCallbacks", "MessageGaps", "depth_of"):
        monkeypatch.setattr(inputs_module, name, MagicMock())
    station = SimpleNamespace(guards=StampGuards(1.0))
    inputs = Inputs(MagicMock(), SimulatorParameters(most_ahead=10.0), station, None, lambda: None)
    inputs.guards.check("sources", NOW + S, NOW)
    with pytest.raises(MessageRefused, match="1 s are allowed"):
        inputs.guards.check("sources", NOW + 8 * S, NOW)


def test_an_area_in_a_moving_frame_is_refused_after_the_clock_was_checked():
    truck = Truck()
    inputs = DryInputs(truck)
    inputs._area("areas/polygon", header(NOW, "truck"), "live_area", lambda frame: [])
    assert truck.calls == ["notice", "lookup"]
    (why,) = inputs.refusals
    assert why.startswith("frame 'truck' moves: an area stays") and "must be static" in why


@pytest.mark.parametrize("now_ns", [NOW, 0])
def test_a_mesh_in_a_moving_frame_is_refused_also_before_the_first_clock(now_ns):
    inputs = DryInputs(Truck(), now_ns)
    inputs.on_mesh(b"", 1)
    assert inputs.refusals == ["frame 'truck' moves: a mesh has no stamp, so its frame must be static (/tf_static)"]


def test_only_an_understood_message_ends_the_fault_of_a_mute_sensor():
    def refuse():
        raise MessageRefused("it is damaged")

    inputs = DryInputs(Truck())
    inputs._try("sources", refuse, 0)
    assert (inputs.understood, inputs.refusals) == ([], ["it is damaged"])
    inputs._try("sources", lambda: None, 0)
    assert inputs.understood == ["sources"]


def test_a_simulator_forgets_transforms_when_its_clock_goes_back():
    truck = Truck()
    node = SimpleNamespace(_now=lambda: NOW, transforms=truck, inputs=None, station=None)
    SimulatorNode._clock_went_back(node, 60.0)
    assert truck.calls == ["clear"]


def test_a_recorder_forgets_transforms_when_its_clock_goes_back(node, monkeypatch):
    truck = Truck()
    monkeypatch.setattr(recorder, "TfTransforms", lambda made_for: truck)
    RecorderNode._frames(node, SimpleNamespace(use_tf=True, frame=MapFrame(), transforms_max_age_s=1.0))
    clock = node.get_clock()
    clock._set_ros_time_is_active(True)
    clock.set_ros_time_override(Time(nanoseconds=NOW, clock_type=clock.clock_type))
    assert "clear" not in truck.calls
    clock.set_ros_time_override(Time(nanoseconds=NOW - 60 * S, clock_type=clock.clock_type))
    assert truck.calls == ["clear"]
