"""Tests that are marked `long` are left out of `make test`: every file must still have a test in it."""

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
FILES = sorted(TESTS.rglob("test_*.py"))


def is_long(function: ast.FunctionDef) -> bool:
    """True if a test is marked as a whole."""
    return any(ast.unparse(decorator) == "pytest.mark.long" for decorator in function.decorator_list)


@pytest.mark.parametrize("path", FILES, ids=[str(path.relative_to(TESTS)) for path in FILES])
def test_every_file_has_a_test_that_is_not_long(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    tests = [each for each in ast.walk(tree) if isinstance(each, ast.FunctionDef) and each.name.startswith("test_")]
    assert not all(is_long(each) for each in tests)
