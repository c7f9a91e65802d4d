"""Tests that a full, damaged or deleted log does not lose a held level: the level continues or is unknown."""

import errno
import os
import shutil
import time
from pathlib import Path

import pytest
from live_sites.alert_evidence import NOW, S, area, evidence, site

from rpf3d_core.alerts import witness
from rpf3d_core.alerts.audit import audit_log
from rpf3d_core.alerts.decide import decide
from rpf3d_core.alerts.levels import Acknowledgement, Level
from rpf3d_core.alerts.lines import Decision
from rpf3d_core.alerts.log import DecisionLog
from rpf3d_core.alerts.log_files import NotLogged, files_in
from rpf3d_core.alerts.state_file import BLOCK, NAME, SLOT, StateFile
from rpf3d_core.alerts.witness import Witness

CALM, DANGER = evidence(area(0)), evidence(area(3000))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Return the folder of a log, inside the folder of the test because the log has a file next to its folder."""
    return tmp_path / "decisions"


def log_one(log: DecisionLog, answer=CALM, step: int = 0) -> None:
    """Log one decision that follows the last one, `step` seconds after NOW."""
    alert = decide(log.last_alert, answer, site(), NOW + step * S)
    log.decided(Decision(log.last_alert, answer, None, NOW + step * S, alert), site())


def without_room(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    def full(*given: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    for name in names:
        monkeypatch.setattr(os, name, full)


def unlogged_danger(folder: Path, *failing: str) -> None:
    """Start a log, raise the level while no line can be written, and close the log. failing : failing calls of os"""
    with pytest.MonkeyPatch.context() as patched, DecisionLog(folder, "0.1.0") as log:
        log_one(log)
        without_room(patched, *failing)
        for step in (1, 2):
            with pytest.raises(NotLogged):
                log_one(log, DANGER, step)


def test_a_first_start_needs_no_person_and_neither_does_one_before_the_first_decision(folder: Path) -> None:
    for _ in range(2):
        with DecisionLog(folder, "0.1.0") as log:
            assert (log.last_alert, log.unknown, log.problems) == (None, "", ())


def test_what_was_decided_while_the_disk_was_full_is_continued_and_the_audit_fails(folder: Path) -> None:
    unlogged_danger(folder, "write")
    with DecisionLog(folder, "0.1.0") as log:
        assert log.last_alert is not None and log.last_alert.held == Level.EVACUATE
        assert (log.unknown, log.missing) == ("", 2)
        assert "the last 2 decisions are not in the log" in log.problems[0]
        log_one(log, CALM, 3)
    with DecisionLog(folder, "0.1.0") as log:
        assert (log.missing, log.problems) == (0, ())
        assert log.last_alert.held == Level.EVACUATE
    found = audit_log(folder)
    assert not found.sound and "2 decisions before this line could not be written" in found.findings[0]


def test_a_line_after_the_missing_decisions_that_is_no_decision_hides_none(folder: Path) -> None:
    unlogged_danger(folder, "write")
    with DecisionLog(folder, "0.1.0") as log:
        log.refused(Acknowledgement(by="", why="", at_ns=NOW), "acknowledged_by is empty")
    with DecisionLog(folder, "0.1.0") as log:
        assert log.last_alert.held == Level.EVACUATE


def test_what_could_be_kept_nowhere_is_unknown_until_a_person_acknowledges(folder: Path) -> None:
    unlogged_danger(folder, "write", "pwrite")
    for _ in range(2):  # also after a second start before anyone acts
        with DecisionLog(folder, "0.1.0") as log:
            assert "not in the log" in log.unknown
            log_one(log, CALM, 3)
    with DecisionLog(folder, "0.1.0") as log:
        log.settle()
        assert log.unknown == ""
    with DecisionLog(folder, "0.1.0") as log:
        assert log.unknown == ""


@pytest.mark.parametrize("failing", [("pwrite",), ("write", "pwrite")], ids=["the state", "a line, too"])
def test_a_failure_after_which_all_was_written_needs_no_person(folder: Path, failing: tuple[str, ...]) -> None:
    """One failed write of the state must not leave its sign permanently."""
    with DecisionLog(folder, "0.1.0") as log:
        log_one(log)
        with pytest.MonkeyPatch.context() as patched:
            without_room(patched, *failing)
            with pytest.raises(NotLogged, match="inputs cannot be saved for the next start: No space left"):
                log.remember({"heard": ["north"]})
            if "write" in failing:
                with pytest.raises(NotLogged):
                    log_one(log, DANGER, 1)
        assert Witness(folder).is_unlogged
        log_one(log, CALM, 2)
        assert Witness(folder).is_unlogged, "what was received is not yet kept"
        log.remember({"heard": ["north"]})
        assert Witness(folder).is_unlogged, "a decision may be missing"
        log_one(log, CALM, 3)
    with DecisionLog(folder, "0.1.0") as log:
        assert (log.unknown, log.memory) == ("", {"heard": ["north"]})
        assert log.last_alert is not None
        assert log.last_alert.held == (Level.EVACUATE if "write" in failing else Level.NORMAL)


def fail_to_remember(log: DecisionLog) -> None:
    with pytest.MonkeyPatch.context() as patched:
        without_room(patched, "pwrite")
        with pytest.raises(NotLogged):
            log.remember({"heard": ["north"]})


@pytest.mark.parametrize("order", [1, -1], ids=["before", "after"])
@pytest.mark.parametrize("has_begun", [True, False])
def test_a_log_takes_away_no_sign_that_another_program_made(folder: Path, order: int, has_begun: bool) -> None:
    """A second simulator makes the sign before or after the log's own failure; it cannot open the log."""
    with DecisionLog(folder, "0.1.0") as log:
        if not has_begun:
            Witness(folder).begun_path.unlink()
        for step in (lambda: Witness(folder).unlog(), lambda: fail_to_remember(log))[::order]:
            step()
            time.sleep(0.02)  # longer than the time resolution of a file system
        log.remember({"heard": ["north"]})
        log_one(log)
    with DecisionLog(folder, "0.1.0") as log:
        assert "not in the log" in log.unknown


