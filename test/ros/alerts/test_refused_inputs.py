"""Tests that a refused message is a fault until its topic publishes a valid message, whatever the evidence shows."""

from functools import partial

import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import EVACUATE, NORMAL, NOW, S, evidence, site

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.site_model import AcknowledgeSpec
from rpf3d_ros.alerts.alert_desk import AlertDesk
from rpf3d_ros.alerts.refused_inputs import RefusedInputs
from rpf3d_ros.alerts.standing_faults import StandingFaults

wait = partial(wait_for, seconds=20.0, pause=0.002)

RADAR, OTHER, SILENCE = "sources", "source_cloud", 30.0


class Reports:
    """Keeps the alerts and other reports of a desk."""

    def __init__(self):
        self.alerts, self.ignored = [], []

    def decided(self, alert, evidence):
        self.alerts.append(alert)

    def __getattr__(self, name):
        return lambda *given: self.ignored.append(name)


@pytest.fixture
def refused():
    """Return a `RefusedInputs` and the standing faults that it reports."""
    faults = StandingFaults(lambda: None)
    return RefusedInputs(faults.report, SILENCE), faults


def by_one_who_sees(faults, inputs):
    """Return a function of a person's name and a time that acknowledges the faults which are shown then."""
    return lambda by, now: inputs.acknowledged(by, now, faults.sentences)


def test_a_refusal_stands_until_a_message_of_the_same_topic_is_understood(refused):
    inputs, faults = refused
    inputs.refused(RADAR, "frame_id is 'radar'", at=0.0)
    assert "sources was refused (frame_id is 'radar')" in faults.sentences[0]
    inputs.understood(OTHER, lambda: 1, SILENCE + 1.0, is_whole=False)
    assert len(faults.sentences) == 1
    inputs.understood(RADAR, lambda: 1, SILENCE + 1.0, is_whole=False)
    assert faults.sentences == ()


def test_a_message_about_another_wall_does_not_make_good_a_refused_one(refused):
    """A radar may report one wall after another; the refused message may be the only one about a dangerous wall."""
    inputs, faults = refused
    for at in range(0, 60, 2):
        inputs.refused(RADAR, "pose 0 is not finite", at=at)
        inputs.understood(RADAR, lambda: 1, at + 1.0, is_whole=False)
        assert len(faults.sentences) == 1
    inputs.understood(RADAR, lambda: 1, 58.0 + SILENCE, is_whole=False)
    assert len(faults.sentences) == 1
    inputs.understood(RADAR, lambda: 1, 58.1 + SILENCE, is_whole=False)
    assert faults.sentences == ()


def test_a_person_who_looked_ends_a_refusal_after_a_message_was_understood(refused):
    inputs, faults = refused
    acknowledged = by_one_who_sees(faults, inputs)
    inputs.refused(RADAR, "pose 0 is not finite", at=0.0)
    assert acknowledged("A. Shift", 1.0) == ()
    inputs.understood(RADAR, lambda: 2, 2.0, is_whole=False)
    assert acknowledged("A. Shift", 3.0) == (), "another program may have sent the understood message"
    inputs.understood(RADAR, lambda: 1, 4.0, is_whole=False)
    assert "may have reported other sources" in faults.sentences[0]
    assert acknowledged("A. Shift", 5.0) == (RADAR,)
    assert faults.sentences == ()
    inputs.refused(RADAR, "pose 0 is not finite", at=6.0)
    assert acknowledged("A. Shift", 7.0) == (), "nothing was understood since"


def test_a_person_ends_no_refusal_that_is_not_shown_yet(refused):
    inputs, faults = refused
    inputs.refused(RADAR, "pose 0 is not finite", at=0.0)
    first = faults.sentences
    assert inputs.acknowledged("A. Shift", SILENCE + 1.0, shown=()) == ()
    inputs.understood(RADAR, lambda: 1, 2.0, is_whole=False)
    assert inputs.acknowledged("A. Shift", 3.0, shown=first) == (), "the person does not know of unreported places"
    assert inputs.acknowledged("A. Shift", 4.0, shown=faults.sentences) == (RADAR,)


def test_a_message_of_areas_is_complete_and_ends_a_refusal_at_once(refused):
    inputs, faults = refused
    inputs.refused("areas/polygon", "two corners", at=0.0)
    inputs.understood("areas/polygon", lambda: 1, 0.1, is_whole=True)
    assert faults.sentences == ()


def test_a_flood_of_refused_messages_changes_what_must_be_remembered_once(refused):
    inputs, faults = refused
    for late in range(1, 4):
        inputs.refused(RADAR, f"its stamp is {late} s older", at=0.0)
    assert inputs.reasons == {RADAR: "its stamp is 1 s older"}
    assert "is 3 s older" in faults.sentences[0]


