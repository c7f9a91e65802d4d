"""A thousand messages of sources a second: memory stays, the newest is answered, what is dropped is counted."""

import os
import time

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_peer import FEW_ROCKS, NODE, poses, resident

SECONDS = float(os.environ.get("RPF3D_FLOOD", "5"))
"""How long it lasts at its rate; a minute in `make soak`."""

SOON = 5.0
"""Seconds until the newest message is answered on a machine that does little else."""

IN_TURN = 20.0
"""Answers to a single message that may take as long as the answer to the newest of a flood of thousands."""

RATE = 1000
"""Messages a second; on a busy machine the flood has a lower rate and lasts longer, with the same messages."""

RECEIVED_EVERY = 10
"""Messages after which the peer looks whether it has received something, which takes longer than to publish."""

MEMORY = 100.0
"""MB more than before: each message would take kilobytes if it were kept, and each answer more."""


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
    """Seconds that something takes."""
    began = time.monotonic()
    assert do()
    return time.monotonic() - began


def dropped(peer):
    """How many messages of sources the simulator says that it has dropped."""
    status = peer.health.get(f"{NODE}: queues")
    return int(next((pair.value for pair in status.values if pair.key == "sources_dropped"), 0)) if status else 0
