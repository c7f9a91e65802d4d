"""The safety argument of the alerts names tests that exist, and has a line for every number in its table of inputs."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
PAGE = TESTS.parent / "docs" / "explanation" / "safety-argument.md"
TEXT = PAGE.read_text(encoding="utf-8")
NAMED = re.findall(r"`([\w/]+\.py)::(\w+)`", TEXT)


@cache
def functions_in(file: str) -> set[str]:
    """Return the names of the functions in a file of `test/`."""
    tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize(("file", "name"), NAMED, ids=lambda part: part.rsplit("/", 1)[-1])
def test_a_test_that_the_argument_names_exists(file: str, name: str) -> None:
    assert name in functions_in(file)


def test_every_line_is_shown_by_a_test_or_by_lines_below_it() -> None:
    lines = re.findall(r"^\| ([\d.]+) \|[^|]*\| (.*) \|$", TEXT, re.MULTILINE)
    assert len(lines) > 30
    assert [number for number, shown in lines if "::" not in shown and not re.match(r"\d+\.\d", shown)] == []


def test_the_table_of_inputs_refers_to_lines_of_the_argument() -> None:
    numbers = set(re.findall(r"^\| ([\d.]+) \|", TEXT, re.MULTILINE))
    table = TEXT.split("## What can be wrong with an input?")[1].split("## ")[0]
    referred = set(re.findall(r"\b\d\.\d\b", table))
    assert len(referred) > 10
    assert referred <= numbers
