"""Tests that a connected publisher of areas from which the node received no message becomes a fault.

An example is a latched outline from before the node's first start: the node subscribes without durability, so it never
receives this outline.
"""

from dataclasses import replace

import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

import numpy as np
from never_green import combination, pit
from never_green.combination import Run, configuration_of, site_values
from never_green.dry_node import DryNode
from never_green.plan import Plan, Send, Speaker, Truth
from never_green.stories import MAX_AGE, RADAR_A, survey

from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.site_model import Thresholds
from rpf3d_ros.nodes.inputs import Inputs

TRUTH = Truth(sources=(), bank_until=np.inf, areas=(pit.outline(pit.ROAD),) * 2, area_since=0.0)
MACHINES = "areas/equipment"
MUTE = f"{MACHINES} has had a publisher (/speaker_0) for more than 5 s, but no valid message has been received"
WHOLE = Send(sent=0.1, at=0.1, topic="terrain/points", kind="grid", places=survey(TRUTH, 0.1))
ROAD = Send(sent=0.2, at=0.2, topic="areas/polygon", kind="polygon", places=pit.outline(pit.ROAD))
QUIET = Send(sent=0.3, at=0.3, topic=RADAR_A, kind="poses", places=np.empty((0, 3)))
MACHINE = Send(sent=0.2, at=0.2, topic=MACHINES, kind="poses", places=pit.placed(48.0, 20.0, 0.0)[None])
NONE = MACHINE._replace(places=np.empty((0, 3)))


class Mine:
    """A node whose site file has the area `live_area` and a pattern, with a connected publisher of machines."""

    def __init__(self, monkeypatch, pattern, since=0.0, until=np.inf):
        topics = (RADAR_A, "terrain/points", "areas/polygon")
        machines = Speaker(topic=MACHINES, number=0, since=since, until=until)
        self.plan = Plan(
            truth=TRUTH, sends=(), speakers=(*(Speaker(topic=each, number=0) for each in topics), machines),
            sensors=(RADAR_A,), limits="restrict", expects=False, restart_at=1e6,
        )  # fmt: skip
        self.pattern = pattern
        monkeypatch.setattr(combination, "configuration_of", self._configured)
        self.run, self.at = Run(self.plan), 0.0

    def _configured(self, plan):
        made = configuration_of(plan)
        if self.pattern is None:
            return replace(made, thresholds=None)
        values = site_values("restrict", has_machines=False)
        areas = {**values["areas"], self.pattern: values["areas"]["live_area"]}
        return replace(made, thresholds=Thresholds.model_validate({**values, "areas": areas}))

    def send(self, *sends):
        """Send messages, one every 0.1 s; return the faults of the last alert."""
        for send in sends:
            self.at += 0.1
            self.run.deliver(send._replace(sent=self.at, at=self.at))
            self.run.node.tick()
        return self.alert.faults

    def stay_quiet(self, seconds):
        """Let the radar see nothing for some seconds; return the faults of the last alert."""
        until = self.at + seconds
        while self.at < until:
            self.send(QUIET)
        return self.alert.faults

    @property
    def alert(self):
        return self.run.node.station.desk.alert

    def pause(self):
        """Deactivate the node, and activate it again, with new subscriptions."""
        node = self.run.node
        node.inputs.close()
        node.station.deactivate()
        node.inputs = Inputs(node.ros, configuration_of(self.plan).parameters, node.station, node.health,
                             node._notice_jump)  # fmt: skip
        node.station.activate()
        node.settle()


@pytest.fixture
def start(monkeypatch):
    """Yield a function that starts a `Mine`; close the last node afterwards."""
    mines = []

    def started(pattern="equipment*", **speaker):
        mines.append(Mine(monkeypatch, pattern, **speaker))
        return mines[-1]

    yield started
    mines[-1].run.close()


