"""Find crests of a terrain: lines where flat ground ends above a steep face, as candidates for sources of rocks.

The upper borders of faces (`face_borders`) are rough lines near crests. Each point of such a line is moved to the brow
and a little beyond it, so that rocks fall.
"""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import shapely
from numpy.lib.stride_tricks import sliding_window_view

from rpf3d_core.imports.face_borders import JOINED, upper_borders
from rpf3d_core.terrain.faces import LOWEST, first_face
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import HeightImage, height_image, heights_at

SHORTEST, LONGEST = 10.0, 300.0
"""Smallest and largest length (m) of a crest; a longer crest is cut into several."""
SPACING = 3.0
"""Distance (m) between the points of a crest."""
OVER = 0.2
"""Distance (m) in plan of a crest in front of the brow, so that rocks fall and do not stop behind the brow."""
SEARCHED = 3.0
"""Largest distance (m) of the brow in front of or behind the border of a face."""
STRAY = 1.0
"""Largest distance (m) of a point of the brow from the median of five neighbours; beyond it, the point is noise."""
BEHIND = 5
"""Number of steps of FINE (m) from the brow back to a place that must have ground.

Without this condition, the edge of a survey could count as a crest.
"""
HIGHEST = 40.0
"""Largest distance (m) in plan from the border of a face at which the foot of the face is searched."""
FINE, PIXEL = 0.1, 0.2
"""Step (m) of the search for brow and foot, and side (m) of the pixels of the image in which they are searched."""
COARSE = 1.0
"""Smallest side (m) of the pixels of the image of the whole terrain, in which faces are searched first."""
MOST_CRESTS = 16
"""Largest number of crests of the coarse search whose lines are searched again in a fine image."""
ENERGY_LINE = 30.0
"""Smallest angle (degrees) from the horizontal of the straight line from a crest to ground that rocks may reach.

Sources
-------
Jaboyedoff & Labiouse 2011, Nat. Hazards Earth Syst. Sci. 11, 819: energy lines of rockfalls have 27 to 37 degrees.
"""
LONG = 50.0
"""Smallest length (m) of the first crest, if there is one; a shorter crest may be a gap in a road, or noise."""
STOPPING = 1.0
"""Smallest height (m) of ground above the line with the angle ENERGY_LINE at which the ground stops rocks.

Such ground is, for example, a wide road.
"""
LOW = 0.1
"""Percentile (%) of the heights of the vertices that counts as the lowest ground, because of spikes of the survey."""
RAYS, STEPS = 12, 250
"""Number of places along a crest from which its fall is computed, and number of ground points in front of each."""


class Crest(NamedTuple):
    """A stretch of a crest.

    points : (N, 3) m, local frame, on the ground a little beyond the brow, so that rocks fall
    length : m, in plan; height : m, median height of the face below
    fall : m, from the crest down to the lowest ground that rocks from there may reach, as `_fall` estimates it
    """

    points: FloatArray
    length: float
    height: float
    fall: float


def crests_of(terrain: Terrain) -> list[Crest]:
    """Return the crests of a terrain: first the crest with the longest fall, then the others, the largest face first.

    The first crest is chosen among the crests that are at least LONG (50 m) long, or among all crests if all are
    shorter. Faces are searched in a coarse image; the lines of the first MOST_CRESTS (16) crests are searched again in
    a fine image. The points of the crests are in the local frame.
    """
    image = height_image(terrain, terrain.vertices[:, :2], 2.0 * COARSE, COARSE)
    lowest = float(np.percentile(terrain.vertices[:, 2], LOW, method="lower"))
    lines = [part for line in upper_borders(image, SHORTEST) for part in _stretches(line)]
    rough = [
        (_with_fall(image, crest, lowest), k) for k, line in enumerate(lines) for crest in _on_the_brow(image, line)
    ]
    kept = _in_order([crest for crest, _ in rough], MOST_CRESTS)
    used = [lines[k] for k in dict.fromkeys(rough[i][1] for i in kept)]  # a line may have several crests
    found = (crest for line in used for crest in _on_the_brow(height_image(terrain, line, HIGHEST, PIXEL), line))
    exact = [_with_fall(image, crest, lowest) for crest in found]
    return [exact[i] for i in _in_order(exact, len(exact))]


def listed(crests: Sequence[Crest], most: int) -> list[Crest]:
    """Return at most `most` crests: first the crest with the longest fall, then the others, the largest face first.

    The first crest is chosen among the crests that are at least LONG (50 m) long, or among all crests if all are
    shorter. The crest with the highest mean altitude is always included: if this crest is not among the first `most`
    crests, it replaces the last of them.

    most : largest number of crests, at least 2
    """
    return [crests[i] for i in _in_order(crests, most)]


def _in_order(crests: Sequence[Crest], most: int) -> list[int]:
    """Return the indices of at most `most` crests in the order of `listed`; most : at least 2.

    The highest crest is included even if lower faces are larger: rocks from the top of a wall fall farthest, and reach
    all places that rocks from lower crests reach. If several crests have the longest fall (in whole metres), the crest
    with the largest face is the first.
    """
    if not crests:
        return []
    by_size = sorted(range(len(crests)), key=lambda i: -_size(crests[i]))
    long = [i for i in by_size if crests[i].length >= LONG] or by_size
    first = max(long, key=lambda i: round(crests[i].fall))
    order = [first, *(i for i in by_size if i != first)]
    highest = max(order, key=lambda i: float(crests[i].points[:, 2].mean()))
    return order[:most] if highest in order[:most] else [*order[: most - 1], highest]


def _size(crest: Crest) -> float:
    """Return the area (m2), as seen from the front, of the face below a crest; crests are sorted by this area."""
    return crest.length * crest.height


