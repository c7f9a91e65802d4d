"""Tests that compiled code is never stale, works without a cache, and names models without a rule."""

import ast
import shutil
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest
from programs.command_line import ROOT, python

from rpf3d_core.jit import cache
from rpf3d_core.jit.cache import source_digest
from rpf3d_core.jit.dispatch import model_function
from rpf3d_core.kinetics.rebound import rebound

numba = pytest.importorskip("numba", reason="numba is not installed: there is nothing to compile")

HALF = "from rpf3d_core.jit.dispatch import kernel\n\n\n@kernel\ndef factor(x):\n    return {factor} * x\n"
LOOP = """\
from rpf3d_core.jit.dispatch import loop
from rpf3d_core.terrain.factor import factor


@loop
def total(n):
    s = 0
    for i in range(n):
        s += factor(i)
    return s
"""
OF_FLIGHTS, OF_COUNTS = "rpf3d_core.simulation.engines", "rpf3d_core.hazard.tally"
"""Modules whose loops simulate rocks and count them."""
IN_FLIGHTS = (
    "values.py", "jit/dispatch.py", "kinetics/rebound.py", "kinetics/rebounds/mass_scaled.py", "detection/contact.py",
    "effects/drag.py", "arc.py",
)  # fmt: skip
NOT_IN_FLIGHTS = (
    "cli.py", "commands/run.py", "runs/run.py", "results/summary.py", "recordings/log.py", "setup/prepared.py",
    "hazard/layers.py", "hazard/maps.py", "hazard/walks/visiting.py", "ensemble/flights.py", "terrain/mesh/welding.py",
    "terrain/mesh/faults.py", "jit/background.py",
)  # fmt: skip
RUN = "from rpf3d_core.terrain.total import total; print(total(10), len(total.stats.cache_hits))"


class Known(NamedTuple):
    """A model with a rule."""

    a: float


class Unknown(NamedTuple):
    """A model without one."""

    a: float


@model_function
def doubled(model: object, x: float) -> float:
    """Return a value that depends on the model."""


@doubled.rule(Known)
def known_doubled(model: Known, x: float) -> float:
    """Return 2 x + a."""
    return 2.0 * x + model.a


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """Return a copy of the package, whose sources may be edited."""
    root = tmp_path / "rpf3d_core"
    shutil.copytree(ROOT / "rpf3d_core", root, ignore=shutil.ignore_patterns("__pycache__"))
    (root / "terrain" / "factor.py").write_text(HALF.format(factor=2))
    (root / "terrain" / "total.py").write_text(LOOP)
    return root


def edit(package: Path) -> None:
    """Write another factor into a file of another size, because Python detects edits by size and time only."""
    (package / "terrain" / "factor.py").write_text(HALF.format(factor=3) + "# edited\n")


def digest_of(monkeypatch: pytest.MonkeyPatch, package: Path, module: str = OF_FLIGHTS) -> str:
    cache._digest.cache_clear()
    cache._package.cache_clear()
    monkeypatch.setattr(cache, "SOURCES", package)
    return source_digest(module)


def total_of(package: Path, **environment: str) -> tuple[int, int]:
    """Return the result of the compiled loop in a new process, and the number of loops loaded from the cache."""
    done = python(RUN, cwd=package.parent, PYTHONPATH=str(package.parent), **environment)
    assert done.returncode == 0, done.stderr
    answer, loaded = done.stdout.split()
    return int(answer), int(loaded)


def test_a_model_is_dispatched_on_its_class_in_python_and_compiled() -> None:
    compiled = numba.njit(lambda model, x: doubled(model, x))
    assert doubled(Known(1.0), 3.0) == compiled(Known(1.0), 3.0) == 7.0


def test_a_class_without_a_rule_is_named() -> None:
    with pytest.raises(TypeError, match="doubled has no rule for Unknown"):
        doubled(Unknown(1.0), 3.0)
    with pytest.raises(TypeError, match="rebound has no rule for Unknown"):
        rebound(Unknown(1.0), None, None, None, None)


def test_a_class_without_a_rule_is_named_by_compiled_calls_too() -> None:
    compiled = numba.njit(lambda model, x: doubled(model, x))
    with pytest.raises(Exception, match="doubled has no rule for Unknown"):
        compiled(Unknown(1.0), 3.0)


