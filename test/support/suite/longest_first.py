"""Order the test files, longest first, and select the tests that `make test` leaves out because they take long.

Two lists are made from measured times: longest_files.txt and long_tests.txt. In long_tests.txt are the functions whose
examples take more than LONGEST in total, except the quickest function of each file and the functions in KEPT. So
`make test` has tests of every file. This command rewrites both lists from the durations that pytest prints. Run it on
an idle machine, and again if it compiled loops:

    make test-all PYTEST_ADDOPTS=--durations=0 | .venv/bin/python test/support/suite/longest_first.py

A third list, lone_loops.txt, is kept by hand: functions that alone need a compiled loop. Where no loop is compiled yet,
each of these loops takes 20 to 100 s. So `make test` runs only the examples of these functions that name the reference
engine, if there are any.
"""

import re
import sys
from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from random import Random

TESTS = Path(__file__).parents[2]
LIST = Path(__file__).with_name("longest_files.txt")
"""File with one line for each test file, longest first: the seconds of its tests, and its path in the folder `test`."""
LONG_LIST = Path(__file__).with_name("long_tests.txt")
"""File with one line for each long test function, longest first: its seconds, its file in `test`, and its name."""
LONE_LIST = Path(__file__).with_name("lone_loops.txt")
"""File with one line for each function that alone needs a compiled loop: its file in `test`, and its name."""
SHORT = 3.0
"""Smallest time (s) of a test file in LIST; files that are not listed run last."""
LONGEST = 1.0
"""Largest time (s) of all examples of a test function that `make test` runs."""
KEPT = (
    "project/test_golden.py::test_an_entry_has_the_golden_results",
    "ros/faults/test_false_greens.py::",
    "ros/faults/test_never_green.py::",
    "commands/test_first_scenes.py::",
    "hard/test_never_below.py::",
    "project/test_docs.py::",
    "project/test_layers.py::",
    "project/test_names.py::",
    "project/test_package.py::",
)
"""First characters of functions that `make test` always runs, such as those of equal results and false greens."""
DURATION = re.compile(r"^ *([\d.]+)s (?:setup|call|teardown) +test/([\w/]+\.py)::(\w+)", re.MULTILINE)


def seconds_of_files() -> dict[str, float]:
    """Return the time (s) of each file in LIST, by its path in the folder `test`."""
    return _seconds_in(LIST)


@cache
def long_tests() -> dict[str, float]:
    """Return the time (s) of each function in LONG_LIST, by its file and name: `hard/test_gaps.py::test_x`."""
    return _seconds_in(LONG_LIST)


def is_long(node: str) -> bool:
    """Return True if a list leaves out a test of `make test`; node : its name, as in `hard/test_gaps.py::test_x[1]`."""
    function, _, example = node.partition("[")
    return function in long_tests() or (function in lone_loops() and "reference" not in example)


@cache
def lone_loops() -> frozenset[str]:
    """Return the functions in LONE_LIST, by file and name: `hard/test_gaps.py::test_x`."""
    return frozenset(LONE_LIST.read_text(encoding="utf-8").split())


def _seconds_in(path: Path) -> dict[str, float]:
    rows = (line.split() for line in path.read_text(encoding="utf-8").splitlines())
    return {name: float(seconds) for seconds, name in rows}


def longest_first(files: Iterable[Path]) -> list[int]:
    """Return the indices of files, longest file first; files with equal times keep their order."""
    seconds = seconds_of_files()
    taken = [seconds.get(file.relative_to(TESTS).as_posix(), 0.0) if TESTS in file.parents else 0.0 for file in files]
    return sorted(range(len(taken)), key=lambda i: -taken[i])


def shuffled(files: Iterable[Path], turn: int) -> list[int]:
    """Return the indices of files in a random order of the files, a different order for each turn.

    The tests of a file stay together. If a run has no time for all tests, each file comes early in some of the turns.

    turn : any number, for example how many commits there are
    """
    given = list(files)
    order = sorted(set(given))
    Random(turn).shuffle(order)
    place = {file: k for k, file in enumerate(order)}
    return sorted(range(len(given)), key=lambda i: place[given[i]])


def seconds_of_functions(durations: str) -> Counter[str]:
    """Return the time (s) of each test function, by file and name, from the durations that pytest has printed."""
    seconds: Counter[str] = Counter()
    for taken, file, function in DURATION.findall(durations):
        seconds[f"{file}::{function}"] += float(taken)  # type: ignore[assignment]
    return seconds


def files_listed(seconds: Mapping[str, float]) -> str:
    """Return the text of LIST; seconds : of each test function (s)."""
    files: Counter[str] = Counter()
    for function, taken in seconds.items():
        files[function.partition("::")[0]] += taken  # type: ignore[assignment]
    return "".join(f"{taken:.0f} {file}\n" for file, taken in files.most_common() if taken >= SHORT)


def long_listed(seconds: Mapping[str, float]) -> str:
    """Return the text of LONG_LIST; seconds : of each test function (s)."""
    of_file: defaultdict[str, list[str]] = defaultdict(list)
    for function in sorted(seconds, key=lambda each: (seconds[each], each)):
        of_file[function.partition("::")[0]].append(function)
    long = [
        function for functions in of_file.values() for function in functions[1:]
        if seconds[function] > LONGEST and not function.startswith(KEPT)
    ]  # fmt: skip
    return "".join(f"{seconds[each]:.1f} {each}\n" for each in sorted(long, key=lambda each: (-seconds[each], each)))


if __name__ == "__main__":
    measured = seconds_of_functions(sys.stdin.read())
    LIST.write_text(files_listed(measured), encoding="utf-8")
    LONG_LIST.write_text(long_listed(measured), encoding="utf-8")
