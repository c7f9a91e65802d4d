"""Find lines of sources whose points are not in their order along the crest, as in an unsorted list of points.

Rocks start along the straight lines between successive points. If the points are not in order, the line jumps to and
fro, and rocks start next to the crest.
"""

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rpf3d_core.ensemble.flights import IntArray
from rpf3d_core.formats.polylines import read_lines
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import plain
from rpf3d_core.terrain.frame import FloatArray, Up

SHARP = 135.0
"""A line turns back at a point where its direction changes by more than this angle (degrees); crests turn less."""
LONGER = 1.05
"""Ratio (-) of a line's length to its length in another order; above it, the points are probably out of order."""
MOST_POINTS = 5_000
"""Largest number of points of a line that is compared; every further point takes longer."""


def warnings_of_lines(scene: Scene) -> Iterator[str]:
    """Yield a warning for each source whose line turns back, and would be shorter with its points in another order."""
    for number, spec in enumerate(scene.sources):
        if spec.line is None:
            continue
        for line in lines_in_plan(spec.line, scene.terrain.up):
            if (ordered := shorter_order(line)) is not None:
                yield f"`sources[{number}].line` of {spec.name!r} {_in_words(line, line[ordered])}"


def lines_in_plan(line: Path | tuple[tuple[float, float, float], ...], up: Up) -> list[FloatArray]:
    """Return the lines (P, 2) m of a source in plan, from a file or from the scene; up : the axis that points up."""
    if isinstance(line, Path):
        return read_lines(line)
    return [np.array(line, dtype=float)[:, [0, 1] if up == "z" else [0, 2]]]


def _in_words(line: FloatArray, ordered: FloatArray) -> str:
    """Return the end of a warning on a line (P, 2) m; ordered : (P, 2) m, its points in another order."""
    turns = sharp_turns(line)
    return (
        f"turns back at {len(turns):,} of its {len(line):,} points, first at {_place(line, int(turns[0]))}: are the "
        "points in their order along the crest? Rocks start on the straight lines between successive points. The "
        f"line is {_length(line):,.0f} m long; in another order it would be {_length(ordered):,.0f} m"
    )


def shorter_order(line: FloatArray) -> IntArray | None:
    """Return an order (P,) of the points of a line (P, 2) m in which the line is clearly shorter; None if none is.

    The line is clearly shorter if its old length is more than LONGER (1.05) times its new length; the new
    length of a closed line includes the segment back to the first point. Only lines with a sharp turn, and with 4 to
    MOST_POINTS points, are compared. The other order is that of `_by_neighbours`.
    """
    if not 4 <= len(line) <= MOST_POINTS or not len(sharp_turns(line)):
        return None
    order = _by_neighbours(line)
    closing = float(np.linalg.norm(line[order[0]] - line[order[-1]])) if np.array_equal(line[0], line[-1]) else 0.0
    return order if _length(line) > LONGER * (_length(line[order]) + closing) else None


def sharp_turns(line: FloatArray) -> IntArray:
    """Return the indices (T,) of the points at which a line (P, 2) m turns by more than SHARP degrees."""
    heading = np.arctan2(*np.diff(line, axis=0).T[::-1])
    turn = np.abs((np.diff(heading) + math.pi) % (2.0 * math.pi) - math.pi)
    return np.asarray(np.flatnonzero(np.degrees(turn) > SHARP) + 1)


def _by_neighbours(line: FloatArray) -> IntArray:
    """Return the indices (P,) of points (P, 2) m in the order of a walk to the nearest point not yet visited.

    The walk begins at the point farthest from the mean of all points.
    """
    left = np.ones(len(line), dtype=bool)
    at = int(np.argmax(np.linalg.norm(line - line.mean(axis=0), axis=1)))
    order = [at]
    for _ in range(len(line) - 1):
        left[at] = False
        away = np.where(left, np.hypot(*(line - line[at]).T), np.inf)
        at = int(np.argmin(away))
        order.append(at)
    return np.array(order)


def _length(line: FloatArray) -> float:
    """Return the length (m) of a line (P, 2) m."""
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def _place(line: FloatArray, number: int) -> str:
    """Return a point of a line as text: its number, counted from 1, and its coordinates (m); number : index, from 0."""
    x, y = line[number].tolist()
    return f"point {number + 1} ({plain(x)}, {plain(y)})"
