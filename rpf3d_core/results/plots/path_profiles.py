"""Compute profiles of paths: height and speed against the horizontal distance travelled, with the terrain below."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from vtkmodules.vtkCommonCore import mutable
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkStaticCellLocator

from rpf3d_core.ensemble.flights import Deposits, FloatArray, IntArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.formats.vtk_mesh import triangle_mesh
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.plan_view import Window, facets_near
from rpf3d_core.values import DEPOSITED

ABOVE_CONTACT = 0.05
"""The search for the terrain below a path point begins this height (m) above the point.

Rounding may put a contact point just below the terrain.
"""
ON_EDGE = 1e-6
"""Distance (m) from a facet up to which a line hits the facet.

With the distance 0, rounding would let lines pass between neighbouring facets at their common edge.
"""


@dataclass(frozen=True, eq=False)
class PathProfiles:
    """The profiles of some rocks as S points, grouped by rock in order of time.

    row : (S,) row of the rock in `Deposits`; t : (S,) s; distance : (S,) m, travelled in plan since the release
    elevation : (S,) m, in the input's vertical coordinate; speed : (S,) m/s
    """

    row: IntArray
    t: FloatArray
    distance: FloatArray
    elevation: FloatArray
    speed: FloatArray


def profile_of(terrain: Terrain, samples: PathSamples) -> PathProfiles:
    """Return the profiles of sampled paths, to be drawn or written."""
    return PathProfiles(
        row=samples.row,
        t=samples.t,
        distance=travelled(samples),
        elevation=samples.x[:, 2] + terrain.frame.origin[2],
        speed=samples.speed,
    )


def travelled(samples: PathSamples) -> FloatArray:
    """Return the horizontal distance (S,) m travelled along each path since the release."""
    step = np.zeros(len(samples.row))
    step[1:] = np.linalg.norm(np.diff(samples.x[:, :2], axis=0), axis=1)
    starts = samples.starts
    step[starts] = 0.0
    along = np.cumsum(step)
    lengths = np.diff(np.append(starts, len(step)))
    distance: FloatArray = along - np.repeat(along[starts], lengths)
    return distance


def terrain_below(terrain: Terrain, points: FloatArray) -> FloatArray:
    """Return the height (N,) m of the terrain straight below points (N, 3) m, local frame; NaN without terrain."""
    near = _facets_near(terrain, points)
    height = np.full(len(points), np.nan)
    if len(near) == 0:
        return height
    mesh = _mesh(terrain, near)
    bottom = mesh.GetBounds()[4] - 1.0
    locator: Any = vtkStaticCellLocator()  # VTK's type stubs do not have `mutable`
    locator.SetDataSet(mesh)
    locator.BuildLocator()
    fraction, sub, cell, hit, place = mutable(0.0), mutable(0), mutable(0), [0.0] * 3, [0.0] * 3
    for i, (x, y, z) in enumerate(points.tolist()):
        top, end = (x, y, z + ABOVE_CONTACT), (x, y, bottom)
        if locator.IntersectWithLine(top, end, ON_EDGE, fraction, hit, place, sub, cell):
            height[i] = hit[2]
    return height


def typical_rows(deposits: Deposits, rows: IntArray, runout: FloatArray) -> IntArray:
    """Return the rows of at most three example rocks to draw: the rocks of shortest, median and longest runout.

    Only rocks that stopped or were caught are chosen, or any rocks if none of the rocks in `rows` stopped.

    rows : (N,) rows in `deposits` to choose from; runout : (R,) m, of all rocks
    """
    at_rest = rows[np.isin(deposits.outcome[rows], DEPOSITED)]
    some = at_rest if len(at_rest) else rows
    ranked = some[np.argsort(runout[some], kind="stable")]
    places = [0, len(ranked) // 2, len(ranked) - 1] if len(ranked) else []
    return ranked[np.unique(np.array(places, dtype=np.int64))]


def _facets_near(terrain: Terrain, points: FloatArray) -> IntArray:
    """Return the facets (F,) that may lie below points (N, 3) m: their boxes in plan overlap the box of the points."""
    if len(points) == 0:
        return np.empty(0, dtype=np.int64)
    (left, bottom), (right, top) = points[:, :2].min(axis=0), points[:, :2].max(axis=0)
    return facets_near(terrain, Window(left=left, right=right, bottom=bottom, top=top))


def _mesh(terrain: Terrain, facets: IntArray) -> vtkPolyData:
    """Return some facets as a VTK mesh in the local frame, to search the terrain below points."""
    used, corners = np.unique(terrain.triangles[facets], return_inverse=True)
    return triangle_mesh(terrain.vertices[used], corners.reshape(-1, 3))
