"""Close the small holes of a mesh with triangles; large holes stay open, because they are gaps of the survey."""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray

Index = NDArray[np.int32]


class Filled(NamedTuple):
    """The holes of a mesh: triangles that close the small holes, and the areas of the holes that stay open.

    triangles : (T, 3) new triangles between existing points, facing up
    closed : number of closed holes; areas : (H,) m^2, areas in plan of the holes that stay open
    """

    triangles: Index
    closed: int
    areas: FloatArray


def fill_holes(plan: FloatArray, triangles: Index, widest: float) -> Filled:
    """Return the triangles that close the small holes of a mesh, and the areas of the holes that stay open.

    plan : (V, 2) m, points; triangles : (F, 3), facing up, covering the plan at most once
    widest : m; a hole is small if its triangulation has no side in plan longer than this
    """
    sides = _border(triangles)
    holes = _holes(plan, sides)
    parts, hole = shapely.get_parts(shapely.constrained_delaunay_triangles(holes), return_index=True)
    corners = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)
    longest = np.sqrt(((corners[:, 1:] - corners[:, :3]) ** 2).sum(axis=2)).max(axis=1, initial=0.0)
    most = np.zeros(len(holes))
    np.maximum.at(most, hole, longest)
    small = most <= widest
    places = corners[small[hole], :3].reshape(-1, 2)
    return Filled(
        triangles=_numbers(plan, sides, places).reshape(-1, 3),
        closed=int(small.sum()),
        areas=np.asarray(shapely.area(holes[~small])),
    )


def _border(triangles: Index) -> Index:
    """Return the border of a mesh: the sides (S, 2) that belong to only one triangle.

    Each side is given by the numbers of its two points, in the order in which the triangle lies to the left.

    triangles : (F, 3), facing up
    """
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    size = int(triangles.max(initial=0)) + 1
    forward, backward = sides[:, 0] * size + sides[:, 1], sides[:, 1] * size + sides[:, 0]
    both = np.sort(np.minimum(forward, backward))
    lonely = both[np.concatenate([both[1:] != both[:-1], [True]]) & np.concatenate([[True], both[1:] != both[:-1]])]
    return sides[np.isin(np.minimum(forward, backward), lonely)].astype(np.int32)


def _holes(plan: FloatArray, sides: Index) -> NDArray[np.object_]:
    """Return the holes of a mesh as polygons (H,) in plan: regions enclosed by border sides (S, 2), without triangles.

    plan : (V, 2) m, points of the mesh
    """
    regions = np.array(shapely.get_parts(shapely.polygonize(shapely.linestrings(plan[sides]))), dtype=object)
    if not len(regions):
        return regions
    shells = shapely.get_coordinates(shapely.get_exterior_ring(shapely.orient_polygons(regions)), return_index=True)
    first = np.flatnonzero(np.concatenate([[True], shells[1][1:] != shells[1][:-1]]))
    begin, end = shells[0][first], shells[0][first + 1]
    # Along the counter-clockwise shell of a hole, the triangles lie to the right: their sides run the other way.
    reverse = {(*q, *p) for p, q in zip(plan[sides[:, 0]].tolist(), plan[sides[:, 1]].tolist(), strict=True)}
    ends = np.concatenate([begin, end], axis=1).tolist()
    return regions[[tuple(end) in reverse for end in ends]]


def _numbers(plan: FloatArray, sides: Index, places: FloatArray) -> Index:
    """Return the number (M,) of the border point that has exactly the coordinates of each place (M, 2) m.

    plan : (V, 2) m, points of the mesh; sides : (S, 2) border sides, from `_border`
    """
    border = np.unique(sides)
    number = dict(zip(map(tuple, plan[border].tolist()), border.tolist(), strict=True))
    return np.array([number[place] for place in map(tuple, places.tolist())], np.int32)
