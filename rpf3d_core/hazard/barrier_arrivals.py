"""Find how each rock arrives at each barrier: the barrier catches the rock, or the rock breaks through or flies over.

A barrier consists of upright panels along a line in plan, the panel segments. The record of impacts has a row for each
contact with a panel. It has no row for a flight over a panel, so the recorded paths are intersected with the panels.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from rpf3d_core.arc import Arc, velocity
from rpf3d_core.effects.barriers import BELOW, CORNER, Barriers, crossing_of, stands_at
from rpf3d_core.effects.obstacle_cells import index_of, leaves_at
from rpf3d_core.hazard.flown import FlownRocks
from rpf3d_core.jit.dispatch import kernel, loop
from rpf3d_core.simulation.record import BLOW, FIRST_OBSTACLE, POSE
from rpf3d_core.values import Mode, Outcome
from rpf3d_core.vectors import dot

NEVER, OVER, THROUGH, HELD = range(4)
"""Results of a rock's arrival at a barrier: NEVER arrived, flew OVER, broke THROUGH, or was caught (HELD)."""
FLIGHT, CAUGHT, FAILED = int(Mode.FLIGHT), int(Outcome.CAUGHT), int(Outcome.FAILED)


class BarrierArrivals(NamedTuple):
    """How the N rocks of a batch arrived at B barriers.

    did, t, energy, height : (N, B) data of each rock's first arrival
        did : result, one of OVER, THROUGH and HELD; NEVER for a rock that did not arrive
        t : s, time since the release; infinite for a rock that did not arrive, whose energy and height are 0
        energy : J, of translation; for rocks with a shape, of translation and rotation
        height : m, of the rock's centre or of its top, as the scene chooses, above the foot of the panel
    held : (N, B) 1 if the barrier caught the rock in the end, else 0
    events : (N, B, 4) number of arrivals of each rock, by result in the order NEVER (always 0), OVER, THROUGH, HELD
    """

    did: Any
    t: Any
    energy: Any
    height: Any
    held: Any
    events: Any


class Crossed(NamedTuple):
    """Working memory to recognise a crossing that is found twice, because it lies where two panel segments join.

    piece : (K,) row of the path segment with which each of K panel segments was compared last
    t, barrier : (K,) time (s) and barrier of each crossing on the current path segment, in the order of finding
    last : (B,) time (s) of the latest crossing of each barrier on earlier segments of the path
    """

    piece: Any
    t: Any
    barrier: Any
    last: Any


class PassingRock(NamedTuple):
    """A rock that may pass barriers: its row in the batch, mass (kg) and radius (m).

    impacts, facets : impacts of all rocks, and what each impact struck, as in `FlownRocks`
    begin, end : rows of the impacts of this rock, from `begin` to before `end`
    caught : True if an obstacle caught the rock in the end; the last impact is the contact with this obstacle
    """

    row: int
    mass: float
    radius: float
    impacts: Any
    facets: Any
    begin: int
    end: int
    caught: bool


class ContactHere(NamedTuple):
    """A rock's contact with one panel segment at the place where the rock crosses another panel segment.

    q : row of the contact among the impacts, -1 for none
    after : True if the rock crosses the other segment after the contact, False if before
    """

    q: int
    after: bool


class PathSegment(NamedTuple):
    """One segment of a recorded path, with the arc that the rock follows there.

    pieces : all path segments (S, 10), columns time, position and velocity at the start, velocity at the end; with more
        columns if rocks spin or have a shape
    p : row of this segment in `pieces`
    flies : True for a flight, False for motion on the ground
    arc : the parabola of a flight; for motion on the ground, the straight line between both ends of the segment
    until : time of the arc at the segment's end: s for a flight; 1 for motion on the ground
    """

    pieces: Any
    p: int
    flies: bool
    arc: Arc
    until: float


def empty_arrivals(rocks: int, barriers: int) -> BarrierArrivals:
    """Return a `BarrierArrivals` in which no rock has arrived yet; rocks, barriers : numbers of rocks and barriers."""
    shape = rocks, barriers
    did, held = (np.zeros(shape, dtype=np.int64) for _ in range(2))
    return BarrierArrivals(
        did=did,
        t=np.full(shape, np.inf),
        energy=np.zeros(shape),
        height=np.zeros(shape),
        held=held,
        events=np.zeros((*shape, 4), np.int64),
    )