def test_a_model_function_keeps_the_name_and_the_words_of_its_stub() -> None:
    assert (doubled.__name__, doubled.__doc__) == ("doubled", "Return a value that depends on the model.")


@pytest.mark.parametrize("file", IN_FLIGHTS)
def test_the_digest_changes_when_the_source_of_a_kernel_changes(
    monkeypatch: pytest.MonkeyPatch, package: Path, file: str
) -> None:
    before = digest_of(monkeypatch, package)
    path = package / file
    path.write_text(path.read_text() + "\n")
    assert digest_of(monkeypatch, package) != before


@pytest.mark.parametrize("file", IN_FLIGHTS)
def test_the_digest_stays_when_a_docstring_changes(monkeypatch: pytest.MonkeyPatch, package: Path, file: str) -> None:
    before = digest_of(monkeypatch, package)
    path = package / file
    path.write_text(path.read_text().replace('"""', '"""Words.\n\n    More words.\n    ', 1))
    assert digest_of(monkeypatch, package) == before


def test_what_the_digest_leaves_out_are_statements_that_are_strings() -> None:
    """A string that the code uses, such as a text in brackets, must count."""
    for name, text in sources_in_the_package().texts.items():
        ends = (found.start() + len(found[0].rstrip()) for found in cache.DOCSTRING.finditer(text))
        left_out = {text.count("\n", 0, end) + 1 for end in ends}
        docs = {
            node.end_lineno for node in ast.walk(ast.parse(text))
            if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        }  # fmt: skip
        assert left_out <= docs, name


def test_no_two_loops_of_a_file_have_the_same_name() -> None:
    """The names of the files in the cache do not have line numbers, which change with docstrings."""
    for name in sources_in_the_package().texts:
        if "@loop" in sources_in_the_package().texts[name]:
            import_module(f"rpf3d_core.{name.replace('/', '.')}")
    names = [(each.__module__, each.py_func.__qualname__) for each in cache.LOOPS]
    assert len(names) > 50 and len(set(names)) == len(names)


@pytest.mark.parametrize("file", NOT_IN_FLIGHTS)
def test_the_digest_of_flights_stays_when_a_file_changes_that_no_flight_calls(
    monkeypatch: pytest.MonkeyPatch, package: Path, file: str
) -> None:
    before = digest_of(monkeypatch, package)
    path = package / file
    path.write_text(path.read_text() + "\n")
    assert digest_of(monkeypatch, package) == before


def test_an_edit_of_what_counts_recompiles_what_counts(monkeypatch: pytest.MonkeyPatch, package: Path) -> None:
    before = digest_of(monkeypatch, package, OF_COUNTS)
    path = package / "hazard" / "bins.py"
    path.write_text(path.read_text() + "\n")
    assert digest_of(monkeypatch, package, OF_COUNTS) != before


def sources_in_the_package() -> cache.PackageSources:
    root = ROOT / "rpf3d_core"
    files = {path.relative_to(root).with_suffix("").as_posix(): path.read_text() for path in root.rglob("*.py")}
    return cache.PackageSources(files)


@pytest.mark.parametrize("module", [OF_FLIGHTS, OF_COUNTS, "rpf3d_core.hazard.walks.visiting"])
def test_every_module_that_is_imported_with_a_loop_counts_in_its_digest(module: str) -> None:
    """Python's import lists the modules, independently of the search in the sources."""
    package = sources_in_the_package()
    counted = package.kernel_sources(module.removeprefix("rpf3d_core.").replace(".", "/"))
    listing = f"import sys; import {module}; print(*(n for n in sys.modules if 'rpf3d_core.' in n))"
    loaded = {name.removeprefix("rpf3d_core.").replace(".", "/") for name in python(listing).stdout.split()}
    files = {name for name in loaded if name in package.texts}
    assert len(files) > 15 and files <= counted


def test_every_rule_that_is_registered_for_flights_counts_in_their_digest() -> None:
    """The registered rules themselves are compared, after all files with physics are imported."""
    counted = sources_in_the_package().kernel_sources("simulation/engines")
    registered = set()
    for name in sources_in_the_package().texts:
        if name.split("/")[0] in ("materials", "kinetics", "detection", "effects", "simulation"):
            for each in vars(import_module(f"rpf3d_core.{name.replace('/', '.')}")).values():
                rules = getattr(getattr(each, "has_rule", None), "__self__", {})
                registered |= {rule.__module__.removeprefix("rpf3d_core.").replace(".", "/") for rule in rules.values()}
    registered &= set(sources_in_the_package().texts)  # a test may have registered a rule of its own
    assert len(registered) > 30 and registered <= counted


