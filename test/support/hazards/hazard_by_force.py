"""Recompute hazard maps by brute force from stored paths: every cell is compared with every segment of the paths.

The code shares nothing with `rpf3d_core.hazard`. For each segment and each square or facet, the code computes the time
interval in which the segment is over the cell. The ends of the interval are the times at which the segment crosses the
borders, solved for all borders at once in NumPy.
"""

import math
from dataclasses import dataclass

import numpy as np

from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.paths import along_pieces
from rpf3d_core.terrain.facets import Facets
from rpf3d_core.values import Mode, Outcome

G = 9.81
CHORDS = 8
"""Number of chords that replace a curved slide, as in `hazard.tracks`."""
JOINED = 1e-9
"""Largest time (s) between two intervals in a cell that count as one stay."""


@dataclass
class Stays:
    """The time intervals of one rock in one cell, the rock's largest values there, and its counts.

    times : pairs of begin and end (s); energy : J; speed : m/s; height : m above ground; impacts, deposits : numbers
    """

    times: list
    energy: float = 0.0
    speed: float = 0.0
    height: float = 0.0
    impacts: int = 0
    deposits: int = 0


def straight_pieces(flights: Flights):
    """Yield (row, t, x, v, duration, gravity, speed at the start, speed at the end) for each segment that is straight.

    A segment must be straight in plan: a curved slide is replaced by CHORDS chords. x, v : at the start; for a slide, v
    is the mean velocity. Both speeds are None for a flight; gravity is 0 for a slide.
    """
    p = flights.paths
    for i in np.flatnonzero(p.mode != Mode.END):
        duration = p.t[i + 1] - p.t[i]
        if duration <= 0.0:
            continue
        if p.mode[i] == Mode.FLIGHT:
            yield p.row[i], p.t[i], p.x[i], p.v[i], duration, G, None, None
            continue
        way, begin = p.x[i + 1, :2] - p.x[i, :2], p.v[i, :2]
        bent = abs(begin[0] * way[1] - begin[1] * way[0]) > 1e-6 * np.abs(begin).sum() * np.abs(way).sum()
        count = CHORDS if bent else 1
        points = [along_pieces(p, np.array([i]), np.array([k / count]), G)[0][0] for k in range(count + 1)]
        step = duration / count
        begin, end = np.linalg.norm(p.v[i]), np.linalg.norm(p.v_end[i])
        for k in range(count):
            speeds = begin + (end - begin) * k / count, begin + (end - begin) * (k + 1) / count
            yield p.row[i], p.t[i] + k * step, points[k], (points[k + 1] - points[k]) / step, step, 0.0, *speeds