def empty_crossed(panels: int, barriers: int) -> Crossed:
    """Return a `Crossed` without any crossing: working memory for `find_arrivals`.

    panels, barriers : numbers of panel segments and of barriers
    """
    number = np.full(panels, -1, dtype=np.int64)
    return Crossed(piece=number, t=np.empty(panels), barrier=number.copy(), last=np.full(barriers, -np.inf))


@loop
def find_arrivals(barriers: Barriers, flown: FlownRocks, crossed: Crossed, found: BarrierArrivals) -> None:
    """Find the arrivals of flown rocks at the barriers, and write the arrivals to `found`.

    Rocks whose simulation failed are skipped.

    crossed : working memory, from `empty_crossed`
    """
    counts, first = flown.counts, flown.first
    for r in range(len(flown.mass)):
        if counts[r, 0] == FAILED:
            continue
        rock = _passing_rock(flown, r)
        for q in range(rock.begin, rock.end):
            _contact(barriers, q, rock, found)
        for b in range(len(crossed.last)):
            crossed.last[b] = -math.inf
        for p in range(first[r, 1], first[r + 1, 1] - 1):
            if flown.pieces[p + 1, 0] > flown.pieces[p, 0]:
                _cross(barriers, _segment(flown, p), rock, crossed, found)


@kernel
def _passing_rock(flown: FlownRocks, r: int) -> PassingRock:
    """Return the rock in row r of a batch, with its impacts."""
    return PassingRock(
        row=r,
        mass=flown.mass[r],
        radius=flown.radius[r],
        impacts=flown.impacts,
        facets=flown.facets,
        begin=flown.first[r, 0],
        end=flown.first[r + 1, 0],
        caught=flown.counts[r, 0] == CAUGHT,
    )


@kernel
def _is_held(rock: PassingRock, q: int) -> bool:
    """Return True if the obstacle in row q of the impacts caught the rock."""
    return bool(rock.caught and q + 1 == rock.end)


@kernel
def _panel_of(barriers: Barriers, facet: int) -> int:
    """Return the index of the panel segment that an impact struck, -1 if the impact struck something else.

    facet : number in the row of the impact, as in `FlownRocks`
    """
    k = FIRST_OBSTACLE - facet - barriers.first
    return k if facet < 0 and 0 <= k < len(barriers.panel.x) else -1


@kernel
def _contact(barriers: Barriers, q: int, rock: PassingRock, found: BarrierArrivals) -> None:
    """Record an arrival of a rock in `found` if row q of the impacts is a contact with a barrier."""
    panel, impacts, k = barriers.panel, rock.impacts, _panel_of(barriers, rock.facets[q])
    if k < 0:
        return
    b, did = panel.barrier[k], HELD if _is_held(rock, q) else THROUGH
    height = impacts[q, 3] - _foot(barriers, k, impacts[q, 1], impacts[q, 2]) + panel.top[b] * rock.radius
    _note(found, rock.row, b, did, impacts[q, 0], _energy_at(rock, q, False), height)


@kernel
def _energy_at(rock: PassingRock, q: int, after: bool) -> float:
    """Return the energy (J) of a rock at the contact in row q of the impacts; with rotation if rocks have a shape.

    after : True for the energy after the contact, False for the energy before it
    """
    impacts, later = rock.impacts, 1 if after else 0
    if impacts.shape[1] > BLOW:
        return rock.mass * impacts[q, BLOW + 1 + later]  # type: ignore[no-any-return]
    return 0.5 * rock.mass * impacts[q, 7 + later] * impacts[q, 7 + later]  # type: ignore[no-any-return]


@kernel
def _foot(barriers: Barriers, k: int, x: float, y: float) -> float:
    """Return the height z (m) of the foot of panel segment k at the place x, y (m)."""
    panel = barriers.panel
    dx, dy = panel.dx[k], panel.dy[k]
    along = ((x - panel.x[k]) * dx + (y - panel.y[k]) * dy) / (dx * dx + dy * dy)
    return panel.z[k] + along * panel.dz[k]  # type: ignore[no-any-return]


