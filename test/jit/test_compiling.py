"""Compiled code is never stale, costs nothing but time where it cannot be kept, and names what it does not know."""

import shutil
from pathlib import Path
from typing import NamedTuple

import pytest
from command_line import ROOT, python

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
OF_KERNELS = ("values.py", "jit/dispatch.py", "kinetics/rebound.py", "detection/contact.py", "arc.py")
OF_NO_KERNEL = (
    "cli.py", "commands/run.py", "runs/run.py", "results/summary.py", "recordings/log.py", "setup/prepared.py",
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
    """Twice or whatever."""


@doubled.rule(Known)
def known_doubled(model: Known, x: float) -> float:
    """Twice, and more."""
    return 2.0 * x + model.a


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A copy of the package, whose sources may be edited."""
    root = tmp_path / "rpf3d_core"
    shutil.copytree(ROOT / "rpf3d_core", root, ignore=shutil.ignore_patterns("__pycache__"))
    (root / "terrain" / "factor.py").write_text(HALF.format(factor=2))
    (root / "terrain" / "total.py").write_text(LOOP)
    return root


def edit(package: Path) -> None:
    """Another factor, in a file of another size: Python's own byte code is stale where size and second are the same."""
    (package / "terrain" / "factor.py").write_text(HALF.format(factor=3) + "# edited\n")


def digest_of(monkeypatch: pytest.MonkeyPatch, package: Path) -> str:
    cache._digest.cache_clear()
    monkeypatch.setattr(cache, "SOURCES", package)
    return source_digest()


def total_of(package: Path, **environment: str) -> tuple[int, int]:
    """The answer of the compiled loop in a fresh process, and how many of its compilations were loaded."""
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
    assert (doubled.__name__, doubled.__doc__) == ("doubled", "Twice or whatever.")


@pytest.mark.parametrize("file", OF_KERNELS)
def test_the_digest_changes_when_the_source_of_a_kernel_changes(
    monkeypatch: pytest.MonkeyPatch, package: Path, file: str
) -> None:
    before = digest_of(monkeypatch, package)
    path = package / file
    path.write_text(path.read_text() + "\n")
    assert digest_of(monkeypatch, package) != before


@pytest.mark.parametrize("file", OF_NO_KERNEL)
def test_the_digest_stays_when_a_file_without_kernels_changes(
    monkeypatch: pytest.MonkeyPatch, package: Path, file: str
) -> None:
    before = digest_of(monkeypatch, package)
    path = package / file
    path.write_text(path.read_text() + "\n")
    assert digest_of(monkeypatch, package) == before


def test_every_module_that_is_imported_with_a_kernel_counts_in_the_digest() -> None:
    """Asked of Python's own import, which shares nothing with the search through the sources."""
    root = ROOT / "rpf3d_core"
    texts = {path.relative_to(root).with_suffix("").as_posix(): path.read_text() for path in root.rglob("*.py")}
    counted = cache.kernel_sources(texts)
    listing = "import sys; import rpf3d_core.simulation.engines; print(*(n for n in sys.modules if 'rpf3d_core.' in n))"
    loaded = {name.removeprefix("rpf3d_core.").replace(".", "/") for name in python(listing).stdout.split()}
    files = {name for name in loaded if name in texts}
    assert len(files) > 30 and files <= counted


def test_a_file_without_kernels_that_no_kernel_imports_does_not_count() -> None:
    texts = {
        "a": "from rpf3d_core.b import (\n    x,\n)\n\n@kernel\ndef f(): ...", "b": "from rpf3d_core.c import d as e\n",
        "c/d": "", "e": "from rpf3d_core.a import f\n", "f": "# @kernel\n",
    }  # fmt: skip
    assert cache.kernel_sources(texts) == {"a", "b", "c/d"}


def test_what_was_compiled_is_kept_for_the_next_process(package: Path, tmp_path: Path) -> None:
    home = {"XDG_CACHE_HOME": str(tmp_path / "cache")}
    assert total_of(package, **home) == (90, 0)
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
