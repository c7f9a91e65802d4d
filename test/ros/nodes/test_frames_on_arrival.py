"""Tests that only the survey thread waits for the first transforms, not the thread that receives them."""

import threading
import time

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rpf3d_ros.interface.transforms import FoundTransform, InputFrames
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.nodes import frames_on_arrival
from rpf3d_ros.nodes.frames_on_arrival import FramesOnArrival

NOW = 10**18
QUICK = 20.0
"""Longest time (s) until a thread that no longer has to wait continues; a busy machine needs a second."""


class Late:
    """A provider of transforms that knows no transform until the test sets `found`."""

    found = "it is unknown"

    def __init__(self):
        self.asked = threading.Event()

    def lookup(self, target, source, stamp_ns):
        self.asked.set()
        return self.found


def on_a_thread(frames):
    """Look up the frame of a drone on another thread.

    Return the thread, and a list that receives the name of the frame or the reason of the refusal.
    """
    found = []

    def ask():
        try:
            found.append(frames.of("drone", NOW).other.source)
        except MessageRefused as refusal:
            found.append(str(refusal))

    thread = threading.Thread(target=ask, daemon=True)
    thread.start()
    return thread, found


def joined(thread):
    thread.join(QUICK)
    assert not thread.is_alive()


@pytest.fixture
def late(monkeypatch):
    monkeypatch.setattr(frames_on_arrival, "FIRST_TRANSFORMS", 1e6)
    return Late()


def test_a_survey_waits_for_the_first_transforms(late):
    thread, found = on_a_thread(FramesOnArrival(InputFrames(MapFrame(), late), is_patient=True))
    assert late.asked.wait(QUICK) and found == []
    late.found = FoundTransform((0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0), None)
    joined(thread)
    assert found == ["drone"]


def test_a_waiting_survey_is_refused_when_the_node_is_deactivated(late):
    frames = FramesOnArrival(InputFrames(MapFrame(), late), is_patient=True)
    thread, found = on_a_thread(frames)
    assert late.asked.wait(QUICK) and found == []
    frames.close()
    joined(thread)
    assert "it is unknown" in found[0]


def test_the_thread_of_the_executor_never_waits(late):
    began = time.monotonic()
    with pytest.raises(MessageRefused, match="it is unknown"):
        FramesOnArrival(InputFrames(MapFrame(), late), is_patient=True).of("drone", NOW)
    assert time.monotonic() - began < QUICK


def test_after_the_first_seconds_and_without_tf_no_survey_waits(late, monkeypatch):
    for patience, is_patient in ((0.0, True), (1e6, False)):
        monkeypatch.setattr(frames_on_arrival, "FIRST_TRANSFORMS", patience)
        thread, found = on_a_thread(FramesOnArrival(InputFrames(MapFrame(), late), is_patient=is_patient))
        joined(thread)
        assert "it is unknown" in found[0]