def _with_fall(image: HeightImage, crest: Crest, lowest: float) -> Crest:
    """Return a crest with its fall, which is at least the height of the face below the crest.

    image : heights of the whole terrain; lowest : height (m) of the lowest ground of the terrain
    """
    return crest._replace(fall=max(_fall(image, crest.points, lowest), crest.height))


def _fall(image: HeightImage, points: FloatArray, lowest: float) -> float:
    """Return the fall (m) from a crest (N, 3) m: down to the lowest ground in front that rocks may reach.

    Rocks may reach ground if the straight line from the crest to this ground is steeper than ENERGY_LINE (30 degrees),
    and if no ground in between stops the rocks. The result is the median over RAYS (12) places along the crest.

    image : heights of the whole terrain; lowest : height (m) of the lowest ground of the terrain
    """
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1))])
    at = (np.arange(RAYS) + 0.5) / RAYS * along[-1]
    x, y, top = (np.interp(at, along, column) for column in points.T)
    plan, slope = np.column_stack([x, y]), math.tan(math.radians(ENERGY_LINE))
    relief = max(float(top.max()) - lowest, LOWEST)
    distance = np.linspace(0.0, relief / slope, STEPS + 1)[1:]
    ground = heights_at(image, plan[:, None, :] + distance[:, None] * _outwards(plan)[:, None, :])
    drop, line = top[:, None] - ground, slope * distance
    stopped = np.logical_or.accumulate(drop + STOPPING < line, axis=1)  # not in holes, where there is no ground
    return float(np.median(np.where((drop >= line) & ~stopped, drop, 0.0).max(axis=1)))


def _stretches(line: FloatArray) -> list[FloatArray]:
    """Return a line (N, 2) m cut into stretches (P, 2) m of equal length, at most LONGEST (300 m).

    The points of a stretch are at most SPACING (3 m) apart.
    """
    whole = shapely.LineString(line)
    parts = max(1, math.ceil(whole.length / LONGEST))
    each = max(2, math.ceil(whole.length / parts / SPACING) + 1)
    places = np.linspace(0.0, whole.length, parts * (each - 1) + 1)
    points = shapely.get_coordinates(shapely.line_interpolate_point(whole, places))
    return [points[i * (each - 1) : (i + 1) * (each - 1) + 1] for i in range(parts)]


def _on_the_brow(image: HeightImage, line: FloatArray) -> Iterator[Crest]:
    """Yield the crests along a line (N, 2) m, moved to the brow; points with no face in front of them are left out.

    If two successive remaining points are more than JOINED + SPACING (9 m) apart, a new crest begins at the second
    point.

    image : heights with ground on both sides of the line, up to HIGHEST (40 m) in front of it
    """
    outwards = _outwards(line)
    distance = np.arange(-SEARCHED, HIGHEST, FINE)
    ground = heights_at(image, line[:, None, :] + distance[:, None] * outwards[:, None, :])
    found = [_brow_and_height(distance, heights) for heights in ground]
    brow, height = np.array(found).T
    kept = np.flatnonzero(height >= LOWEST)
    gaps = np.flatnonzero(np.linalg.norm(np.diff(line[kept], axis=0), axis=1) > JOINED + SPACING) + 1
    for some in np.split(kept, gaps):
        plan = line[some] + (_in_line(brow[some])[:, None] + OVER) * outwards[some]
        yield from _crest(np.column_stack([plan, heights_at(image, plan)]), height[some])


def _outwards(line: FloatArray) -> FloatArray:
    """Return the unit vectors (N, 2) to the left of a line (N, 2) m, where the face is."""
    tangent = np.gradient(line, axis=0)
    outwards = np.column_stack([-tangent[:, 1], tangent[:, 0]])
    return np.asarray(outwards / np.maximum(np.linalg.norm(outwards, axis=1, keepdims=True), 1e-12))


def _in_line(brow: FloatArray) -> FloatArray:
    """Return the distances (N,) m from points of a line to the brow, after removal of noise.

    A distance counts as noise if it differs by more than STRAY (1 m) from the median of five successive distances, with
    this distance in the middle. The median replaces the noise.
    """
    if len(brow) < 3:
        return brow
    around = np.median(sliding_window_view(np.pad(brow, 2, mode="reflect"), 5), axis=1)
    return np.where(np.abs(brow - around) > STRAY, around, brow)


def _crest(points: FloatArray, height: FloatArray) -> Iterator[Crest]:
    """Yield the crest through the points (N, 3) m that are on ground; nothing if the crest is shorter than 10 m.

    points : NaN as z where there is no ground; height : (N,) m, height of the face below each point
    """
    on_ground = np.isfinite(points[:, 2])
    points, height = points[on_ground], height[on_ground]
    if len(points) < 2:
        return
    points = shapely.get_coordinates(shapely.simplify(shapely.LineString(points), FINE), include_z=True)
    length = float(np.linalg.norm(np.diff(points[:, :2], axis=0), axis=1).sum())
    if length >= SHORTEST:
        face = float(np.median(height))
        yield Crest(points=points, length=length, height=face, fall=face)


def _brow_and_height(distance: FloatArray, ground: FloatArray) -> tuple[float, float]:
    """Return the distance (m) of the brow on a line across a crest, and the face's height (m); NaN and 0 without face.

    A face does not count if its brow is SEARCHED (3 m) or more in front of the border of the face, or if there is no
    ground behind the brow (BEHIND).

    distance, ground : (S,) m, distances and elevations of the line's points
    """
    face = first_face(distance, ground)
    if face is None or face.brow >= SEARCHED:
        return math.nan, 0.0
    behind = max(int(np.searchsorted(distance, face.brow)) - BEHIND, 0)
    return (face.brow, face.height) if np.isfinite(ground[behind]) else (math.nan, 0.0)
