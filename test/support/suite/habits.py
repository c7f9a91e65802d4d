"""Search prose for words that texts of rpf3d must not use, and pages for lines that are too long.

python test/support/suite/habits.py [FILE ...]

codespell finds the words, with the dictionary habits.txt. Prose is a page, or the comments and docstrings of a Python
file. Code in it (between backticks, in fences, names before a colon as in `name : meaning`) does not count for words,
but counts for the length of lines. Without arguments: all prose of the project. Exit code 0: nothing found.
"""

import io
import re
import subprocess
import sys
import tempfile
import tokenize
from collections.abc import Iterable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
DICTIONARY = Path(__file__).with_name("habits.txt")
PLACES = ("rpf3d_core", "rpf3d_ros", "launch", "docs", "benchmarks", "test", "examples")
PAGES = (".md", ".rst")
KINDS = (*PAGES, ".py")
MOST_CHARACTERS = 160
"""Largest number of characters in a line of a page: only rows of tables and code, which cannot wrap, need that many."""
GENERATED = ROOT / "docs" / "api"
CODE = r"`[^`]*`|\b\w+(, \w+)* : "
"""Pattern of the parts of a line that codespell ignores."""
FENCED = r"(?m)^ *```.*?^ *```"
BEGINNINGS = (tokenize.ENCODING, tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
"""Tokens after which a statement begins."""


def all_prose() -> list[Path]:
    """Return the files of the project that hold prose."""
    inside = (path for place in PLACES for path in (ROOT / place).rglob("*"))
    files = sorted(path for path in (*ROOT.iterdir(), *inside) if path.suffix in KINDS)
    return [path for path in files if not path.is_relative_to(GENERATED)]


def prose_of(source: str) -> str:
    """Return a Python file without its code: comments and docstrings, each on its own lines."""
    lines = [""] * (source.count("\n") + 1)
    for token in prose_tokens(source):
        for i, text in enumerate(token.string.split("\n"), token.start[0] - 1):
            lines[i] += f" {text}"
    return "\n".join(lines)


def prose_tokens(source: str) -> Iterator[tokenize.TokenInfo]:
    """Yield the comments and the docstrings; every string that is a separate statement counts as a docstring."""
    begins = True
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT or (begins and token.type == tokenize.STRING):
            yield token
        if token.type not in (tokenize.COMMENT, tokenize.NL):
            begins = token.type in BEGINNINGS


def phrases(dictionary: Path) -> list[str]:
    """Return the entries of a dictionary with several words, because codespell looks for single words only."""
    entries = (line.partition("->")[0] for line in dictionary.read_text(encoding="utf-8").splitlines())
    return [entry for entry in entries if " " in entry]


def codespell(files: Iterable[Path], folder: Path) -> int:
    """Run codespell in a folder that holds the prose of the files; return its exit code."""
    for path in files:
        copy = folder / place_of(path)
        copy.parent.mkdir(parents=True, exist_ok=True)
        text = path.read_text(encoding="utf-8")
        copy.write_text(prose_of(text) if path.suffix == ".py" else text, encoding="utf-8")
    words = rf"(?i:\b(?:{'|'.join(map(re.escape, phrases(DICTIONARY)))})\b)|[\w'-]+"
    options = ["-D", str(DICTIONARY), "--regex", words, "--ignore-regex", CODE, "--ignore-multiline-regex", FENCED]
    return subprocess.run([sys.executable, "-m", "codespell_lib", *options, "."], cwd=folder, check=False).returncode


def long_lines(files: Iterable[Path]) -> list[str]:
    """Return a message for each line of a page with more than MOST_CHARACTERS characters, also in tables and code."""
    return [
        f"{place_of(path)}:{n}: the line has {len(line)} characters, more than {MOST_CHARACTERS}"
        for path in files if path.suffix in PAGES
        for n, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1) if len(line) > MOST_CHARACTERS
    ]  # fmt: skip


def place_of(path: Path) -> Path:
    """Return the path of a file relative to the project; only the name for a file outside the project."""
    path = path.resolve()
    return path.relative_to(ROOT) if path.is_relative_to(ROOT) else Path(path.name)


def main(names: list[str]) -> int:
    """Search the files with these names, or all prose of the project; return the exit code."""
    files = [*map(Path, names)] if names else all_prose()
    long = long_lines(files)
    for message in long:
        print(message, flush=True)
    with tempfile.TemporaryDirectory() as folder:
        return codespell(files, Path(folder)) or int(len(long) > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
