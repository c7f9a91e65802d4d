"""Tests of the second process that compiles in the background; its failure costs only time."""

import os
import select
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from programs.command_line import LONGEST, environment

from rpf3d_core.jit import background

pytest.importorskip("numba", reason="numba is not installed: there is nothing to compile")

LOOP = """\
import time
from rpf3d_core.jit.dispatch import loop


@loop
def total(n):
    s = 0
    for i in range(n):
        s += i
    return s


@loop
def product(n):
    s = 1
    for i in range(n):
        s *= i + 1
    return s


def precompile():
    print("rpf3d_core.terrain.sums.slow")  # is no answer
    product(3)


class Slow:
    \"\"\"Takes longer to compile than anyone waits.\"\"\"

    __name__, typeof_pyval = "slow", None  # its module is that of its class

    def compile(self, types):
        time.sleep(600)


slow = Slow()
"""
BEGIN = """\
import os, signal, subprocess, sys
from rpf3d_core.jit import background
from rpf3d_core.terrain.sums import product, precompile, slow, total
background.has_spare_core = lambda: True
{before}
with background.background_compiler(total) as compiler:
    process = compiler._process
    {then}
    product(3)
    compiler.wait()
    print(total(10), len(total.stats.cache_hits), process is not None)
    assert process is None or process.poll() is not None, "it idles while rocks fly"
"""
TOLD = "compiler.compile((total, (10,)))"
TOLD_IN_TURN = f"compiler.call(precompile); {TOLD}; compiler.wait(precompile)"
HITS = "; print(len((product(3), product)[1].stats.cache_hits), compiler.has_done(precompile), end=' ')"
TOLD_SLOW = "compiler.compile((slow, ()))"
IMPATIENT = "background.PATIENCE = 0.2"
HANGS = "import time; time.sleep(600)"
AT_WORK = 3.0
"""Time (s) after which a second process has usually started to work."""
END_SOON = 20.0
"""Longest time (s) until a process that was asked to end has ended, on a busy machine."""


@pytest.fixture
def sources(tmp_path: Path) -> Path:
    """Return a folder with a package `rpf3d_core` that has the project's `jit` and two loops."""
    (tmp_path / "rpf3d_core" / "terrain").mkdir(parents=True)
    shutil.copytree(Path(background.__file__).parent, tmp_path / "rpf3d_core" / "jit")
    (tmp_path / "rpf3d_core" / "terrain" / "sums.py").write_text(LOOP)
    return tmp_path


def started(sources: Path, before: str = "", then: str = TOLD, **changes: str) -> "subprocess.Popen[str]":
    """Start a process that lets a second one compile. before, then : code to run before and after this start"""
    home = {"PYTHONPATH": str(sources), "XDG_CACHE_HOME": str(sources / "cache"), **changes}
    program = BEGIN.format(before=before, then=then)
    return subprocess.Popen(
        [sys.executable, "-c", program], env=environment(**home), cwd=sources, stdout=subprocess.PIPE, text=True
    )  # fmt: skip


def printed(sources: Path, before: str = "", then: str = TOLD, **changes: str) -> str:
    """Return the output of such a process: its result, loops from the cache, and whether a second process ran."""
    with started(sources, before, then, **changes) as process:
        said, _ = process.communicate(timeout=LONGEST)
        assert process.returncode == 0
    return said.strip()


def other_in_place_of_it(program: str) -> str:
    """Return code that lets another program run instead of the second process."""
    return (
        "background._started = lambda loops: "
        f"subprocess.Popen([sys.executable, '-c', {program!r}], stdin=subprocess.PIPE, stdout=subprocess.PIPE)"
    )


def test_what_the_second_process_compiled_the_first_finds_in_the_cache(sources: Path) -> None:
    assert printed(sources) == "45 1 True"


def test_there_is_no_second_process_for_what_the_cache_holds(sources: Path) -> None:
    printed(sources)
    assert printed(sources) == "45 1 False"


def test_there_is_no_second_process_where_no_core_is_to_spare(sources: Path) -> None:
    assert printed(sources, before="background.has_spare_core = lambda: False") == "45 0 False"


@pytest.mark.parametrize(
    ("cores", "load", "spare"), [(1, 0.0, False), (2, 0.4, True), (2, 1.9, True), (2, 2.0, False), (8, 7.2, True)]
)
def test_a_core_is_to_spare_where_fewer_programs_run_than_there_are_cores(
    monkeypatch: pytest.MonkeyPatch, cores: int, load: float, spare: bool
) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(cores)), raising=False)
    monkeypatch.setattr(os, "getloadavg", lambda: (load, 9.0, 9.0), raising=False)
    assert background.has_spare_core() is spare


