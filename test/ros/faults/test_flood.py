"""Tests with 1000 messages of sources per second: memory is bounded, the newest is answered, drops are counted."""

import os
import time

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import FEW_ROCKS, NODE, poses, resident

SECONDS = float(os.environ.get("RPF3D_FLOOD", "5"))
"""Duration (s) of the flood at its nominal rate; a minute in `make soak`."""

SOON = 5.0
"""Longest time (s) until the newest message is answered, on a machine that runs little else."""

IN_TURN = 20.0
"""On a slow machine: longest time until the answer to the newest message, over the time of an answer to one message."""

RATE = 1000
"""Messages per second; on a busy machine the rate is lower, and the same number of messages takes longer."""

RECEIVED_EVERY = 10
"""Number of messages after which the peer looks for received messages, which takes longer than to publish one."""

MEMORY = 100.0
"""Memory (MB) that the simulator may take in addition: much less than if it kept every message and every answer."""


def test_a_flood_of_sources_is_answered_with_the_newest_in_bounded_memory_and_drops_are_counted(stage):
    process = stage.node("simulator_node", **FEW_ROCKS)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.stand_on_ramp()
    peer.answered()
    memory, sent, began = resident(process.pid), 0, time.monotonic()
    while sent < SECONDS * RATE:
        if sent < (time.monotonic() - began) * RATE:
            place = (5.0 + 20.0 * (sent % 7) / 7.0, 5.0 + 50.0 * (sent % 11) / 11.0, 50.0)
            newest = peer.now()
            peer.send("sources", poses([place], newest))
            sent += 1
        if sent % RECEIVED_EVERY == 0:
            peer.spin()
    answered = seconds_of(lambda: peer.wait_for_answer(newest))
    peer.wait(lambda: dropped(peer) > 0, "drops to be told of: otherwise the flood was none")
    assert resident(process.pid) < memory + MEMORY
    alone = seconds_of(peer.answered)
    assert answered < max(SOON, IN_TURN * alone), "the newest waited behind what it has made worthless"


def seconds_of(do):
    """Call `do`, which must return a true value; return the time (s) that it took."""
    began = time.monotonic()
    assert do()
    return time.monotonic() - began


def dropped(peer):
    """Return the number of messages of sources that the simulator reports as dropped."""
    status = peer.health.get(f"{NODE}: queues")
    return int(next((pair.value for pair in status.values if pair.key == "sources_dropped"), 0)) if status else 0
