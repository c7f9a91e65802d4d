"""Tests of the documentation site: all pages are in its contents, and docstrings form the function reference."""

import ast
import re
from fnmatch import fnmatchcase
from pathlib import Path

import gallery
import pytest
from website.api_docstrings import as_rst

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(ROOT).as_posix() for path in DOCS.rglob("*.md"))
AT_THE_ROOT = [name for name in ("README.md", "CHANGELOG.rst", "CONTRIBUTING.md") if (ROOT / name).is_file()]


def settings(name: str) -> list[str]:
    """Return a list of the Sphinx settings by its name, read without importing the settings."""
    tree = ast.parse((DOCS / "website" / "conf.py").read_text(encoding="utf-8"))
    values = [node.value for node in tree.body if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == name]
    return list(ast.literal_eval(values[0]))


def contents() -> list[str]:
    """Return the entries of all tables of contents of the index: page names without a suffix, or patterns."""
    blocks = re.findall(r"^```\{toctree\}\n(.*?)^```", (DOCS / "index.md").read_text(), re.MULTILINE | re.DOTALL)
    lines = [line for block in blocks for line in block.splitlines() if line and not line.startswith(":")]
    return [line.removeprefix("../") if line.startswith("../") else f"docs/{line}" for line in lines]


def fits(name: str, pattern: str) -> bool:
    """Return whether a name matches a pattern as in Sphinx: a star does not match a slash."""
    return name.count("/") == pattern.count("/") and fnmatchcase(name, pattern)


@pytest.mark.parametrize("page", [*PAGES, *AT_THE_ROOT])
def test_every_page_is_part_of_the_site_and_of_its_table_of_contents(page: str) -> None:
    assert any(fits(page, pattern) for pattern in settings("include_patterns"))
    name = page.rpartition(".")[0]
    assert name == "docs/index" or [pattern for pattern in contents() if fits(name, pattern)]


def test_every_kind_of_page_has_an_entry_and_every_entry_a_page() -> None:
    names = [page.rpartition(".")[0] for page in [*PAGES, *AT_THE_ROOT]]
    made = "docs/api/*/index"
    assert [entry for entry in contents() if entry != made and not any(fits(name, entry) for name in names)] == []


@pytest.mark.parametrize(
    ("docstring", "rst"),
    [
        ("Return *x* of n_z, |v| and `a_b`.", r"Return \*x\* of n\_z, \|v\| and \ ``a_b``\ ."),
        ("See `values.Outcome`.", r"See \ :py:obj:`values.Outcome <rpf3d_core.values.Outcome>`\ ."),
        ("First.\n\nx : m; v, w : m/s\n    and rad/s", "First.\n\n* ``x``: m\n* ``v``, ``w``: m/s and rad/s"),
        ("Rules:\n- one\n  goes on\n- two", "Rules:\n\n* one goes on\n* two"),
        ("Raises\n------\nInputError\n    No file.", "**Raises**\n\n* \\ ``InputError``\\ : No file."),
        ("Parameters\n----------\npath : str\n    The file.", "**Parameters**\n\n* ``path``: str. The file."),
        (">>> f(a_b)\n1", ">>> f(a_b)\n1"),
    ],
)
def test_a_docstring_becomes_restructuredtext(docstring: str, rst: str) -> None:
    assert as_rst(docstring) == rst


def test_the_page_of_examples_is_as_the_scripts_say() -> None:
    assert gallery.PAGE.read_text(encoding="utf-8") == gallery.gallery(ROOT), "run: python docs/gallery.py"


def test_the_page_of_examples_shows_title_text_picture_and_script(tmp_path: Path) -> None:
    for place in ("examples", "docs/images/examples"):
        (tmp_path / place).mkdir(parents=True)
    (tmp_path / "examples" / "fly.py").write_text('"""Fly a rock.\n\nOne rock.\n"""\n')
    (tmp_path / "examples" / "_shared.py").write_text('"""Not an example."""\n')
    (tmp_path / "docs" / "images" / "examples" / "fly.png").touch()
    page = gallery.gallery(tmp_path)
    assert [line for line in page.splitlines() if line.startswith("#")] == ["# Examples", "## Fly a rock"]
    assert "\nOne rock.\n" in page and "(images/examples/fly.png)" in page and "(../examples/fly.py)" in page
