"""Tests of the mark `long`: no file has only long tests; the files that take longest run first."""

import ast
from pathlib import Path

import pytest
from longest_first import listing, longest_first, seconds_of_files

TESTS = Path(__file__).parents[1]
FILES = sorted(TESTS.rglob("test_*.py"))


def is_long(function: ast.FunctionDef) -> bool:
    """Return True if the whole test function is marked `long`."""
    return any(ast.unparse(decorator) == "pytest.mark.long" for decorator in function.decorator_list)


@pytest.mark.parametrize("path", FILES, ids=[str(path.relative_to(TESTS)) for path in FILES])
def test_every_file_has_a_test_that_is_not_long(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tests = [each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef) and each.name.startswith("test_")]
    assert not all(is_long(each) for each in tests)


def test_the_files_that_take_longest_come_first_and_the_others_stay_in_order() -> None:
    listed = [TESTS / file for file in seconds_of_files()]
    assert set(listed) < set(FILES), "the list names a file that is not there: see test/support/longest_first.py"
    others = [TESTS / "a.py", Path("/elsewhere/b.py"), TESTS / "c.py"]
    given = [*others[:2], *reversed(listed), others[2]]
    assert [given[i] for i in longest_first(given)][-3:] == others
    seconds = [seconds_of_files()[given[i].relative_to(TESTS).as_posix()] for i in longest_first(given)[:-3]]
    assert seconds == sorted(seconds, reverse=True)


def test_the_list_is_made_from_the_durations_that_pytest_prints() -> None:
    printed = """
    ===== slowest durations =====
    2.50s call     test/ros/nodes/test_a.py::test_a[1-test/b.py::x]
    12.00s setup    test/hard/test_b.py::test_b
    0.61s teardown test/ros/nodes/test_a.py::test_a[2]
    0.30s call     test/hard/test_c.py::test_c
    """
    assert listing(printed) == "12 hard/test_b.py\n3 ros/nodes/test_a.py\n"
