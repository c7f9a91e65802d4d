"""Damaged messages on every input of a living simulator: it refuses what it cannot use, keeps its memory, and answers.

Damage is drawn from a fixed seed, in the bytes of a sound message as they travel: anywhere (`mutated_files`) and, three
times in four, a value that is none in the place of one, for most of the former is what the middleware cannot read, and
never reaches the simulator. `test_damaged_messages` has the conversions alone.
"""

import math
import os
import random
import struct

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from geometry_msgs.msg import Point, PointStamped
from live_peer import FEW_ROCKS, INPUTS, ON_THE_SLOPE, TOE, cloud, header, polygon, poses, ramp, resident
from mutated_files import mutated
from quick import long_except
from rclpy.serialization import serialize_message

from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.survey_mesh import grid_mesh
from rpf3d_ros.messages.terrain_messages import cdr_of_mesh

QUICK = {"terrain/mesh", "sources"}
"""Inputs that `make test` tries: what the rocks fall on, and where they fall from."""

MUTATIONS = int(os.environ.get("RPF3D_MUTATIONS", "50"))
"""For each of eight topics."""

NO_BYTES = bytes(1)
"""Sent in the place of nothing at all: a message of no bytes is not sent, because what followed one arrived late here,
and why has not been looked for."""

AHEAD = 0.5
"""Seconds that a damaged stamp may be ahead, and shut its topic for what is stamped now."""

NO_VALUES = (*(struct.pack("<d", value) for value in (math.nan, math.inf, -1e300)), b"\xff" * 4, bytes(4))
"""What is put in the place of a number of as many bytes; doubles dominate, as they do in poses."""

CDR_HEADER = 4
"""Bytes before what numbers are aligned to."""

REFUSED = 2
"""How many different refusals must be reported at least: damage must reach the simulator, not the middleware alone."""

MOST = 20
"""Times as many messages at most: a busy machine drops most of those that overtake one another."""

PACE = 0.03
"""Seconds that a message may stay without a word before the next is sent, so that few overtake one another."""

MEMORY = 300.0
"""MB more than at the start: a message takes kilobytes. A few grounds that damage has made large may be in use."""


def small(points):
    return points[::10, ::10]


def sound(topic, stamp):
    """A small sound message of a topic."""
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
    """A message with one of its numbers exchanged."""
    value = rng.choice(NO_VALUES)
    place = CDR_HEADER + len(value) * rng.randrange((len(message) - CDR_HEADER) // len(value))
    return message[:place] + value + message[place + len(value) :]


@pytest.fixture(scope="module")
def living(shared_stage):
    """A simulator that has answered once, its peer, and the memory (MB) it took."""
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
    """The different refusals that the simulator has reported after n states."""
    return {said.message for said in peer.said[after:] if "refused" in said.message}
