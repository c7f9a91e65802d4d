"""A thousand messages of sources a second: memory stays, the newest is answered, what is dropped is counted."""

import os
import time

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_peer import FEW_ROCKS, NODE, SECOND, poses, resident

SECONDS = float(os.environ.get("RPF3D_FLOOD", "5"))
"""How long it lasts; a minute in `make soak`."""

RATE = 1000
REACHED = 0.5
"""Share of the rate that the flood must have had to be one: the two sides share two cores, with other tests."""

MEMORY = 100.0
"""MB more than before: each message would take kilobytes if it were kept, and each answer more."""


def test_a_flood_of_sources_is_answered_with_the_newest_in_bounded_memory_and_drops_are_counted(stage):
    process = stage.node("simulator_node", **FEW_ROCKS)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.stand_on_ramp()
    peer.answered()
    memory, sent, began = resident(process.pid), 0, time.monotonic()
    while (passed := time.monotonic() - began) < SECONDS:
        if sent < passed * RATE:
            place = (5.0 + 20.0 * (sent % 7) / 7.0, 5.0 + 50.0 * (sent % 11) / 11.0, 50.0)
            newest = peer.now()
            peer.send("sources", poses([place], newest))
            sent += 1
        peer.spin()
    assert sent > REACHED * RATE * SECONDS, "the flood was none"
    answered = time.time_ns()
    peer.wait_for_answer(newest)
    answered = (time.time_ns() - answered) / SECOND
    peer.wait(lambda: dropped(peer) > 0, "drops to be told of")
    assert resident(process.pid) < memory + MEMORY
    assert answered < 5.0, "the newest waited behind what it has made worthless"
    assert peer.answered()


def dropped(peer):
    """How many messages of sources the simulator says that it has dropped."""
    status = peer.health.get(f"{NODE}: queues")
    return int(next((pair.value for pair in status.values if pair.key == "sources_dropped"), 0)) if status else 0
