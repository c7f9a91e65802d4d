"""Each line of the safety argument of the alerts has tests that exist, and its table of inputs names existing lines."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parents[1]
DOCS = TESTS.parent / "docs"
TEXT = (DOCS / "explanation" / "safety-argument.md").read_text(encoding="utf-8")
LINES = re.findall(r"^- \*\*([\d.]+)\*\* ", TEXT, re.MULTILINE)
SHOWN = (DOCS / "reference" / "safety-tests.md").read_text(encoding="utf-8")
NAMED = re.findall(r"`([\w/]+\.py)::(\w+)`", SHOWN)


@cache
def functions_in(file: str) -> set[str]:
    """Return the names of the functions in a file of `test/`."""
    tree = ast.parse((TESTS / file).read_text(encoding="utf-8"))
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)}


@pytest.mark.parametrize(("file", "name"), NAMED, ids=lambda part: part.rsplit("/", 1)[-1])
def test_a_test_that_the_argument_names_exists(file: str, name: str) -> None:
    assert name in functions_in(file)


def test_every_line_has_a_section_with_a_test() -> None:
    sections = re.split(r"^### ([\d.]+)$", SHOWN, flags=re.MULTILINE)
    assert len(LINES) > 50
    assert sections[1::2] == LINES
    assert [line for line, text in zip(sections[1::2], sections[2::2], strict=True) if "::" not in text] == []


def test_the_table_of_inputs_refers_to_lines_of_the_argument() -> None:
    table = TEXT.split("## What can be wrong with an input?")[1].split("## ")[0]
    referred = set(re.findall(r"\b\d\.\d+\b", table))
    assert len(referred) > 10
    assert referred <= set(LINES)


def test_the_dangers_that_are_not_covered_refer_to_lines_of_the_argument() -> None:
    dangers = TEXT.split("## Which dangers are not covered?")[1]
    referred = {line for named in re.findall(r"\(([\d., ]+)\)", dangers) for line in named.split(", ")}
    assert len(referred) > 10
    assert referred <= set(LINES)
