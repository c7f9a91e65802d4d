"""View the terrain from above as an image: find the uppermost facet under each pixel, for the maps."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray

CANDIDATES_AT_ONCE = 500_000
"""Number of pairs of facet and pixel that are processed together: limits the memory to about 50 MB, and is fast."""

EDGE = 1e-9
"""Slack (-) of the test whether a pixel centre lies in a facet: a centre on an edge then lies in both facets."""


class Window(NamedTuple):
    """A rectangle in plan that an image shows. left, right : x (m); bottom, top : y (m); both in the local frame."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Extent from west to east, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Extent from south to north, m."""
        return self.top - self.bottom


@dataclass(frozen=True, eq=False)
class PlanView:
    """The terrain seen from above, as an image of facet numbers.

    facet : (H, W) number of the uppermost facet at the centre of each pixel, -1 for no facet; row 0 is the bottom row
    window : the rectangle in plan that the image shows
    """

    facet: IntArray
    window: Window


def seen_from_above(terrain: Terrain, window: Window, pixels: int) -> PlanView:
    """Return the view of a terrain from above: the uppermost facet under the centre of each pixel, (H, W).

    Parameters
    ----------
    terrain : Terrain
        Facets of any size, overlapping in plan or not; a vertical facet covers no pixel.
    window : Window
        Of width and height > 0.
    pixels : int
        Number of pixels along the longer side of the window.
    """
    size = max(window.width, window.height) / pixels
    shape = (max(1, round(window.height / size)), max(1, round(window.width / size)))
    facet = np.full(shape[0] * shape[1], -1, dtype=np.int32)
    highest = np.full(len(facet), -np.inf)
    for near, pixel, height in surfaces_at(terrain, window, shape):
        before = highest[pixel]
        np.maximum.at(highest, pixel, height)
        top = (height > before) & (height == highest[pixel])
        facet[pixel[top]] = near[top]  # of several candidates with the same height, the last one assigned stays
    return PlanView(facet.reshape(shape), window)


def surfaces_at(
    terrain: Terrain, window: Window, shape: tuple[int, int]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]]:
    """Yield each pair of a facet and a pixel whose centre lies in the facet in plan, in chunks of three arrays (N,).

    The arrays are the facets, the pixels, and the heights (m) of the facets at the pixel centres. A pixel has several
    pairs where facets lie above each other. A vertical facet covers no pixel.

    window : of width and height > 0; shape : rows and columns of pixels, whose numbers go row by row from the bottom
    """
    scale = np.array([shape[1] / window.width, shape[0] / window.height])
    in_pixels = terrain.vertices * (*scale, 1.0) - (*(np.array([window.left, window.bottom]) * scale + 0.5), 0.0)
    near = facets_near(terrain, window)
    for chunk, pixel, height in _candidates(in_pixels, terrain.triangles[near], shape):
        yield near[chunk], pixel, height


def facets_near(terrain: Terrain, window: Window) -> NDArray[np.int64]:
    """Return the facets (N,) that may overlap a window.

    A facet is left out if all three corners lie beyond one side of the window.
    """
    side = np.zeros(len(terrain.vertices), dtype=np.uint8)  # one bit for each side of the window (Cohen and Sutherland)
    x, y = terrain.vertices[:, 0], terrain.vertices[:, 1]
    for bit, beyond in enumerate((x < window.left, x > window.right, y < window.bottom, y > window.top)):
        side |= beyond.view(np.uint8) << bit
    a, b, c = terrain.triangles.T
    return np.flatnonzero((side[a] & side[b] & side[c]) == 0)


def _candidates(
    vertices: FloatArray, triangles: IntArray, shape: tuple[int, int]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64], FloatArray]]:
    """Yield pairs of a facet and a pixel whose centre lies in the facet in plan, in chunks of three arrays (N,).

    The arrays are the facets, the pixels, and the heights (m) of the facets at the pixel centres.

    vertices : (V, 3) x and y in pixels, z in m; shape : rows and columns of the image
    """
    some, first, counts = _pixel_boxes(vertices, triangles, shape)
    pairs = counts[:, 0] * counts[:, 1]
    ends = np.cumsum(pairs)
    chunks = np.searchsorted(ends, np.arange(CANDIDATES_AT_ONCE, ends[-1] if len(ends) else 0, CANDIDATES_AT_ONCE))
    for part in np.split(np.arange(len(some)), np.unique(chunks)):
        facet = np.repeat(some[part], pairs[part])
        ordinal = np.arange(len(facet)) - np.repeat(np.cumsum(pairs[part]) - pairs[part], pairs[part])
        row, column = np.divmod(ordinal, np.repeat(counts[part, 0], pairs[part]))
        column += np.repeat(first[part, 0], pairs[part])
        row += np.repeat(first[part, 1], pairs[part])
        planes = _planes(vertices[triangles[some[part]]])
        covered, height = _heights(planes, pairs[part], column, row)
        yield facet[covered], (column + shape[1] * row)[covered], height


