"""Find terrain files that lie above each other, such as two surveys of the same ground: rocks fly on the upper one."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.plan_view import Window, surfaces_at

PLACES = 400
"""Approximate number of places at which files are compared; they lie on a grid over the ground of several files."""
MOST_ROWS = 200
"""Largest number of rows and of columns of the grid of places, also over a narrow strip."""
LEAST_HEIGHT = 0.1
"""Smallest height (m) between two files that counts; overlapping surveys of one day differ by some centimetres."""
LEAST_SHARE = 0.05
"""Smallest share (-) of the places on two files that must differ in height; on steep faces, noise is enough."""
FEWEST = 3
"""Smallest number of places at which two files must lie above each other."""
MOST_PAIRS = 3
"""Largest number of pairs of files that are reported."""
MANY_DUPLICATES = 0.001
"""Share (-) of facets on the vertices of other facets above which they are reported; drawings often have a few."""


class Overlap(NamedTuple):
    """Two files that lie above each other.

    upper, lower : numbers of the files; area : m^2 in plan where both have ground at different heights
    height : m, median height of the upper file above the lower file there
    """

    upper: int
    lower: int
    area: float
    height: float


def overlap_warnings(
    terrain: Terrain, facets: Sequence[int], paths: Sequence[Path], window: Window | None
) -> tuple[str, ...]:
    """Return a warning for each pair of files that lie above each other, the pairs with the largest areas first.

    facets : number of facets of each file, in the order of the facets of the terrain; paths : of the files
    window : from `shared_window`
    """
    if window is None:
        return ()
    found = sorted(overlaps_in(terrain, facets, window), key=lambda each: -each.area)
    names = [path.name for path in paths]
    shown = names if len(set(names)) == len(names) else [str(path) for path in paths]
    return tuple(_in_words(overlap, shown) for overlap in found[:MOST_PAIRS])


def duplicate_warnings(faults: FaultReport) -> tuple[str, ...]:
    """Return a warning if many facets of a terrain have the same vertices as other facets, as in a file given twice."""
    if faults.duplicate_facets <= MANY_DUPLICATES * faults.triangles:
        return ()
    return (
        f"{faults.duplicate_facets:,} of {faults.triangles:,} triangles lie on the same vertices as other triangles: "
        "is the same ground in `terrain.files` twice, or twice in a file? Keep one: areas count twice, and the zone of "
        "a rock on such ground is that of either triangle",
    )


def overlaps_in(terrain: Terrain, facets: Sequence[int], window: Window) -> Iterator[Overlap]:
    """Yield each pair of files that lie above each other, from a sample of about PLACES (400) places in a window.

    At each place, the uppermost surface of each file counts; a file may have overhangs.

    facets : number of facets of each file
    """
    size = np.sqrt(window.width * window.height / PLACES)
    rows, columns = (min(MOST_ROWS, max(1, round(side / size))) for side in (window.height, window.width))
    shape = (rows, columns)
    tops = _tops(terrain, np.cumsum(facets), window, shape)
    area = window.width * window.height / (shape[0] * shape[1])
    for one, other in combinations(range(len(facets)), 2):
        both = np.isfinite(tops[one]) & np.isfinite(tops[other])
        heights = tops[one][both] - tops[other][both]
        apart = heights[np.abs(heights) >= LEAST_HEIGHT]
        if len(apart) >= max(FEWEST, LEAST_SHARE * len(heights)):
            upper, lower = (one, other) if (apart > 0.0).mean() >= 0.5 else (other, one)
            yield Overlap(upper, lower, area * len(apart), float(np.median(np.abs(apart))))


def _tops(terrain: Terrain, ends: NDArray[np.int64], window: Window, shape: tuple[int, int]) -> FloatArray:
    """Return the height (K, P) m of the uppermost surface of K files at each of P pixels; -inf where a file has none.

    ends : (K,) number of the facet after the last facet of each file
    """
    near = _at_rows(terrain, window, shape[0])
    corners = terrain.vertices[terrain.triangles[near]].reshape(-1, 3)
    few = replace(terrain, vertices=corners, triangles=np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
    tops = np.full((len(ends), shape[0] * shape[1]), -np.inf)
    for facet, pixel, height in surfaces_at(few, window, shape):
        np.maximum.at(tops, (np.searchsorted(ends, near[facet], side="right"), pixel), height)
    return tops


def _at_rows(terrain: Terrain, window: Window, rows: int) -> NDArray[np.int64]:
    """Return the facets (N,) that cross the middle of a row of pixels, which are few of millions of facets."""
    above = np.ceil((terrain.vertices[:, 1] - window.bottom) * (rows / window.height) - 0.5)
    row = above.clip(0, rows).astype(np.uint8)  # one byte for each vertex stays in the processor's cache
    a, b, c = (row[corner] for corner in terrain.triangles.T)
    return np.flatnonzero((a != b) | (a != c))


def shared_window(plan: FloatArray, points: Sequence[int]) -> Window | None:
    """Return the smallest window around all ground that may be in two files; None if the files lie next to each other.

    It is the box around the common parts of each two files' boxes.

    plan : (N, 2) m, all points of all files, local frame; points : number of points of each file
    """
    if len(points) < 2:
        return None
    parts = [plan[end - number : end] for end, number in zip(np.cumsum(points), points, strict=True)]
    boxes = [np.array([(column.min(), column.max()) for column in part.T]).T for part in parts]
    common = [(np.maximum(a[0], b[0]), np.minimum(a[1], b[1])) for a, b in combinations(boxes, 2)]
    common = [(low, high) for low, high in common if (low < high).all()]
    if not common:
        return None
    left, bottom = np.min([low for low, _ in common], axis=0).tolist()
    right, top = np.max([high for _, high in common], axis=0).tolist()
    return Window(left=left, right=right, bottom=bottom, top=top)


def _in_words(overlap: Overlap, names: Sequence[str]) -> str:
    """Return the warning on two files that lie above each other; names : of all files."""
    upper, lower = names[overlap.upper], names[overlap.lower]
    return (
        f"about {three_figures(overlap.area)} m2 of the terrain have two surfaces above each other, {upper} above "
        f"{lower} by {three_figures(overlap.height)} m in the median, and rocks fly on the upper one: are these two "
        "surveys of the same ground? Keep one"
    )
