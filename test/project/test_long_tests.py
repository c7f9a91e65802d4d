"""Tests of the mark `long`: no file has only long tests; the files that take longest run first."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest
from suite.longest_first import (
    KEPT,
    files_listed,
    is_long,
    lone_loops,
    long_listed,
    long_tests,
    longest_first,
    seconds_of_files,
    seconds_of_functions,
    shuffled,
)

TESTS = Path(__file__).parents[1]
FILES = sorted(TESTS.rglob("test_*.py"))


def functions_in(path: Path) -> list[ast.FunctionDef]:
    """Return the test functions of a file."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    return [each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef) and each.name.startswith("test_")]


def is_marked(function: ast.FunctionDef) -> bool:
    """Return True if the whole test function is marked `long`."""
    return any(ast.unparse(decorator) == "pytest.mark.long" for decorator in function.decorator_list)


@pytest.mark.parametrize("path", FILES, ids=[str(path.relative_to(TESTS)) for path in FILES])
def test_every_file_has_a_test_that_is_not_long(path: Path) -> None:
    listed, name = long_tests(), path.relative_to(TESTS).as_posix()
    assert not all(is_marked(each) or f"{name}::{each.name}" in listed for each in functions_in(path))


def test_the_list_of_long_tests_names_tests_that_are_there() -> None:
    there = {f"{path.relative_to(TESTS).as_posix()}::{each.name}" for path in FILES for each in functions_in(path)}
    assert set(long_tests()) - there == set(), "the list names a test that is not there: see longest_first.py"
    assert lone_loops() - there == set() == lone_loops() & set(long_tests()), "see longest_first.py"


def test_of_a_test_that_alone_needs_a_loop_the_reference_engine_is_in_make_test() -> None:
    both = min(each for each in lone_loops() if each.startswith("effects/test_barriers.py"))
    assert is_long(f"{both}[0.1-compiled]") and is_long(both) and not is_long(f"{both}[0.1-reference]")
    assert is_long(f"{next(iter(long_tests()))}[reference]") and not is_long("effects/test_x.py::test_x[compiled]")


def test_a_long_test_is_one_that_takes_long_is_not_the_quickest_of_its_file_and_is_not_kept() -> None:
    seconds = {
        "a/test_a.py::test_quick": 0.1, "a/test_a.py::test_short": 0.9, "a/test_a.py::test_slow": 9.0,
        "b/test_b.py::test_only": 20.0, "b/test_b.py::test_slower": 30.0, f"{KEPT[-1]}test_x": 40.0,
        f"{KEPT[-1]}test_y": 50.0,
    }  # fmt: skip
    assert long_listed(seconds) == "30.0 b/test_b.py::test_slower\n9.0 a/test_a.py::test_slow\n"


def test_listed_tests_are_not_among_those_of_make_test(pytestconfig: pytest.Config) -> None:
    command = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-p", "no:cacheprovider", "-m"]
    name, function = next(iter(long_tests())).split("::")
    file, found = str(TESTS / name), {}
    for marks in ("long", "not long"):
        done = subprocess.run([*command, marks, file], cwd=pytestconfig.rootpath, capture_output=True, text=True)
        found[marks] = {line.partition("[")[0].partition("::")[2] for line in done.stdout.splitlines() if "::" in line}
    assert function in found["long"] and function not in found["not long"] and found["not long"]


def test_the_files_that_take_longest_come_first_and_the_others_stay_in_order() -> None:
    listed = [TESTS / file for file in seconds_of_files()]
    assert set(listed) < set(FILES), "the list names a file that is not there: see test/support/suite/longest_first.py"
    others = [TESTS / "a.py", Path("/elsewhere/b.py"), TESTS / "c.py"]
    given = [*others[:2], *reversed(listed), others[2]]
    assert [given[i] for i in longest_first(given)][-3:] == others
    seconds = [seconds_of_files()[given[i].relative_to(TESTS).as_posix()] for i in longest_first(given)[:-3]]
    assert seconds == sorted(seconds, reverse=True)


def test_the_lists_are_made_from_the_durations_that_pytest_prints() -> None:
    printed = """
    ===== slowest durations =====
    2.50s call     test/ros/nodes/test_a.py::test_a[1-test/b.py::x]
    12.00s setup    test/hard/test_b.py::test_b
    0.61s teardown test/ros/nodes/test_a.py::test_a[2]
    0.30s call     test/hard/test_c.py::test_c
    """
    seconds = seconds_of_functions(printed)
    assert files_listed(seconds) == "12 hard/test_b.py\n3 ros/nodes/test_a.py\n"
    assert seconds["ros/nodes/test_a.py::test_a"] == pytest.approx(3.11)


def test_each_turn_has_the_files_in_another_order_and_keeps_the_tests_of_a_file_together() -> None:
    files = [TESTS / name for name in ("a.py", "b.py", "b.py", "c.py", "d.py")]
    orders = [[files[i].name for i in shuffled(files, turn)] for turn in range(50)]
    assert all(sorted(order) == sorted(file.name for file in files) for order in orders)
    assert all(order.index("b.py") + 1 == len(order) - 1 - order[::-1].index("b.py") for order in orders)
    assert {order[0] for order in orders} == {"a.py", "b.py", "c.py", "d.py"}
    assert shuffled(files, 7) == shuffled(files, 7)


@pytest.mark.parametrize(("last_start", "outcome"), [("1", "1 skipped"), ("9e9", "1 passed")])
def test_a_test_is_skipped_with_the_reason_if_it_would_begin_too_late(
    last_start: str, outcome: str, pytestconfig: pytest.Config
) -> None:
    test = f"{TESTS}/project/test_long_tests.py::test_the_list_of_long_tests_names_tests_that_are_there"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-rs", "-p", "no:cacheprovider", test], cwd=pytestconfig.rootpath,
        env=os.environ | {"RPF3D_LAST_START": last_start}, capture_output=True, text=True,
    )  # fmt: skip
    assert outcome in done.stdout
    assert ("no time is left for this test" in done.stdout) == (outcome == "1 skipped")
