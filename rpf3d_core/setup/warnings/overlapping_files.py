"""Find terrain files that lie above each other, such as two surveys of the same ground: rocks fly on the upper one."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.outward import three_figures
from rpf3d_core.setup.warnings.rims_in_ground import stands_in_ground
from rpf3d_core.terrain.facets import Terrain, area_vectors
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.faults import FaultReport
from rpf3d_core.terrain.plan_view import Window, surfaces_at

PLACES = 400
"""Approximate number of places at which files are compared; they lie on a grid over the ground of several files."""
MOST_ROWS = 200
"""Largest number of rows and of columns of the grid of places, also over a narrow strip."""
LEAST_HEIGHT = 0.1
"""Smallest distance (m) between two files, normal to the ground, that counts; surveys of one day differ by less."""
LEAST_SHARE = 0.05
"""Smallest share (-) of the places on both files where heights must differ; on steep faces, noise causes a few."""
LEAST_COMMON = 0.5
"""Smallest share (-) of the smaller file's area that must be in the larger file, too; neighbours share a strip."""
LARGEST_BODY = 0.8
"""Largest area in plan of a file that can be a pile, berm or building, divided by the area of the file below (-)."""
LEAST_RAISED = 3.0
"""Smallest volume of a pile above the ground, divided by the volume of its buried part (-)."""
LOWEST_RIM = 0.25
"""Largest height of a pile's rim above the ground, divided by the median height of the pile (-)."""
FEWEST = 3
"""Smallest number of places at which two files must lie above each other."""
MOST_PAIRS = 3
"""Largest number of pairs of files that are reported."""
MANY_DUPLICATES = 0.001
"""Share (-) of facets that lie on the vertices of other facets, above which such facets are reported.

Drawings often have a few such facets.
"""


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
    """Return warnings on the MOST_PAIRS (3) pairs of files that lie above each other over the largest areas.

    The pair with the largest area is first. The result is empty if no files lie above each other.

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

    At each place, the uppermost surface of each file counts; a file may have overhangs. The distance between two files
    is measured normal to the ground: two surveys with a small shift in plan differ much in height on a face. A pile,
    berm or building in a separate file is not reported, because it rises from the ground, with its rim in the ground.

    facets : number of facets of each file; window : from `shared_window`
    """
    size = np.sqrt(window.width * window.height / PLACES)
    rows, columns = (min(MOST_ROWS, max(1, round(side / size))) for side in (window.height, window.width))
    ends = np.cumsum(facets)
    tops, upright = _tops(terrain, ends, window, (rows, columns))
    files = [slice(end - number, end) for end, number in zip(ends.tolist(), facets, strict=True)]
    area = window.width * window.height / (rows * columns)
    for one, other in combinations(range(len(facets)), 2):
        both = np.isfinite(tops[one]) & np.isfinite(tops[other])
        heights = tops[one][both] - tops[other][both]
        normal = heights * np.minimum(upright[one][both], upright[other][both])
        apart = heights[np.abs(normal) >= LEAST_HEIGHT]
        if len(apart) < max(FEWEST, LEAST_SHARE * len(heights)):
            continue
        sizes = [_size_in_plan(terrain, files[number]) for number in (one, other)]
        if area * len(heights) < LEAST_COMMON * min(sizes):
            continue
        small, large = (one, other) if sizes[0] <= sizes[1] else (other, one)
        raised = apart if small == one else -apart
        if max(sizes) * LARGEST_BODY < min(sizes) or not _is_body(terrain, files[small], files[large], raised):
            upper, lower = (one, other) if (apart > 0.0).mean() >= 0.5 else (other, one)
            yield Overlap(upper, lower, area * len(apart), float(np.median(np.abs(apart))))


def _is_body(terrain: Terrain, small: slice, large: slice, raised: FloatArray) -> bool:
    """Return True if the smaller of two files is a pile, berm or building on the ground of the larger file.

    small, large : facets of the files; raised : (N,) m, heights of the smaller file above the larger file
    """
    above, below = raised.clip(min=0.0).sum(), -raised.clip(max=0.0).sum()
    if above < LEAST_RAISED * below:
        return False
    slack = max(LEAST_HEIGHT, LOWEST_RIM * float(np.median(raised[raised > 0.0])))
    return stands_in_ground(terrain, small, large, slack)


def _size_in_plan(terrain: Terrain, facets: slice) -> float:
    """Return the area (m^2) in plan of the facets of a file; top and bottom of a closed body count once, not twice."""
    area = area_vectors(terrain.vertices, terrain.triangles[facets])[:, 2]
    return float(max(area.clip(min=0.0).sum(), -area.clip(max=0.0).sum()))


def _tops(
    terrain: Terrain, ends: NDArray[np.int64], window: Window, shape: tuple[int, int]
) -> tuple[FloatArray, FloatArray]:
    """Return the height (K, P) m of the uppermost surface of K files at P pixels, and the cosine (K, P) of its slope.

    The slope is the angle from the horizontal. Where a file has no surface, the height is -inf and the cosine 0.

    ends : (K,) for each file, the number of its last facet plus 1
    """
    near = _at_rows(terrain, window, shape[0])
    corners = terrain.vertices[terrain.triangles[near]].reshape(-1, 3)
    few = replace(terrain, vertices=corners, triangles=np.arange(len(corners), dtype=np.int32).reshape(-1, 3))
    areas = area_vectors(few.vertices, few.triangles)
    lengths = np.linalg.norm(areas, axis=1)
    cosine = np.abs(areas[:, 2]) / np.where(lengths > 0.0, lengths, 1.0)
    tops, upright = np.full((2, len(ends), shape[0] * shape[1]), -np.inf)
    for facet, pixel, height in surfaces_at(few, window, shape):
        place = (np.searchsorted(ends, near[facet], side="right"), pixel)
        before = tops[place]
        np.maximum.at(tops, place, height)
        top = (height > before) & (height == tops[place])
        upright[place[0][top], pixel[top]] = cosine[facet[top]]
    return tops, upright.clip(min=0.0)


def _at_rows(terrain: Terrain, window: Window, rows: int) -> NDArray[np.int64]:
    """Return the facets (N,) that may cover a pixel centre, because they cross the middle line of a row of pixels.

    Of millions of facets, these are only few. rows : number of rows of pixels in the window
    """
    above = np.ceil((terrain.vertices[:, 1] - window.bottom) * (rows / window.height) - 0.5)
    row = above.clip(0, rows).astype(np.uint8)  # one byte for each vertex stays in the processor's cache
    a, b, c = (row[corner] for corner in terrain.triangles.T)
    return np.flatnonzero((a != b) | (a != c))


def shared_window(plan: FloatArray, points: Sequence[int]) -> Window | None:
    """Return the smallest window around all ground that may be in two files; None without such ground.

    Where the boxes of two files overlap, they have a common part; the window contains the common parts of all pairs.
    There is no such ground in a single file, or if all files lie next to each other.

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
        "surveys of the same ground, or is one a pile or building on it? If they are two surveys of the same ground, "
        "keep one; a pile or building on the ground is right"
    )