@pytest.mark.parametrize("published", [MACHINE, NONE], ids=["a machine", "no machine"])
def test_a_connected_publisher_of_areas_that_was_never_received_is_a_fault_until_it_publishes(start, published):
    mine = start()
    assert mine.send(WHOLE, ROAD, QUIET) == ()
    assert mine.stay_quiet(MAX_AGE - 0.5) == () and mine.alert.level == Level.NORMAL, "as for a mute sensor"
    (fault,) = mine.stay_quiet(2.0)
    assert fault.startswith(MUTE) and "publish the area again" in fault and "an empty message if there is no" in fault
    assert mine.alert.level == Level.FAULT and mine.alert.alarm
    mine.send(published)
    assert mine.stay_quiet(2.0) == () and mine.alert.level == Level.NORMAL
    mine.send(WHOLE)
    assert mine.stay_quiet(MAX_AGE + 2.0) == (), "an area has no age limit"


def test_a_refused_message_of_an_area_does_not_end_the_fault_of_its_mute_topic(start):
    mine = start()
    mine.send(WHOLE, ROAD, MACHINE._replace(frame="truck"))
    assert any(fault.startswith(MUTE) for fault in mine.stay_quiet(MAX_AGE + 2.0))
    mine.send(MACHINE)
    assert mine.stay_quiet(2.0) == ()


def test_areas_without_limits_need_not_publish(start):
    mine = start(pattern="crusher*")
    mine.send(WHOLE, ROAD)
    assert mine.stay_quiet(MAX_AGE + 2.0) == ()


def test_the_time_counts_from_the_connection_and_the_fault_ends_some_time_after_the_publisher_has_gone(start):
    mine = start(since=3.0, until=9.5)
    mine.send(WHOLE, ROAD)
    assert mine.stay_quiet(3.0 + MAX_AGE - 0.5) == ()
    assert any(fault.startswith(MUTE) for fault in mine.stay_quiet(1.5))
    mine.send(WHOLE)
    mine.stay_quiet(MAX_AGE + 3.0)
    assert mine.alert.faults == ()


def test_a_publisher_of_areas_that_goes_in_time_is_no_fault(start):
    mine = start(until=2.0)
    mine.send(WHOLE, ROAD)
    assert mine.stay_quiet(MAX_AGE + 4.0) == ()


def test_after_a_pause_the_time_of_a_mute_topic_of_areas_begins_again(start):
    mine = start()
    mine.send(WHOLE, ROAD)
    assert any(fault.startswith(MUTE) for fault in mine.stay_quiet(MAX_AGE + 2.0))
    mine.pause()
    mine.send(WHOLE, ROAD, QUIET)
    assert mine.stay_quiet(2.0) == ()
    assert any(fault.startswith(MUTE) for fault in mine.stay_quiet(MAX_AGE))
    mine.send(MACHINE)
    assert mine.stay_quiet(2.0) == ()


def test_after_a_restart_one_message_ends_both_faults_of_a_topic_that_had_an_area(start):
    mine = start()
    mine.send(WHOLE, ROAD, MACHINE)
    assert mine.stay_quiet(1.0) == ()
    mine.run.restart()
    mine.send(WHOLE, ROAD)
    faults = mine.stay_quiet(MAX_AGE + 2.0)
    assert any(fault.startswith(MUTE) for fault in faults)
    assert any(f"nothing has been received on {MACHINES} since the start" in fault for fault in faults)
    mine.send(MACHINE)
    assert mine.stay_quiet(2.0) == ()


def test_without_a_site_file_a_mute_topic_of_areas_changes_nothing(start, monkeypatch):
    monkeypatch.setattr(DryNode, "settle", lambda node: None)  # it waits for the alert desk, which needs a site file
    mine, reported = start(pattern=None), []
    node = mine.run.node
    monkeypatch.setattr(node.station, "report_fault", lambda cause, sentence: reported.append((cause, sentence)))
    for at in (1.0, MAX_AGE + 2.0, 1000.0):
        mine.run.at = at
        node.inputs.publishers.look()
    assert reported and not any(sentence for _, sentence in reported)
    assert not any(MACHINES in cause for cause, _ in reported if cause.startswith("mute"))
