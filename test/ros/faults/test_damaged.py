"""Tests with damaged messages on every input of a running simulator: it refuses them and still answers afterwards.

Damage is drawn from a fixed seed and applied to the serialised bytes of a valid message. In one message of four, bytes
anywhere are damaged (`mutated_files`); most of these messages never reach the simulator, because the middleware cannot
read them. In the others, one number is replaced by an invalid one. `test_damaged_messages` tests the conversions alone.
"""

import math
import os
import random
import struct

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point, PointStamped
from input_files.mutated_files import mutated
from messages.live_peer import FEW_ROCKS, INPUTS, ON_THE_SLOPE, TOE, cloud, header, polygon, poses, ramp, resident
from rclpy.serialization import serialize_message
from suite.quick import long_except

from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

QUICK = {"terrain/mesh", "sources"}
"""Input topics that `make test` tries: one of terrain, one of sources."""

MUTATIONS = int(os.environ.get("RPF3D_MUTATIONS", "50"))
"""Least number of damaged messages per topic."""

NO_BYTES = bytes(1)
"""Sent instead of an empty message: messages after an empty one arrived late, for an unknown reason."""

AHEAD = 0.5
"""Longest time (s) that a stamp may be ahead; so long, a damaged stamp can keep its topic from accepting messages."""

NO_VALUES = (*(struct.pack("<d", value) for value in (math.nan, math.inf, -1e300)), b"\xff" * 4, bytes(4))
"""Bytes that replace a number of the same length; most are doubles, as in poses."""

CDR_HEADER = 4
"""Length (bytes) of the CDR header; numbers are aligned relative to its end."""

REFUSED = 2
"""Least number of different refusals: they show that damaged messages reach the simulator, not only the middleware."""

MOST = 20
"""Largest number of messages, over MUTATIONS: on a busy machine most of them overwrite one another in the queue."""

PACE = 0.03
"""Longest time (s) to wait for a report on a message before the next is sent, so that few overwrite one another."""

MEMORY = 300.0
"""Memory (MB) that the simulator may take in addition: a message takes kilobytes, but damage may enlarge a terrain."""


def small(points):
    return points[::10, ::10]


def sound(topic, stamp):
    """Return a small valid message of a topic, with a stamp (ns)."""
    flat = small(ramp()).reshape(-1, 3)
    places = [ON_THE_SLOPE] * 5
    columns = {name: flat[:, i] for i, name in enumerate("xyz")} | {"diameter": np.full(len(flat), 0.7)}
    return {
        "terrain/points": lambda: cloud(small(ramp()), stamp),
        "terrain/mesh": lambda: cdr_of_mesh(grid_mesh(small(ramp()))),
        "terrain/update": lambda: cloud(ramp()[20:30, 20:30], stamp),
        "sources": lambda: poses(places, stamp),
        "clicked_point": lambda: PointStamped(header=header(stamp), point=Point(x=10.0, y=30.0, z=32.0)),
        "source_cloud": lambda: cloud_of_columns(header(stamp), columns),
        "areas/polygon": lambda: polygon(TOE, stamp),
        "areas/equipment": lambda: poses(places, stamp),
    }[topic]()


def planted(message, rng):
    """Return the bytes of a message with one number replaced by an invalid value."""
    value = rng.choice(NO_VALUES)
    place = CDR_HEADER + len(value) * rng.randrange((len(message) - CDR_HEADER) // len(value))
    return message[:place] + value + message[place + len(value) :]


@pytest.fixture(scope="module")
def living(shared_stage):
    """Yield the process of a simulator that has answered once, its peer, and its memory (MB)."""
    process = shared_stage.node("simulator_node", most_ahead=AHEAD, **FEW_ROCKS)
    peer = shared_stage.live_peer()
    peer.wait_for_simulator()
    peer.stand_on_ramp()
    peer.answered()
    yield process, peer, resident(process.pid)
    assert process.poll() is None, "the simulator has died"


@pytest.mark.parametrize("topic", long_except(QUICK, INPUTS))
def test_damaged_messages_are_refused_and_the_simulator_lives_on(living, topic):
    process, peer, memory = living
    rng, before = random.Random(topic), len(peer.said)
    for number in range(MOST * MUTATIONS):
        if number >= MUTATIONS and len(refusals(peer, before)) >= REFUSED:
            break
        message = sound(topic, peer.now())
        whole = message if isinstance(message, bytes) else serialize_message(message)
        peer.send(topic, (planted if number % 4 else mutated)(whole, rng) or NO_BYTES)
        peer.spin(PACE, until_something_is_said=True)
    peer.send(topic, sound(topic, peer.now()))
    peer.spin(AHEAD)
    peer.stand_on_ramp()
    assert peer.answered_again()
    assert process.poll() is None
    assert len(refusals(peer, before)) >= REFUSED
    assert resident(process.pid) < memory + MEMORY


def refusals(peer, after):
    """Return the different refusals among the states that the simulator has reported since the first `after` states."""
    return {said.message for said in peer.said[after:] if "refused" in said.message}