@kernel
def _note(found: BarrierArrivals, r: int, b: int, did: int, t: float, energy: float, height: float) -> None:
    """Count an arrival of rock r at barrier b, and record it if no earlier arrival of the rock there is recorded.

    did : result of the arrival (OVER, THROUGH or HELD); t : s, since the release; energy : J; height : m above the foot
    """
    found.events[r, b, did] += 1
    if did == HELD:
        found.held[r, b] = 1
    if t < found.t[r, b]:
        found.did[r, b], found.t[r, b], found.energy[r, b], found.height[r, b] = did, t, energy, height


@kernel
def _segment(flown: FlownRocks, p: int) -> PathSegment:
    """Return the path segment in row p of the recorded paths, with the arc that the rock follows there."""
    pieces, flies = flown.pieces, flown.modes[p] == FLIGHT
    x, v = (pieces[p, 1], pieces[p, 2], pieces[p, 3]), (pieces[p, 4], pieces[p, 5], pieces[p, 6])
    if flies:
        arc, until = Arc(x=x, v=v, gravity=flown.gravity), pieces[p + 1, 0] - pieces[p, 0]
    else:
        chord = (pieces[p + 1, 1] - x[0], pieces[p + 1, 2] - x[1], pieces[p + 1, 3] - x[2])
        arc, until = Arc(x=x, v=chord, gravity=0.0), 1.0
    return PathSegment(pieces=pieces, p=p, flies=flies, arc=arc, until=until)


@kernel
def _cross(
    barriers: Barriers, segment: PathSegment, rock: PassingRock, crossed: Crossed, found: BarrierArrivals
) -> None:
    """Record where a path segment passes barriers without a contact: above a panel, or through a panel of capacity 0.

    The arrivals are written to `found`; crossed : working memory, which also receives the crossings
    """
    p, arc, until = segment.p, segment.arc, segment.until
    cells, number = barriers.cells, 0
    i, j = index_of(arc.x[0], cells.x, cells.cell, cells.nx), index_of(arc.x[1], cells.y, cells.cell, cells.ny)
    while True:
        leave_i = leaves_at(i, cells.nx, cells.x, cells.cell, arc.x[0], arc.v[0])
        leave_j = leaves_at(j, cells.ny, cells.y, cells.cell, arc.x[1], arc.v[1])
        for entry in range(cells.starts[j * cells.nx + i], cells.starts[j * cells.nx + i + 1]):
            k = cells.ids[entry]
            if crossed.piece[k] != p:
                crossed.piece[k] = p
                number = _pass(barriers, k, segment, rock, number, crossed, found)
        if min(leave_i, leave_j) >= until:
            break
        if leave_i <= leave_j:
            i += 1 if arc.v[0] > 0.0 else -1
        else:
            j += 1 if arc.v[1] > 0.0 else -1
    for n in range(number):
        crossed.last[crossed.barrier[n]] = max(crossed.last[crossed.barrier[n]], crossed.t[n])


@kernel
def _pass(
    barriers: Barriers,
    k: int,
    segment: PathSegment,
    rock: PassingRock,
    number: int,
    crossed: Crossed,
    found: BarrierArrivals,
) -> int:
    """Record an arrival if a path segment crosses panel segment k without a contact.

    Return the number of arrivals found on this path segment so far. Nothing is recorded if the same crossing has been
    found before, or if another panel at the same place has caught the rock before.

    number : number of arrivals found on this path segment before this call
    """
    pieces, p, arc, until = segment.pieces, segment.p, segment.arc, segment.until
    crossing = crossing_of(barriers.panel, barriers.slack, k, arc, until)
    if crossing.t == math.inf:
        return number
    b = barriers.panel.barrier[k]
    high = crossing.height + barriers.panel.top[b] * rock.radius
    did = _passes_as(barriers, b, crossing.height, high)
    duration = pieces[p + 1, 0] - pieces[p, 0]
    t = pieces[p, 0] + crossing.t / until * duration
    way = math.sqrt(arc.v[0] * arc.v[0] + arc.v[1] * arc.v[1]) * until
    if did == NEVER or _is_known(crossed, number, b, t, CORNER * duration / way):
        return number
    here = _contact_here(barriers, k, rock, t, barriers.slack * duration / way)
    if here.after and _is_held(rock, here.q):
        return number
    crossed.t[number], crossed.barrier[number] = t, b
    energy = _energy_at(rock, here.q, here.after) if here.q >= 0 else _energy_on(segment, crossing.t, rock.mass)
    _note(found, rock.row, b, did, t, energy, high)
    return number + 1


