"""Check whether a rock has fallen through the ground by rounding errors.

The check concerns rocks that would leave the terrain, or would meet a different side of the ground than before.
Contacts are exact except for rounding, and no list of the effects of rounding is complete. If a rock lies under the
ground although the search found no contact, the rock has fallen through the ground. The rock then does not count as a
rock that left the terrain. Its flight ends at the last place where the rock was known to be on the ground, with the
outcome `fell_through`. The summary counts this outcome, and alerts treat the outcome as a danger.

The check tests a few places along the flight. Vertical lines at and around each place (COLUMNS), here called lines of
sight, show whether ground is below or above the place. If the rock moves from above the ground to below the ground, and
not around the outer edge of the terrain, the rock has fallen.

Each line of sight is one search for contacts. The search is large and is compiled at each place in the code that calls
it. So the check is a record that advances step by step (`Inquiry`), and one call of the search serves all lines of
sight.
"""

import math
from typing import NamedTuple

from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facets import Facets

ALONG = 3
"""Largest number of places along a flight that the check tests, until one of these places is below the ground."""
FIRST = 64.0
"""Path to the first tested place, in crack widths: far more than the depth (4) at which a rock still meets a facet."""
FURTHER = 256.0
"""Factor by which the path to each tested place is longer than the path to the previous place (-)."""
HALVES = 40
"""Number of times that the check halves an interval of time, to find when a rock passed below the ground."""
WIDTH = 1.0 / 16.0
"""Distance from a tested place to the vertical lines around it, divided by the path of the rock to the place (-)."""
COLUMNS = ((0.0, 0.0), (1.0, 0.4), (-0.4, 1.0), (-1.0, -0.4), (0.4, -1.0))
"""Offsets in plan of the vertical lines of sight, in units of the distance that WIDTH defines (-).

One line is at the tested place, four lines are around it, because a rock straight below a vertex may lie within no
facet.
"""
STEEPEST = 1000.0
"""Largest height of a facet's underside above a rock that fell through the facet, divided by the rock's path (-).

A facet that is higher above the rock is not the ground that the rock left.
"""
STRAIGHT = 1e-100
"""Gravity (m/s^2) of an arc that is a straight line; not 0, because the reference engine divides by gravity."""
OVER, UNDER, OFF = 0, 1, 2
"""Result of the check at one place: above the ground, below the ground, or outside the terrain."""


class Inquiry(NamedTuple):
    """The state of the check whether a rock has fallen through the ground.

    open : True while the check continues; fell : result of a finished check, True if the rock has fallen through
    place, path : number of the tested place, and the path to this place along the flight (m)
    over, under : last time when the rock was above the ground, and first time when the rock was below the ground (s)
    line : number of the line of sight, from 0: at offset k of COLUMNS, line 2 k goes down and line 2 k + 1 goes up
    nearest : distance to the nearest underside of a facet above the place (m), of the lines so far; inf for none
    some_over : True if a line that goes down, at the place or around it, met the free side of the ground
    """

    open: bool
    fell: bool
    place: int
    path: float
    over: float
    under: float
    line: int
    nearest: float
    some_over: bool


@kernel
def inquiry(facets: Facets, open_: bool) -> Inquiry:
    """Return the initial state of the check for a fall through the ground, before any place is tested.

    open_ : True to start the check; False for a check that is not needed
    """
    return Inquiry(
        open=open_,
        fell=False,
        place=0,
        path=FIRST * facets.crack,
        over=0.0,
        under=math.inf,
        line=0,
        nearest=math.inf,
        some_over=False,
    )


