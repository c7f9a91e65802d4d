"""Tests of a site that requires two persons: what the terminal, `alerts` and the decision log show."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from messages.live_peer import PATIENCE, with_alerts

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.levels import ANOTHER_PERSON
from rpf3d_ros.messages.refusals import TAKEN_UP
from rpf3d_ros.nodes.acknowledge import NOT_ALONE, NOT_YET

ROOT = Path(__file__).resolve().parents[3]


def acknowledge(by):
    """Acknowledge at a terminal as the person `by`; return the exit code and the output."""
    command = [sys.executable, "-m", "rpf3d_ros.nodes.acknowledge", by, "the slope was inspected", "--patience", "60"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=ROOT, timeout=PATIENCE)
    return done.returncode, done.stdout + done.stderr


def waits(code, told):
    """Return whether the program answered that another person must acknowledge, too, or only to look at the alerts."""
    return (code == NOT_ALONE and ANOTHER_PERSON in told) or is_taken_up(code, told)


def is_taken_up(code, told):
    """Return whether the program answered to look at the alerts, because a busy machine has not decided yet."""
    return (code, told) == (NOT_YET, f"{TAKEN_UP}\n")


def value(peer, key, status=0):
    return next(pair.value for pair in peer.alerts[-1].status[status].values if pair.key == key)


def test_evacuate_falls_only_when_two_persons_have_acknowledged(stage, tmp_path):
    parameters = with_alerts(tmp_path)
    with parameters["site_file"].open("a") as site:
        site.write("acknowledge: {persons: 2, held_from: evacuate, within_s: 600}\n")
    stage.node("simulator_node", **parameters)
    peer = stage.live_peer()
    peer.wait_for_simulator()
    peer.see_rocks_reach_the_toe()
    peer.answered([])
    peer.wait(lambda: value(peer, "evident") == "normal", "nothing to be seen")
    assert waits(*acknowledge("A. Shift"))
    peer.wait(lambda: value(peer, "waiting_by") == "A. Shift", "the acknowledgement that waits")
    assert value(peer, "waiting_by", status=1) == "A. Shift" and value(peer, "level") == "evacuate"
    assert waits(*acknowledge("a shift"))
    code, told = acknowledge("B. Survey")
    assert is_taken_up(code, told) or (code, told) == (0, "B. Survey: the level is normal\n"), told
    peer.wait(lambda: value(peer, "level") == "normal", "normal")
    assert value(peer, "waiting_by") == value(peer, "waiting_until_ns") == ""
    assert stage.clear() == [0]
    audit = audit_log(parameters["decision_log"])
    given = [change.alert.acknowledgement for change in audit.changes if change.alert.acknowledgement is not None]
    assert audit.sound and [one.by for one in given] == ["A. Shift", "a shift", "B. Survey"]
    assert {one.client for one in given} == {"/rpf3d_acknowledge (enclave /)"}
