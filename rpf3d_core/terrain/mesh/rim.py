"""Find the rim of a mesh: the sides of facets that no other facet shares."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.mesh.edges import Edges

Numbers = NDArray[np.int64]


class Rim(NamedTuple):
    """The sides of a mesh's rim, in the direction of their facets.

    begin, end : (S,) vertices of each side, in the order of the facet's corners
    third : (S,) the third corner of the facet; facet : (S,) the facet
    """

    begin: Numbers
    end: Numbers
    third: Numbers
    facet: Numbers


def rim_of(triangles: NDArray[np.int32], edges: Edges) -> Rim:
    """Return the rim of a mesh.

    triangles : (F, 3); edges : of these triangles; the directions of the sides are those of the triangles, also if the
        triangles were turned over after `edges` was made
    """
    use = edges.start[edges.uses == 1]
    low, high = (ends[edges.uses == 1].astype(np.int64) for ends in (edges.low, edges.high))
    facet = edges.facet[use].astype(np.int64)
    corners = triangles[facet].astype(np.int64)
    place = (corners == low[:, None]).argmax(axis=1)
    down = np.take_along_axis(corners, ((place + 1) % 3)[:, None], axis=1)[:, 0] != high
    begin, end = np.where(down, high, low), np.where(down, low, high)
    return Rim(begin=begin, end=end, third=corners.sum(axis=1) - low - high, facet=facet)
