"""Tests that a second process works in order, reports errors as the first would, and never outlives it."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from programs.command_line import LONGEST, environment
from programs.processes import is_there
from programs.waiting import wait_for

from rpf3d_core.errors import InputError
from rpf3d_core.results.second_process import SecondProcessEnded, second_process

CLERK = ("programs.second_workers", "Clerk")


def number_in(path: Path) -> int:
    wait_for(lambda: path.is_file() and path.read_text().endswith("\n"), LONGEST)
    return int(path.read_text().split()[0])


def test_work_is_done_in_order_in_another_process_which_is_gone_afterwards(tmp_path: Path) -> None:
    path = tmp_path / "notes"
    with second_process(*CLERK) as second:
        assert second is not None and second.has_begun()
        for words in ("one", "two", "three"):
            second.ask("note", path, words)
        second.wait()
        notes = [line.split() for line in path.read_text().splitlines()]
    assert [words for _, words in notes] == ["one", "two", "three"]
    (number,) = {int(pid) for pid, _ in notes}
    assert number != os.getpid() and not is_there(number)


def test_a_large_value_arrives_whole_while_nobody_waits(tmp_path: Path) -> None:
    words = "x" * 30_000_000
    with second_process(*CLERK) as second:
        assert second is not None
        second.ask("note", tmp_path / "notes", words)
        second.wait()
    assert (tmp_path / "notes").read_text().split()[1] == words


def test_the_first_failure_is_raised_here_and_ends_the_work(tmp_path: Path) -> None:
    with second_process(*CLERK) as second:
        assert second is not None
        second.ask("refuse", "the field is wrong")
        second.ask("note", tmp_path / "notes", "never")
        with pytest.raises(InputError, match=r"^the field is wrong$"):
            second.wait()
    assert not (tmp_path / "notes").exists()


def test_a_failure_that_cannot_be_pickled_keeps_its_words() -> None:
    with second_process(*CLERK) as second:
        assert second is not None
        second.ask("fail_unpicklably", "too bad")
        with pytest.raises(RuntimeError, match="ValueError: too bad"):
            second.wait()


def test_a_class_that_is_not_there_is_a_failure() -> None:
    with second_process("programs.second_workers", "Nobody") as second:
        assert second is not None
        second.ask("note")
        with pytest.raises(AttributeError, match="Nobody"):
            second.wait()


def test_what_a_library_prints_is_no_answer(tmp_path: Path) -> None:
    with second_process(*CLERK) as second:
        assert second is not None
        second.ask("say", "hello")
        second.ask("note", tmp_path / "notes", "done")
        second.wait()
    assert (tmp_path / "notes").read_text().split()[1] == "done"


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_ctrl_c_and_sigterm_do_not_stop_the_work(tmp_path: Path, number: int) -> None:
    with second_process(*CLERK) as second:
        assert second is not None and second.has_begun()
        second._process.send_signal(number)
        second.ask("note", tmp_path / "notes", "done")
        second.wait()
    assert (tmp_path / "notes").is_file()


def test_a_killed_process_is_an_error_that_says_how_it_ended(tmp_path: Path) -> None:
    with second_process(*CLERK) as second:
        assert second is not None
        second.ask("hang", tmp_path / "notes")
        os.kill(number_in(tmp_path / "notes"), signal.SIGKILL)
        with pytest.raises(SecondProcessEnded, match=r"^was killed by SIGKILL$"):
            second.wait()


def test_an_exception_here_ends_the_process(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), second_process(*CLERK) as second:
        assert second is not None
        second.ask("hang", tmp_path / "notes")
        number = number_in(tmp_path / "notes")
        raise KeyboardInterrupt
    assert not is_there(number)


def test_the_process_ends_when_the_main_process_is_killed(tmp_path: Path) -> None:
    program = (
        "import sys, time\nfrom pathlib import Path\n"
        "from rpf3d_core.results.second_process import second_process\n"
        f"with second_process(*{CLERK!r}) as second:\n"
        "    second.ask('hang', Path(sys.argv[1]))\n"
        "    time.sleep(600)\n"
    )
    home = environment()
    home["PYTHONPATH"] = os.pathsep.join([home["PYTHONPATH"], str(Path(__file__).parents[1] / "support")])
    with subprocess.Popen([sys.executable, "-c", program, str(tmp_path / "notes")], env=home) as main:
        number = number_in(tmp_path / "notes")
        main.kill()
    wait_for(lambda: not is_there(number), LONGEST)


def test_there_is_no_process_where_python_cannot_be_started(monkeypatch: pytest.MonkeyPatch) -> None:
    for program in ("", "/nowhere/python"):
        monkeypatch.setattr(sys, "executable", program)
        with second_process(*CLERK) as second:
            assert second is None


@pytest.mark.parametrize("program", ["/bin/true", "/bin/echo"])
def test_another_program_in_place_of_python_has_not_begun(monkeypatch: pytest.MonkeyPatch, program: str) -> None:
    monkeypatch.setattr(sys, "executable", program)
    with second_process(*CLERK) as second:
        assert second is not None and not second.has_begun()
        with pytest.raises(SecondProcessEnded, match="did not start"):
            second.wait()


@pytest.mark.parametrize("compiles", [False, True])
def test_only_a_process_that_compiles_imports_numba(compiles: bool) -> None:
    pytest.importorskip("numba", reason="numba is not installed")
    with pytest.raises(InputError, match=f"numba: {compiles}"), second_process(*CLERK, compiles=compiles) as second:
        assert second is not None
        second.ask("tell_of_numba")
        second.wait()
