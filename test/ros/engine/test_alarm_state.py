"""The contact of an alarm bridge is closed only on fresh, valid and agreeing alerts."""

import socket
import subprocess
import sys
from functools import partial

import pytest
from waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from alert_evidence import NOW, S, decided, evidence
from std_msgs.msg import Header

from rpf3d_ros.engine.alarm_state import NOTHING_YET, AlarmState, HeardAlert, heard_alert
from rpf3d_ros.messages.alert_messages import Publication, alerts_message
from rpf3d_ros.messages.alert_reading import alerts_of
from rpf3d_ros.messages.stamps import nanoseconds_of_text, seconds_text
from rpf3d_ros.nodes.alarm_contacts import FileContact, TcpContact, is_closed

STALE = 3.0
CALM = HeardAlert(sequence=1, left_s=9.0, is_alarm=False, level="normal")
wait = partial(wait_for, seconds=20.0, pause=0.01)


@pytest.fixture
def heard():
    """A state after two calm publications, at 100 and 101 s."""
    state = AlarmState(STALE)
    for sequence, at in ((1, 100.0), (2, 101.0)):
        state.note_alarm(False, at)
        state.note_alert(CALM._replace(sequence=sequence), at)
    return state


def test_it_is_closed_while_all_is_fresh_and_calm_and_open_once_it_is_stale(heard):
    assert heard.why_open(101.0) == heard.why_open(104.0) == ""
    assert "nothing has been received for 3.1 s" in heard.why_open(104.1)


def test_one_message_alone_closes_nothing_because_it_may_be_a_latched_one():
    state = AlarmState(STALE)
    assert state.why_open(0.0) == NOTHING_YET
    state.note_alarm(False, 0.0)
    assert state.why_open(0.0) == NOTHING_YET
    state.note_alert(CALM, 0.0)
    assert "two publications" in state.why_open(0.0)


@pytest.mark.parametrize("sequence", [2, 1])
def test_a_repeated_or_falling_number_opens_it(heard, sequence):
    heard.note_alert(CALM._replace(sequence=sequence), 102.0)
    assert "repeated, or of two programs" in heard.why_open(102.0)


def test_a_missed_publication_does_not(heard):
    heard.note_alert(CALM._replace(sequence=9), 102.0)
    assert heard.why_open(102.0) == ""


@pytest.mark.parametrize(("facts", "sentence"), [
    ({"is_alarm": True, "level": "restrict"}, "the alarm sounds, the level is restrict"),
    ({"level": "fault"}, "the level is fault"),
    ({"left_s": -1.0}, "no longer valid"),
])  # fmt: skip
def test_an_alert_that_is_not_calm_opens_it(heard, facts, sentence):
    heard.note_alert(CALM._replace(sequence=3, **facts), 102.0)
    assert sentence in heard.why_open(102.0)


def test_an_alarm_opens_it_whatever_the_last_alert_says_and_either_topic_may_be_stale(heard):
    heard.note_alarm(True, 102.0)
    assert "the alarm sounds" in heard.why_open(102.0)
    heard.note_alarm(False, 104.5)
    assert "nothing has been received" in heard.why_open(104.5)


def test_a_publisher_that_was_lost_opens_it_until_two_more_publications(heard):
    heard.note_lost("the simulator is not alive")
    assert heard.why_open(101.0) == "the simulator is not alive"
    heard.note_alert(CALM._replace(sequence=3), 102.0)
    assert heard.why_open(102.0)
    heard.note_alert(CALM._replace(sequence=4), 103.0)
    assert heard.why_open(103.0) == ""


def received(publication):
    alert = decided(evidence())
    return heard_alert(alerts_of(alerts_message(Header(), alert, 7, publication)))


def test_an_alert_has_its_number_its_time_and_how_long_it_is_valid():
    found = received(Publication(sequence=12, at_ns=NOW + S))
    assert found == HeardAlert(sequence=12, left_s=9.0, is_alarm=False, level="normal")
    assert received(None) is None, "of a program that gives no number"


@pytest.mark.parametrize("ns", [0, 1, -1, 1_500_000_001, NOW, 2**63 - 1, -(2**63)])
def test_a_time_comes_back_from_its_text_exactly(ns):
    assert nanoseconds_of_text(seconds_text(ns)) == ns


@pytest.mark.parametrize(
    "text", ["", "1", "1.5", "nan", "1e3.000000000", "٣.000000000", " 1.000000000", "1.0000000001"]
)
def test_any_other_text_is_no_time(text):
    assert nanoseconds_of_text(text) is None


HOLD = """
import sys, time
from pathlib import Path
from rpf3d_ros.nodes.alarm_contacts import FileContact
contact = FileContact(Path(sys.argv[1]))
contact.set(True)
print("held", flush=True)
time.sleep(60)
"""


def test_a_dry_contact_opens_when_its_process_is_killed(tmp_path):
    path = tmp_path / "contact"
    assert not is_closed(path)
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE)
    try:
        assert process.stdout.readline() == b"held\n"
        assert is_closed(path)
    finally:
        process.kill()
        process.wait()
    assert path.read_bytes() == b"closed\n" and not is_closed(path), "the word alone would lie"


def test_a_dry_contact_opens_and_closes(tmp_path):
    contact = FileContact(tmp_path / "contact")
    for closed in (True, True, False, False, True):
        contact.set(closed)
        assert is_closed(tmp_path / "contact") is closed
    contact.close()
    assert not is_closed(tmp_path / "contact")


def test_a_tcp_contact_says_its_state_at_once_at_each_change_and_again_and_again():
    contact = TcpContact(0)
    with socket.create_connection(("127.0.0.1", contact.port), timeout=60.0) as client:
        lines = client.makefile()
        assert lines.readline() == "open\n"
        contact.set(True)
        wait(lambda: lines.readline() == "closed\n")
        assert lines.readline() == "closed\n"
        contact.set(False)
        wait(lambda: lines.readline() == "open\n")
        contact.close()
        while lines.readline():
            pass
