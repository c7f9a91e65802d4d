"""Tests that the check of `make lint` finds words that the texts of rpf3d avoid, and too long lines of pages."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest
from suite import habits

HABITS = Path(habits.__file__)
ENTRIES = habits.DICTIONARY.read_text(encoding="utf-8").splitlines()

needs_codespell = pytest.mark.skipif(
    importlib.util.find_spec("codespell_lib") is None, reason="codespell is not installed: it is in the extra `test`"
)


def check(*paths: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, str(HABITS), *map(str, paths)], capture_output=True, text=True, check=False)


@needs_codespell
def test_a_page_with_each_given_up_word_fails_and_names_each_of_them(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("".join(f"Here {entry.partition('->')[0]} stands.\n" for entry in ENTRIES), encoding="utf-8")
    done = check(page)
    assert done.returncode != 0
    assert [line.split(":")[1] for line in done.stdout.splitlines()] == [str(n + 1) for n in range(len(ENTRIES))]


@needs_codespell
@pytest.mark.parametrize(
    "text",
    ['"""Fly it anew."""\n', "x = 1  # nobody reads\n", '"""Fly.\n\nIt is dearer."""\n', 'X = 1\n"""Once more."""\n'],
)
def test_a_comment_or_a_docstring_with_a_given_up_word_fails(tmp_path: Path, text: str) -> None:
    module = tmp_path / "module.py"
    module.write_text(text, encoding="utf-8")
    done = check(module)
    assert done.returncode != 0
    assert f"module.py:{len(text.splitlines())}:" in done.stdout


@needs_codespell
@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("page.md", "The key `told`, and a block:\n```yaml\ntold: anew\n```\nPeik, Tschamut, Authume, Chant Sura.\n"),
        ("module.py", 'told = "anew"\n"""Names of `told`.\n\nsaid : sentences; heard, told : topics\n"""\n'),
    ],
)
def test_code_and_names_pass(tmp_path: Path, name: str, text: str) -> None:
    (tmp_path / name).write_text(text, encoding="utf-8")
    done = check(tmp_path / name)
    assert (done.returncode, done.stdout) == (0, "")


@needs_codespell
@pytest.mark.parametrize("name", ["page.md", "page.rst"])
@pytest.mark.parametrize("text", ["word " * 32 + "end", f"| {'cell ' * 32}|", f"```\n{'x' * 161}\n```"])
def test_a_page_with_a_line_of_more_than_160_characters_fails_also_in_a_table_or_in_code(
    tmp_path: Path, name: str, text: str
) -> None:
    (tmp_path / name).write_text(f"A page.\n\n{text}\n", encoding="utf-8")
    done = check(tmp_path / name)
    line = 3 + text.count("\n") // 2
    assert done.returncode != 0
    assert done.stdout.startswith(f"{name}:{line}: the line has ") and len(done.stdout.splitlines()) == 1


@needs_codespell
def test_a_line_of_160_characters_and_a_long_line_of_a_module_pass(tmp_path: Path) -> None:
    (tmp_path / "page.md").write_text("é" * 160 + "\n", encoding="utf-8")
    (tmp_path / "module.py").write_text(f"x = '{'y' * 200}'\n", encoding="utf-8")
    done = check(tmp_path / "page.md", tmp_path / "module.py")
    assert (done.returncode, done.stdout) == (0, "")


def test_no_line_of_a_page_of_the_project_is_too_long() -> None:
    assert habits.long_lines(habits.all_prose()) == []


def test_each_entry_offers_a_better_word_and_is_never_replaced_by_a_program() -> None:
    # A comma at the end keeps `codespell -w` from replacing a word, because only a reader can choose the replacement.
    assert [entry for entry in ENTRIES if not entry.partition("->")[2].endswith(",")] == []


def test_all_prose_holds_the_pages_and_the_code() -> None:
    files = {str(path.relative_to(habits.ROOT)) for path in habits.all_prose()}
    assert {"README.md", "docs/index.md", "docs/howto/imports.md", "rpf3d_core/arc.py", "setup.py"} <= files
