"""Close the open seams of a mesh: let the sides of facets run through the vertices of the facets on the other side.

A seam is open where a vertex lies close to a side of another facet, but not on it, as after rounding a T-junction to
the millimetres of an export. The facet is cut into parts whose sides end at this vertex. No vertex moves, and the only
new facets are parts of cut facets.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.facets import unit_normals
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.facet_parts import Parts, Triangles, cut_facets
from rpf3d_core.terrain.mesh.matched_sides import Flags, closing_pairs, farthest
from rpf3d_core.terrain.mesh.near_rim import Near, joined_pairs
from rpf3d_core.terrain.mesh.rim import Numbers, Rim

WIDEST_CLOSED = 0.02
"""Largest width (m) of a seam that is closed: rounding all coordinates to 1 cm opens a T-junction by up to 1.8 cm.

A vertex and the side near it both move by up to half the diagonal of a cube of 1 cm, 0.87 cm. A survey is not more
accurate than this.
"""
SHARE_CLOSED = 0.05
"""Largest width of a seam that is closed, as a share of the length of the side; a fine mesh then keeps its shape."""
MOST_TURNED = 0.5
"""Least cosine (-) of the angle between the normals of a facet and of a part of it, so at most 60 degrees.

A vertex that was rounded to 1 mm turns a part by tens of degrees if it lies some millimetres from a corner.
"""
MAY_LEAN = 0.02
"""Largest change (-) of the vertical component of a unit normal that may change its sign.

