"""Close the narrow seams of a terrain, and list the wider ones that stay open.

A seam is open where a vertex lies close to a side of another facet, but not on it, as after rounding a T-junction to
the millimetres of an export. A rock can fall through unnoticed, because the rim at the seam looks like the rim of the
terrain. `mesh.close_seams` closes the seams of a mesh; this module applies it to a terrain with zones and edges.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import CRACK, Terrain, tolerance_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.close_seams import close_seams, may_be_closed
from rpf3d_core.terrain.mesh.edges import Edges, edges_of
from rpf3d_core.terrain.mesh.near_rim import WIDEST, Near, near_rim
from rpf3d_core.terrain.mesh.rim import Numbers, Rim, rim_of

RELATIVE = 0.01
"""Largest width of an open seam, as a share of the length of the side.

Without this limit, vertices and sides on opposite edges of the small facets of a fine mesh would count as open seams.
"""
MOST_SIDES = 1_000_000
"""Largest number of sides of the rim for which seams are closed; along a longer rim, seams are only counted."""
SAMPLED = 200_000
"""Number of sides that are searched, evenly spread, on a rim with more than MOST_SIDES sides."""


class Seams(NamedTuple):
    """The seams of a terrain: closed seams, and seams that are still open.

    closed : number of vertices at which seams were closed; widest : m, largest width of a seam that was closed
    vertex, gap : (N,), (N,) m, vertex and width of each seam that is still open
    sampled : True if only a sample of the rim was searched
    """

    closed: int
    widest: float
    vertex: Numbers
    gap: FloatArray
    sampled: bool


class ClosedTerrain(NamedTuple):
    """A terrain of F facets after its seams were closed.

    terrain, edges : the terrain and the edges of its facets
    parent : (N,) the facet that each added part was cut from; the parts are the facets from F on
    seams : what was closed, and what is still open
    """

    terrain: Terrain
    edges: Edges
    parent: Numbers
    seams: Seams


def with_closed_seams(terrain: Terrain, edges: Edges) -> ClosedTerrain:
    """Return the terrain after its narrow seams were closed; a terrain without such seams is returned unchanged.

    The first part of a facet that is cut has the facet's number; the other parts follow after all facets, in the
    facet's zone. Vertices do not change. If the rim has more than MOST_SIDES sides, nothing is closed, and only open
    seams in a sample of the rim are listed.

    edges : of the terrain's facets
    """
    rim = rim_of(terrain.triangles, edges)
    sampled = len(rim.begin) > MOST_SIDES
    searched = np.linspace(0, len(rim.begin) - 1, SAMPLED).astype(int) if sampled else None
    pairs = near_rim(terrain.vertices, rim, searched)
    crack, found = _seams_among(pairs, terrain)
    if sampled or not len(found.gap):
        found = found.of(_is_seam(found))
        return ClosedTerrain(terrain, edges, np.empty(0, np.int64), _seams_left(found, None, sampled))
    closed = close_seams(terrain.vertices, terrain.triangles, rim, pairs, crack)
    found = found.of(_is_seam(found) | _is_among(found, closed.refused, len(terrain.vertices)))
    if not len(closed.parent):
        return ClosedTerrain(terrain, edges, closed.parent, _seams_left(found, None, sampled))
    zone = np.concatenate([terrain.zone, terrain.zone[closed.parent]])
    edges = edges_of(closed.triangles, len(terrain.vertices))
    left = _still_open(found, closed.closed, edges, len(terrain.vertices))
    ready = replace(terrain, triangles=closed.triangles, zone=zone)
    return ClosedTerrain(ready, edges, closed.parent, _seams_left(left, closed.closed, sampled))


def may_have_seams(sides: FloatArray) -> bool:
    """Return True if the rim of a terrain has a vertex close to a side, so that seams may have to be closed.

    A vertex within a crack counts, too, so the answer may be True for a terrain without seams. For a rim of more than
    MOST_SIDES sides the answer is False, because its seams are not closed.

    sides : (S, 3, 3) m, the sides of the rim: begin, end and third corner of the facet
    """
    if not 0 < len(sides) <= MOST_SIDES:
        return False
    places, number = np.unique(sides.reshape(-1, 3), axis=0, return_inverse=True)
    begin, end, third = number.reshape(-1, 3).astype(np.int64).T
    pairs = near_rim(places, Rim(begin=begin, end=end, third=third, facet=np.arange(len(sides))))
    return bool(may_be_closed(pairs).any())


def _seams_among(pairs: Near, terrain: Terrain) -> tuple[float, Near]:
    """Return the crack width (m) of a terrain, and the pairs that are seams.

    A seam is wider than a crack, but narrow enough to be reported (`_is_seam`) or closed (`may_be_closed`). If no pair
    is narrow enough, the crack width is not computed, which would take time on a large terrain: it is then 0.

    pairs : all vertices close to sides of the rim
    """
    narrow = pairs.of(_is_seam(pairs) | may_be_closed(pairs))
    crack = CRACK * tolerance_of(terrain) if len(narrow.gap) else 0.0
    return crack, narrow.of(narrow.gap > crack)


def _is_seam(pairs: Near) -> NDArray[np.bool_]:
    """Return flags (N,): true for pairs that are reported as an open seam if they stay open."""
    return np.asarray(pairs.gap <= np.minimum(WIDEST, RELATIVE * pairs.length))


def _still_open(found: Near, closed: Near, edges: Edges, vertices: int) -> Near:
    """Return the seams that are still open: the pairs that were not closed, and whose vertex is still on the rim.

    found, closed : all pairs, and the closed pairs; edges : of the mesh after closing; vertices : number of vertices
    """
    rim, on_rim = edges.uses == 1, np.zeros(vertices, bool)
    on_rim[edges.low[rim]], on_rim[edges.high[rim]] = True, True
    return found.of(on_rim[found.vertex] & ~_is_among(found, closed, vertices))


def _is_among(pairs: Near, others: Near, vertices: int) -> NDArray[np.bool_]:
    """Return flags (N,): true for pairs that are also among other pairs; vertices : number of vertices."""
    return np.isin(pairs.side * vertices + pairs.vertex, others.side * vertices + others.vertex)


def _seams_left(left: Near, closed: Near | None, sampled: bool) -> Seams:
    """Return the seams that were closed and those that are still open; closed : None if no seam was closed."""
    return Seams(
        closed=0 if closed is None else np.unique(closed.vertex).size,
        widest=0.0 if closed is None else float(closed.gap.max(initial=0.0)),
        vertex=left.vertex,
        gap=left.gap,
        sampled=sampled,
    )
