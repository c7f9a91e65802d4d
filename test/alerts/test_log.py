"""Tests of the decision log: only whole lines, also after a kill, and a report if the disk is full."""

import errno
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from live_sites.alert_evidence import NORMAL, NOW, SHIFT, S, area, decided, evidence, later, logged_shift, site
from programs.command_line import ROOT, environment

from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Acknowledgement, Alert, Level
from rpf3d_core.alerts.lines import Decision, content_of
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.log_files import NotLogged, files_in


def contents(folder: Path) -> list[dict]:
    """Return the content of each line of a log; all lines must be valid."""
    lines = [raw for _, path in files_in(folder) for raw in path.read_bytes().splitlines(keepends=True)]
    assert all(raw.endswith(b"\n") for raw in lines)
    found = [content_of(raw) for raw in lines]
    assert None not in found
    return found


def kinds(folder: Path) -> list[str]:
    return [line["kind"] for line in contents(folder)]


def log_one_more(folder: Path, step: int = 100, **options: int) -> DecisionLog:
    """Open a log, add one decision after its last alert, and close the log; return it."""
    thresholds = site()
    with DecisionLog(folder, "0.2.0", **options) as log:
        now, answer = NOW + step * S, later(NORMAL, step)
        alert = decide(log.last_alert, answer, thresholds, now)
        log.decided(Decision(log.last_alert, answer, None, now, alert), thresholds)
    return log


def test_a_log_has_a_line_a_decision_and_the_thresholds_once(tmp_path: Path) -> None:
    logged_shift(tmp_path)
    assert kinds(tmp_path) == ["file", "site", *["decision"] * len(SHIFT)]
    lines = contents(tmp_path)
    assert [line["n"] for line in lines] == list(range(len(lines)))
    assert [line["before"] for line in lines[1:]] == [line["sha256"] for line in lines[:-1]]
    first = lines[2]
    assert (first["evidence"]["seed"], first["evidence"]["terrain_digest"], first["version"]) == (1, "7e" * 32, "0.1.0")
    assert lines[-2]["acknowledgement"]["by"] == "A. Shift"


def test_a_node_that_starts_again_goes_on_from_what_is_held(tmp_path: Path) -> None:
    thresholds = site()
    raised = decided(evidence(area(3000)), thresholds=thresholds)
    with DecisionLog(tmp_path, "0.1.0") as log:
        assert log.last_alert is None
        log.decided(Decision(None, evidence(area(3000)), None, NOW, raised), thresholds)
    with DecisionLog(tmp_path, "0.1.0") as log:
        assert log.last_alert == raised
        assert decide(log.last_alert, None, thresholds, NOW + S).level == Level.EVACUATE


def test_a_log_that_is_opened_again_continues_the_chain(tmp_path: Path) -> None:
    alerts = logged_shift(tmp_path)
    log = log_one_more(tmp_path)
    assert log.problems == ()
    lines = contents(tmp_path)
    assert lines[-1]["previous"]["at_ns"] == alerts[-1].at_ns
    assert lines[-1]["sha256"] == log.head
    assert audit_log(tmp_path).sound


def test_other_thresholds_are_written_before_the_decision_that_they_made(tmp_path: Path) -> None:
    logged_shift(tmp_path)
    other = site(fewest_rocks=2000)
    with DecisionLog(tmp_path, "0.1.0") as log:
        alert = decide(log.last_alert, NORMAL, other, NOW + 60 * S)
        log.decided(Decision(log.last_alert, NORMAL, None, NOW + 60 * S, alert), other)
    assert kinds(tmp_path)[-2:] == ["site", "decision"]
    assert audit_log(tmp_path).sound


def test_a_log_goes_on_in_the_next_file_when_one_is_large(tmp_path: Path) -> None:
    logged_shift(tmp_path, largest_bytes=4000)
    files = files_in(tmp_path)
    assert [number for number, _ in files] == list(range(1, len(files) + 1))
    assert len(files) > 2
    for _, path in files:
        assert [content_of(raw)["kind"] for raw in path.read_bytes().splitlines()][:3] == ["file", "site", "decision"]
    assert audit_log(tmp_path).sound
    assert audit_log(files[1][1]).sound, "each file can be audited by itself"
    log_one_more(tmp_path, largest_bytes=4000)
    assert audit_log(tmp_path).sound


def test_refused_acknowledgements_stand_in_the_log(tmp_path: Path) -> None:
    logged_shift(tmp_path)
    with DecisionLog(tmp_path, "0.1.0") as log:
        log.refused(Acknowledgement(by="", why="", at_ns=NOW, client="/desk (enclave /)"), "acknowledged_by is empty")
    last = contents(tmp_path)[-1]
    assert (last["because"], last["at_ns"], last["client"]) == ("acknowledged_by is empty", NOW, "/desk (enclave /)")
    assert (audit_log(tmp_path).refused, audit_log(tmp_path).sound) == (1, True)


@pytest.mark.parametrize("kept", [1, 40, -2, -1], ids=["one byte", "forty bytes", "all but two", "all but its end"])
def test_a_torn_last_line_is_kept_aside_and_said_and_the_log_goes_on(tmp_path: Path, kept: int) -> None:
    logged_shift(tmp_path)
    (_, path) = files_in(tmp_path)[-1]
    whole = path.read_bytes()
    last = whole.splitlines(keepends=True)[-1]
    path.write_bytes(whole[: len(whole) - len(last)] + last[:kept])
    log = log_one_more(tmp_path)
    if kept == -1:  # nothing is missing but the end of the line
        assert log.problems == ()
        assert path.read_bytes().startswith(whole)
    else:
        (aside,) = tmp_path.glob("*.torn-*")
        assert aside.read_bytes() == last[:kept]
        assert f"the last line was cut off; its {len(last[:kept])} bytes are kept" in log.problems[0]
        assert kinds(tmp_path)[-2:] == ["torn", "decision"]
    found = audit_log(tmp_path)
    assert found.sound, found.findings


