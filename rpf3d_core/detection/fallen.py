"""The last guard: a rock that is about to leave the terrain must not do so from below the ground.

Contact is found to rounding, and rounding has ways that no list is complete of. A rock that no facet took although it
lies under the ground has fallen through. It is not counted as one that left: it ends where it was last known to be on
the ground, as `fell_through`, which the summary counts and alerts take for danger.

A few places along the flight are looked at, straight down and straight up. If the rock comes from over the ground to
below it, and not around the rim, it has fallen. The lines of sight go through the search for contacts one by one, so
this is an inquiry of steps (`Inquiry`): the search is large, and compiled wherever it is called.
"""

import math
from typing import NamedTuple

from rpf3d_core.arc import Arc, position, time_over
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.terrain.facets import Facets

ALONG = 3
"""Places along a flight that are looked at."""
FIRST = 64.0
"""Cracks of path to the first of them: 16 times as deep as a rock may lie below a facet that still takes it."""
FURTHER = 256.0
"""Path to a place over that to the place before."""
HALVES = 40
"""How often the time in which a rock came below the ground is halved."""
WIDTH = 1.0 / 16.0
"""How far around a place is looked, over the path to it."""
COLUMNS = ((0.0, 0.0), (1.0, 0.4), (-0.4, 1.0), (-1.0, -0.4), (0.4, -1.0))
"""Where is looked, in plan: at a place, and around it, for a rock straight below a vertex lies within no facet."""
STEEPEST = 1000.0
"""Rise of the ground over a path; of what is above a rock, something must be the ground that it has left."""
STRAIGHT = 1e-100
"""Gravity (m/s^2) of an arc that is a straight line; not 0, by which the reference engine's boxes would divide."""
OVER, UNDER, BESIDE = 0, 1, 2
"""Where a place is: over ground, below it, or where there is none."""


class Inquiry(NamedTuple):
    """What is known so far of a rock that may have fallen.

    open : whether it goes on; fell : if it does not, whether the rock has fallen
    place, path : number of the place that is looked at, and m to it along the flight
    over, under : s, the last time that the rock was over the ground, and the first that it was under it
    line : number of the line of sight: down and up in each column
    nearest : m to the nearest back above the place; some_over : whether a column around it has ground below it
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
    """An inquiry that has seen nothing."""
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
    """The straight line that is looked along next, from t = 0 to 1 s: down past the terrain, or up past it."""
    x = position(arc, _time(arc, asked))
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
    """The inquiry after its line of sight met a side of a facet `height` metres away; inf if it met none.

    A place is under the ground where neither it nor the places around it have ground straight below them: next to an
    upright wall it may have the back of the wall's top above it, by rounding; in a gully only the places around it lie
    under the ground. If no back is near, the rock has not come through any of them, and counts as over the ground.
    end : s, when the flight ends; later places are not looked at
    """
    upwards, around = asked.line % 2 == 1, asked.line > 1
    ground_below, back_above = not upwards and side > 0.0, upwards and side < 0.0
    if height == math.inf:
        ground_below, back_above = False, False
    if ground_below and not around:
        return _found(arc, end, asked, OVER)
    if upwards and around and not back_above:
        return _found(arc, end, asked, BESIDE)
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
    """The inquiry after it has found where a place is: closed, or with the next place.

    A rock that leaves over the rim may pass under the mesh afterwards. On its way there it is outside the rim, and
    halving the time between over and under finds such a place. At the first place, "outside" may be rounding at a seam.
    """
    t, place = _time(arc, asked), asked.place + 1
    over, under = t if where == OVER else asked.over, t if where == UNDER else asked.under
    path = asked.path if under < math.inf else FURTHER * asked.path
    fell = where != BESIDE and under < math.inf and (over == 0.0 or place == ALONG + HALVES)
    goes_on = not fell and (where != BESIDE or place == 1) and (under < math.inf or place < ALONG)
    after = Inquiry(
        open=goes_on,
        fell=fell,
        place=place,
        path=path,
        over=over,
        under=under,
        line=0,
        nearest=math.inf,
        some_over=False,
    )
    if goes_on and _time(arc, after) > end:
        return Inquiry(
            open=False,
            fell=False,
            place=place,
            path=path,
            over=over,
            under=under,
            line=0,
            nearest=math.inf,
            some_over=False,
        )
    return after


@kernel
def _time(arc: Arc, asked: Inquiry) -> float:
    """When the rock is at the place that is looked at (s)."""
    return time_over(arc, 0.0, asked.path) if asked.under == math.inf else 0.5 * (asked.over + asked.under)
