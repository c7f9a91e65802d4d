"""Cut facets into parts, so that their sides run through given vertices."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.mesh.near_rim import Near
from rpf3d_core.terrain.mesh.rim import Numbers, Rim

Triangles = NDArray[np.int32]


class Parts(NamedTuple):
    """A mesh of F facets after some facets were cut into parts.

    triangles : (F + N, 3); the first part of a facet has the facet's number, the other parts follow after all facets
    parent : (N,) the facet from which each of the other parts was cut
    """

    triangles: Triangles
    parent: Numbers


def cut_facets(triangles: Triangles, pairs: Near, rim: Rim) -> Parts:
    """Return the mesh after cutting facets at vertices near their sides; all parts keep the winding of their facet.

    The parts at a side share the corner opposite to the side. A facet that is cut at several sides is cut at one side
    after another.

    triangles : (F, 3); rim : the rim of the mesh
    pairs : the vertices of each side, sorted along the side; no vertex occurs twice in a facet
    """
    count = len(triangles)
    grown = np.concatenate([triangles, np.empty((len(pairs.vertex), 3), triangles.dtype)])
    parent = np.empty(len(pairs.vertex), np.int64)
    facets, of_pair = np.unique(rim.facet[pairs.side], return_inverse=True)
    corner = (triangles[rim.facet[pairs.side]] == rim.begin[pairs.side, None]).argmax(axis=1)
    holder = np.repeat(facets[:, None], 3, axis=1)
    made = 0
    for side in range(3):
        some = np.flatnonzero(corner == side)
        rows = count + made + np.arange(len(some))
        parent[rows - count] = facets[of_pair[some]]
        _cut_at_one_side(grown, rows, some, pairs, rim, holder[of_pair[some], side])
        last = _last_of_each(pairs.side[some])
        moved, facet = rows[last], of_pair[some[last]]
        if side < 2:
            together = holder[facet, side + 1] == holder[facet, side]
            holder[facet[together], side + 1] = moved[together]
        made += len(some)
    return Parts(triangles=grown, parent=parent)


def _cut_at_one_side(grown: Triangles, rows: Numbers, some: Numbers, pairs: Near, rim: Rim, held: Numbers) -> None:
    """Cut facets at one of their sides: the first part of a facet replaces the facet, the other parts become new rows.

    grown : (F + N, 3), changed; rows : (M,) rows of the new parts; some : (M,) the pairs at these sides
    held : (M,) the row of the facet, or of the part of the facet, that holds the side of each pair
    """
    if not len(some):
        return
    side, vertex = pairs.side[some], pairs.vertex[some].astype(grown.dtype)
    begin, end = rim.begin[side].astype(grown.dtype), rim.end[side].astype(grown.dtype)
    whole = grown[held]
    apex = whole[(whole != begin[:, None]) & (whole != end[:, None])]
    last = _last_of_each(side)
    following = np.append(vertex[1:], vertex[:1])
    following[last] = end[last]
    grown[rows] = np.stack([vertex, following, apex], axis=1)
    first = np.roll(last, 1)
    grown[held[first], (whole[first] == end[first, None]).argmax(axis=1)] = vertex[first]


def _last_of_each(side: Numbers) -> NDArray[np.bool_]:
    """Return flags (M,): True for the last pair of each side.

    side : (M,) the side of each pair; pairs of the same side follow each other
    """
    last = np.ones(len(side), bool)
    last[:-1] = side[1:] != side[:-1]
    return last