def cut(inside, turning, duration):
    """Return the times (N,) s at which a rock enters N cells during a segment, and the times (N,) s at which it leaves.

    Both times are in [0, duration]. For a cell in which the rock never is, the first time is not before the second.

    inside : (N, K) distance from each of the K borders of a cell at time 0, positive inside, in any unit
    turning : (N, K) change of this distance per second
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        at = -inside / turning
    low = np.where(turning > 0, at, np.where((turning == 0) & (inside < 0), np.inf, -np.inf)).max(axis=1)
    high = np.where(turning < 0, at, np.inf).min(axis=1)
    return np.maximum(low, 0.0), np.minimum(high, duration)


def clock(gravity, ends, duration, t):
    """Return the time (s) at which a rock reaches the point that it would reach after t seconds at its mean speed.

    A slide covers the distance u t + a t^2 / 2. The acceleration a changes the speed from u to the speed at the end.
    For a flight, the result is t. ends : speeds (m/s) at the start and the end
    """
    a = 0.0 if gravity else (ends[1] - ends[0]) / duration
    if a == 0.0:
        return t
    way = 0.5 * (ends[0] + ends[1]) * t
    return (math.sqrt(max(ends[0] ** 2 + 2.0 * a * way, 0.0)) - ends[0]) / a


def speed(v, gravity, ends, duration, t):
    """Return the speed (m/s) on a segment, t seconds after its start; t : as returned by `clock`."""
    if gravity == 0.0:
        return ends[0] + (ends[1] - ends[0]) * t / duration
    return math.hypot(v[0], v[1], v[2] - gravity * t)


def height_above(facets, f, x, v, gravity, low, high):
    """Return the largest vertical height (m) of a segment above the plane of facet f, from time `low` to time `high`.

    The height is computed at three times, and at the time at which the velocity is parallel to the plane; at least 0.
    """
    n, a = facets.normals[f], facets.corners[f, :3]
    times = np.linspace(low, high, 3)
    if gravity:
        top = (v @ n) / (n[2] * gravity)
        times = np.append(times, np.clip(top, low, high))
    places = x + v * times[:, None] - 0.5 * gravity * times[:, None] ** 2 * np.array([0.0, 0.0, 1.0])
    return max(float((((places - a) @ n) / n[2]).max()), 0.0)


def by_force(flights: Flights, facets: Facets, raster, mass):
    """Return three dictionaries from (rock, cell) to `Stays`: for the squares of the raster, for facets, and for zones.

    mass : mass (kg) of every rock
    """
    squares, ground, zones = {}, {}, {}
    corners = np.asarray(facets.corners).reshape(-1, 3, 3)
    side = np.sign(facets.normals[:, 2])
    edges = (np.roll(corners, -1, axis=1) - corners)[..., :2] * side[:, None, None]
    columns, rows = np.meshgrid(np.arange(raster.nx), np.arange(raster.ny))
    west, south = raster.x + columns.ravel() * raster.cell, raster.y + rows.ravel() * raster.cell
    for row, t, x, v, duration, gravity, *ends in straight_pieces(flights):
        inside = np.stack([x[0] - west, west + raster.cell - x[0], x[1] - south, south + raster.cell - x[1]], 1)
        turning = np.broadcast_to([v[0], -v[0], v[1], -v[1]], inside.shape)
        low, high = cut(inside, turning, duration)
        over = np.flatnonzero(high > low)
        for cell in over:
            stay(squares, row, cell, t, low[cell], high[cell], v, gravity, ends, duration, mass)
        away = x[:2] - corners[..., :2]
        f_low, f_high = cut(
            edges[..., 0] * away[..., 1] - edges[..., 1] * away[..., 0],
            edges[..., 0] * v[1] - edges[..., 1] * v[0], duration,
        )  # fmt: skip
        for f in np.flatnonzero((f_high > f_low) & (side != 0)):
            stay(ground, row, f, t, f_low[f], f_high[f], v, gravity, ends, duration, mass)
            stay(zones, row, facets.zone[f], t, f_low[f], f_high[f], v, gravity, ends, duration, mass)
            high_above = height_above(facets, f, x, v, gravity, f_low[f], f_high[f])
            for kind, cell in ((ground, f), (zones, facets.zone[f])):
                kind[row, cell].height = max(kind[row, cell].height, high_above)
            for cell in over:
                begin, end = max(low[cell], f_low[f]), min(high[cell], f_high[f])
                if end > begin:
                    most = height_above(facets, f, x, v, gravity, begin, end)
                    squares[row, cell].height = max(squares[row, cell].height, most)
    count(flights, facets, raster, mass, squares, ground, zones)
    return squares, ground, zones


def stay(kind, row, cell, t, low, high, v, gravity, ends, duration, mass):
    """Add one interval of a segment to the stays of a rock in a cell.

    kind : one of the dictionaries of `by_force`; low, high : times (s) as returned by `cut`
    row, t, v, gravity, ends, duration : the segment, as in `straight_pieces`
    """
    low, high = (clock(gravity, ends, duration, pace) for pace in (low, high))
    found = kind.setdefault((row, cell), Stays([]))
    found.times.append((t + low, t + high))
    fastest = max(speed(v, gravity, ends, duration, low), speed(v, gravity, ends, duration, high))
    found.speed = max(found.speed, fastest)
    found.energy = max(found.energy, 0.5 * mass * fastest**2)


def count(flights, facets, raster, mass, squares, ground, zones):
    """Count all deposits and impacts in the stays; in facets and zones also compare the speeds before impacts."""

    def square(x):
        return math.floor((x[1] - raster.y) / raster.cell) * raster.nx + math.floor((x[0] - raster.x) / raster.cell)

    i, d = flights.impacts, flights.deposits
    for row, x, f, fast in zip(i.row, i.x, i.facet, i.speed_in, strict=True):
        squares[row, square(x)].impacts += 1
        for found in (ground[row, f], zones[row, facets.zone[f]]):
            found.impacts += 1
            found.speed, found.energy = max(found.speed, fast), max(found.energy, 0.5 * mass * fast**2)
    for row in np.flatnonzero(d.outcome == Outcome.STOPPED):
        squares[row, square(d.x[row])].deposits += 1
        ground[row, d.facet[row]].deposits += 1
        zones[row, facets.zone[d.facet[row]]].deposits += 1


def passages(times):
    """Return the number of passages in a list of time intervals; intervals at most JOINED apart are one passage."""
    entered, until = 0, -math.inf
    for begin, end in sorted(times):
        entered += begin > until + JOINED
        until = max(until, end)
    return entered
