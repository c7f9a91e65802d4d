"""Tests that the simulator ends soon on SIGTERM, whatever it does, with exit code 0 and readable files."""

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import CONFIGURE, SHUT_DOWN, cloud, ramp_of, with_alerts
from programs.ending import ended_in_time

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.live.store import read_last

BUILT_FOR_SECONDS = 1500
"""Points along a side of a grid that takes seconds to become terrain."""


def unconfigured(stage, peer):
    pass


def inactive(stage, peer):
    assert peer.change(CONFIGURE)


def finalized(stage, peer):
    assert peer.change(SHUT_DOWN), stage.output("simulator_node")
    assert peer.state() == "finalized"


@pytest.mark.long
@pytest.mark.parametrize("reach", [unconfigured, inactive, finalized])
def test_a_simulator_that_is_not_active_ends_on_sigterm(stage, reach):
    process = stage.node("simulator_node", autostart=False)
    peer = stage.live_peer()
    peer.wait_for_sentence("unconfigured")
    reach(stage, peer)
    assert ended_in_time(process) == 0, stage.output("simulator_node")
    assert "Traceback" not in stage.output("simulator_node")


def test_a_simulator_that_compiles_while_it_configures_ends_on_sigterm(stage, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(stage.folder / "empty"))
    process = stage.node("simulator_node")
    peer = stage.live_peer()
    peer.wait_for_sentence("configuring")
    peer.spin(1.0)
    assert "active" not in {said.message for said in peer.said}, "it was done before it could be disturbed"
    assert ended_in_time(process) == 0, stage.output("simulator_node")
    assert "Traceback" not in stage.output("simulator_node")


def flies(peer):
    """Wait until the simulator refines its answer; with the parameters of this test it never finishes."""
    peer.wait(lambda: int(peer.answer_values()["stage"]) > 1, "a refined answer")


def builds(peer):
    """Publish a terrain that takes seconds to build; return while the simulator builds it."""
    peer.send("terrain/points", cloud(ramp_of(BUILT_FOR_SECONDS), peer.now()))
    peer.spin(0.5)


@pytest.mark.long
@pytest.mark.parametrize("busy", [flies, builds])
def test_a_simulator_at_work_ends_on_sigterm_and_leaves_its_terrain_and_decisions_whole(stage, busy):
    endless = {"target.half_width": 1e-6, "target.most_rocks": 1_000_000_000}
    process = stage.node("simulator_node", **with_alerts(stage.folder) | endless)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    stamp = peer.stand_on_ramp()
    peer.watch_toe()
    peer.answered()
    peer.wait_for_alert("evacuate")
    peer.wait_for_sentence("is stored", len(peer.said))
    busy(peer)
    assert ended_in_time(process) == 0, stage.output("simulator_node")
    assert "Traceback" not in stage.output("simulator_node")
    assert read_last(stage.folder / "store").pieces[-1].stamp_ns == stamp
    assert audit_log(stage.folder / "decisions").sound