@kernel
def line_of_sight(facets: Facets, arc: Arc, asked: Inquiry) -> Arc:
    """Return the next vertical line to search for ground, down or up from a tested place to beyond the terrain.

    The line is given as an arc that takes one second.

    arc : the flight of the rock; asked : state of the check
    """
    x = position(arc, _time(arc, asked.path, asked.over, asked.under))
    (east, north), apart = COLUMNS[asked.line // 2], WIDTH * asked.path
    slack = FIRST * facets.crack
    down, up = max(x[2] - facets.low[2], 0.0) + slack, max(facets.high[2] - x[2], 0.0) + slack
    return Arc(
        x=(x[0] + apart * east, x[1] + apart * north, x[2]),
        v=(0.0, 0.0, -down if asked.line % 2 == 0 else up),
        gravity=STRAIGHT,
    )


@kernel
def answered(arc: Arc, end: float, asked: Inquiry, height: float, side: float) -> Inquiry:
    """Return the state of the check for a fall through the ground after the search along one line of sight.

    The first rule that holds decides where the place is:
    - If the line down at the place meets the free side of the ground, the place counts as above the ground.
    - If a line down around the place does not meet the free side, and the line up from the same point does not meet the
      back of the ground, the place counts as outside the terrain.
    - If no line down, at the place or around it, meets the free side, the place counts as under the ground. Exception:
      if no place was under the ground before, and no underside of a facet is near above the place, the rock has not
      passed through a facet, and the place counts as above the ground.
    - In all other cases the place counts as above the ground.

    All lines are needed. Next to a vertical wall, rounding may put the place just inside the wall: only a line around
    the place then meets the free side. In a gully, the lines around the place may begin under the sides of the gully:
    only the line at the place then meets the free side.

    end : s, end of the flight; later places are not tested
    height : m, distance along the line of sight to the facet that the line met; inf if the line met no facet
    side : side of this facet that the line met, as in `Contact`
    asked : state of the check before this search
    """
    upwards, around = asked.line % 2 == 1, asked.line > 1
    ground_below, back_above = not upwards and side > 0.0, upwards and side < 0.0
    if height == math.inf:
        ground_below, back_above = False, False
    if ground_below and not around:
        return _found(arc, end, asked, OVER)
    if upwards and around and not back_above:
        return _found(arc, end, asked, OFF)
    nearest = min(asked.nearest, height) if back_above else asked.nearest
    some_over, line = asked.some_over or ground_below, asked.line + (2 if ground_below else 1)
    if line == 2 * len(COLUMNS):
        near = asked.under < math.inf or nearest <= STEEPEST * asked.path
        return _found(arc, end, asked, UNDER if near and not some_over else OVER)
    return Inquiry(
        open=True,
        fell=False,
        place=asked.place,
        path=asked.path,
        over=asked.over,
        under=asked.under,
        line=line,
        nearest=nearest,
        some_over=some_over,
    )


@kernel
def _found(arc: Arc, end: float, asked: Inquiry, where: int) -> Inquiry:
    """Return the state of the check for a fall after a tested place is classified: finished, or at the next place.

    where : the result at the place: OVER (above the ground), UNDER (below the ground) or OFF (outside the terrain)

    OFF finishes the check: the rock has not fallen. A rock that leaves across the outer edge of the terrain may pass
    under the mesh later, but only after it was outside the terrain. At the first place, OFF does not finish the check,
    because rounding at a seam may be the cause.

    UNDER finishes the check if no place before was above the ground: the rock has fallen. Otherwise the time between
    `over` and `under` is halved repeatedly, to find a place outside the terrain. The rock has fallen if there is none.

    OVER never shows a fall. If none of the first ALONG places, up to `end`, is under the ground, the rock has not
    fallen.

    asked : state of the check before; end : s, end of the flight
    """
    t, place = _time(arc, asked.path, asked.over, asked.under), asked.place + 1
    over, under = t if where == OVER else asked.over, t if where == UNDER else asked.under
    path = asked.path if under < math.inf else FURTHER * asked.path
    fell = where != OFF and under < math.inf and (over == 0.0 or place == ALONG + HALVES)
    goes_on = not fell and (where != OFF or place == 1) and (under < math.inf or place < ALONG)
    return Inquiry(
        open=goes_on and _time(arc, path, over, under) <= end,
        fell=fell,
        place=place,
        path=path,
        over=over,
        under=under,
        line=0,
        nearest=math.inf,
        some_over=False,
    )


@kernel
def _time(arc: Arc, path: float, over: float, under: float) -> float:
    """Return the time (s) when the rock is at the place to be tested.

    path : length of the path (m) to the place, used until the rock was found under the ground (`under` is inf)
    over, under : last time above the ground and first time under the ground (s); the result is their mean if known
    """
    return time_over(arc, 0.0, path) if under == math.inf else 0.5 * (over + under)
