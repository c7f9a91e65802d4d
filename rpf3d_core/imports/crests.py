"""Find crests of a terrain: lines where flat ground ends above a steep face, as candidates for sources of rocks.

The terrain is seen as an image of heights. Steep pixels form faces. The border of a face is a crest where the ground
outside the face is higher than in the face. Each point of a crest is then moved to the brow, and a little over it.
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.faces import LOWEST, STEEP, first_face
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import HeightImage, height_image, heights_at

SHORTEST, LONGEST = 10.0, 100.0
"""Least length (m) of a crest, and length from which it is cut into several."""
SPACING = 3.0
"""Distance (m) between points of a crest that are moved to the brow."""
OVER = 0.2
"""Distance (m) in plan by which a crest lies over the brow, so that rocks fall instead of resting behind it."""
SEARCHED = 3.0
"""Distance (m) before and behind the border of a face in which the brow is searched."""
BEHIND = 5
"""Number of steps behind the brow on which there must be ground: the edge of the survey is no crest."""
HIGHEST = 40.0
"""Distance (m) in plan in which the foot of the face below a crest is searched."""
FINE, PIXEL = 0.1, 0.2
"""Step (m) of the search for brow and foot, and side (m) of the pixels of the image in which they are searched."""
COARSE = 1.0
"""Smallest side (m) of the pixels in which faces are searched."""
MOST_CRESTS = 12
"""Largest number of crests that are moved to the brow; the others are lower or shorter."""


class Crest(NamedTuple):
    """A stretch of a crest: points (N, 3) m on the ground just over the brow, local frame.

    length : m, in plan; height : m, median height of the face below
    """

    points: FloatArray
    length: float
    height: float


class _Grid(NamedTuple):
    """Heights (rows, columns) m at the centres of pixels; left, bottom : m, of the image; side : (2,) m of a pixel."""

    heights: FloatArray
    left: float
    bottom: float
    side: FloatArray


def crests_of(terrain: Terrain) -> list[Crest]:
    """Return the crests of a terrain, those with the largest product of length and height first."""
    image = height_image(terrain, terrain.vertices[:, :2], 0.0, COARSE)
    lines = [part for line in _borders(_grid(image)) for part in _stretches(line)]
    rough = [(crest, line) for line in lines for crest in _on_the_brow(image, line)]
    rough.sort(key=lambda found: -_size(found[0]))
    exact = [crest for _, line in rough[:MOST_CRESTS]
             for crest in _on_the_brow(height_image(terrain, line, HIGHEST, PIXEL), line)]  # fmt: skip
    return sorted(exact, key=lambda crest: -_size(crest))


def _size(crest: Crest) -> float:
    """Return the area (m2) of the face below a crest, seen from the front, by which crests are ranked."""
    return crest.length * crest.height


def _grid(image: HeightImage) -> _Grid:
    """Return the heights at the centres of the pixels of an image."""
    rows, columns = image.view.facet.shape
    window = image.view.window
    side = np.array([window.width / columns, window.height / rows])
    x = window.left + (np.arange(columns) + 0.5) * side[0]
    y = window.bottom + (np.arange(rows) + 0.5) * side[1]
    heights = np.stack([heights_at(image, np.column_stack([x, np.full(columns, each)])) for each in y])
    return _Grid(heights=heights, left=window.left, bottom=window.bottom, side=side)


def _steep(grid: _Grid) -> NDArray[np.bool_]:
    """Return True (rows, columns) for pixels on ground that is steeper than STEEP, seen over three pixels."""
    if min(grid.heights.shape) < 2:
        return np.zeros(grid.heights.shape, dtype=bool)
    along_y, along_x = np.gradient(grid.heights, grid.side[1], grid.side[0])
    with np.errstate(invalid="ignore"):
        return np.asarray(np.hypot(along_x, along_y) > math.tan(math.radians(STEEP)))


def _borders(grid: _Grid) -> list[FloatArray]:
    """Return lines (N, 2) m along borders of faces with higher ground outside; the face is on their left."""
    steep = _steep(grid)
    segments = [*_sides(grid, steep, axis=0), *_sides(grid, steep, axis=1)]
    if not segments:
        return []
    merged = shapely.line_merge(shapely.MultiLineString(segments), directed=True)
    lines = shapely.simplify(shapely.get_parts(merged), 1.5 * float(grid.side.max()))
    return [shapely.get_coordinates(line) for line in lines if line.length >= SHORTEST]


def _sides(grid: _Grid, steep: NDArray[np.bool_], axis: int) -> Iterator[FloatArray]:
    """Yield the sides (2, 2) m between a steep pixel and a higher flat one, neighbours along an axis (0: north)."""
    near = [slice(None), slice(None)]
    far = [slice(None), slice(None)]
    near[axis], far[axis] = slice(None, -1), slice(1, None)
    a, b = tuple(near), tuple(far)
    rises = grid.heights[b] > grid.heights[a]
    for falls, inside in ((rises & steep[a] & ~steep[b], -1.0), (~rises & ~steep[a] & steep[b], 1.0)):
        for row, column in np.argwhere(falls & np.isfinite(grid.heights[a]) & np.isfinite(grid.heights[b])).tolist():
            corner = np.array([column, row], dtype=float) + ((0.0, 1.0) if axis == 0 else (1.0, 0.0))
            other = corner + ((1.0, 0.0) if axis == 0 else (0.0, 1.0))
            ends = np.array([corner, other]) * grid.side + (grid.left, grid.bottom)
            turned = (inside < 0.0) == (axis == 0)
            yield ends[::-1] if turned else ends


def _stretches(line: FloatArray) -> list[FloatArray]:
    """Return a line (N, 2) m cut into stretches of about equal length up to LONGEST, with points every SPACING m."""
    whole = shapely.LineString(line)
    parts = max(1, math.ceil(whole.length / LONGEST))
    each = max(2, math.ceil(whole.length / parts / SPACING) + 1)
    places = np.linspace(0.0, whole.length, parts * (each - 1) + 1)
    points = shapely.get_coordinates(shapely.line_interpolate_point(whole, places))
    return [points[i * (each - 1) : (i + 1) * (each - 1) + 1] for i in range(parts)]


def _on_the_brow(image: HeightImage, line: FloatArray) -> Iterator[Crest]:
    """Yield the crest along a line (N, 2) m, moved to the brow, without points below which no face is found."""
    tangent = np.gradient(line, axis=0)
    outwards = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    outwards /= np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-12)
    distance = np.arange(-SEARCHED, HIGHEST, FINE)
    ground = heights_at(image, line[:, None, :] + distance[:, None] * outwards[:, None, :])
    found = [_brow_and_height(distance, heights) for heights in ground]
    kept = [i for i, (_, height) in enumerate(found) if height >= LOWEST]
    if len(kept) < 2:
        return
    plan = line[kept] + np.array([found[i][0] + OVER for i in kept])[:, None] * outwards[kept]
    points = np.column_stack([plan, heights_at(image, plan)])
    points = points[np.isfinite(points[:, 2])]
    if len(points) < 2:
        return
    points = shapely.get_coordinates(shapely.simplify(shapely.LineString(points), FINE), include_z=True)
    length = float(np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1).sum())
    if length >= SHORTEST:
        yield Crest(points=points, length=length, height=float(np.median([found[i][1] for i in kept])))


def _brow_and_height(distance: FloatArray, ground: FloatArray) -> tuple[float, float]:
    """Return the distance (m) of the brow on a line across a crest, and the height (m) of the face below; or NaN, 0.

    distance, ground : (S,) m
    """
    face = first_face(distance, ground)
    if face is None or face.brow >= SEARCHED:
        return math.nan, 0.0
    behind = max(int(np.searchsorted(distance, face.brow)) - BEHIND, 0)
    return (face.brow, face.height) if np.isfinite(ground[behind]) else (math.nan, 0.0)
