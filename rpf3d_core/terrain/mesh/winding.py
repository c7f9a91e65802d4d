"""Repair the winding of a mesh, so that every normal points towards the free side.

First, facets are turned over so that neighbours agree across every edge of exactly two facets. Then each component of
the mesh is turned as a whole: an open component so that it faces up (the sum of n_z times area is not negative), a
closed component so that it faces outwards (its signed volume is not negative). Facets on the same three vertices face
the same way: only the first takes part in the repair, because a facet and its copy would form a closed component, in
which one facet faces down.
"""

from typing import NamedTuple

import numpy as np

from rpf3d_core.terrain.facets import area_vectors
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.mesh.edges import Edges, Flags, Index, edges_of, facets_on_borders, shared_by_two


class Winding(NamedTuple):
    """A mesh after the repair of its winding, and what the repair changed.

    triangles : (F, 3), in the order of the input, each with the same first corner
    areas : (F, 3) m^2, the area of each facet times its unit normal
    flipped : (F,) true for facets that were turned over
    piece : (F,) component of each facet across edges of exactly two facets: the smallest facet of the component
    one_sided : number of components that have only one side, such as a Moebius strip; their windings cannot agree, so
        such a component is only turned over as a whole
    """

    triangles: Index
    areas: FloatArray
    flipped: Flags
    piece: Index
    one_sided: int


def repair_winding(vertices: FloatArray, triangles: Index, edges: Edges) -> Winding:
    """Return the mesh after turning over all facets whose normal points away from the free side (the air).

    The module's description states how the free side is found. `triangles` itself is not changed.

    Parameters
    ----------
    vertices : (V, 3) float
        m, z up.
    triangles : (F, 3) int
        Indices into vertices.
    edges : Edges
        The edges of these triangles.
    """
    first = _first_copies(triangles, edges)
    kept = np.flatnonzero(first == np.arange(len(first))).astype(np.int32)
    if len(kept) < len(first):
        return _with_copies(vertices, triangles, first, kept)
    piece, flipped, one_sided = _agreement(len(triangles), edges)
    areas = area_vectors(vertices, triangles)
    areas[flipped] *= -1.0
    wrong = _faces_wrong(vertices[triangles[:, 0]], areas, piece, edges)
    areas[wrong] *= -1.0
    flipped ^= wrong
    triangles = triangles.copy()
    triangles[flipped, 1:] = triangles[flipped, :0:-1]
    return Winding(triangles=triangles, areas=areas, flipped=flipped, piece=piece, one_sided=one_sided)


def _first_copies(triangles: Index, edges: Edges) -> Index:
    """Return the first facet (F,) with the same three vertices as each facet: the facet itself, if it is no copy.

    A facet and its copies share all edges. So either two of them are the only facets at an edge, or more than two
    facets share each edge; only such facets are compared.
    """
    first = np.arange(len(triangles), dtype=np.int32)
    f, g, _ = shared_by_two(edges)
    total = triangles.sum(axis=1)
    twins = total[f] == total[g]  # two vertices of the facets are the same, so the third is as well
    crowded = np.repeat(edges.uses > 2, edges.uses)
    if not twins.any() and not crowded.any():
        return first
    some = np.unique(np.concatenate([f[twins], g[twins], edges.facet[crowded]]))
    _, begin, number = np.unique(np.sort(triangles[some], axis=1), axis=0, return_index=True, return_inverse=True)
    first[some] = some[begin[number.ravel()]]
    return first


def _with_copies(vertices: FloatArray, triangles: Index, first: Index, kept: Index) -> Winding:
    """Return the winding of a mesh in which some facets are copies of others: a copy faces as the first facet does.

    vertices : (V, 3) m; triangles : (F, 3); first : (F,) the first facet with the same vertices as each facet
    kept : (K,) the facets that are no copies
    """
    whole = repair_winding(vertices, triangles[kept], edges_of(triangles[kept], len(vertices)))
    row = np.searchsorted(kept, first)
    flipped = whole.flipped[row]
    copy = np.flatnonzero(first != np.arange(len(first)))
    flipped[copy] ^= _runs_the_other_way(triangles[copy], triangles[first[copy]])
    areas = area_vectors(vertices, triangles)
    areas[flipped] *= -1.0
    wound = triangles.copy()
    wound[flipped, 1:] = wound[flipped, :0:-1]
    return Winding(wound, areas, flipped, kept[whole.piece[row]], whole.one_sided)


def _runs_the_other_way(copy: Index, original: Index) -> Flags:
    """Return flags (C,): true for a copy that passes its vertices in the opposite direction to the original facet.

    The vertices decide, not the areas, so the flag is also right for a facet without area.

    copy, original : (C, 3) vertices of C facets, and of the facets on the same three different vertices
    """
    rolled = [(copy == np.roll(original, k, axis=1)).all(axis=1) for k in range(3)]
    return np.asarray(~np.any(rolled, axis=0))


def _agreement(count: int, edges: Edges) -> tuple[Index, Flags, int]:
    """Return the component (F,) of each facet, flags (F,) of facets to turn, and the number of one-sided components.

    After the flagged facets are turned over, the windings of neighbours agree. Exception: one-sided components, such as
    a Moebius strip.

    Method: each facet f has two nodes, f for the unchanged facet and f + F for the facet turned over. The nodes of two
    neighbours are joined if their windings agree. So each component has two copies in the graph. The copies are
    connected with each other only if the component is one-sided.

    count : number of facets F
    """
    f, g, agree = shared_by_two(edges)
    if agree.all():
        return components(count, f, g), np.zeros(count, bool), 0
    turned = np.where(agree, g, g + np.int32(count))
    opposite = np.where(agree, g + np.int32(count), g)
    node = components(2 * count, np.concatenate([f, f + np.int32(count)]), np.concatenate([turned, opposite]))
    piece = np.minimum(node[:count], node[count:])
    return piece, node[:count] != piece, len(np.unique(piece[node[:count] == node[count:]]))


def _faces_wrong(first: FloatArray, areas: FloatArray, piece: Index, edges: Edges) -> Flags:
    """Return flags (F,): true if the component of a facet must be turned over to face the free side.

    An open component must face up, a closed component outwards.

    first : (F, 3) m, the first corner of each facet; areas : (F, 3) m^2, the area of each facet times its unit normal
    piece : (F,) component of each facet across edges of exactly two facets
    """
    upward = np.bincount(piece, areas[:, 2], len(piece))
    has_border = np.zeros(len(piece), bool)
    has_border[piece[facets_on_borders(edges)]] = True
    wrong = upward < 0.0
    if not has_border[piece].all():
        volume = np.bincount(piece, np.einsum("ij,ij->i", first, areas), len(piece))
        wrong = np.where(has_border, wrong, volume < 0.0)
    return np.asarray(wrong[piece])
