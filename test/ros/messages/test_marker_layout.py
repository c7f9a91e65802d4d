"""Tests that markers written directly as bytes equal the markers that rclpy serialises from objects."""

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import ColorRGBA, Header
from suite.property_budget import examples
from suite.slowness import slowness
from visualization_msgs.msg import Marker, MarkerArray

from rpf3d_core.live.zones import ShownZone
from rpf3d_ros.messages.marker_layout import CLEARING, NO_POINTS, Layout, cdr_of_markers
from rpf3d_ros.messages.marker_messages import trajectory_markers, zone_markers

BURST = 0.020
"""Longest CPU time (s) for all markers of a burst of sources: a fifth of the limit of the burst's answer."""

TEXT = st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=9)


def built(header, markers):
    """Return the MarkerArray of objects to compare with."""
    return MarkerArray(markers=[_built(header, marker) for marker in markers])


def _built(header, layout):
    r, g, b, a = layout.colour
    return Marker(
        header=header, ns=layout.namespace, id=layout.number, type=layout.kind, action=layout.action, text=layout.text,
        pose=Pose(orientation=Quaternion(w=1.0)), scale=Vector3(**dict(zip("xyz", layout.scale, strict=True))),
        color=ColorRGBA(r=r, g=g, b=b, a=a), points=[Point(x=x, y=y, z=z) for x, y, z in layout.points.tolist()],
        colors=[ColorRGBA(r=r, g=g, b=b, a=a) for r, g, b, a in layout.colours.tolist()],
    )  # fmt: skip


def as_rclpy_reads(message):
    """Return the message that a subscriber receives: 32-bit numbers are rounded."""
    return deserialize_message(serialize_message(message), type(message))


@st.composite
def layouts(draw):
    points = draw(st.integers(0, 5))
    rng = np.random.default_rng(draw(st.integers(0, 99)))
    colours = rng.random((points if draw(st.booleans()) else 0, 4)).astype(np.float32)
    return Layout(
        draw(TEXT), draw(st.integers(-5, 99)), Marker.LINE_STRIP, Marker.ADD, (0.5, 0.25, 0.125), (1.0, 0.5, 0.25, 1.0),
        1e5 * rng.standard_normal((points, 3)), colours, draw(TEXT),
    )  # fmt: skip


@examples(100)
@given(frame=TEXT, markers=st.lists(layouts(), max_size=5))
def test_the_bytes_are_read_as_the_objects_that_they_stand_for(frame, markers):
    header = Header(frame_id=frame, stamp=Time(sec=-3, nanosec=999_999_999))
    read = deserialize_message(cdr_of_markers(header, [CLEARING, *markers]), MarkerArray)
    assert read == as_rclpy_reads(built(header, [CLEARING, *markers]))


def test_the_bytes_are_as_many_as_rclpy_makes():
    markers = [CLEARING, Layout("a", points=np.ones((3, 3)), text="result 1"), Layout("bc", points=NO_POINTS)]
    header = Header(frame_id="map")
    ours, theirs = cdr_of_markers(header, markers), serialize_message(built(header, markers))
    assert abs(len(ours) - len(theirs)) < 4, "rclpy pads the end"


def test_a_burst_of_sources_is_drawn_in_a_fraction_of_its_answer():
    rng = np.random.default_rng(1)
    columns = {name: rng.random(200 * 400) for name in ("x", "y", "z", "speed")}
    columns["rock"] = np.repeat(np.arange(200), 400)
    zones = [ShownZone(name, rng.random((10_000, 3, 3)), rng.random((2000, 2, 3))) for name in ("0.01", "0.1", "0.5")]
    header, seconds = Header(frame_id="map"), []
    for _ in range(5):
        slow = slowness()
        began = time.process_time()
        trajectory_markers(header, columns, 200, 50)
        zone_markers(header, zones)
        seconds.append((time.process_time() - began) / slow)
    assert min(seconds) < BURST
