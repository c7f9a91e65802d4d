"""Warn about closed lines of sources: rocks also start along the closing segment, which the user might not expect.

The closing segment of a closed line is its last segment, which leads back to the first point.
"""

from collections.abc import Iterator

import numpy as np

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.formats.polylines import without_repeats
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import plain
from rpf3d_core.setup.warnings.line_order import lines_in_plan
from rpf3d_core.terrain.frame import FloatArray

LONG = 3.0
"""Ratio (-) of the closing segment to the median length of the other segments above which a closed line is suspicious.

A crest around a whole pit closes with a segment like the others.
"""
FEW_POINTS = 5
"""Number of points up to which every closed line is suspicious."""


def warnings_of_source_lines(scene: Scene) -> Iterator[str]:
    """Yield a warning for each closed line of a source with few points, or with a long closing segment.

    The closing segment is the last segment, which leads back to the first point.
    """
    for number, spec in enumerate(scene.sources):
        if spec.line is None:
            continue
        place = f"`sources[{number}].line` of {spec.name!r}"
        for line in map(without_repeats, lines_in_plan(spec.line, scene.terrain.up)):
            if _closes_suspiciously(line):
                yield f"{place} {_closing_in_words(line)}"


def _closes_suspiciously(line: FloatArray) -> bool:
    """Return True if a line (P, 2) m is closed, and its closing segment is long or the line has few points."""
    if len(line) < 4 or not np.array_equal(line[0], line[-1]):
        return False
    lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
    return len(line) <= FEW_POINTS or bool(lengths[-1] > LONG * np.median(lengths[:-1]))


def _closing_in_words(line: FloatArray) -> str:
    """Return the end of a warning on a closed line (P, 2) m, with the length and the ends of its closing segment."""
    begin, end = (f"({plain(x)}, {plain(y)})" for x, y in line[-2:].tolist())
    length = three_figures(float(np.linalg.norm(line[-1] - line[-2])))
    return (
        f"is closed: rocks start along its closing segment, too, {length} m from {begin} to {end}; if this segment is "
        "no crest, open the line"
    )
