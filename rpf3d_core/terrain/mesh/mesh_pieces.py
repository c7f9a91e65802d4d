"""Turn over the components of a mesh that face the wrong side; faster than `winding`, because nothing is sorted.

Before, all neighbouring facets must already agree in their winding. Afterwards, each open component faces up, and each
closed component faces outwards, as after `winding`. A mesh without downward facets does not need this repair. If
all facets face down, it is faster to turn all facets over.
"""

from typing import Any

import numpy as np

from rpf3d_core.jit.dispatch import loop
from rpf3d_core.jit.memory import Memory, Share, halves
from rpf3d_core.terrain.facets import IntArray, area_vector, vertex
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.components import name_by_roots, unite
from rpf3d_core.vectors import dot


def turn_wrong_pieces(
    vertices: FloatArray, triangles: IntArray, starts: IntArray, to: IntArray, memory: Memory, share: Share
) -> None:
    """Turn over mesh components on the wrong side: open components that face down, closed ones that face inwards.

    Each facet keeps its first corner.

    vertices : (V, 3) m; triangles : (F, 3), changed in place
    starts (V + 1,), to : the directed edges of the mesh: each facet has three, from each corner to its next corner.
        to[starts[v] : starts[v + 1]] are the end vertices of the directed edges that start at vertex v; no directed
        edge occurs twice
    memory : provides the arrays that are needed only during the call; share : runs functions in parallel (`jit.memory`)
    """
    count = len(triangles)
    of, cursor = memory("out_of", len(to), np.int32), memory("out_cursor", len(starts), np.int32)
    cursor[:] = starts
    share([lambda a=a, b=b: _fill_of(triangles, a, b, cursor, of) for a, b in halves(len(vertices))])  # type: ignore[misc]
    above, sums = memory("pieces", count, np.int32), memory("piece_sums", 2 * count, np.float64).reshape(-1, 2)
    border = memory("piece_border", count, np.bool_)
    _join(starts, to, of, above, border)
    _sum_up(vertices, triangles, above, border, sums)
    _turn_some(triangles, above, border, sums)


@loop
def _fill_of(triangles: Any, begin: int, end: int, cursor: Any, of: Any) -> None:
    """Write the facet of each directed edge into `of`, for the edges that start at the vertices `begin` to `end` - 1.

    triangles : (F, 3); of : (E,) receives the facets; the directed edges are sorted by the vertex at which they start
    cursor : (V + 1,) for each vertex, the next free index in `of`; changed
    """
    for f in range(len(triangles)):
        a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
        if a != b and b != c and c != a:
            for v in (a, b, c):
                if begin <= v < end:
                    of[cursor[v]] = f
                    cursor[v] += 1


@loop
def _join(starts: Any, to: Any, of: Any, above: Any, border: Any) -> None:
    """Write the lowest facet number of each facet's component into `above` (F,); mark facets at the border in `border`.

    starts (V + 1,), to : to[starts[v] : starts[v + 1]] are the end vertices of the directed edges that start at v
    of : the facet of each directed edge
    border : (F,) receives true for a facet with a side on the border of the mesh, else false
    """
    for f in range(len(above)):
        above[f], border[f] = f, False
    for v in range(len(starts) - 1):
        for e in range(starts[v], starts[v + 1]):
            w, mate = to[e], -1
            for other in range(starts[w], starts[w + 1]):
                if to[other] == v:
                    mate = of[other]
            if mate < 0:
                border[of[e]] = True
            else:
                unite(above, of[e], mate)
    name_by_roots(above)


@loop
def _sum_up(vertices: Any, triangles: Any, above: Any, border: Any, sums: Any) -> None:
    """Write the area in plan (m^2) and three times the volume (m^3) of each component into `sums` (F, 2).

    Both have a sign: the area is positive if the component faces up, the volume if a closed component faces outwards.
    The row of a component is its lowest facet number, from `above` (F,). For each open component, the function also
    sets `border` (F,) to true at this facet number.

    vertices : (V, 3) m; triangles : (F, 3)
    """
    for f in range(len(above)):
        sums[f, 0], sums[f, 1] = 0.0, 0.0
    for f in range(len(above)):
        a, b, c = (vertex(vertices, triangles[f, 0]), vertex(vertices, triangles[f, 1]),
                   vertex(vertices, triangles[f, 2]))  # fmt: skip
        area = area_vector(a, b, c)
        sums[above[f], 0] += area[2]
        sums[above[f], 1] += dot(a, area)
        if border[f]:
            border[above[f]] = True


@loop
def _turn_some(triangles: Any, above: Any, border: Any, sums: Any) -> None:
    """Turn over the facets of components that face the wrong side.

    These are open components with a negative area in plan, and closed components with a negative volume.

    triangles : (F, 3), changed; above : (F,) lowest facet number of the facet's component
    border : (F,) at the lowest facet number of a component, true if the component is open
    sums : (F, 2) at this number, area in plan (m^2) and three times the volume (m^3) of the component
    """
    for f in range(len(above)):
        piece = above[f]
        if sums[piece, 0 if border[piece] else 1] < 0.0:
            triangles[f, 1], triangles[f, 2] = triangles[f, 2], triangles[f, 1]
