"""Locator of the reference engine: VTK's static cell locator finds the facets in boxes along the arc.

This is the broad phase. vtkStaticCellLocator returns a superset of the cells within a box, quickly on meshes of
millions of triangles. Both engines share the narrow phase (`narrow_phase.py`). The thesis uses VTK too (section 3.4).
"""

import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.detection.contact import NO_CONTACT, Contact, PreviousContact, first_contact
from rpf3d_core.detection.narrow_phase import earlier_of
from rpf3d_core.detection.search import notices_falls
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets

FIRST_BOX = 2.0
"""Length of the first box to search along an arc, in median facet sizes.

Each next box is twice as long, up to LONGEST_BOX where the box overlaps the terrain's box.
"""
CELLS_PER_BUCKET = 1
"""Facets per bucket of VTK's locator, which returns whole buckets: VTK's default of 10 returns four times as many."""
LONGEST_BOX = 16.0
"""Length of the longest box that is searched along an arc, in median facet sizes."""
MOST_SIZES = 1e5
"""Largest diagonal of a terrain in facet sizes: a limit to the number of boxes if facets are tiny."""
SAMPLE = 100_000
"""Least number of facets in the sample from which the usual facet size is estimated."""


class VtkLocator:
    """The locator of the reference engine: VTK's locator over F facets, and a list for its results.

    Only one thread may use a locator, because all searches write into the same list.

    locator : VTK's locator; found : list that receives the facets of a search
    size : usual size of a facet (m), the unit of the lengths of search boxes
    """

    def __init__(self, facets: Facets) -> None:
        self._points = np.ascontiguousarray(np.asarray(facets.corners).reshape(-1, 3))
        self._cells = _triangle_cells(len(self._points) // 3)
        self.locator = vtkStaticCellLocator()
        self.locator.SetNumberOfCellsPerNode(CELLS_PER_BUCKET)
        self.locator.SetDataSet(_polydata(self._points, self._cells))
        self.locator.BuildLocator()
        self.found = vtkIdList()
        self.size = max(_median_size(self._points), math.dist(facets.low, facets.high) / MOST_SIZES) or 1.0


def _median_size(points: np.ndarray) -> float:
    """Return the usual size (m) of facets, for the length of search boxes, from corners `points` (3 F, 3) m.

    The size is the side of a square with the area of two median facets.
    """
    a, b, c = points.reshape(-1, 3, 3)[:: max(len(points) // (3 * SAMPLE), 1)].transpose(1, 0, 2)
    return float(np.sqrt(np.median(np.linalg.norm(np.cross(b - a, c - a), axis=1))))


def _triangle_cells(count: int) -> np.ndarray:
    """Return the cells (4 count,) that VTK needs for `count` triangles that share no corners.

    Each cell is the number 3, followed by the numbers of the triangle's three corners.
    """
    cells = np.empty((count, 4), dtype=np.int64)
    cells[:, 0] = 3
    cells[:, 1:] = np.arange(3 * count).reshape(-1, 3)
    return cells.ravel()


def _polydata(points: np.ndarray, cells: np.ndarray) -> vtkPolyData:
    """Return the facets in the form that VTK's locator needs; the result shares the memory of `points`.

    points : (3 F, 3) m, corners of the facets; cells : from `_triangle_cells`
    """
    vtk_points = vtkPoints()
    vtk_points.SetData(numpy_to_vtk(points))
    triangles = vtkCellArray()
    triangles.ImportLegacyFormat(numpy_to_vtkIdTypeArray(cells, deep=True))
    mesh = vtkPolyData()
    mesh.SetPoints(vtk_points)
    mesh.SetPolys(triangles)
    return mesh


@first_contact.rule(VtkLocator)
def first_contact_in_boxes(locator: VtkLocator, facets: Facets, arc: Arc, left: PreviousContact, end: float) -> Contact:
    """Return the earliest contact of an arc: search box after box until the best contact lies within the boxes.

    A box outside the terrain's box contains no facet and is not searched. Such boxes become longer without a limit, so
    that a rock that starts far away needs few boxes. A long box that overlaps the terrain's box is halved.

    left : the contact from which the rock starts; end : s, later contacts need not be found
    """
    best, begin, length = NO_CONTACT, 0.0, FIRST_BOX
    while True:
        leave = min(time_over(arc, begin, length * locator.size), end)
        if not leave > begin:  # NaN, or a step that is zero after rounding
            leave = end
        box = _box(arc, begin, leave, REACH * facets.tolerance)
        meets = _meets(box, facets)
        if meets and length > LONGEST_BOX:
            length *= 0.5
            continue
        if meets:
            best = _best_in_box(locator, facets, arc, left, box, best)
        if best.t <= leave or not leave < end:
            return best
        begin, length = leave, min(2.0 * length, LONGEST_BOX) if meets else 2.0 * length


def _best_in_box(
    locator: VtkLocator, facets: Facets, arc: Arc, left: PreviousContact, box: list[float], best: Contact
) -> Contact:
    """Return the earliest of `best` and the contacts of an arc with the facets in a box.

    box : low and high x, low and high y, low and high z, m
    left : the contact from which the rock starts
    """
    locator.locator.FindCellsWithinBounds(box, locator.found)
    for k in range(locator.found.GetNumberOfIds()):
        best = earlier_of(left, facets, locator.found.GetId(k), arc, best)
    return best


def _meets(box: list[float], facets: Facets) -> bool:
    """Return True if a box (low and high x, y, z, m) overlaps the terrain's box; a NaN counts as an overlap."""
    return not any(
        box[2 * axis] > facets.high[axis] or box[2 * axis + 1] < facets.low[axis] for axis in range(3)
    )


@notices_falls.rule(VtkLocator)
def checks_falls(locator: VtkLocator) -> bool:
    """Return True: with this locator, a rock that would leave the terrain is checked for a fall through the ground."""
    return True


def _box(arc: Arc, begin: float, end: float, slack: float) -> list[float]:
    """Return the box to search around an arc from `begin` to `end` (s), as low and high x, y, z (m).

    The box is widened by the slack (m).
    """
    p, q = position(arc, begin), position(arc, end)
    apex = arc.v[2] / arc.gravity
    top = max(p[2], q[2])
    if begin < apex < end:
        top = position(arc, apex)[2]
    return [
        min(p[0], q[0]) - slack, max(p[0], q[0]) + slack,
        min(p[1], q[1]) - slack, max(p[1], q[1]) + slack,
        min(p[2], q[2]) - slack, top + slack,
    ]  # fmt: skip
