"""Plan how a patch is joined to the terrain, before anything is changed: which facets to remove and which to add.

The footprint of a patch is the area of its own facets in plan. Every facet of the terrain that touches the footprint is
removed as a whole; all other facets stay exactly the same. The ring-shaped gap between the remaining terrain and the
border of the patch is filled with triangles. Small holes of the patch, in which no facet of the terrain remains, are
filled, too. In larger holes the terrain remains unchanged.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_grid import CellRectangle
from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.detection.bucket_patch import Entries, Plan, block_of, entries_of, most_entries
from rpf3d_core.detection.footprint import (
    Footprint,
    beside_what_stays,
    near_patch,
    over_what_goes,
    touched,
    used_by_what_stays,
)
from rpf3d_core.errors import TerrainError
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets, IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.gap_around_patch import CROSSING, rim_edges, triangles_between
from rpf3d_core.terrain.grid_rows import Mesh

OUTSIDE = "the patch lies outside the terrain: the patch touches no part of it"
FOLDED = "the patch folds over itself or stands upright in plan: only a patch that looks up everywhere can be joined"


class PatchChange(NamedTuple):
    """The planned changes of a patch to a terrain with F facets and V vertices.

    gone : (G,) facets that are removed; freed : (U,) vertices that no facet uses after the patch
    vertices : (N, 3) m, added vertices; triangles : (S, 3) added triangles, numbers from V on refer to `vertices`
    block, entries : range of search cells (buckets) of all changed facets, and the added facets in each of these cells
    low, high : corners of the box in plan of all removed and added facets, m
    """

    gone: NDArray[np.int32]
    freed: NDArray[np.int64]
    vertices: FloatArray
    triangles: NDArray[np.int64]
    block: CellRectangle
    entries: Entries
    low: Plan
    high: Plan


def change_of(
    patch: Mesh, terrain: Terrain, facets: Facets, locator: BucketLocator, marks: NDArray[np.uint8]
) -> PatchChange | None:
    """Return the changes that a patch will make to the terrain; None if the patch replaces the whole terrain.

    patch : mesh in the terrain's local frame; facets, locator : facets and search structure of the terrain
    marks : (F,) all STAYS before the call; the function sets GOES for each facet that the patch removes

    Raises TerrainError if the patch does not touch the terrain, folds over itself in plan, has facets far wider than
    those of the terrain, or cannot be joined to the terrain.
    """
    slack, corners = REACH * facets.tolerance, _corners(patch.vertices, patch.triangles)
    _check_sheet(corners)
    found = _Found(terrain, facets, locator, marks, corners, slack)
    if len(found.gone) == 0:
        raise TerrainError(OUTSIDE)
    rim = rim_edges(terrain.triangles[found.gone])
    seam = beside_what_stays(rim, terrain.vertices, terrain.triangles, locator, marks)
    if not seam.any() and not _any_stays(facets, marks):
        return None
    border = rim[~seam]
    ring = _ring(patch, terrain, rim[seam], border[~found.near(_lines(terrain.vertices, border))], found)
    came = np.concatenate([patch.triangles + np.int64(len(terrain.vertices)), ring])
    some = np.unique(terrain.triangles[found.gone]).astype(np.int64)
    used = used_by_what_stays(some, terrain.vertices, terrain.triangles, locator, marks) | np.isin(some, ring)
    new = _corners(np.concatenate([terrain.vertices[some], patch.vertices]), _renumbered(came, some, terrain))
    both = np.concatenate([facets.corners[found.gone], new])
    block, (low, high) = block_of(both, locator, slack), _extent(both)
    entries = entries_of(new, locator, block, slack, most_entries(len(facets.zone)))
    return PatchChange(
        gone=found.gone,
        freed=some[~used],
        vertices=patch.vertices,
        triangles=came,
        block=block,
        entries=entries,
        low=low,
        high=high,
    )


class _Found:
    """The facets of the terrain that a patch touches (`gone`), and methods to compare places with the patch in plan.

    Creating the object sets GOES in `marks` for the facets in `gone`.
    """

    def __init__(
        self, terrain: Terrain, facets: Facets, locator: BucketLocator, marks: NDArray[np.uint8], patch: FloatArray,
        slack: float,
    ) -> None:  # fmt: skip
        self._ground, self._locator, self._marks = facets.corners, locator, marks
        block = block_of(patch, locator, 2.0 * slack)
        entries = entries_of(patch, locator, block, 2.0 * slack, most_entries(len(facets.zone)))
        self._footprint = Footprint(corners=patch, block=block, entries=entries, slack=slack)
        self.gone = touched(facets.corners, locator, self._footprint, marks)

    def near(self, thin: FloatArray) -> NDArray[np.bool_]:
        """Return flags (N,), True for each of the triangles (N, 9) m that touches the patch in plan."""
        return near_patch(thin, self._locator, self._footprint)

    def between(self, points: FloatArray) -> NDArray[np.bool_]:
        """Return flags (N,), True for places (N, 2) m in the gap: over a removed facet, but not over the patch."""
        over = over_what_goes(points, self._ground, self._locator, self._marks)
        flat = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
        return over & ~near_patch(np.tile(flat, 3), self._locator, self._footprint._replace(slack=0.0))


def _check_sheet(corners: FloatArray) -> None:
    """Raise TerrainError if a facet of the patch does not face upwards, because a patch must not fold over itself.

    corners : (N, 9) m, the facets of the patch
    """
    u, w = corners[:, 3:5] - corners[:, 0:2], corners[:, 6:8] - corners[:, 0:2]
    if not bool((u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0] > 0.0).all()):
        raise TerrainError(FOLDED)


def _any_stays(facets: Facets, marks: NDArray[np.uint8]) -> bool:
    """Return True if a facet with an area stays in the terrain, so that the patch is not the whole terrain."""
    stays = np.flatnonzero(marks[: len(facets.zone)] == 0)
    return bool(facets.normals[stays].any())


def _ring(
    patch: Mesh, terrain: Terrain, seam: NDArray[np.int64], border: NDArray[np.int64], found: _Found
) -> NDArray[np.int64]:
    """Return the triangles (T, 3) that fill the gap between the remaining terrain and the border of the patch.

    Numbers below V are vertices of the terrain, which has V vertices. Vertex k of the patch has the number V + k.

    seam : (N, 2) edges between removed and remaining facets
    border : (M, 2) edges of the removed facets at the former boundary of the terrain, away from the patch
    found : the facets that the patch touches
    """
    count = len(terrain.vertices)
    edges = np.concatenate([seam, border, rim_edges(patch.triangles) + count])
    ids = np.unique(edges)
    old = int(np.searchsorted(ids, count))
    places = np.concatenate([terrain.vertices[ids[:old], :2], patch.vertices[ids[old:] - count, :2]])
    some = triangles_between(places, np.searchsorted(ids, edges).astype(np.int32))
    ring = ids[some[found.between(places[some].mean(axis=1))]]
    _check_closed(seam, ring)
    return ring


def _check_closed(seam: NDArray[np.int64], ring: NDArray[np.int64]) -> None:
    """Raise TerrainError if a gap would remain: if an edge in `seam` has no triangle of `ring`.

    seam : (N, 2) edges between removed and remaining facets
    ring : (T, 3) triangles between the remaining terrain and the patch
    """
    sides = {(a, b) for a, b, c in ring.tolist()} | {(b, c) for a, b, c in ring.tolist()}
    sides |= {(c, a) for a, b, c in ring.tolist()}
    if not all((a, b) in sides for a, b in seam.tolist()):
        raise TerrainError(f"the patch cannot be joined to the remaining ground: {CROSSING}: publish the whole terrain")


def _renumbered(came: NDArray[np.int64], some: NDArray[np.int64], terrain: Terrain) -> NDArray[np.int64]:
    """Return triangles (N, 3) with new vertex numbers: first the vertices in `some`, then the patch's vertices.

    came : (N, 3) added triangles; the patch's vertices are numbered after all V vertices of the terrain
    some : (K,) sorted numbers of those vertices of the terrain that get the new numbers 0 to K - 1
    """
    old = came < len(terrain.vertices)
    return np.where(old, np.searchsorted(some, np.where(old, came, 0)), came - len(terrain.vertices) + len(some))


def _extent(corners: FloatArray) -> tuple[Plan, Plan]:
    """Return the south-western and north-eastern corner (m) of the box in plan around facets (N, 9) m."""
    x, y = (np.ascontiguousarray(corners[:, k::3]) for k in range(2))  # a minimum along rows takes ten times as long
    return (float(x.min()), float(y.min())), (float(x.max()), float(y.max()))


def _corners(vertices: FloatArray, triangles: Any) -> FloatArray:
    return np.ascontiguousarray(vertices[triangles].reshape(-1, 9))


def _lines(vertices: FloatArray, edges: IntArray | NDArray[np.int64]) -> FloatArray:
    """Return edges (E, 2) as triangles without area (E, 9) m, so that functions for triangles accept them."""
    return _corners(vertices, edges[:, [0, 1, 1]])