def test_what_was_received_and_is_not_known_makes_the_next_start_unknown(folder: Path) -> None:
    with DecisionLog(folder, "0.1.0") as log:
        log.remember({"heard": ["north"]})
        log.lose_received()
        log_one(log)
    with DecisionLog(folder, "0.1.0") as log:
        assert "not in the log" in log.unknown
        log.settle()
        log.lose_received()
        log.remember({"heard": ["north"]})
        log_one(log, CALM, 1)
    with DecisionLog(folder, "0.1.0") as log:
        assert log.unknown == "", "known again"


def test_a_log_takes_away_no_sign_while_the_level_is_unknown(folder: Path) -> None:
    with DecisionLog(folder, "0.1.0") as log:
        log_one(log)
    state_deleted(folder)
    with DecisionLog(folder, "0.1.0") as log:
        fail_to_remember(log)
        log.remember({"heard": ["north"]})
        log_one(log, CALM, 1)
        assert log.unknown and Witness(folder).is_unlogged


def test_why_a_level_is_unknown_is_kept_as_soon_as_the_state_can_be_written(folder: Path) -> None:
    with DecisionLog(folder, "0.1.0") as log:
        log_one(log)
    zeros_at_the_end(folder)
    with pytest.MonkeyPatch.context() as patched:
        without_room(patched, "pwrite")
        log = DecisionLog(folder, "0.1.0")
    log_one(log, CALM, 1)
    log.close()
    Witness(folder).settle()  # now only the state can contain it
    with DecisionLog(folder, "0.1.0") as log:
        assert "are damaged" in log.unknown


