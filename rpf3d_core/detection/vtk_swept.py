"""Find the contacts of a flying sphere with VTK's locator, for the reference engine."""

from typing import Any

from rpf3d_core.detection.sphere_course import NO_TOUCH, Course, Touch
from rpf3d_core.detection.swept import box_of, stretch_end, swept_contact
from rpf3d_core.detection.touching import SphereSweep, looked_at, scan
from rpf3d_core.detection.vtk_locator import FIRST_BOX, LONGEST_BOX, VtkLocator
from rpf3d_core.terrain.facet_geometry import REACH
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec


@scan.rule(VtkLocator)
def scan_cells(locator: VtkLocator, facets: Facets, low: Vec, high: Vec, quest: Any, best: Touch) -> Touch:
    """Return the best result of a search among the facets that VTK finds in a box.

    low, high : (3,) m, corners of the box; quest : the search, such as `SphereSweep`; best : the best result so far
    """
    box = [low[0], high[0], low[1], high[1], low[2], high[2]]
    locator.locator.FindCellsWithinBounds(box, locator.found)
    for k in range(locator.found.GetNumberOfIds()):
        best = looked_at(quest, facets, locator.found.GetId(k), best)
    return best


@swept_contact.rule(VtkLocator)
def swept_in_boxes(locator: VtkLocator, facets: Facets, course: Course, end: float) -> Touch:
    """Return the first contact of a flying sphere: search box after box until the best contact lies in these boxes.

    course : motion of the sphere's centre; end : s, finite, later contacts need not be found
    """
    best: Touch = NO_TOUCH
    begin, length = 0.0, FIRST_BOX
    while True:
        leave = stretch_end(course, begin, length * max(locator.size, course.radius), end)
        low, high = box_of(course, begin, leave, REACH * facets.tolerance)
        best = scan(locator, facets, low, high, SphereSweep(course=course, end=end, before=leave), best)
        if best.t <= leave or not leave < end:
            return best
        begin, length = leave, min(2.0 * length, LONGEST_BOX)
