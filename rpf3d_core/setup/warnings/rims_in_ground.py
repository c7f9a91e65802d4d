"""Distinguish a pile, berm or building in a terrain file of its own from a second survey of the ground below it."""

from dataclasses import replace

import numpy as np

from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plan_view import Window, facets_near
from rpf3d_core.terrain.sections import ground_at

PLACES = 200
"""Number of places along a rim whose heights above the ground are compared."""


def stands_in_ground(terrain: Terrain, body: slice, ground: slice, slack: float) -> bool:
    """Return True if a file is a body that stands in the ground of another file, such as a pile or a building.

    The rim of a body lies on or below the ground: the rim of a building is the foot of its walls. The rim of a second
    survey of the same ground is as far above the ground as the rest of the survey: the result is then False. The median
    height of the rim counts, because rims are drawn by hand. The result is True for a file without a rim, and False if
    no ground lies above or below the rim.

    body : facets of the file with the rim; ground : facets of the other file
    slack : m, height above the ground up to which a rim lies on the ground
    """
    places = _along_rim(terrain, terrain.triangles[body])
    if not len(places):
        return True
    (left, bottom), (right, top) = places[:, :2].min(axis=0).tolist(), places[:, :2].max(axis=0).tolist()
    below = replace(terrain, triangles=terrain.triangles[ground])
    near = facets_near(below, Window(left=left, right=right, bottom=bottom, top=top))
    height, facet = ground_at(replace(below, triangles=below.triangles[near]), places[:, :2])
    on_it = facet >= 0
    return bool(on_it.any() and np.median((places[:, 2] - height)[on_it]) <= slack)


def _along_rim(terrain: Terrain, triangles: IntArray) -> FloatArray:
    """Return places (P, 3) m at equal distances along the rim of triangles (F, 3): the sides of only one triangle.

    The result is (0, 3) if the triangles have no rim.
    """
    sides = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
    sides = sides[sides[:, 0] != sides[:, 1]].astype(np.int64)
    keys, uses = np.unique(sides[:, 0] * len(terrain.vertices) + sides[:, 1], return_counts=True)
    ends = terrain.vertices[np.stack(np.divmod(keys[uses == 1], len(terrain.vertices)), axis=1)]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    after = np.cumsum(lengths)
    if not len(after) or after[-1] == 0.0:
        return np.empty((0, 3))
    way = (np.arange(PLACES) + 0.5) / PLACES * after[-1]
    side = np.searchsorted(after, way)
    share = (after[side] - way) / lengths[side]
    return np.asarray(ends[side, 1] + share[:, None] * (ends[side, 0] - ends[side, 1]))
