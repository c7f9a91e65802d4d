"""Tests that public parts of the core have docstrings, with shapes and units in the interface between folders.

Reviewers check this for functions used only inside a folder, because a general rule would demand shapes also for
functions that take numbers and arrays alike.
"""

import ast
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import pytest
from suite.package_files import ROOT, files_of

CORE = files_of("rpf3d_core")

ARRAY = re.compile(r"\b(\w*Array|NDArray|ArrayLike|ndarray)\b")
FLOAT_ARRAY = re.compile(r"\b(FloatArray|ArrayLike)\b|float(64|32)")
SHAPE = re.compile(
    r"\([A-Zn0-9][A-Zn0-9 +*-]*(, ?[\w.+* -]+)*,?\)"  # (R, 3), (3,), (F,), (S + 1, 3)
    r"|\(\.\.\.(, ?\w+)*\)"  # (..., 3)
    r"|\b(each|per|one|a) (row|facet|rock|point|vertex)"  # one value per facet
)
UNIT = re.compile(
    r"(?<![\w-])(m|m2|m3|s|kg|J|N|rad|m/s2?|rad/s|kg/m3|1/m|degrees?|seconds?|metres?)(?![\w-])|_deg\b"
    r"|\(-\)|\[0, 1[\])]"
    r"|\b(unit|share|fraction|ratio|colou?r|RGBA?|normals?|directions?|vectors?|axes|indices|index|weights?|speeds?|energy|draws?)\b"
)
"""A unit, or a word that implies the unit or that there is none."""


class Public(NamedTuple):
    """A public function, method or class: its name as FILE:NAME, and its node in the syntax tree."""

    name: str
    node: ast.FunctionDef | ast.ClassDef


@cache
def tree_of(path: Path) -> ast.Module:
    return ast.parse(path.read_text())


def public(path: Path) -> Iterator[Public]:
    place = str(path.relative_to(ROOT))
    for node in tree_of(path).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
            yield Public(f"{place}:{node.name}", node)
            members = node.body if isinstance(node, ast.ClassDef) else []
            for member in members:
                if isinstance(member, ast.FunctionDef) and not member.name.startswith("_"):
                    yield Public(f"{place}:{node.name}.{member.name}", member)


PUBLIC = [item for path in CORE for item in public(path)]
FUNCTIONS = [item for item in PUBLIC if isinstance(item.node, ast.FunctionDef)]


def statements(tree: ast.Module) -> Iterator[ast.AST]:
    """Yield the module and all statements in it, at any depth.

    Expressions are skipped: they cannot contain an import, and they make up most of the tree.
    """
    waiting: list[ast.AST] = [tree]
    while waiting:
        node = waiting.pop()
        yield node
        for part in ("body", "orelse", "finalbody", "handlers", "cases"):
            if isinstance(inner := getattr(node, part, None), list):
                waiting += inner


def offered() -> set[str]:
    """Return the names of the core, as FILE:NAME, that files in other folders import."""
    found = set()
    for path in files_of("rpf3d_core", "rpf3d_ros", "test"):
        for node in statements(tree_of(path) if path in CORE else ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("rpf3d_core."):
                origin = ROOT / Path(*str(node.module).split(".")).with_suffix(".py")
                if origin.parent != path.parent:
                    found |= {f"{origin.relative_to(ROOT)}:{name.name}" for name in node.names}
    return found


OFFERED = offered()


def is_offered(item: Public) -> bool:
    place, _, name = item.name.partition(":")
    return f"{place}:{name.split('.')[0]}" in OFFERED


def annotations(function: ast.FunctionDef) -> str:
    arguments = [*function.args.posonlyargs, *function.args.args, *function.args.kwonlyargs]
    parts = [argument.annotation for argument in arguments] + [function.returns]
    return " ; ".join(ast.unparse(part) for part in parts if part is not None)


def fields(record: ast.ClassDef) -> dict[str, str]:
    return {
        node.target.id: ast.unparse(node.annotation)
        for node in record.body
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name) and not node.target.id.startswith("_")
    }


WITH_ARRAYS = [item for item in FUNCTIONS if is_offered(item) and ARRAY.search(annotations(item.node))]  # type: ignore[arg-type]
WITH_FLOATS = [item for item in WITH_ARRAYS if FLOAT_ARRAY.search(annotations(item.node))]  # type: ignore[arg-type]
RECORDS = [
    item
    for item in PUBLIC
    if isinstance(item.node, ast.ClassDef)
    and is_offered(item)
    and any(ARRAY.search(kind) for kind in fields(item.node).values())
]


def doc_of(item: Public) -> str:
    return ast.get_docstring(item.node) or ""


@pytest.mark.parametrize("path", CORE, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_file_with_code_says_what_it_is_for(path: Path) -> None:
    tree = tree_of(path)
    assert ast.get_docstring(tree) or not tree.body


@pytest.mark.parametrize("item", PUBLIC, ids=lambda item: item.name)
def test_a_public_name_says_what_it_is(item: Public) -> None:
    first_line = doc_of(item).partition("\n")[0]
    assert first_line, f"{item.name} has no docstring"
    assert first_line.endswith((".", "?", ":")), f"{item.name}: the first line is not a sentence"


@pytest.mark.parametrize("item", WITH_ARRAYS, ids=lambda item: item.name)
def test_a_function_of_arrays_tells_their_shapes(item: Public) -> None:
    assert SHAPE.search(doc_of(item)), f"{item.name} takes or gives arrays and tells no shape such as (R, 3)"


@pytest.mark.parametrize("item", WITH_FLOATS, ids=lambda item: item.name)
def test_a_function_of_float_arrays_tells_their_units(item: Public) -> None:
    assert UNIT.search(doc_of(item)), f"{item.name} takes or gives numbers and tells no unit"


@pytest.mark.parametrize("item", RECORDS, ids=lambda item: item.name)
def test_a_record_of_arrays_tells_each_of_them(item: Public) -> None:
    assert isinstance(item.node, ast.ClassDef)
    arrays = [name for name, kind in fields(item.node).items() if ARRAY.search(kind)]
    untold = [name for name in arrays if not re.search(rf"\b{name}\b", doc_of(item))]
    assert untold == []
    assert SHAPE.search(doc_of(item)) or re.search(r"\b[A-Z] (rows|columns)\b", doc_of(item))


@pytest.mark.parametrize(
    "text", ["(R, 3) m", "(3,)", "(F,)", "(..., 3)", "(S + 1, 3)", "(n + 1,) m", "one value a facet"]
)
def test_the_shape_rule_knows_a_shape(text: str) -> None:
    assert SHAPE.search(text)


@pytest.mark.parametrize("text", ["the points", "points (m)", "as given (see above)", "vertices, in order"])
def test_the_shape_rule_knows_what_is_none(text: str) -> None:
    assert not SHAPE.search(text)
