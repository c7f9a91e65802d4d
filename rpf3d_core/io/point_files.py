"""Points from a text file: x y z first on each line, further columns ignored."""

import math
from pathlib import Path

import numpy as np

from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import FloatArray


def read_points(path: Path) -> FloatArray:
    """Points (N, 3) of a file, N >= 1, in the input's own coordinates.

    Numbers are separated by blanks or commas; what follows a `#` is a comment, and empty lines are skipped.

    Raises
    ------
    InputError
        If the file cannot be read, holds no point, or a line does not begin with three finite numbers; names the line.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as fault:
        raise InputError(f"{path}: cannot be read as text ({fault})") from fault
    numbered = [(number, line.split("#")[0].replace(",", " ").split()) for number, line in enumerate(lines, start=1)]
    points = [_point(path, number, words) for number, words in numbered if words]
    if not points:
        raise InputError(f"{path}: holds no point; each line must begin with x y z")
    return np.array(points)


def _point(path: Path, number: int, words: list[str]) -> tuple[float, ...]:
    try:
        point = tuple(float(word) for word in words[:3])
    except ValueError:
        point = ()
    if len(point) != 3 or not all(map(math.isfinite, point)):
        found = " ".join(words)
        raise InputError(f"{path}, line {number}: must begin with three finite numbers x y z, but is {found!r}")
    return point