def test_the_sources_of_a_loop_are_what_it_imports_and_the_rules_of_the_models_it_calls() -> None:
    texts = {
        "a": "from rpf3d_core.b import (\n    x,\n)  # fmt: skip\n\n@loop\ndef f(): ...",
        "b": "from rpf3d_core.c import d as e  # and no more\n", "c/d": "", "e": "from rpf3d_core.a import f\n",
        "f": "@loop\ndef g(): ...", "g": "@model_function\ndef way(model): ...",
        "h": "from rpf3d_core.g import way\n\n@way.rule(H)\ndef h_way(model): ...",
        "i": "    from rpf3d_core.g import way\n\n@loop\ndef j(): ...",
    }  # fmt: skip
    package = cache.PackageSources(texts)
    assert package.kernel_sources("a") == {"a", "b", "c/d"}
    assert package.kernel_sources("f") == {"f"}
    assert package.kernel_sources("i") == {"i", "g", "h"}
    assert package.kernel_sources("outside") == set(texts)


def test_a_rule_of_a_model_function_that_is_not_found_counts_for_all_loops() -> None:
    package = cache.PackageSources({"a": "@loop\ndef f(): ...", "b": "@other.rule(B)\ndef g(model): ..."})
    assert package.kernel_sources("a") == {"a", "b"}


def test_what_was_compiled_is_kept_for_the_next_process(package: Path, tmp_path: Path) -> None:
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert total_of(package, **home) == (90, 0)
    assert total_of(package, **home) == (90, 1)


def test_what_was_compiled_is_kept_for_the_same_sources_elsewhere(package: Path, tmp_path: Path) -> None:
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert total_of(package, **home) == (90, 0)
    elsewhere = tmp_path / "elsewhere" / package.name
    shutil.copytree(package, elsewhere)
    assert total_of(elsewhere, **home) == (90, 1)
    edit(elsewhere)
    assert total_of(elsewhere, **home) == (135, 0)
    assert total_of(package, **home) == (90, 1)


def test_where_numba_has_no_list_of_places_each_copy_compiles_for_itself(package: Path, tmp_path: Path) -> None:
    moved = "from numba.core.caching import CacheImpl as c; c._locator_classes = tuple(c._locator_classes)\n"
    said = [
        python(moved + RUN, cwd=package.parent, PYTHONPATH=str(package.parent), XDG_CACHE_HOME=str(tmp_path / "cache"))
        for _ in range(2)
    ]
    assert [each.stdout.split() for each in said] == [["90", "0"], ["90", "1"]], said
    assert not list((tmp_path / "cache").rglob("*-numba-*"))


def test_an_edit_of_a_docstring_compiles_nothing(package: Path, tmp_path: Path) -> None:
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert total_of(package, **home) == (90, 0)
    for file in ("factor.py", "total.py"):
        path = package / "terrain" / file
        path.write_text('"""A module.\n\nIts lines move.\n"""\n\n' + path.read_text())
    assert total_of(package, **home) == (90, 1)


def test_an_edit_in_a_file_that_a_loop_calls_is_never_run_stale(package: Path, tmp_path: Path) -> None:
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert total_of(package, **home)[0] == 90
    edit(package)
    assert total_of(package, **home) == (135, 0)


def test_a_home_that_cannot_be_written_to_costs_a_compilation_and_no_failure(package: Path) -> None:
    for _ in range(2):
        assert total_of(package, HOME="/dev/null", XDG_CACHE_HOME="")[0] == 90


def test_a_home_that_cannot_be_written_to_never_runs_stale_code(package: Path) -> None:
    nowhere = {"HOME": "/dev/null", "XDG_CACHE_HOME": ""}
    assert total_of(package, **nowhere)[0] == 90
    edit(package)
    assert total_of(package, **nowhere)[0] == 135
    assert not list(package.rglob("*.nbi")), "nothing is written beside the sources"
