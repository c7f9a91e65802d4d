"""A clock that jumps back, as where a simulation or a bag begins anew: nothing from before is believed afterwards."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_peer import SECOND, poses, with_alerts

LATE, EARLY = 100_000 * SECOND, 50_000 * SECOND


def test_after_the_clock_went_back_there_is_a_fault_until_all_is_heard_anew_and_then_it_is_normal_again(stage):
    process = stage.node("simulator_node", use_sim_time=True, **with_alerts(stage.folder))
    peer = stage.live_peer(clock=True)
    peer.run_clock(LATE)
    peer.wait_for_simulator()
    peer.wait_for_sentence("active")
    peer.stand_on_ramp()
    peer.watch_toe()
    peer.answered([])
    peer.wait_for_alert("normal")
    peer.refused("sources", poses([], EARLY), "goes back by")
    before = len(peer.alerts)
    peer.run_clock(EARLY)
    told = peer.wait_for_alert("fault", before)
    assert "clock went back" in told.message
    peer.stand_on_ramp()
    peer.watch_toe()
    before = len(peer.alerts)
    peer.answered([])
    peer.wait_for_alert("normal", before)
    assert process.poll() is None
