"""Tests that the contact of an alarm bridge is closed only while alerts are fresh and valid and agree with `alarm`."""

import errno
import os
import queue
import signal
import socket
import subprocess
import sys
import time
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from programs.waiting import wait_for

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from live_sites.alert_evidence import NOW, S, decided, evidence
from std_msgs.msg import Header

from rpf3d_ros.alerts.alarm_state import NOTHING_YET, AlarmState, HeardAlert, heard_alert
from rpf3d_ros.messages.alert_messages import Publication, alerts_message
from rpf3d_ros.messages.alert_reading import alerts_of
from rpf3d_ros.messages.stamps import nanoseconds_of_text, seconds_text
from rpf3d_ros.nodes import alarm_contacts
from rpf3d_ros.nodes.alarm_bridge import put_newest
from rpf3d_ros.nodes.alarm_contacts import FileContact, TcpContact, Wanted, is_closed, line_says_closed

STALE = 3.0
CALM = HeardAlert(sequence=1, stamp_ns=0, until_ns=0, is_alarm=False, level="normal", run="a1")
wait = partial(wait_for, seconds=20.0, pause=0.01)


def at(moment, sequence, **facts):
    """Return a calm alert that is published at the steady time `moment` (s) and is valid for 9 s.

    sequence : number of the publication; facts : fields of the alert that differ from CALM
    """
    stamp = clock(moment)
    return CALM._replace(**{"sequence": sequence, "stamp_ns": stamp, "until_ns": stamp + 9 * S, **facts})


def clock(moment):
    """Return the time (ns) that the bridge's clock shows at a steady time (s); the clock shows NOW at 100 s."""
    return NOW + round((moment - 100.0) * S)


def why_open(state, moment, ahead=0.0):
    """Return the reason why the contact is open at a steady time (s), or "" if it is closed.

    ahead : how far (s) the clock of the bridge is ahead of the right time
    """
    return state.why_open(moment, clock(moment + ahead))


@pytest.fixture
def heard():
    """Return an `AlarmState` that has received two calm publications, at 100 and 101 s."""
    state = AlarmState(STALE)
    for sequence, moment in ((1, 100.0), (2, 101.0)):
        state.note_alarm(False, moment)
        state.note_alert(at(moment, sequence), moment)
    return state


def test_it_is_closed_while_all_is_fresh_and_calm_and_open_once_it_is_stale(heard):
    assert why_open(heard, 101.0) == why_open(heard, 104.0) == ""
    assert "nothing has been received for 3.1 s" in why_open(heard, 104.1)


def test_one_message_alone_closes_nothing_because_it_may_be_a_latched_one():
    state = AlarmState(STALE)
    assert why_open(state, 100.0) == NOTHING_YET
    state.note_alarm(False, 100.0)
    assert why_open(state, 100.0) == NOTHING_YET
    state.note_alert(at(100.0, 1), 100.0)
    assert "two alerts in a row" in why_open(state, 100.0)


@pytest.mark.parametrize("wrong", [{"sequence": 2}, {"sequence": 1}, {"sequence": 9, "run": "b2"}])
def test_a_number_that_does_not_rise_or_another_run_opens_it_until_all_come_from_one_run_for_long_enough(heard, wrong):
    heard.note_alert(at(102.0, **{"sequence": 3, **wrong}), 102.0)
    assert "alerts are repeated, two programs" in why_open(heard, 102.0)
    for step in range(1, 5):
        heard.note_alarm(False, 102.0 + step)
        heard.note_alert(at(102.0 + step, **{"run": "a1", **wrong, "sequence": 10 + step}), 102.0 + step)
        assert bool(why_open(heard, 102.0 + step)) is (step < STALE)