@kernel
def _energy_on(segment: PathSegment, t: float, mass: float) -> float:
    """Return the energy (J) of a rock on a path segment.

    If rocks have a shape, the energy includes the rotation at the start of the segment. On the ground, the squared
    speed changes linearly along the segment's chord.

    t : time of the segment's arc, as in `PathSegment.until`; mass : of the rock (kg)
    """
    pieces, p = segment.pieces, segment.p
    if segment.flies:
        going = velocity(segment.arc, t)
        speed2 = dot(going, going)
    else:
        start, end = (pieces[p, 4], pieces[p, 5], pieces[p, 6]), (pieces[p, 7], pieces[p, 8], pieces[p, 9])
        speed2 = dot(start, start) + t * (dot(end, end) - dot(start, start))
    if pieces.shape[1] > POSE:
        speed2 += 2.0 * pieces[p, POSE + 7]
    return 0.5 * mass * speed2


@kernel
def _passes_as(barriers: Barriers, b: int, height: float, high: float) -> int:
    """Return the result of a crossing of a panel's plane without a contact: OVER, THROUGH, or NEVER for no arrival.

    The result is THROUGH only for a barrier of capacity 0, which has no contacts. It is NEVER if the crossing is a
    contact, which has a row among the impacts, or is below the panel's foot.

    height : height of the rock's centre above the foot of the panel (m)
    high : height above this foot of the rock's centre or top, as the scene says (m); the rock flies over if `high` is
        above the top of the panel
    """
    panel = barriers.panel
    if high > panel.height[b] or (panel.height[b] == 0.0 and height >= -BELOW):
        return OVER
    return THROUGH if panel.capacity[b] == 0.0 and height >= -BELOW else NEVER


@kernel
def _contact_here(barriers: Barriers, k: int, rock: PassingRock, t: float, instant: float) -> ContactHere:
    """Return the contact of a rock with another panel segment where the rock crosses panel segment k at the time t (s).

    If panel segments are at the same place, a rock meets them in the order of their indices
    (`effects.barriers.first_panel`). So the rock crosses segment k after its last contact at this place with a panel
    segment of a smaller index. Without such a contact, the rock crosses segment k before its first contact at this
    place. The path alone does not show this order: one path segment ends at the contact, the next path segment begins
    there, and both cross panel segment k.

    rock : `begin` to `end` are the rows of its impacts
    instant : time (s) in which the rock moves by `barriers.slack` (m); contacts within this time of t count as at the
        same place
    """
    here = ContactHere(q=-1, after=False)
    for q in range(rock.begin, rock.end):
        if rock.impacts[q, 0] > t + instant:
            break
        met = _panel_of(barriers, rock.facets[q])
        if met < 0 or rock.impacts[q, 0] < t - instant:
            continue
        x = (rock.impacts[q, 1], rock.impacts[q, 2], rock.impacts[q, 3])
        if stands_at(barriers.panel, k, x, barriers.slack) and (met < k or here.q < 0):
            here = ContactHere(q=q, after=bool(met < k))
    return here


@kernel
def _is_known(crossed: Crossed, number: int, b: int, t: float, instant: float) -> bool:
    """Return True if a crossing of barrier b at the time t (s) was found before.

    number : crossings found on the current path segment so far; times within `instant` (s) count as equal
    """
    known = abs(t - crossed.last[b]) <= instant
    for n in range(number):
        known = known or (crossed.barrier[n] == b and abs(t - crossed.t[n]) <= instant)
    return bool(known)