A facet within about 1 degree of upright may lean to either side after rounding. On other facets, a part that faces down
would lie over other ground.
"""
NARROWEST = 1e-7
"""Least height of a part of a facet, as a share of its longest side (-); a narrower part has no safe normal."""


class ClosedSeams(NamedTuple):
    """A mesh of F facets after its seams were closed.

    triangles : (F + N, 3); the first part of a facet has the facet's number, the other parts follow after all facets
    parent : (N,) the facet from which each of the other parts was cut
    closed : the pairs of a vertex and a side that now runs through it, without pairs within a crack; the side is a
        side of the rim before closing
    refused : the pairs that would close a seam, but would turn or flatten a part of the facet too much
    """

    triangles: Triangles
    parent: Numbers
    closed: Near
    refused: Near


def close_seams(vertices: FloatArray, triangles: Triangles, rim: Rim, pairs: Near, crack: float) -> ClosedSeams:
    """Return the mesh after its seams were closed as far as this is safe.

    A seam is closed if it is at most WIDEST_CLOSED (m) and SHARE_CLOSED times the length of the side wide, if the side
    and the vertex belong to the rim, if a part of the side then fits a side on the other side of the seam
    (`matched_sides`), and if the parts of the facet face the same way as the facet. Sides that have only vertices
    within a crack stay as they are, because no rock falls through a crack.

    vertices : (V, 3) m; triangles : (F, 3), with consistent winding; rim : the rim of the mesh
    pairs : all vertices close to sides of the rim; crack : m, width of a gap that is ignored
    """
    pairs = pairs.of(may_be_closed(pairs))
    pairs = _once_a_facet(pairs, rim, len(vertices))
    refused = pairs.of(np.zeros(0, np.int64))
    while True:
        pairs = closing_pairs(pairs, rim, len(vertices))
        cut = pairs.of(_on_open_sides(pairs, rim, crack))
        parts = cut_facets(triangles, cut, rim)
        damaged = _damaged_parts(vertices, triangles, parts)
        if not len(damaged):
            break
        out = _that_damage(pairs, rim, parts, damaged, crack)
        refused = joined_pairs([refused, pairs.of(out & (pairs.gap > crack))])
        pairs = pairs.of(~out)
    return ClosedSeams(
        triangles=parts.triangles,
        parent=parts.parent,
        closed=cut.of(cut.gap > crack),
        refused=refused,
    )


def may_be_closed(pairs: Near) -> Flags:
    """Return flags (N,): true for pairs of a vertex and a side that are narrow enough to be closed."""
    return np.asarray(pairs.gap <= np.minimum(WIDEST_CLOSED, SHARE_CLOSED * pairs.length))


def _once_a_facet(pairs: Near, rim: Rim, vertices: int) -> Near:
    """Return the pairs without vertices that are close to two sides of one facet: the nearer side keeps the vertex.

    pairs : sorted as in `Near`; rim : the rim of the mesh; vertices : number of vertices
    """
    key = rim.facet[pairs.side] * vertices + pairs.vertex
    return pairs.of(farthest(key, -pairs.gap, np.ones(len(key), bool)))


def _on_open_sides(pairs: Near, rim: Rim, crack: float) -> Flags:
    """Return flags (N,): true for pairs whose side has at least one vertex that is off the side by more than a crack.

    rim : the rim of the mesh; crack : m
    """
    is_open = np.zeros(len(rim.begin), bool)
    is_open[pairs.side[pairs.gap > crack]] = True
    return np.asarray(is_open[pairs.side])


def _damaged_parts(vertices: FloatArray, triangles: Triangles, parts: Parts) -> Numbers:
    """Return the rows (D,) of parts that are nearly without area or turned away from their facet, in 3D or in plan.

    vertices : (V, 3) m; triangles : (F, 3) before facets were cut; parts : the mesh after facets were cut
    """
    count = len(triangles)
    rows = np.concatenate([np.unique(parts.parent), count + np.arange(len(parts.parent))])
    made, facets = parts.triangles[rows], triangles[_facet_of(rows, parts, count)]
    new, old = unit_normals(vertices, made), unit_normals(vertices, facets)
    turned = (new * old).sum(axis=1) < MOST_TURNED
    over = (new[:, 2] * old[:, 2] < 0.0) & (np.abs(new[:, 2] - old[:, 2]) > MAY_LEAN)
    return np.asarray(rows[turned | over | _is_needle(vertices, made)])


def _is_needle(vertices: FloatArray, triangles: Triangles) -> Flags:
    """Return flags (F,): true for facets that are narrower than NARROWEST; vertices : (V, 3) m; triangles : (F, 3)."""
    corners = vertices[triangles]
    sides = corners - np.roll(corners, 1, axis=1)
    twice_area = np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1)
    return np.asarray(twice_area <= NARROWEST * (sides * sides).sum(axis=2).max(axis=1))


def _facet_of(rows: Numbers, parts: Parts, count: int) -> Numbers:
    """Return the facet (N,) from which each part was cut.

    rows : (N,) rows of the parts in `parts.triangles`; count : number of facets before they were cut
    """
    facet = rows.copy()
    facet[rows >= count] = parts.parent[rows[rows >= count] - count]
    return facet


def _that_damage(pairs: Near, rim: Rim, parts: Parts, damaged: Numbers, crack: float) -> NDArray[np.bool_]:
    """Return flags (N,): true for the pairs that must be left out, because they make damaged parts of facets.

    For each facet with damaged parts, one pair is flagged. Candidates are the pairs whose vertex is a corner of a
    damaged part and is farther from its side than a crack; the farthest vertex is chosen. Without a candidate, all
    pairs of the facet are flagged.

    rim : the rim of the mesh; parts : the mesh after facets were cut; damaged : (D,) rows of damaged parts; crack : m
    """
    count = len(parts.triangles) - len(parts.parent)
    facet, of_pair = _facet_of(damaged, parts, count), rim.facet[pairs.side]
    vertices = int(parts.triangles.max()) + 1
    corners = facet[:, None] * vertices + parts.triangles[damaged]
    touches = np.isin(of_pair * vertices + pairs.vertex, corners) & (pairs.gap > crack)
    hopeless = np.isin(of_pair, np.setdiff1d(facet, of_pair[touches]))
    return farthest(of_pair, pairs.gap, touches) | hopeless