def test_where_two_speak_on_a_topic_no_message_of_it_ends_a_refusal(refused):
    inputs, faults = refused
    inputs.refused(RADAR, "its stamp is 0.300 s older", at=0.0)
    inputs.understood(RADAR, lambda: 2, SILENCE + 1.0, is_whole=False)
    assert len(faults.sentences) == 1
    inputs.understood(RADAR, lambda: 1, SILENCE + 1.0, is_whole=False)
    assert faults.sentences == ()


def test_a_person_ends_the_refusal_of_a_speaker_that_is_silent_since_and_of_no_other(refused):
    inputs, faults = refused
    acknowledged = by_one_who_sees(faults, inputs)
    inputs.refused(RADAR, "pose 0 is not finite", at=0.0)
    inputs.refused(OTHER, "frame_id is ''", at=20.0)
    assert acknowledged("A. Shift", SILENCE) == ()
    assert acknowledged("A. Shift", SILENCE + 1.0) == (RADAR,)
    assert len(faults.sentences) == 1 and OTHER in faults.sentences[0]
    assert inputs.reasons == {OTHER: "frame_id is ''"}


def test_where_the_site_demands_two_persons_two_end_the_refusal_of_what_both_saw_silent():
    faults, late = StandingFaults(lambda: None), SILENCE + 1.0
    inputs = RefusedInputs(faults.report, SILENCE, AcknowledgeSpec(persons=2, within_s=100.0))
    acknowledged = by_one_who_sees(faults, inputs)
    inputs.refused(RADAR, "pose 0 is not finite", at=0.0)
    inputs.refused(OTHER, "frame_id is ''", at=10.0)
    assert acknowledged("A. Shift", late) == acknowledged("a shift", late + 1.0) == ()
    assert acknowledged("B. Survey", late + 102.0) == (), "too late"
    assert acknowledged("A. Shift", late + 103.0) == (RADAR, OTHER)
    inputs.refused(RADAR, "pose 0 is not finite", at=0.0)
    assert acknowledged("A. Shift", late) == ()
    inputs.refused(OTHER, "frame_id is ''", at=5.0)
    assert acknowledged("B. Survey", late) == (), "a later message is refused"
    assert acknowledged("A. Shift", late + 5.0) == (RADAR,), "B has not seen the other topic silent"


def test_standing_faults_change_only_when_a_sentence_does():
    changes = []
    faults = StandingFaults(lambda: changes.append(faults.sentences))
    for sentence in ("one", "one", "two", "", ""):
        faults.report("cause", sentence)
    assert changes == [("one",), ("two",), ()]
    faults.settle("another")
    assert len(changes) == 3


def test_a_standing_fault_is_decided_on_at_once_and_its_end_too_and_the_log_is_reproduced(tmp_path):
    reports = Reports()
    desk = AlertDesk(site(), DecisionLog(tmp_path, "0.1.0"), lambda: NOW, reports)
    desk.decide_on("wall", evidence(), RADAR)
    assert wait(lambda: reports.alerts)[-1].level == Level.NORMAL
    desk.standing.report("refused: sources", "a message on sources was refused")
    assert wait(lambda: len(reports.alerts) == 2 and reports.alerts)[-1].faults == ("a message on sources was refused",)
    assert reports.alerts[-1].level == Level.FAULT and reports.alerts[-1].alarm
    desk.standing.settle("refused: sources")
    assert wait(lambda: len(reports.alerts) == 3 and reports.alerts)[-1].level == Level.NORMAL
    assert desk.close(20.0)
    audit = audit_log(tmp_path)
    assert audit.sound and audit.reproduced == 3


def test_a_standing_fault_lets_no_acknowledgement_lower_the_level_and_hides_no_evacuation():
    reports = Reports()
    desk = AlertDesk(site(), None, lambda: NOW, reports)
    desk.decide_on("wall", EVACUATE, RADAR)
    desk.standing.report("cause", "not understood")
    desk.decide_on("wall", NORMAL._replace(trigger_stamp_ns=NOW - S), RADAR)
    wait(lambda: reports.alerts and reports.alerts[-1].evident == Level.NORMAL)
    assert (reports.alerts[-1].level, reports.alerts[-1].faults) == (Level.EVACUATE, ("not understood",))
    replies = []
    desk.acknowledge("J. Meyer", "looks quiet", replies.append)
    assert wait(lambda: replies)[0][0] is False
    assert desk.close(20.0)
