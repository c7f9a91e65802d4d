"""Change the arrays of a terrain as a patch requires: added facets are written into the rows of removed facets.

An unused row contains a facet without area, which no rock can touch and no search finds. If more facets are added than
removed, the arrays grow into the spare memory behind them.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_locator import BucketLocator
from rpf3d_core.detection.bucket_patch import BucketPatch, patched_locator
from rpf3d_core.errors import TerrainError
from rpf3d_core.jit.memory import Share, halves
from rpf3d_core.live.patching import PatchChange
from rpf3d_core.live.reused_memory import Room
from rpf3d_core.terrain.facets import (
    RELATIVE_TOLERANCE,
    Facets,
    Terrain,
    facets_from,
    lay_out_some,
    widen_to_corners,
)
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec

WIDER = 1.25
"""Largest factor by which patches may lengthen the terrain's diagonal.

The contact tolerance, which depends on the diagonal, stays the same; its margin is a factor of 200
(`RELATIVE_TOLERANCE`).
"""


class IndexedTerrain(NamedTuple):
    """A terrain, its facets, and the search structure (buckets) over them; all share memory."""

    terrain: Terrain
    facets: Facets
    locator: BucketLocator


def with_patch(
    terrain: Terrain, facets: Facets, locator: BucketLocator, change: PatchChange, room: Room, share: Share
) -> IndexedTerrain:
    """Carry out the changes of a patch in the memory of the terrain, and return the changed terrain.

    Raises TerrainError, with nothing changed, if the patch makes the terrain too wide for its contact tolerance.

    facets, locator : facets and search structure of the terrain; change : the changes of the patch
    room : the memory of the terrain; share : runs functions in parallel
    """
    low, high = _box(facets, change, room.memory.longer("marks", len(facets.zone)), share)
    numbers, vertices = _vertices(terrain, change, room)
    rows, empty, count = _rows(len(facets.zone), change, room)
    triangles = room.memory.longer("triangles", 3 * count).reshape(-1, 3)
    triangles[rows], triangles[empty] = numbers, numbers[0, 0]
    geometry = room.memory.longer("geometry", 12 * count).reshape(-1, 12)
    lay_out_some(vertices, triangles, rows, geometry)
    lay_out_some(vertices, triangles, empty, geometry)
    zone, marks = room.memory.longer("zone", count), room.memory.longer("marks", count)
    zone[len(facets.zone) :], marks[len(facets.zone) :] = 0, 0
    edited = facets_from(geometry, zone, low, high, facets.tolerance)
    patch = BucketPatch(gone=marks, rows=rows, block=change.block, entries=change.entries)
    index = patched_locator(locator, edited, patch, room.memory, share)
    room.patched(empty)
    whole = Terrain(vertices, triangles, zone, terrain.zones, terrain.frame)
    return IndexedTerrain(terrain=whole, facets=edited, locator=index)


def _vertices(terrain: Terrain, change: PatchChange, room: Room) -> tuple[NDArray[np.int64], FloatArray]:
    """Write a patch's new vertices into the vertex array: first into free rows of the array, then after its last row.

    Return the added triangles (S, 3) with final vertex numbers, and all vertices (V, 3) m.
    """
    before, coming = len(terrain.vertices), len(change.vertices)
    free = np.concatenate([room.free_vertices, change.freed])
    places = np.concatenate([free[:coming], np.arange(before, before + max(coming - len(free), 0))])
    room.free_vertices = free[coming:]
    vertices = room.memory.longer("vertices", 3 * max(before, int(places.max(initial=-1)) + 1)).reshape(-1, 3)
    vertices[places] = change.vertices
    old = change.triangles < before
    return np.where(old, change.triangles, places[np.where(old, 0, change.triangles - before)]), vertices


def _rows(before: int, change: PatchChange, room: Room) -> tuple[NDArray[np.int32], NDArray[np.int32], int]:
    """Return the rows (S,) for the added facets, the rows (U,) that stay unused, and the new number of rows.

    Added facets get the rows of removed facets first, then unused rows, then new rows after the last row.

    before : number of rows before the patch
    """
    coming = len(change.triangles)
    free = np.concatenate([change.gone, room.free_rows]).astype(np.int32)
    more = np.arange(before, before + max(coming - len(free), 0), dtype=np.int32)
    return np.concatenate([free[:coming], more]), free[coming:], before + len(more)


def _box(facets: Facets, change: PatchChange, marks: NDArray[np.uint8], share: Share) -> tuple[Vec, Vec]:
    """Return the low and high corner (m) of the box around all facets after a patch.

    Raises TerrainError if the box becomes too wide for the terrain's contact tolerance.

    marks : (F,) from `change_of`: STAYS or GOES for each facet; share : runs functions in parallel
    """
    going = facets.corners[change.gone].reshape(-1, 3)
    box = np.array([facets.low, facets.high])
    if bool((going == box[0]).any() or (going == box[1]).any()):
        box = _box_of_what_stays(facets, marks, share)
    low, high = np.minimum(box[0], change.vertices.min(axis=0)), np.maximum(box[1], change.vertices.max(axis=0))
    if RELATIVE_TOLERANCE * math.dist(low, high) > WIDER * facets.tolerance:
        raise TerrainError("the patch reaches far beyond the terrain: publish the whole terrain")
    (x, y, z), (u, v, w) = low.tolist(), high.tolist()
    return (x, y, z), (u, v, w)


def _box_of_what_stays(facets: Facets, marks: NDArray[np.uint8], share: Share) -> FloatArray:
    """Return the low and high corner (2, 3) m of the box around the facets that a patch does not remove.

    marks : (F,) STAYS or GOES for each facet; share : runs functions in parallel
    """
    boxes = np.array([[[np.inf] * 3, [-np.inf] * 3]] * 2)
    share([
        lambda k=k, a=a, b=b: widen_to_corners(facets.corners, marks, a, b, boxes[k])  # type: ignore[misc]
        for k, (a, b) in enumerate(halves(len(facets.zone)))
    ])  # fmt: skip
    return np.stack([boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)])