@pytest.mark.parametrize("content", [b"", b'{"kind":"file","n":'], ids=["empty", "torn"])
def test_a_file_whose_first_line_was_never_written_is_begun_again(tmp_path: Path, content: bytes) -> None:
    logged_shift(tmp_path)
    (tmp_path / "decisions-000002.jsonl").write_bytes(content)
    log_one_more(tmp_path)
    assert [number for number, _ in files_in(tmp_path)] == [1, 2]
    found = audit_log(tmp_path)
    assert found.sound, found.findings


def test_a_log_with_a_damaged_middle_stays_as_it_is_and_goes_on_in_a_new_file(tmp_path: Path) -> None:
    alerts = logged_shift(tmp_path)
    (_, path) = files_in(tmp_path)[0]
    path.write_bytes(path.read_bytes().replace(b'"level":"watch"', b'"level":"evacuate"'))
    damaged = path.read_bytes()
    log = log_one_more(tmp_path)
    assert "were damaged or changed" in log.problems[0]
    assert path.read_bytes() == damaged
    assert contents_of(tmp_path / "decisions-000002.jsonl")[-1]["previous"]["at_ns"] == alerts[-1].at_ns
    assert not audit_log(tmp_path).sound


def contents_of(path: Path) -> list[dict]:
    return [content_of(raw) for raw in path.read_bytes().splitlines()]


def test_two_processes_cannot_write_one_log(tmp_path: Path) -> None:
    with DecisionLog(tmp_path, "0.1.0"), pytest.raises(NotLogged, match="another process writes"):
        DecisionLog(tmp_path, "0.1.0")
    DecisionLog(tmp_path, "0.1.0").close()


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(NotLogged, match="cannot be written"):
        DecisionLog(tmp_path / "file" / "log", "0.1.0")


class FullDisk:
    """A disk that accepts only `takes` bytes."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, takes: int) -> None:
        self.write, self.takes, self.patch = os.write, takes, monkeypatch
        monkeypatch.setattr(os, "write", self)

    def __call__(self, descriptor: int, data: bytes) -> int:
        if self.takes == 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        written = self.write(descriptor, data[: self.takes])
        self.takes -= written
        return written

    def make_room(self) -> None:
        self.patch.setattr(os, "write", self.write)


@pytest.mark.parametrize("takes", [0, 100])
@pytest.mark.parametrize("largest_bytes", [1, 10**6], ids=["at the start of a file", "within a file"])
def test_on_a_full_disk_the_caller_is_told_and_the_log_stays_whole(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, takes: int, largest_bytes: int
) -> None:
    thresholds, before = site(), decided(NORMAL)
    with DecisionLog(tmp_path, "0.1.0", largest_bytes) as log:
        log.decided(Decision(None, NORMAL, None, NOW, before), thresholds)
        whole = [path.read_bytes() for _, path in files_in(tmp_path)]
        disk = FullDisk(monkeypatch, takes)
        unlogged: Alert = decide(before, None, thresholds, NOW + S)
        for _ in range(2):
            with pytest.raises(NotLogged, match="cannot be written: No space left on device"):
                log.decided(Decision(before, None, None, NOW + S, unlogged), thresholds)
            assert [path.read_bytes() for _, path in files_in(tmp_path)] == whole
        disk.make_room()
        after = decide(unlogged, NORMAL, thresholds, NOW + 2 * S)
        log.decided(Decision(unlogged, NORMAL, None, NOW + 2 * S, after), thresholds)
        assert log.last_alert == after
        again = decide(after, NORMAL, thresholds, NOW + 3 * S)
        log.decided(Decision(after, NORMAL, None, NOW + 3 * S, again), thresholds)
    decisions = [line for line in contents(tmp_path) if line["kind"] == "decision"]
    assert [line.get("lost") for line in decisions] == [None, 2, None]
    found = audit_log(tmp_path)
    assert found.reproduced == found.decisions == 3
    assert any("2 decisions before this line could not be written" in finding for finding in found.findings)


ENDLESS = """
import sys
from live_sites.alert_evidence import *
thresholds, alert = site(), None
with DecisionLog(sys.argv[1], "0.1.0", largest_bytes=20_000) as log:
    alert, step = log.last_alert, 0
    while True:
        step += 1
        answer = later(WATCH if step % 7 else EVACUATE, step)
        new = decide(alert, answer, thresholds, NOW + step * S)
        log.decided(Decision(alert, answer, None, NOW + step * S, new), thresholds)
        alert = new
        print(log.head, flush=True)
"""


def test_a_log_is_whole_up_to_the_last_published_decision_after_kill_9(tmp_path: Path) -> None:
    paths = os.pathsep.join(map(str, (ROOT, ROOT / "test" / "support")))
    for _ in range(3):
        process = subprocess.Popen(
            [sys.executable, "-c", ENDLESS, str(tmp_path)], stdout=subprocess.PIPE, text=True,
            env=environment(PYTHONPATH=paths),
        )  # fmt: skip
        assert process.stdout is not None
        published = [process.stdout.readline().strip() for _ in range(40)]
        process.send_signal(signal.SIGKILL)
        published += process.stdout.read().split()
        process.wait()
        # The pipe may have truncated the last word.
        assert audit_log(tmp_path, head=published[-2]).decisions >= 40
    DecisionLog(tmp_path, "0.1.0").close()
    found = audit_log(tmp_path)
    assert found.reproduced == found.decisions >= 120
    # Each run after the first starts with a step back in time, which its decision contains.
    assert found.sound, found.findings
