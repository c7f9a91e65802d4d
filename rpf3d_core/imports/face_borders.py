"""Find the upper borders of faces in an image of heights: rough lines near crests, without gaps along a crest.

A face is ground steeper than STEEP (45 degrees). Its border is a contour line of the slope. The upper border is the
part of the border at which the face falls away from the border. Noise of a survey makes gaps in a border and cuts faces
into islands, so parts are joined if the brow continues after a gap of at most JOINED (6 m).
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import contourpy
import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.faces import LOWEST, STEEP
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import HeightImage, heights_at

JOINED = 6.0
"""Longest gap (m) between two parts of a crest that may be joined."""
SMALLEST = 5.0
"""Smallest length (m) of the border of a face; shorter borders are noise."""
FALLS = 0.3
"""Smallest cosine (-) of the angle between the directions into the face and downhill at an upper border; at the
sides of a face the cosine is smaller."""
TURNS = 0.5
"""Smallest cosine (-) of the angle between the directions of two parts that are joined."""
HEADING = 4.0
"""Length (m) at the end of a part from which its direction is computed."""


class _Grid(NamedTuple):
    """Heights at the centres of the pixels of an image.

    heights : (H, W) m, NaN without ground; x, y : (W,), (H,) m, plan coordinates of columns and rows, local frame
    """

    heights: FloatArray
    x: FloatArray
    y: FloatArray


def upper_borders(image: HeightImage, shortest: float) -> list[FloatArray]:
    """Return lines (N, 2) m along the upper borders of faces; the face is on the left of a line.

    image : of the terrain with a margin of two pixels, so that faces end within the image
    shortest : smallest length (m) of a line
    """
    grid = _grid(image)
    if min(grid.heights.shape) < 3:
        return []
    downhill = _downhill(grid)
    slope = np.hypot(downhill[..., 0], downhill[..., 1])
    lines = contourpy.contour_generator(x=grid.x, y=grid.y, z=slope).lines(math.tan(math.radians(STEEP)))
    contours = [np.asarray(line, dtype=float) for line in lines]
    parts = [part for contour in contours if _length(contour) >= SMALLEST for part in _upper(grid, downhill, contour)]
    joined = _joined(parts, [_heights_of_ends(grid, part) for part in parts])
    side = float(grid.x[1] - grid.x[0])
    return [shapely.get_coordinates(shapely.simplify(shapely.LineString(line), 0.5 * side))
            for line in joined if _length(line) >= shortest]  # fmt: skip


def _grid(image: HeightImage) -> _Grid:
    """Return the heights at the centres of the pixels of an image."""
    rows, columns = image.view.facet.shape
    window = image.view.window
    x = window.left + (np.arange(columns) + 0.5) * window.width / columns
    y = window.bottom + (np.arange(rows) + 0.5) * window.height / rows
    heights = np.stack([heights_at(image, np.column_stack([x, np.full(columns, each)])) for each in y])
    return _Grid(heights=heights, x=x, y=y)


def _downhill(grid: _Grid) -> FloatArray:
    """Return the slope (H, W, 2) (-) as vectors downhill: fall per metre along x and y; 0 next to missing ground.

    The slope of a pixel is computed from the heights of its neighbours.
    """
    along_y, along_x = np.gradient(grid.heights, grid.y, grid.x)
    return np.asarray(np.nan_to_num(-np.stack([along_x, along_y], axis=-1)))


def _at(grid: _Grid, points: FloatArray) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return row and column (N,) of the pixels at points (N, 2) m; for points outside the grid, the nearest pixel."""
    row = np.rint((points[:, 1] - grid.y[0]) / (grid.y[1] - grid.y[0])).astype(np.int64)
    column = np.rint((points[:, 0] - grid.x[0]) / (grid.x[1] - grid.x[0])).astype(np.int64)
    return np.clip(row, 0, len(grid.y) - 1), np.clip(column, 0, len(grid.x) - 1)


def _upper(grid: _Grid, downhill: FloatArray, contour: FloatArray) -> Iterator[FloatArray]:
    """Yield the parts (N, 2) m of the border of a face at which the face falls away from the border.

    contour : (P, 2) m, the border, with the steeper ground on its left; downhill : (H, W, 2) from `_downhill`
    """
    way = np.diff(contour, axis=0)
    inwards = np.column_stack([-way[:, 1], way[:, 0]])
    inwards /= np.maximum(np.linalg.norm(inwards, axis=1, keepdims=True), 1e-12)
    side = float(grid.x[1] - grid.x[0])
    down = downhill[_at(grid, contour[:-1] + 0.5 * way + side * inwards)]
    cosine = (down * inwards).sum(axis=1) / np.maximum(np.linalg.norm(down, axis=1), 1e-12)
    lengths = np.linalg.norm(way, axis=1)
    falls, first = _without_gaps(cosine > FALLS, lengths, closed=bool(np.array_equal(contour[0], contour[-1])))
    places = np.concatenate([contour[:-1][first:], contour[:-1][:first]])
    for begin, end in _runs(falls):
        last = contour[-1:] if first == 0 and end == len(falls) else places[[end % len(falls)]]
        yield np.concatenate([places[begin:end], last])


