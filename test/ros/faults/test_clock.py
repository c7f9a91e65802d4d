"""Tests of a clock that jumps back, as when a simulation or bag restarts: earlier evidence no longer counts."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import SECOND, poses, with_alerts

from rpf3d_core.alerts.log_files import files_in
from rpf3d_ros.messages.health import ERROR

LATE, EARLY = 100_000 * SECOND, 50_000 * SECOND


@pytest.mark.long
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
    peer.refused("sources", poses([], EARLY), "older than the last message")
    peer.wait_for_alert("fault", reason="older than the last message")
    peer.run_clock(EARLY)
    peer.wait_for_alert("fault", reason="clock went back")
    peer.stand_on_ramp()
    peer.watch_toe()
    before = len(peer.alerts)
    peer.answered([])
    peer.acknowledge_refusals(before)
    peer.wait_for_alert("normal", before)
    assert process.poll() is None


def test_before_the_first_clock_the_alarm_is_on_without_a_decision_and_the_first_decision_has_the_first_time(stage):
    stage.node("simulator_node", use_sim_time=True, **with_alerts(stage.folder))
    peer = stage.live_peer(clock=True)
    said = peer.wait_for_sentence("no time on /clock yet")
    assert (said.part, said.level) == ("rpf3d_simulator: clock", ERROR)
    peer.wait(lambda: peer.alarms, "the alarm")
    peer.wait_for_sentence("no time on /clock yet", len(peer.said))  # published again for late subscribers
    peer.stand_on_ramp(stamp_ns=LATE)
    peer.send("sources", poses([], LATE))
    peer.wait_for_answer(LATE)
    assert all(peer.alarms) and not peer.alerts and not files_in(stage.folder / "decisions")
    peer.run_clock(LATE)
    peer.wait_for_alert("fault")
    first = {pair.key: pair.value for pair in peer.alerts[0].status[0].values}
    assert LATE <= int(first["decided_at_ns"]) < LATE + 10 * SECOND
    peer.wait_for_sentence("the clock runs", len(peer.said))
    peer.stand_on_ramp()
    peer.watch_toe()
    peer.answered([])
    peer.wait_for_alert("normal")