def test_there_is_no_second_process_where_nothing_can_be_kept(sources: Path) -> None:
    assert printed(sources, HOME="/dev/null", XDG_CACHE_HOME="") == "45 0 False"


@pytest.mark.long
@pytest.mark.parametrize(
    "program", ["import sys; sys.exit(3)", "import os; os.kill(os.getpid(), 9)", "import sys; sys.stdin.buffer.read(9)"]
)
def test_a_second_process_that_breaks_down_costs_nothing_but_time(sources: Path, program: str) -> None:
    assert printed(sources, before=other_in_place_of_it(program)) == "45 0 True"


def test_a_second_process_that_is_killed_at_work_costs_nothing_but_time(sources: Path) -> None:
    assert printed(sources, then=f"{TOLD}; process.kill()") == "45 0 True"


def test_a_second_process_that_hangs_is_ended(sources: Path) -> None:
    hangs = f"{other_in_place_of_it(HANGS)}; {IMPATIENT}"
    assert printed(sources, before=hangs) == "45 0 True"


def test_one_part_is_waited_for_and_the_rest_goes_on(sources: Path) -> None:
    assert printed(sources, then=TOLD_IN_TURN + HITS) == "1 True 45 1 True"


def test_no_other_part_is_waited_for(sources: Path) -> None:
    then = f"compiler.call(precompile); {TOLD_SLOW}; compiler.wait(precompile){HITS}"
    then += f"; print(compiler.has_done(slow), process.poll(), end=' '); {IMPATIENT}"
    assert printed(sources, then=then) == "1 True False None 45 0 True"


@pytest.mark.parametrize("program", ["import sys; sys.exit(3)", "import os; os.kill(os.getpid(), 9)"])
def test_one_that_breaks_down_while_a_part_is_waited_for_costs_nothing_but_time(sources: Path, program: str) -> None:
    assert printed(sources, before=other_in_place_of_it(program), then=TOLD_IN_TURN + HITS) == "0 True 45 0 True"


@pytest.mark.long
@pytest.mark.parametrize("number", ["SIGKILL", "SIGINT"])
def test_one_that_is_ended_while_a_part_is_waited_for_costs_nothing_but_time(sources: Path, number: str) -> None:
    end = f"import threading; threading.Timer({AT_WORK}, process.send_signal, [signal.{number}]).start(); "
    then = f"{end}{TOLD_SLOW}; compiler.call(precompile); compiler.wait(precompile){HITS}"
    then += "; assert process.returncode != -signal.SIGABRT"
    assert printed(sources, then=then) == "0 True 45 0 True"


def test_one_that_hangs_while_a_part_is_waited_for_is_ended_once(sources: Path) -> None:
    hangs = f"{other_in_place_of_it(HANGS)}; {IMPATIENT}"
    ended = "; assert process.poll() is not None; background.PATIENCE = 600.0"
    assert printed(sources, before=hangs, then=TOLD_IN_TURN + HITS + ended) == "0 True 45 0 True"


def test_what_cannot_be_done_ends_the_waiting(sources: Path) -> None:
    (sources / "rpf3d_core" / "terrain" / "sums.py").write_text(LOOP.replace("product(3)", "product(None)"))
    assert printed(sources, then=TOLD_IN_TURN + HITS) == "0 True 45 0 True"


def test_without_a_second_process_nothing_is_waited_for(sources: Path) -> None:
    alone = "background.has_spare_core = lambda: False"
    assert printed(sources, before=alone, then=TOLD_IN_TURN + HITS) == "0 True 45 0 False"


def test_a_second_process_that_cannot_be_started_costs_nothing(sources: Path) -> None:
    assert printed(sources, before="sys.executable = '/no/such/python'") == "45 0 False"


@pytest.mark.long
@pytest.mark.skipif(not hasattr(os, "pidfd_open"), reason="the system cannot tell when another's child ends")
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT], ids=["killed", "interrupted"])
@pytest.mark.parametrize(
    "then",
    ["{pid}; signal.pause()", f"{TOLD_SLOW}; {{pid}}; signal.pause()", f"{TOLD_SLOW}; {{pid}}; compiler.wait(slow)"],
    ids=["idle", "at work", "waited for"],
)
def test_the_second_process_never_outlives_the_first(sources: Path, number: int, then: str) -> None:
    with started(sources, then=then.format(pid="print(process.pid, flush=True)")) as first:
        assert first.stdout is not None
        second = os.pidfd_open(int(first.stdout.readline()))
        assert not select.select([second], [], [], AT_WORK)[0], "it ends before it should"
        first.send_signal(number)
        assert select.select([second], [], [], END_SOON)[0], "it goes on"
        os.close(second)
