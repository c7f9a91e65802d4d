"""The facets near a body, listed once for a part of its path."""

from typing import Any, NamedTuple

from rpf3d_core.detection.closest import closest_point
from rpf3d_core.detection.sphere_course import NO_TOUCH, Touch
from rpf3d_core.detection.touching import looked_at, scan
from rpf3d_core.jit.dispatch import kernel, routine
from rpf3d_core.simulation.bodies.room import GAP, PLANE_COLUMNS, UNKNOWN, BodyRoom
from rpf3d_core.terrain.facet_geometry import corner, stored_normal
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Vec
from rpf3d_core.vectors import norm, subtract


class Gather(NamedTuple):
    """A search that lists all facets within a distance (m) of a point x (3,) m.

    facets : (F,) receives the numbers of the first F facets; count : (1,) receives the number of all of them
    """

    x: Vec
    distance: float
    facets: Any
    count: Any


@looked_at.rule(Gather)
def gathered(quest: Gather, facets: Facets, f: int, best: Touch) -> Touch:
    """Add facet f to the list of a search if the facet is near enough and has an area; return `best` unchanged.

    Other searches (rules of `looked_at`) choose the best facet; this search only collects facets.
    """
    n = stored_normal(facets, f)
    if n[0] == 0.0 and n[1] == 0.0 and n[2] == 0.0:
        return best
    if _is_beside(facets, f, quest.x, quest.distance + facets.tolerance):
        return best
    if norm(subtract(quest.x, closest_point(facets, f, quest.x))) <= quest.distance:
        k = quest.count[0]
        if k < len(quest.facets):
            quest.facets[k] = f
        quest.count[0] = k + 1
    return best


@kernel
def _is_beside(facets: Facets, f: int, x: Vec, distance: float) -> bool:
    """Return True if facet f is farther than a distance (m) from x (3,) m along one axis; a quick first test."""
    a, b, c = corner(facets, f, 0), corner(facets, f, 1), corner(facets, f, 2)
    beside = False
    for k in range(3):
        beside = beside or min(a[k], b[k], c[k]) > x[k] + distance or max(a[k], b[k], c[k]) < x[k] - distance
    return beside


@kernel
def _sort(numbers: Any, count: int) -> None:
    """Sort the first `count` numbers, so that the list does not depend on the order of the search."""
    for k in range(1, count):
        number, place = numbers[k], k
        while place > 0 and numbers[place - 1] > number:
            numbers[place] = numbers[place - 1]
            place -= 1
        numbers[place] = number


@routine
def gather(room: BodyRoom, locator: Any, facets: Facets, x: Vec, distance: float) -> bool:
    """List the facets within a distance (m) of x (3,) m in `room.facets`; return False if they do not fit.

    The numbers are in ascending order, and `room.count` is their number. The rows of the listed facets in `room.planes`
    are reset: their gaps are UNKNOWN, all other values are 0. If the facets do not fit, the list is incomplete, and no
    row is reset.
    """
    room.count[0] = 0
    low = (x[0] - distance, x[1] - distance, x[2] - distance)
    high = (x[0] + distance, x[1] + distance, x[2] + distance)
    quest = Gather(x=x, distance=distance, facets=room.facets, count=room.count)
    scan(locator, facets, low, high, quest, NO_TOUCH)
    count = room.count[0]
    if count > len(room.facets):
        return False
    _sort(room.facets, count)
    for k in range(count):
        for column in range(PLANE_COLUMNS):
            room.planes[k, column] = 0.0
        room.planes[k, GAP] = UNKNOWN
    return True
