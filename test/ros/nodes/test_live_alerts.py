"""Tests of the alerts of the process rpf3d_simulator: evidence raises levels, only acknowledgements lower them."""

import json
import subprocess
import sys
import time
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Point32, Polygon, PolygonStamped, Pose, PoseArray, Quaternion
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from messages.live_peer import PATIENCE, acknowledge_as
from std_msgs.msg import Header

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.live.survey import GridSurvey
from rpf3d_ros.messages.alert_reading import alerts_of
from rpf3d_ros.messages.cloud_messages import cloud_of_grid
from rpf3d_ros.messages.health import healths_of
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.marker_reading import outlines_of_markers
from rpf3d_ros.nodes.acknowledge import NOT_YET

ROOT = Path(__file__).resolve().parents[3]
NODE = "rpf3d_simulator"
SITE = """\
site: test pit
valid_s: 2
alarm_from: evacuate
evidence:
  {sources_max_age_s: 6, terrain_max_age_s: 600, clock_tolerance_s: 1, fewest_rocks: 100, most_unfinished: 0.1}
areas:
  live_area:
    watch: {reach_probability: 0.1}
    evacuate: {reach_probability: 0.5}
"""
FLIGHT = {
    "engine": "auto", "rebound": "constant", "ground": "sliding", "first_rocks": 200, "target.most_rocks": 400,
    "position_spread": 0.1, "velocity_spread": 0.0,
}  # fmt: skip