def _pixel_boxes(
    vertices: FloatArray, triangles: IntArray, shape: tuple[int, int]
) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:
    """Return the facets (N,) that may cover a pixel centre, with the first pixel and the pixel counts of their boxes.

    The first pixel (N, 2) is column and row; the counts (N, 2) are numbers of columns and rows. Of millions of facets,
    only a few contain a pixel centre. The other facets are removed in two steps: first by rows, then by columns.

    shape : number of rows and columns of pixels; vertices : (V, 3), x and y in pixels
    """
    height, width = shape
    row, rows = _pixels(vertices[:, 1], triangles, height)
    some = np.flatnonzero(rows > 0)
    column, columns = _pixels(vertices[:, 0], triangles[some], width)
    wide = np.flatnonzero(columns > 0)
    some, column, columns = some[wide], column[wide], columns[wide]
    first, counts = np.stack([column, row[some]], axis=1), np.stack([columns, rows[some]], axis=1)
    return some, first.astype(np.int64), counts.astype(np.int64)


def _pixels(places: FloatArray, triangles: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Return the first pixel (F,) in the box of each facet along one axis, and the number of pixels (F,) in the box.

    A pixel is in the box if its centre is. The number is 0 or less if the box contains no pixel centre.

    places : (V,) coordinates of the vertices along the axis, in pixels; count : number of pixels of the image
    """
    after = np.ceil(np.clip(places, -1.0, count)).astype(np.int32)
    before = np.floor(np.clip(places, -1.0, count)).astype(np.int32)
    a, b, c = triangles.T
    low = np.minimum(np.minimum(after[a], after[b]), after[c]).clip(0, count)
    high = np.maximum(np.maximum(before[a], before[b]), before[c]).clip(-1, count - 1)
    return low, high - low + 1


def _planes(corners: FloatArray) -> FloatArray:
    """Return the coefficients (9, F) of three linear functions of a pixel's column and row, for each facet.

    At a pixel, the functions give the barycentric weights of the facet's second and third corner (-), and the height
    (m) of the facet's plane. The coefficients of a vertical facet are not finite.

    corners : (F, 3, 3) of the facets, x and y in pixels, z in m
    """
    a, ab, ac = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        area = 1.0 / (ab[:, 0] * ac[:, 1] - ab[:, 1] * ac[:, 0])
        second = np.stack([ac[:, 1], -ac[:, 0], ac[:, 0] * a[:, 1] - ac[:, 1] * a[:, 0]]) * area
        third = np.stack([-ab[:, 1], ab[:, 0], ab[:, 1] * a[:, 0] - ab[:, 0] * a[:, 1]]) * area
        height = second * ab[:, 2] + third * ac[:, 2]
    height[2] += a[:, 2]
    return np.concatenate([second, third, height])


def _heights(
    planes: FloatArray, repeats: NDArray[np.int64], column: NDArray[np.int64], row: NDArray[np.int64]
) -> tuple[NDArray[np.int64], FloatArray]:
    """Return the indices (M,) of the pixel centres that lie in their facet, and the heights (M,) m of the facets there.

    planes : (9, F) from `_planes`; column, row : (N,) column and row of each pixel to test, facet after facet
    repeats : (F,) number of consecutive pixels of each facet
    """

    def at(pixels: NDArray[np.int64] | slice, function: int) -> FloatArray:
        x, y, constant = (np.repeat(planes[3 * function + i], repeats)[pixels] for i in range(3))
        value: FloatArray = x * column[pixels] + y * row[pixels] + constant
        return value

    with np.errstate(invalid="ignore"):
        second, third = at(slice(None), 0), at(slice(None), 1)
        covered = np.flatnonzero((second >= -EDGE) & (third >= -EDGE) & (second + third <= 1.0 + EDGE))
    return covered, at(covered, 2)