def test_two_programs_by_turns_never_close_it(heard):
    for step in range(1, 40):
        moment = 101.0 + 0.5 * step
        heard.note_alarm(False, moment)
        heard.note_alert(at(moment, 100 + step, run="ab"[step // 2 % 2]), moment)
        assert step < 2 or why_open(heard, moment)


def test_a_missed_publication_does_not(heard):
    heard.note_alert(at(102.0, 9), 102.0)
    assert why_open(heard, 102.0) == ""


@pytest.mark.parametrize(("facts", "sentence"), [
    ({"is_alarm": True, "level": "restrict"}, "the alarm sounds, the level is restrict"),
    ({"level": "fault"}, "the level is fault"),
    ({"until_ns": 0}, "no longer valid"),
])  # fmt: skip
def test_an_alert_that_is_not_calm_opens_it(heard, facts, sentence):
    heard.note_alert(at(102.0, 3, **facts), 102.0)
    assert sentence in why_open(heard, 102.0)


def test_an_alarm_opens_it_whatever_the_last_alert_says_and_either_topic_may_be_stale(heard):
    heard.note_alarm(True, 102.0)
    assert why_open(heard, 102.0) == "the alarm sounds"
    heard.note_alarm(False, 104.5)
    assert "nothing has been received" in why_open(heard, 104.5)


def test_recorded_alerts_close_nothing_because_their_validity_has_passed_by_the_clock_of_the_bridge():
    state = AlarmState(STALE)
    for sequence in (1, 2, 3):
        moment = 140.0 + sequence
        state.note_alarm(False, moment)
        state.note_alert(at(moment - 40.0, sequence), moment)
        assert why_open(state, moment)
    assert "expired 31.0 s ago" in why_open(state, 143.0)


@pytest.mark.parametrize(("ahead", "sentence"), [
    (0.9, ""), (-0.9, ""), (10.5, "expired 1.5 s ago"), (-1.5, "published 1.5 s in the future"),
])  # fmt: skip
def test_the_clock_of_the_bridge_may_differ_by_the_stated_time(heard, ahead, sentence):
    assert sentence in why_open(heard, 101.0, ahead) and bool(why_open(heard, 101.0, ahead)) is bool(sentence)


@pytest.mark.parametrize(("alarm", "alerts", "sentence"), [
    (["/sim"], ["/sim"], ""), ([], [], ""),
    (["/sim"], ["/sim", "/bag"], "2 programs publish alerts (/bag, /sim)"),
    (["/sim", "/sim"], ["/sim"], "2 programs publish alarm (/sim, /sim)"),
    (["/sim"], ["/bag"], "different nodes: /bag, /sim"),
])  # fmt: skip
def test_more_than_one_publisher_opens_it_as_long_as_it_is_there(heard, alarm, alerts, sentence):
    heard.note_publishers({"alarm": alarm, "alerts": alerts})
    assert sentence in why_open(heard, 101.0) and bool(why_open(heard, 101.0)) is bool(sentence)
    heard.note_publishers({"alarm": ["/sim"], "alerts": ["/sim"]})
    assert why_open(heard, 101.0) == ""


def test_a_publisher_that_was_lost_opens_it_until_two_more_publications(heard):
    heard.note_lost("the simulator has ended or does not respond")
    assert why_open(heard, 101.0) == "the simulator has ended or does not respond"
    heard.note_alert(at(102.0, 3), 102.0)
    assert why_open(heard, 102.0)
    heard.note_alert(at(103.0, 4), 103.0)
    assert why_open(heard, 103.0) == ""


def received(publication):
    alert = decided(evidence())
    return heard_alert(alerts_of(alerts_message(Header(), alert, 7, publication)))


def test_an_alert_has_its_number_its_run_its_time_and_how_long_it_is_valid():
    found = received(Publication(sequence=12, at_ns=NOW + S, run="a1"))
    assert found == CALM._replace(sequence=12, stamp_ns=NOW + S, until_ns=NOW + 10 * S)
    assert found.left_s == 9.0
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
from rpf3d_ros.nodes import alarm_contacts
from rpf3d_ros.nodes.alarm_contacts import FileContact, is_closed
contact = FileContact(Path(sys.argv[1]))
while True:
    contact.set(True)
    time.sleep(0.02)
    if is_closed(Path(sys.argv[1])):
        print("held", flush=True)
"""


@pytest.fixture
def holder(tmp_path):
    """Yield a process that keeps the file contact closed, and the path of the file."""
    path = tmp_path / "contact"
    assert not is_closed(path)
    process = subprocess.Popen([sys.executable, "-c", HOLD, str(path)], stdout=subprocess.PIPE)
    try:
        assert process.stdout.readline() == b"held\n"
        yield process, path
    finally:
        process.kill()
        process.wait()


def test_a_dry_contact_opens_when_its_process_is_killed(holder):
    process, path = holder
    process.kill()
    process.wait()
    assert path.read_bytes().startswith(b"closed\n") and not is_closed(path), "the word alone would lie"


def test_a_reader_who_checks_the_time_sees_a_stopped_process_as_open(holder):
    process, path = holder
    process.send_signal(signal.SIGSTOP)
    wait(lambda: not is_closed(path))
    assert path.read_bytes().startswith(b"closed\n"), "the word and the lock alone would lie"
    process.send_signal(signal.SIGCONT)
    wait(lambda: is_closed(path))


def held(contact, closed, path):
    """Call `contact.set(closed)` repeatedly, as the bridge does, until the file `path` shows this state."""

    def has_state():
        contact.set(closed)
        return is_closed(path) is closed

    wait(has_state)


def test_a_dry_contact_opens_and_closes(tmp_path):
    contact = FileContact(tmp_path / "contact")
    for closed in (True, True, False, False, True):
        held(contact, closed, tmp_path / "contact")
    contact.close()
    assert not is_closed(tmp_path / "contact")
    assert (tmp_path / "contact").read_bytes().startswith(b"open\n")


def test_a_contact_opens_by_itself_if_the_bridge_looks_no_more(tmp_path):
    file, tcp = FileContact(tmp_path / "contact"), TcpContact(0)
    with socket.create_connection(("127.0.0.1", tcp.port), timeout=60.0) as client:
        lines = client.makefile("rb")
        held(file, True, tmp_path / "contact")
        tcp.set(True)
        wait(lambda: line_says_closed(lines.readline()))
        wait(lambda: not line_says_closed(lines.readline()))
        wait(lambda: (tmp_path / "contact").read_bytes().startswith(b"open\n"))
    file.close()
    tcp.close()


def test_a_contact_that_opened_by_itself_waits_for_the_next_state(monkeypatch):
    """The contact stays open until the bridge sets a state again, so a thread that asks for the state must wait."""
    wanted = Wanted()
    wanted.set(True)
    monkeypatch.setattr(alarm_contacts, "LOOKED", -1.0)
    assert not wanted.is_closed
    began = time.monotonic()
    wanted.wait_unless(False, 0.2)
    assert time.monotonic() - began >= 0.2


@pytest.mark.parametrize(("content", "says"), [
    (b"closed\nvalid_until %.3f\n", True), (b"open\n\n\nvalid_until %.3f\n", False), (b"closed\n", False),
    (b"closed\nvalid_until nan\n", False), (b"closed\nvalid_until soon\n", False),
])  # fmt: skip
def test_a_dry_contact_is_closed_only_by_its_word_and_within_its_time(content, says):
    for left, is_within in ((1.0, True), (-0.1, False), (5.0, False)):
        filled = content % (time.time() + left) if b"%" in content else content
        assert alarm_contacts._says_closed(filled) is (says and is_within)


def test_two_bridges_cannot_have_one_file(tmp_path):
    contact = FileContact(tmp_path / "contact")
    with pytest.raises(OSError, match="another alarm bridge uses"):
        FileContact(tmp_path / "contact")
    contact.close()
    FileContact(tmp_path / "contact").close()


FILLED = """
import os, sys
from rpf3d_ros.nodes.free_output import free_output
with free_output():
    for _ in range(100):
        try:
            os.write(2, b"x" * 4096)
        except BlockingIOError:
            pass
    open(sys.argv[-1], "w").write("it went on")
"""


def test_a_reader_of_the_output_that_hangs_stops_no_program(tmp_path):
    reading, writing = os.pipe()
    process = subprocess.Popen([sys.executable, "-c", FILLED, str(tmp_path / "went")], stderr=writing)
    try:
        wait(lambda: (tmp_path / "went").exists() and (tmp_path / "went").read_text())
    finally:
        process.kill()
        process.wait()
        os.close(reading)
        os.close(writing)


def test_output_that_is_read_comes_whole_also_at_the_end():
    said = "from rpf3d_ros.nodes.free_output import free_output\nwith free_output():\n    print('one')\nprint('two')"
    assert subprocess.run([sys.executable, "-c", said], capture_output=True, text=True).stdout == "one\ntwo\n"


def test_a_tcp_contact_says_its_state_at_once_at_each_change_and_again_and_again():
    contact = TcpContact(0)

    def line_of(closed):
        contact.set(closed)
        return lines.readline()

    with socket.create_connection(("127.0.0.1", contact.port), timeout=60.0) as client:
        lines = client.makefile("rb")
        assert lines.readline().startswith(b"open ")
        wait(lambda: line_says_closed(line_of(True)))
        assert line_says_closed(line_of(True))
        wait(lambda: line_of(False).startswith(b"open "))
        contact.close()
        while lines.readline():
            pass


def test_a_line_that_waited_in_a_buffer_closes_nothing(monkeypatch):
    """A program that reads one line each second falls behind: its lines are old, whatever word they have."""
    contact, heard = TcpContact(0), [b""]

    def is_heard():
        contact.set(True)
        heard[0] = lines.readline()
        return heard[0].startswith(b"closed ")

    with socket.create_connection(("127.0.0.1", contact.port), timeout=60.0) as client:
        lines = client.makefile("rb")
        wait(is_heard)
    contact.close()
    said = float(heard[0].split()[1])
    for late, expected in ((0.1, False), (-alarm_contacts.VALID - 0.1, False), (-0.1, True)):
        monkeypatch.setattr(alarm_contacts, "time", SimpleNamespace(time=lambda late=late: said + late))
        assert line_says_closed(heard[0]) == expected


def test_a_state_that_is_read_at_once_is_never_valid_for_too_long(monkeypatch):
    for now in np.random.default_rng(1).uniform(1.7e9, 1.9e9, 1000):
        monkeypatch.setattr(alarm_contacts, "time", SimpleNamespace(time=lambda now=now: now))
        assert line_says_closed(alarm_contacts._line(True, alarm_contacts._until()))


@pytest.mark.parametrize("line", [b"", b"closed\n", b"closed nan\n", b"closed x\n", b"open 1.0\n"])
def test_a_line_without_a_time_closes_nothing(line):
    assert not line_says_closed(line)


def test_a_program_that_falls_behind_reads_closed_no_longer_than_a_line_is_valid(monkeypatch):
    """Nine lines wait; as soon as VALID has passed since the contact opened, none of them says `closed`."""
    contact = TcpContact(0)
    with socket.create_connection(("127.0.0.1", contact.port), timeout=60.0) as client:
        lines = client.makefile("rb", buffering=0)
        until = time.monotonic() + 4.0
        while time.monotonic() < until:  # nothing is read meanwhile: at least eight lines wait
            contact.set(True)
            time.sleep(0.05)
        contact.set(False)
        opened = time.time()
        waiting = [lines.readline() for _ in range(9)]
        while not waiting[-1].startswith(b"open "):
            waiting.append(lines.readline())
    contact.close()
    assert sum(line.startswith(b"closed ") for line in waiting) >= 6
    now = opened + alarm_contacts.VALID + 0.001
    monkeypatch.setattr(alarm_contacts, "time", SimpleNamespace(time=lambda: now))
    assert not any(line_says_closed(line) for line in waiting)


def test_the_state_in_a_file_was_read_after_the_time_in_it(monkeypatch, tmp_path):
    times, read_at, path = iter(range(1_000_000)), [], tmp_path / "contact"
    monkeypatch.setattr(alarm_contacts, "_until", lambda: next(times))
    monkeypatch.setattr(Wanted, "is_closed", property(lambda self: read_at.append(next(times)) or False))
    contact = FileContact(path)
    wait(lambda: float(path.read_bytes().split()[-1]) > 0.0)  # the first time is that of the start
    written = float(path.read_bytes().split()[-1])
    contact.close()
    assert written < read_at[0]


def test_the_state_in_a_line_was_read_after_the_time_in_it(monkeypatch):
    """If the process is stopped between both, the line is old when it is sent."""
    times = iter(range(1_000_000))
    read_at = []
    contact = TcpContact(0)
    monkeypatch.setattr(alarm_contacts, "_until", lambda: next(times))
    monkeypatch.setattr(Wanted, "is_closed", property(lambda self: read_at.append(next(times)) or False))
    with socket.create_connection(("127.0.0.1", contact.port), timeout=60.0) as client:
        line = client.makefile("rb").readline()
    contact.close()
    assert float(line.split()[1]) < read_at[0]


@pytest.mark.parametrize("error", [OSError(errno.EMFILE, "too many open files"), RuntimeError("no new thread")])
def test_a_tcp_contact_accepts_again_after_an_error(error):
    contact, errors = TcpContact(0), [error]
    server = contact._server

    def accept():
        if errors:
            raise errors.pop()
        return server.accept()

    contact._server = SimpleNamespace(accept=accept, shutdown=server.shutdown, close=server.close)
    for _ in range(2):  # a call of `accept` that began earlier takes the first client
        with socket.create_connection(("127.0.0.1", contact.port), timeout=60.0) as client:
            assert client.makefile().readline().startswith("open ")
    assert not errors
    contact.close()


def test_of_too_many_reports_the_oldest_is_dropped():
    reports = queue.Queue(2)
    for report in ("closed", "open: the level is fault", "closed again"):
        put_newest(reports, report)
    assert [reports.get_nowait() for _ in range(2)] == ["open: the level is fault", "closed again"]