def _without_gaps(falls: NDArray[np.bool_], lengths: FloatArray, closed: bool) -> tuple[NDArray[np.bool_], int]:
    """Return flags (S,), True for segments in the upper part of a border, and the number of the segment of flag 0.

    A segment is in the upper part if the face falls away from the segment. A gap is a series of segments from which the
    face does not fall away. A gap of at most JOINED (m) between two segments of the upper part belongs to the upper
    part, too. The flags of a closed border begin with its longest gap; the flags of an open border, or of a border
    without gaps, begin with segment 0.

    falls : (S,) True if the face falls away from a segment; lengths : (S,) m; closed : True if the border is closed
    """
    gaps = list(_runs(~falls))
    spans = [float(lengths[begin:end].sum()) for begin, end in gaps]
    first = gaps[int(np.argmax(spans))][0] if closed and gaps else 0
    falls, lengths = np.roll(falls, -first), np.roll(lengths, -first)
    filled = falls.copy()
    for begin, end in _runs(~falls):
        if begin > 0 and end < len(falls) and lengths[begin:end].sum() <= JOINED:
            filled[begin:end] = True
    return filled, first


def _runs(flags: NDArray[np.bool_]) -> Iterator[tuple[int, int]]:
    """Yield begin and end (exclusive) of each run of True in flags (S,)."""
    changes = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    yield from zip(changes[::2].tolist(), changes[1::2].tolist(), strict=True)


def _heights_of_ends(grid: _Grid, part: FloatArray) -> FloatArray:
    """Return the height (2,) m of the ground at the first and the last point of a part of a border (N, 2) m."""
    return grid.heights[_at(grid, part[[0, -1]])]


def _joined(parts: list[FloatArray], heights: list[FloatArray]) -> list[FloatArray]:
    """Return lines (N, 2) m: parts of borders, each joined to the part that continues its brow.

    The gap between two joined parts is at most JOINED (6 m). Pairs are joined in order of their gap, the smallest
    first.

    heights : (2,) m at the first and the last point of each part
    """
    after: dict[int, int] = {}
    before: dict[int, int] = {}
    for _, one, other in sorted(_neighbours(parts, heights)):
        if one not in after and other not in before and _last(after, other) != one:
            after[one], before[other] = other, one
    return [np.concatenate([parts[i] for i in _chain(after, first)]) for first in range(len(parts))
            if first not in before]  # fmt: skip


def _neighbours(parts: list[FloatArray], heights: list[FloatArray]) -> Iterator[tuple[float, int, int]]:
    """Yield (gap in m, first, second) for each pair of parts in which the second part continues the first part.

    first and second are numbers of parts. The second part starts at most JOINED (6 m) from the end of the first part,
    at about the same height and in about the same direction.

    parts : lines (N, 2) m; heights : (2,) m at the first and the last point of each part
    """
    if not parts:
        return
    starts = shapely.STRtree([shapely.Point(part[0]) for part in parts])
    for one, part in enumerate(parts):
        for other in starts.query(shapely.Point(part[-1]), predicate="dwithin", distance=JOINED).tolist():
            step = abs(float(heights[one][1] - heights[other][0]))
            if other != one and not step > LOWEST and _continues(part, parts[other]):
                yield float(np.linalg.norm(parts[other][0] - part[-1])), one, other


def _continues(part: FloatArray, other: FloatArray) -> bool:
    """Return True if the part `other`, and the gap before it, run in about the direction in which `part` ends.

    part, other : (N, 2) m, parts of borders
    """
    leaving, entering = _heading(part[::-1]) * -1.0, _heading(other)
    gap = other[0] - part[-1]
    across = abs(float(leaving[0] * gap[1] - leaving[1] * gap[0]))
    return float(leaving @ entering) >= TURNS and across <= max(0.5 * JOINED, float(leaving @ gap))


def _heading(part: FloatArray) -> FloatArray:
    """Return the unit vector (2,) from the first point of a line (N, 2) m to the point HEADING (4 m) along the line.

    On a shorter line, the second point is the end of the line.
    """
    line = shapely.LineString(part)
    way = shapely.get_coordinates(shapely.line_interpolate_point(line, min(HEADING, line.length)))[0] - part[0]
    return np.asarray(way / max(float(np.linalg.norm(way)), 1e-12))


def _last(after: dict[int, int], number: int) -> int:
    return _chain(after, number)[-1]


def _chain(after: dict[int, int], first: int) -> list[int]:
    """Return the numbers of the parts of borders that follow one another, starting with the part `first`.

    after : number of the next part, by number of a part; the last part of a chain is missing
    """
    chain = [first]
    while chain[-1] in after:
        chain.append(after[chain[-1]])
    return chain


def _length(line: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())
