"""Tests that the audit repeats each decision bit for bit and finds every changed or missing line."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from live_sites.alert_evidence import NOW, RAMP, SHIFT, S, area, evidence, later, logged_shift, site
from programs.command_line import call, refused

from rpf3d_core.alerts import audit
from rpf3d_core.alerts.audit import areas_changed, audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Level
from rpf3d_core.alerts.lines import BEGINNING, Decision, content_of, line_of
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.errors import InputError

LEVELS_SHOWN = ["normal", "watch", "evacuate", "evacuate", "evacuate", "normal"]
"""Levels shown at the changes during the shift; a fault while `evacuate` is held returns to `evacuate`."""


@pytest.fixture
def log(tmp_path: Path) -> Path:
    logged_shift(tmp_path / "log")
    return tmp_path / "log"


def file_of(log: Path) -> Path:
    return log / "decisions-000001.jsonl"


def lines_of(log: Path) -> list[bytes]:
    return file_of(log).read_bytes().splitlines(keepends=True)


def forged(log: Path, change: Callable[[list[dict]], object]) -> None:
    """Change the contents of lines, and write the whole log again with consistent hashes."""
    contents = [content_of(raw) for raw in lines_of(log)]
    change(contents)
    written, before = b"", BEGINNING
    for number, content in enumerate(contents):
        facts = {key: value for key, value in content.items() if key not in ("kind", "n", "before", "sha256")}
        raw, before = line_of(number, before, content["kind"], facts)
        written += raw
    file_of(log).write_bytes(written)


def test_a_log_as_it_was_written_is_sound(log: Path) -> None:
    found = audit_log(log)
    assert found.sound and found.findings == found.notes == []
    assert (found.files, found.decisions, found.reproduced) == (1, len(SHIFT), len(SHIFT))
    assert found.versions == ["0.1.0"]
    assert found.head == content_of(lines_of(log)[-1])["sha256"]
    assert audit_log(log, head=content_of(lines_of(log)[3])["sha256"]).sound


def test_the_changes_are_told_with_their_reasons(log: Path) -> None:
    changes = audit_log(log).changes
    assert [change.alert.level.word for change in changes] == LEVELS_SHOWN
    assert [bool(change.alert.faults) for change in changes] == [False, False, False, True, False, False]
    assert changes[-1].alert.acknowledgement.by == "A. Shift"


@pytest.mark.parametrize("place", range(9))
def test_a_changed_byte_in_any_line_is_found(log: Path, place: int) -> None:
    lines = lines_of(log)
    middle = len(lines[place]) // 2
    byte = b"0" if lines[place][middle : middle + 1] != b"0" else b"1"
    lines[place] = lines[place][:middle] + byte + lines[place][middle + 1 :]
    file_of(log).write_bytes(b"".join(lines))
    found = audit_log(log)
    assert not found.sound
    assert any(f"line {place + 1}: was damaged or changed" in finding for finding in found.findings)


@pytest.mark.parametrize("place", range(8))
def test_a_missing_line_is_found(log: Path, place: int) -> None:
    lines = lines_of(log)
    file_of(log).write_bytes(b"".join(lines[:place] + lines[place + 1 :]))
    assert any("1 lines before this line are missing" in finding for finding in audit_log(log).findings)


def test_lines_taken_off_the_end_are_found_by_a_hash_that_was_noted_elsewhere(log: Path) -> None:
    head = audit_log(log).head
    file_of(log).write_bytes(b"".join(lines_of(log)[:-1]))
    assert audit_log(log).sound, "the chain alone cannot tell"
    found = audit_log(log, head=head)
    assert not found.sound and "no line of the log has the hash" in found.findings[0]


def test_exchanged_lines_are_found(log: Path) -> None:
    lines = lines_of(log)
    file_of(log).write_bytes(b"".join([*lines[:4], lines[5], lines[4], *lines[6:]]))
    assert not audit_log(log).sound


def test_a_line_exchanged_for_another_with_a_hash_of_its_own_is_found(log: Path) -> None:
    lines = lines_of(log)
    content = content_of(lines[4])
    content["evidence"]["seed"] = 2  # no decision depends on it
    facts = {key: value for key, value in content.items() if key not in ("kind", "n", "before", "sha256")}
    lines[4], _ = line_of(content["n"], content["before"], "decision", facts)
    file_of(log).write_bytes(b"".join(lines))
    (finding,) = audit_log(log).findings
    assert "line 6: contains another hash than that of the previous line" in finding


def test_a_torn_last_line_is_told(log: Path) -> None:
    file_of(log).write_bytes(file_of(log).read_bytes()[:-30])
    found = audit_log(log)
    told = "line 9: was cut off: its end was never written; its content is unknown"
    assert found.findings == [f"{file_of(log).name}, {told}"]
    assert found.reproduced == len(SHIFT) - 1


FORGERIES: dict[str, tuple[Callable[[list[dict]], object], str]] = {
    "a level": (lambda lines: lines[4]["alert"].update(level="normal"), '`level` is "normal", but the audit gets'),
    "a reason": (lambda lines: lines[4]["alert"].update(reasons=["all is well"]), "`reasons` is"),
    "an energy": (lambda lines: lines[4]["evidence"]["areas"][0].update(high=0.01, reached=3), "is not reproduced"),
    "the time": (lambda lines: lines[4].update(now_ns=1), "is not reproduced"),
    "no number": (lambda lines: lines[4].update(now_ns="yesterday"), "the decision cannot be made again"),
    "the thresholds": (lambda lines: lines[1].update(text=lines[1]["text"].replace("0.2", "0.9")), "the digest does"),
    "no thresholds": (lambda lines: lines.pop(1), "are not in the log before this line"),
    "a missing field": (lambda lines: lines[4]["alert"].pop("held"), "does not understand the decision"),
    "a strange level": (lambda lines: lines[4]["alert"].update(level="fine"), "does not understand the decision"),
    "a decision less": (lambda lines: lines.pop(4), "does not continue the previous decision"),
    "a strange line": (lambda lines: lines[4].update(kind="note"), "has the kind 'note'"),
    "another format": (lambda lines: lines[0].update(format=2), "has the format 2, but this version reads"),
    "thresholds of no site": (lambda lines: lines[1].update(text="{}"), "thresholds in the log are not understood"),
}  # fmt: skip


@pytest.mark.parametrize(("change", "sentence"), FORGERIES.values(), ids=FORGERIES)
def test_a_log_written_anew_with_hashes_that_fit_does_not_reproduce(log: Path, change: Callable, sentence: str) -> None:
    forged(log, lambda _: None)
    assert audit_log(log).sound, "the forger writes lines as the log does"
    forged(log, change)
    found = audit_log(log)
    assert not found.sound
    assert any(sentence in finding for finding in found.findings), found.findings


def test_a_file_that_is_missing_is_found(tmp_path: Path) -> None:
    logged_shift(tmp_path, largest_bytes=4000)
    assert audit_log(tmp_path / "decisions-000002.jsonl").notes[0].endswith("the audit does not read earlier files")
    (tmp_path / "decisions-000002.jsonl").unlink()
    assert any("files before decisions-000003.jsonl are missing" in finding for finding in audit_log(tmp_path).findings)
    (tmp_path / "decisions-000003.jsonl").write_bytes(b"")
    assert any("is empty" in finding for finding in audit_log(tmp_path).findings)


def test_another_version_is_made_again_too_and_told(log: Path) -> None:
    forged(log, lambda lines: [line.update(version="0.0.9") for line in lines[2:5]])
    found = audit_log(log)
    assert found.sound and found.versions == ["0.0.9", "0.1.0"]


def test_a_version_that_decides_otherwise_is_found(log: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    decide = audit.decide
    monkeypatch.setattr(audit, "decide", lambda *given: decide(*given)._replace(valid_until_ns=0))
    found = audit_log(log)
    assert (found.reproduced, len(found.findings)) == (0, len(SHIFT))


def test_the_command_prints_the_changes_and_a_verdict(log: Path, monkeypatch, capsys) -> None:
    assert call(monkeypatch, "audit", log) == 0
    printed = capsys.readouterr().out
    assert "watch > evacuate" in printed
    assert "evacuate > evacuate (fault)" in printed
    assert "evacuate > normal" in printed
    assert "ramp: evacuate because 3,000 of 10,000 rocks reached the area" in printed
    assert "acknowledged by A. Shift: inspected from the other side" in printed
    assert "2027-01-15 08:00:02.000 UTC" in printed
    assert "7 of 7 decisions reproduced bit for bit; the chain of lines is whole" in printed
    assert "written by version 0.1.0" in printed


def test_the_command_ends_with_1_where_anything_is_wrong(log: Path, monkeypatch, capsys) -> None:
    forged(log, FORGERIES["a level"][0])
    assert call(monkeypatch, "audit", log) == 1
    printed = capsys.readouterr()
    assert "6 of 7 decisions reproduced bit for bit; the log is NOT sound" in printed.out
    assert "`level` is" in printed.err


def test_the_command_prints_json(log: Path, monkeypatch, capsys) -> None:
    assert call(monkeypatch, "audit", log, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["sound"], told["decisions"], told["reproduced"]) == (True, 7, 7)
    assert told["changes"][2]["alert"]["level"] == "evacuate"
    assert call(monkeypatch, "audit", log, "--json", "--head", "f" * 64) == 1
    assert json.loads(capsys.readouterr().out)["findings"]


def test_a_log_that_is_not_there_is_refused(tmp_path: Path, monkeypatch, capsys) -> None:
    assert refused(monkeypatch, capsys, "audit", tmp_path / "none") == f"{tmp_path / 'none'}: there is no such log"
    assert refused(monkeypatch, capsys, "audit", tmp_path) == f"{tmp_path}: the folder has no decision log"


def test_a_file_that_is_no_log_is_told(tmp_path: Path) -> None:
    (tmp_path / "picture.png").write_bytes(bytes(range(256)) * 4)
    with pytest.raises(InputError, match="is not a decision log: none of its 5 lines"):
        audit_log(tmp_path / "picture.png")
    with DecisionLog(tmp_path / "log", "0.1.0"):
        pass
    with pytest.raises(Exception, match="has no decision log"):
        audit_log(tmp_path / "log")


def test_a_log_from_before_areas_had_levels_is_sound_and_says_so(tmp_path: Path) -> None:
    logged_shift(tmp_path / "new")
    rewritten_without(tmp_path / "new", tmp_path / "old", ("areas",))
    audit = audit_log(tmp_path / "old")
    assert audit.sound and audit.decisions == audit.reproduced == len(SHIFT), audit.findings
    assert len(audit.notes) == 1 and "has no `areas`, because an older version wrote it" in audit.notes[0]
    with DecisionLog(tmp_path / "old", "0.1.0") as log:
        assert log.last_alert is not None and log.last_alert.areas == ()


def rewritten_without(log: Path, folder: Path, names: tuple[str, ...], of_areas: tuple[str, ...] = ()) -> Path:
    """Write a log as an older version wrote it, without some values of alerts and areas; return its folder."""
    head, lines = BEGINNING, []
    for raw in file_of(log).read_bytes().splitlines():
        content = content_of(raw)
        for key in ("alert", "previous"):
            if content.get(key):
                told = {name: value for name, value in content[key].items() if name not in names}
                for one in told.get("areas", ()):
                    for name in of_areas:
                        del one[name]
                content[key] = told
        kept = {key: value for key, value in content.items() if key not in ("kind", "n", "before", "sha256")}
        line, head = line_of(content["n"], head, content["kind"], kept)
        lines.append(line)
    folder.mkdir()
    file_of(folder).write_bytes(b"".join(lines))
    return folder


def test_a_log_from_before_levels_had_times_and_causes_is_sound_can_be_continued_and_says_so(
    log: Path, tmp_path: Path
) -> None:
    names = ("since", "terrain_digest", "terrain_stamp_ns")
    old = rewritten_without(log, tmp_path / "old", names, ("since", "origin", "judged"))
    found = audit_log(old)
    assert found.sound and found.reproduced == len(SHIFT), found.findings
    assert [note.partition("has no `")[2].split("`")[0] for note in found.notes] == list(names)
    with DecisionLog(old, "0.2.0") as opened:
        previous, answer, now = opened.last_alert, later(evidence(area(3000)), 9), NOW + 9 * S
        assert previous.since is None
        alert = decide(previous, answer, site(), now)
        opened.decided(Decision(previous, answer, None, now, alert), site())
    assert alert.since.level_ns == alert.areas[0].since.level_ns == now
    assert audit_log(old).sound, audit_log(old).findings


@pytest.mark.parametrize("forge", [
    lambda alert: alert["since"].update(level_ns=5), lambda alert: alert.update(terrain_digest="ab" * 32),
    lambda alert: alert["areas"][0]["since"].update(not_normal_ns=None),
    lambda alert: alert["areas"][0].update(since=None), lambda alert: alert["areas"].pop(),
])  # fmt: skip
def test_a_forged_time_or_cause_is_found(log: Path, forge: Callable[[dict], object]) -> None:
    forged(log, lambda lines: forge(lines[4]["alert"]))
    assert any("is not reproduced" in finding for finding in audit_log(log).findings)


def test_an_area_whose_level_goes_another_way_than_that_of_the_site_is_told_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    pit = site({"ramp": RAMP, "crusher": RAMP})
    first = evidence(area(3000), area(name="crusher"))
    second = later(evidence(area(3000), area(700, name="crusher")), 1)
    alert = decide(None, first, pit, NOW)
    again = decide(alert, second, pit, NOW + S)
    with DecisionLog(tmp_path / "log", "0.1.0") as opened:
        opened.decided(Decision(None, first, None, NOW, alert), pit)
        opened.decided(Decision(alert, second, None, NOW + S, again), pit)
        third = later(second, 1)
        opened.decided(Decision(again, third, None, NOW + 2 * S, decide(again, third, pit, NOW + 2 * S)), pit)
    changes = audit_log(tmp_path / "log").changes
    assert [areas_changed(change.before, change.alert) for change in changes] == [
        [], [("crusher", Level.NORMAL, Level.RESTRICT)],
    ]  # fmt: skip
    assert call(monkeypatch, "audit", tmp_path / "log") == 0
    assert "crusher: normal > restrict" in capsys.readouterr().out
