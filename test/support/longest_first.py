"""Order the test files, longest first, so that no worker is still busy with a long file after the others have ended.

This command rewrites longest_files.txt, the list of the files that take longest, from the durations printed by pytest:

    make test PYTEST_ADDOPTS=--durations=0 | .venv/bin/python test/support/longest_first.py
"""

import re
import sys
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

TESTS = Path(__file__).parents[1]
LIST = Path(__file__).with_name("longest_files.txt")
"""File with one line for each test file, longest first: the seconds of its tests, and its path in the folder `test`."""
SHORT = 3.0
"""Smallest time (s) of a listed test file; files that are not listed run last."""
DURATION = re.compile(r"^ *([\d.]+)s (?:setup|call|teardown) +test/([\w/]+\.py)::", re.MULTILINE)


def seconds_of_files() -> dict[str, float]:
    """Return the time (s) of each file in LIST, by its path in the folder `test`."""
    rows = (line.split() for line in LIST.read_text(encoding="utf-8").splitlines())
    return {file: float(seconds) for seconds, file in rows}


def longest_first(files: Iterable[Path]) -> list[int]:
    """Return the indices of files, longest file first; files with equal times keep their order."""
    seconds = seconds_of_files()
    taken = [seconds.get(file.relative_to(TESTS).as_posix(), 0.0) if TESTS in file.parents else 0.0 for file in files]
    return sorted(range(len(taken)), key=lambda i: -taken[i])


def listing(durations: str) -> str:
    """Return the text of LIST for the durations that pytest has printed (option --durations=0)."""
    seconds: Counter[str] = Counter()
    for taken, file in DURATION.findall(durations):
        seconds[file] += float(taken)  # type: ignore[assignment]
    return "".join(f"{taken:.0f} {file}\n" for file, taken in seconds.most_common() if taken >= SHORT)


if __name__ == "__main__":
    LIST.write_text(listing(sys.stdin.read()), encoding="utf-8")