def now():
    ns = time.time_ns()
    return Header(frame_id="map", stamp=Time(sec=ns // 10**9, nanosec=ns % 10**9))


def cloud():
    y, x = np.mgrid[0:21, 0:21].astype(float)
    return cloud_of_grid(now(), GridSurvey(np.stack([x, y, np.zeros_like(x)], axis=-1)))


def poses(*places):
    each = [Pose(position=Point(x=x, y=y, z=z), orientation=Quaternion(w=1.0)) for x, y, z in places]
    return PoseArray(header=now(), poses=each)


def square(low, high):
    corners = [Point32(x=float(x), y=float(y)) for x, y in ((low, low), (high, low), (high, high), (low, high))]
    return PolygonStamped(header=now(), polygon=Polygon(points=corners))


def level(peer):
    return newest_value(peer, "level")


def evident(peer):
    """Return the alert level by the newest evidence alone."""
    return newest_value(peer, "evident")


def newest_value(peer, key):
    received = peer.received["alerts"]
    return healths_of(received[-1])[0].values[key] if received else None


def wait_for_alarm(peer, sounds):
    """Spin until the newest `alarm` is `sounds`; the alarm is a separate topic, so it may come after the alert."""
    peer.wait(lambda: peer.received["alarm"] and peer.received["alarm"][-1].data is sounds, f"the alarm to be {sounds}")


def acknowledge_by_program(*words, meanwhile=lambda until: until()):
    """Acknowledge as a person at a terminal does; return the exit code and the output of the program.

    meanwhile : called with a condition that is true as soon as the program has ended
    """
    command = [sys.executable, "-m", "rpf3d_ros.nodes.acknowledge", *words]
    program = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=ROOT)
    try:
        meanwhile(lambda: program.poll() is not None)
        said, _ = program.communicate(timeout=PATIENCE)
    finally:
        program.kill()
    return program.returncode, said


def keep_saying(peer, message, condition, what):
    """Publish the sources `message()` repeatedly, as a radar does, until `condition()` is true; return this value."""
    said = [0.0]

    def found():
        if time.monotonic() - said[0] > 0.5:
            peer.send("sources", message())
            said[0] = time.monotonic()
        return condition()

    return peer.wait(found, what)


@pytest.mark.long
def test_an_alert_goes_up_at_once_down_by_acknowledgement_and_its_log_is_reproduced(stage, tmp_path):
    (tmp_path / "site.yaml").write_text(SITE)
    log = tmp_path / "decisions"
    stage.node("simulator_node", site_file=str(tmp_path / "site.yaml"), decision_log=str(log), **FLIGHT)
    topics = ("alerts", "alarm", "areas/outlines")
    peer = stage.peer(publishes=("terrain/points", "sources", "areas/polygon"), subscribes=topics)
    peer.wait_for_subscribers()
    peer.wait(lambda: level(peer) == "fault", "a fault, because nothing has been received yet")
    wait_for_alarm(peer, True)
    peer.send("terrain/points", cloud())
    peer.send("areas/polygon", square(9.0, 12.0))
    keep_saying(peer, poses, lambda: level(peer) == "normal", "normal, for nothing is seen")
    wait_for_alarm(peer, False)
    peer.wait(lambda: peer.received["areas/outlines"], "where the area lies")
    ((line,), _) = outlines_of_markers(peer.received["areas/outlines"][-1], MapFrame())["areas/live_area"]
    assert (line.min(axis=0), line.max(axis=0)) == (pytest.approx([9.0, 9.0, 0.0]), pytest.approx([12.0, 12.0, 0.0]))
    rock = lambda: poses((10.3, 10.4, 5.0))  # noqa: E731
    keep_saying(peer, rock, lambda: level(peer) == "evacuate", "an evacuation")
    wait_for_alarm(peer, True)
    keep_saying(peer, poses, lambda: len(peer.received["alerts"]) > 20 or time.sleep(0.05), "more decisions")
    assert level(peer) == "evacuate", "nobody has acknowledged"
    nobody = acknowledge_as(peer, "")
    assert not nobody.success and "name" in nobody.message and "NAME: REASON" in nobody.message
    keep_saying(peer, poses, lambda: evident(peer) == "normal", "a decision on the evidence that nothing is seen")
    code, said = acknowledge_by_program(
        "A. Foreman", "the slope was inspected", "--patience", "60",
        meanwhile=lambda until: keep_saying(peer, poses, until, "the program to end"),
    )  # fmt: skip
    assert code == NOT_YET or (code, said) == (0, "A. Foreman: the level is normal\n"), said
    keep_saying(peer, poses, lambda: level(peer) == "normal", "normal")
    peer.wait(lambda: level(peer) == "fault", "a fault, for the sources are stale")
    assert stage.clear() == [0], stage.output("simulator_node")
    for array in peer.received["alerts"]:
        site, area = alerts_of(array)  # the only area determines the level of the site
        assert (site.area, area.area) == (None, "live_area")
        assert (area.state, area.health.level) == (site.state, site.health.level)
    audit = audit_log(log)
    assert audit.sound and audit.decisions > 5 and audit.refused == 1
    lines = [line for path in log.glob("*.jsonl") for line in path.read_text().splitlines()]
    assert all(json.loads(line) for line in lines)
    assert any("A. Foreman" in line for line in lines)


@pytest.mark.long
@pytest.mark.parametrize("transition", ["TRANSITION_DEACTIVATE", "TRANSITION_ACTIVE_SHUTDOWN"])
def test_a_node_that_is_no_longer_active_leaves_the_alarm_on_for_who_comes_later_too(stage, tmp_path, transition):
    (tmp_path / "site.yaml").write_text(SITE)
    stage.node("simulator_node", site_file=str(tmp_path / "site.yaml"), **FLIGHT)
    peer = stage.peer(publishes=("terrain/points", "sources", "areas/polygon"), subscribes=("alerts", "alarm"))
    peer.wait_for_subscribers()
    peer.send("terrain/points", cloud())
    peer.send("areas/polygon", square(9.0, 12.0))
    keep_saying(peer, poses, lambda: level(peer) == "normal", "normal, for nothing is seen")
    wait_for_alarm(peer, False)
    request = ChangeState.Request(transition=Transition(id=getattr(Transition, transition)))
    assert peer.call(ChangeState, f"{NODE}/change_state", request).success
    wait_for_alarm(peer, True)
    peer.wait(lambda: level(peer) == "fault", "a fault, for nobody decides any more")
    late = stage.peer(subscribes=("alerts", "alarm"))
    wait_for_alarm(late, True)
    late.wait(lambda: level(late) == "fault", "the same for who comes late")


def test_there_is_always_a_decision_that_is_valid(stage, tmp_path):
    (tmp_path / "site.yaml").write_text(SITE)
    stage.node("simulator_node", site_file=str(tmp_path / "site.yaml"), **FLIGHT)
    peer = stage.live_peer()  # the peer's queue is deep, so that the peer misses no alert
    numbers = lambda: {int(of["decided_at_ns"]) for of in map(values_of, peer.alerts)}  # noqa: E731
    peer.wait(lambda: len(numbers()) >= 4, "decisions that follow each other without any news")
    late = lambda: {p.key: float(p.value) for p in peer.health[f"{NODE}: executor"].values}["longest_gap_ms"]  # noqa: E731
    peer.wait(lambda: f"{NODE}: executor" in peer.health, "how late the node's own timers were")
    for one, after in pairwise(map(values_of, peer.alerts)):
        assert int(after["decided_at_ns"]) < int(one["valid_until_ns"]) + round(1e6 * late())


def values_of(array):
    """Return key -> value of the site in a message of alerts."""
    return {pair.key: pair.value for pair in array.status[0].values}


@pytest.mark.long
def test_without_a_site_file_there_are_no_alerts_and_acknowledging_says_so(stage):
    stage.node("simulator_node", **{**FLIGHT, "engine": "reference"})
    peer = stage.peer(subscribes=("alerts",))
    peer.wait_for_health(f"{NODE}: lifecycle", "active")
    answer = acknowledge_as(peer, "A. Foreman: inspected")
    assert not answer.success and "site_file" in answer.message
    code, said = acknowledge_by_program("A. Foreman", "inspected", "--patience", "60")
    assert code == 1 and said.startswith("not lowered: no site_file is set"), said
    assert not peer.received["alerts"]


def test_who_acknowledges_nobody_or_nothing_is_told_so_with_exit_code_2(stage):
    stage.peer()  # the domain of this test contains no simulator
    code, said = acknowledge_by_program("A. Foreman", "inspected", "--patience", "0.5")
    assert code == 2 and "/rpf3d_simulator does not answer" in said and "Traceback" not in said
    for words, sentence in ((("A. Foreman", " "), "empty"), (("A: Foreman", "inspected"), "colon"), ((), "required")):
        code, said = acknowledge_by_program(*words)
        assert code == 2 and sentence in said, said