def test_the_sign_that_a_log_was_begun_is_on_disk_at_once(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[Path] = []
    monkeypatch.setattr(witness, "sync_folder", synced.append)
    sign = Witness(folder)
    for count, change in enumerate((sign.begin, sign.unlog, sign.settle), 1):
        change()
        assert synced == [folder.parent] * count


def test_a_sign_is_synced_once_however_many_writes_fail(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk may be slow, and each alert waits for it."""
    sign, synced, failing = Witness(folder), [], [True]

    def sync(path: Path) -> None:
        if failing:
            raise OSError(failing.pop())
        synced.append(path)

    sign.begin()
    monkeypatch.setattr(witness, "sync_folder", sync)
    for _ in range(4):
        sign.unlog()
    assert len(synced) == 1 and sign.is_own, "again only after it failed"
    sign.settle()
    sign.unlog()
    assert len(synced) == 3 and sign.is_unlogged


def zeros_at_the_end(folder: Path) -> None:
    path = files_in(folder)[-1][1]
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) // 3].ljust(len(whole), b"\0"))


def changed_last_decision(folder: Path) -> None:
    path = files_in(folder)[-1][1]
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join([*lines[:-1], lines[-1].replace(b"evacuate", b"normal")]))


def last_file_deleted(folder: Path) -> None:
    files_in(folder)[-1][1].unlink()


def state_deleted(folder: Path) -> None:
    (folder / NAME).unlink()


def state_zeroed(folder: Path) -> None:
    (folder / NAME).write_bytes(bytes(2 * SLOT))


@pytest.mark.parametrize(
    "damage",
    [shutil.rmtree, zeros_at_the_end, changed_last_decision, last_file_deleted, state_deleted, state_zeroed],
    ids=lambda damage: damage.__name__,
)
def test_of_a_log_that_was_damaged_or_deleted_the_level_is_unknown_until_a_person_acknowledges(
    folder: Path, damage
) -> None:
    with DecisionLog(folder, "0.1.0", largest_bytes=1) as log:
        log_one(log, CALM)
        log_one(log, DANGER, 1)
    damage(folder)
    for _ in range(2):
        with DecisionLog(folder, "0.1.0") as log:
            assert log.unknown and log.unknown in log.problems
            log_one(log, CALM, 3)
    with DecisionLog(folder, "0.1.0") as log:
        log.settle()
    with DecisionLog(folder, "0.1.0") as log:
        assert log.unknown == ""


def test_an_audit_finds_lines_that_were_damaged_at_the_end_and_set_aside(folder: Path) -> None:
    with DecisionLog(folder, "0.1.0") as log:
        log_one(log, CALM)
        log_one(log, DANGER, 1)
    zeros_at_the_end(folder)
    DecisionLog(folder, "0.1.0").close()
    assert any("damaged lines" in finding for finding in audit_log(folder).findings)


def test_a_log_of_an_older_version_has_neither_file_and_is_continued(folder: Path) -> None:
    with DecisionLog(folder, "0.1.0") as log:
        log_one(log, DANGER)
    (folder / NAME).unlink()
    Witness(folder).begun_path.unlink()
    with DecisionLog(folder, "0.1.0") as log:
        assert log.unknown == "" and log.last_alert.held == Level.EVACUATE
    assert Witness(folder).is_there and (folder / NAME).exists()


def test_a_first_start_that_cannot_be_told_from_a_lost_log_needs_a_person(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read_only(path: Path) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr(Path, "touch", read_only)
    with DecisionLog(folder, "0.1.0") as log:
        assert "a first start cannot be distinguished from a lost log" in log.unknown
        log_one(log)
        log.settle()
    with DecisionLog(folder, "0.1.0") as log:
        assert log.unknown == ""


def test_what_the_node_had_received_comes_back(folder: Path) -> None:
    memory = {"heard": ["north", "south"], "refused": {"areas/polygon": "crosses itself"}, "areas": []}
    with DecisionLog(folder, "0.1.0") as log:
        log.remember(memory)
    with DecisionLog(folder, "0.1.0") as log:
        assert log.memory == memory


def test_a_state_whose_writing_was_interrupted_is_the_one_before(tmp_path: Path) -> None:
    state = StateFile(tmp_path)
    for number in range(3):
        state.write({"number": number})
    state.close()
    path = tmp_path / NAME
    data = bytearray(path.read_bytes())
    slot = next(slot for slot in (0, 1) if b'"number":2' in data[slot * SLOT : (slot + 1) * SLOT])
    data[slot * SLOT + 10 : slot * SLOT + 20] = bytes(10)
    path.write_bytes(data)
    again = StateFile(tmp_path)
    assert again.facts == {"number": 1} and not again.is_damaged
    again.write({"number": 3})
    again.close()
    assert StateFile(tmp_path).facts == {"number": 3}
    assert path.stat().st_size == 2 * SLOT, "it never grows: a full disk has room for it"


def test_a_change_writes_few_blocks_and_what_has_not_changed_writes_none(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes: list[int] = []
    pwrite = os.pwrite
    with DecisionLog(folder, "0.1.0") as log:
        monkeypatch.setattr(os, "pwrite", lambda file, data, at: sizes.append(len(data)) or pwrite(file, data, at))
        for memory in ({"heard": ["north"]}, {"heard": ["north"]}, {"heard": ["n" * BLOCK]}, {"heard": []}, {"a": 1}):
            log.remember(memory)
        assert sizes == [BLOCK, 2 * BLOCK, BLOCK, 2 * BLOCK], "the last one erases a longer one in its slot"
        for number in range(2):
            log.remember({"a": [number]})
    assert sizes[4:] == [BLOCK, BLOCK]
    with DecisionLog(folder, "0.1.0") as log:
        assert log.memory == {"a": [1]}


def test_the_rest_of_a_slot_is_zero_because_earlier_versions_accept_nothing_else(tmp_path: Path) -> None:
    def rests() -> list[bytes]:
        data = (tmp_path / NAME).read_bytes()
        return [data[at : at + SLOT].partition(b"\n")[2].strip(b"\0") for at in (0, SLOT)]

    state = StateFile(tmp_path)
    for text in ("a", "a" * 3 * BLOCK, "b", "b" * 2 * BLOCK, "c", "c"):
        state.write({"text": text})
        assert rests() == [b"", b""]
    for text in ("a" * 3 * BLOCK, "a" * 3 * BLOCK, "b", "b"):
        state.close()
        state = StateFile(tmp_path)
        state.write({"text": text})
    assert rests() == [b"", b""]
    state.close()
