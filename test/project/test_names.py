"""Tests that each class of the packages has a name of its own, and that no function has many parameters."""

import ast
from collections import defaultdict
from collections.abc import Iterator

import pytest
from suite.package_files import PACKAGES, ROOT, files_of

MOST_PARAMETERS = 7
"""Largest number of parameters of a function, besides `self` and `cls`; more parameters belong in a record."""

EXCEPTIONS = {
    "rpf3d_ros/alerts/alert_desk.py: AlertDesk.__init__",
    "rpf3d_ros/engine/builder.py: Builder.__init__",
    "rpf3d_ros/recording/from_bag_command.py: from_bag",  # each parameter is an option of the command
}
"""Functions that may have more parameters."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


@pytest.fixture(scope="module")
def trees() -> dict[str, ast.Module]:
    return {
        path.relative_to(ROOT).as_posix(): ast.parse(path.read_text(encoding="utf-8")) for path in files_of(*PACKAGES)
    }


def classes_of(tree: ast.AST) -> Iterator[str]:
    """Yield the names of the classes in a tree, except classes inside functions, which no other file can import."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.ClassDef):
            yield node.name
        if not isinstance(node, Function):
            yield from classes_of(node)


def functions_of(tree: ast.AST, before: str = "") -> Iterator[tuple[str, Function]]:
    """Yield the functions in a tree with their names, such as `Desk.close`; before : name of the tree with a dot."""
    for node in ast.iter_child_nodes(tree):
        name = before
        if isinstance(node, Function | ast.ClassDef):
            name = f"{before}{node.name}"
            if isinstance(node, Function):
                yield name, node
            name += "."
        yield from functions_of(node, name)


def parameters_of(function: Function) -> list[str]:
    """Return the names of the parameters of a function without `self` and `cls`; `*rest` and `**rest` count, too."""
    given = function.args
    named = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    return [each.arg for each in named if each is not None and each.arg not in ("self", "cls")]


def with_many_parameters(tree: ast.AST) -> list[str]:
    return [name for name, function in functions_of(tree) if len(parameters_of(function)) > MOST_PARAMETERS]


def shared_names(trees: dict[str, ast.Module]) -> dict[str, list[str]]:
    """Return name -> files for each name of several classes."""
    files = defaultdict(list)
    for path, tree in trees.items():
        for name in classes_of(tree):
            files[name].append(path)
    return {name: paths for name, paths in files.items() if len(paths) > 1}


def test_no_two_classes_have_the_same_name(trees: dict[str, ast.Module]) -> None:
    assert shared_names(trees) == {}, "rename the class that fewer files use, so that its name tells the two apart"


def test_no_function_has_many_parameters(trees: dict[str, ast.Module]) -> None:
    many = {f"{path}: {name}" for path, tree in trees.items() for name in with_many_parameters(tree)}
    assert many - EXCEPTIONS == set(), "pass some of the parameters together, in a NamedTuple or dataclass"
    assert EXCEPTIONS - many == set(), "these functions need no exception any more"


@pytest.mark.parametrize(
    ("one", "other", "shared"),
    [
        ("class A: ...", "class A: ...", True),
        ("class A: ...", "class B:\n class A: ...", True),
        ("class A: ...", "if True:\n class A: ...", True),
        ("class A: ...", "class B: ...", False),
        ("class A: ...", "from one import A", False),
        ("class A: ...", "def f():\n class A: ...", False),
    ],
)
def test_the_rule_of_names_itself_can_say_no(one: str, other: str, shared: bool) -> None:
    assert bool(shared_names({"one.py": ast.parse(one), "other.py": ast.parse(other)})) is shared


@pytest.mark.parametrize(
    ("source", "many"),
    [
        ("def f(a, b, c, d, e, f, g): ...", []),
        ("def f(a, b, c, d, e, f, g, h): ...", ["f"]),
        ("async def f(a, b, c, /, d, e, f, *, g, h): ...", ["f"]),
        ("def f(a, b, c, d, e, f, *g, **h): ...", ["f"]),
        ("class A:\n def f(self, a, b, c, d, e, f, g): ...", []),
        ("class A:\n def f(self, a, b, c, d, e, f, g, h): ...", ["A.f"]),
        ("def f():\n def g(a, b, c, d, e, f, g, h): ...", ["f.g"]),
    ],
)
def test_the_rule_of_parameters_itself_can_say_no(source: str, many: list[str]) -> None:
    assert with_many_parameters(ast.parse(source)) == many
