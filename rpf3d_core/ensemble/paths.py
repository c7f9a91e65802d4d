"""Compute points along the paths of rocks, between the recorded events, for pictures and exports.

A FLIGHT segment is the exact parabola x + v t + g t^2/2. SETTLING and SLIDING segments are drawn as the cubic Hermite
curve with the exact position and velocity at both ends; between the ends the curve is only an approximation. The drawn
velocity changes linearly from one end to the other, so that no drawn speed exceeds the computed speeds. A slide with
constant deceleration is drawn exactly.

Every segment of a rock with a shape is a parabola, which the cubic curve reproduces; its orientation is exact, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray, IntArray, Paths
from rpf3d_core.values import STANDARD_GRAVITY, Mode

FINEST_STEP, COARSEST_STEP = 0.01, 1.0
"""Bounds of the step at which paths are drawn (m): a laboratory ramp is 2 m long, a pit wall 300 m."""

STEPS_ACROSS = 400
"""Number of drawing steps over the largest extent of all paths: about the resolution of a picture on a screen."""


@dataclass(frozen=True, eq=False)
class PathSamples:
    """Points along the paths of rocks, S of them, grouped by rock in order of time: for drawing.

    row : (S,) row of the rock in `Deposits`; t : (S,) s; x : (S, 3) m; v : (S, 3) m/s; mode : (S,) `values.Mode`
    q : (S, 4) orientation w, x, y, z of rocks with a shape, from their principal axes to the axes of the local frame;
        None for points and spheres, or if orientations are not asked for
    An impact is two points of the same t and x: the first has the velocity before the impact, the second after it.
    """

    row: IntArray
    t: FloatArray
    x: FloatArray
    v: FloatArray
    mode: IntArray
    q: FloatArray | None = None

    @property
    def speed(self) -> FloatArray:
        """Speed of the rock at each point (S,), m/s."""
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", self.v, self.v)))

    @property
    def starts(self) -> IntArray:
        """Index (N,) of the first point of each of N rocks, where its path begins."""
        return run_starts(self.row)


def displayed_rows(paths: Paths, limit: int) -> IntArray:
    """Return at most `limit` rows (N,) of the rocks that have a path, spread evenly, to display them."""
    rows = np.unique(paths.row)
    if len(rows) <= limit:
        return rows
    return np.asarray(rows[np.linspace(0, len(rows) - 1, limit).round().astype(int)])


def display_step(paths: Paths) -> float:
    """Return the distance (m) between the drawn points of paths, from the extent of all paths."""
    extent = float(np.ptp(paths.x, axis=0).max()) if len(paths.x) else COARSEST_STEP
    return float(np.clip(extent / STEPS_ACROSS, FINEST_STEP, COARSEST_STEP))


def sample_paths(
    paths: Paths,
    rows: Sequence[int] | IntArray | None = None,
    max_step: float | None = None,
    gravity: float = STANDARD_GRAVITY,
    moments: FloatArray | None = None,
) -> PathSamples:
    """Return points along the paths of some rocks, at most `max_step` apart, to draw the paths.

    Parameters
    ----------
    paths : Paths
        Events, local frame.
    rows : (N,) int, optional
        Rows in `Deposits`; default: all rocks that have a path. A row without a path gives no points.
    max_step : float, optional
        m > 0; default: `display_step(paths)`.
    gravity : float
        The scene's, m/s^2.
    moments : (R, 3) float, optional
        Principal moments of rocks with a shape, ascending, in any unit; by row in `Deposits`. Adds orientations.

    Returns
    -------
    PathSamples
        Every event and the points between events. `t`, `x`, `v` and `q` are exact at events and everywhere along
        flights.
    """
    step = display_step(paths) if max_step is None else max_step
    chosen = np.arange(len(paths.row)) if rows is None else np.flatnonzero(np.isin(paths.row, rows))
    steps = _steps_of_pieces(paths, chosen, step)
    points = steps + _ends_with_a_jump(paths, chosen)
    piece = np.repeat(chosen, points)
    ordinal = np.arange(len(piece)) - np.repeat(np.cumsum(points) - points, points)
    fraction = ordinal / np.repeat(steps, points)
    x, v = along_pieces(paths, piece, fraction, gravity)
    inside = paths.t[piece] + _durations(paths)[piece] * fraction
    t = np.where(fraction < 1.0, inside, paths.t[_next_event(paths, piece)])
    q = None if moments is None else _orientations(paths, piece, fraction, moments)
    return PathSamples(row=paths.row[piece], t=t, x=x, v=v, mode=paths.mode[piece], q=q)


def positions_at(paths: Paths, row: int, times: FloatArray, gravity: float = STANDARD_GRAVITY) -> FloatArray:
    """Return the positions (T, 3) m of one rock at given times (T,) s, as for an animation.

    Times before the release give the release position; times after the end give the end position.

    row : row of the rock in `Deposits`; gravity : m/s^2

    Raises
    ------
    KeyError
        The rock has no path.
    """
    piece, fraction = _segments_at(paths, row, times)
    return along_pieces(paths, piece, fraction, gravity)[0]


def poses_at(
    paths: Paths, row: int, times: FloatArray, moments: FloatArray, gravity: float = STANDARD_GRAVITY
) -> tuple[FloatArray, FloatArray]:
    """Return positions (T, 3) m and orientations (T, 4) w, x, y, z of one rock with a shape at ascending times (T,) s.

    Times before the release give the pose at the release; times after the end give the pose at the end.

    row, gravity : as in `positions_at`; moments : (R, 3) as in `sample_paths`

    Raises
    ------
    KeyError
        The rock has no path.
    """
    piece, fraction = _segments_at(paths, row, times)
    return along_pieces(paths, piece, fraction, gravity)[0], _orientations(paths, piece, fraction, moments)


def _segments_at(paths: Paths, row: int, times: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the path segment (T,) in which a rock is at each time (T,) s, and the elapsed share (T,) of its duration.

    A path segment is given as the row in `Paths` of the event that begins the segment. A time before the release is
    replaced by the time of the release, and a time after the end by the time of the end.

    row : row of the rock in `Deposits`

    Raises
    ------
    KeyError
        The rock has no path.
    """
    events = np.flatnonzero(paths.row == row)
    if len(events) == 0:
        raise KeyError(f"rock of row {row} has no path")
    inside = np.clip(times, paths.t[events[0]], paths.t[events[-1]])
    piece = events[np.searchsorted(paths.t[events], inside, side="right") - 1]
    duration = _durations(paths)[piece]
    elapsed = inside - paths.t[piece]
    return piece, np.divide(elapsed, duration, out=np.zeros_like(elapsed), where=duration > 0.0)


def _orientations(paths: Paths, piece: IntArray, fraction: FloatArray, moments: FloatArray) -> FloatArray:
    """Return the orientations (S, 4) w, x, y, z of rocks with a shape within path segments.

    piece, fraction : as in `along_pieces`; moments : (R, 3) as in `sample_paths`
    """
    from rpf3d_core.ensemble.tumbling import orientations_along  # imported only for rocks with a shape

    return orientations_along(paths, piece, fraction * _durations(paths)[piece], fraction < 1.0, moments)


def along_pieces(
    paths: Paths, piece: IntArray, fraction: FloatArray, gravity: float = STANDARD_GRAVITY
) -> tuple[FloatArray, FloatArray]:
    """Return position (S, 3) m and velocity (S, 3) m/s of rocks within path segments, to draw points between events.

    piece : (S,) row in `Paths` of the event that begins each segment; fraction : (S,) in [0, 1], share of its duration
    """
    duration = _durations(paths)[piece]
    x, v = (rows.take(piece, axis=0) for rows in (paths.x, paths.v))  # take() is four times as fast as indexing
    x, v = _parabola(x, v, fraction * duration, gravity)
    drawn = np.isin(paths.mode[piece], (Mode.SETTLING, Mode.SLIDING)) & (duration > 0.0)
    some = piece[drawn]
    x[drawn], v[drawn] = _hermite(
        (paths.x[some], paths.v[some]), (paths.x[some + 1], paths.v_end[some]), fraction[drawn], duration[drawn]
    )
    at_end = (fraction >= 1.0) & (paths.mode[piece] != Mode.END)
    x[at_end], v[at_end] = paths.x[piece[at_end] + 1], paths.v_end[piece[at_end]]
    return x, v


def run_starts(values: NDArray[np.integer]) -> IntArray:
    """Return the indices (N,) at which N runs of equal values begin in a column (S,), such as row numbers of rocks."""
    if len(values) == 0:
        return np.empty(0, dtype=np.int64)
    return np.concatenate([[0], np.flatnonzero(np.diff(values)) + 1])


def evenly(count: int, most: int) -> IntArray:
    """Return at most `most` (>= 2) of the indices 0 .. count - 1, (N,), evenly spread, with the first and the last."""
    if count <= most:
        return np.arange(count)
    return np.linspace(0, count - 1, most).round().astype(np.int64)


def _durations(paths: Paths) -> FloatArray:
    """Return the duration (S,) s of the path segment that begins at each event; 0 for the end of a path."""
    duration = np.zeros(len(paths.t))
    duration[:-1] = np.diff(paths.t)
    return np.where(paths.mode == Mode.END, 0.0, duration)


def _next_event(paths: Paths, pieces: IntArray) -> IntArray:
    """Return the row (P,) of the event that ends each path segment: the next row, but at most the last row.

    pieces : (P,) row in `Paths` of the event that begins each segment
    """
    return np.minimum(pieces + 1, len(paths.row) - 1)


def _steps_of_pieces(paths: Paths, pieces: IntArray, step: float) -> IntArray:
    """Return the number of drawing steps (P,), at least 1, along each path segment.

    The number follows from an upper bound of the length. A rock in flight is fastest at one end of the segment, so the
    length is at most the larger of both speeds times the duration.

    pieces : (P,) row in `Paths` of the event that begins each segment; step : m, largest distance between drawn points
    """
    speed = np.maximum(np.linalg.norm(paths.v[pieces], axis=1), np.linalg.norm(paths.v_end[pieces], axis=1))
    return np.asarray(np.maximum(1, np.ceil(speed * _durations(paths)[pieces] / step)), dtype=np.int64)


def _ends_with_a_jump(paths: Paths, pieces: IntArray) -> IntArray:
    """Return the number (P,) of additional points that must be drawn at the end of each path segment: 1 or 0.

    The result is 1 if the velocity jumps at the end of the segment, else 0.

    pieces : (P,) row in `Paths` of the event that begins each segment
    """
    jumps = np.any(paths.v_end[pieces] != paths.v[_next_event(paths, pieces)], axis=1)
    return np.asarray(jumps & (paths.mode[pieces] != Mode.END), dtype=np.int64)


def _parabola(x: FloatArray, v: FloatArray, t: FloatArray, gravity: float) -> tuple[FloatArray, FloatArray]:
    """Return the positions x + v t + g t^2/2 (S, 3) m and velocities v + g t (S, 3) m/s of flying rocks t (S,) s later.

    x : (S, 3) m and v : (S, 3) m/s, at t = 0; gravity : m/s^2
    """
    later, faster = x + v * t[:, None], v.copy()
    later[:, 2] -= 0.5 * gravity * (t * t)
    faster[:, 2] -= gravity * t
    return later, faster


def _hermite(
    start: tuple[FloatArray, FloatArray], end: tuple[FloatArray, FloatArray], s: FloatArray, duration: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return positions (S, 3) m on the curves drawn for settling and sliding, and the drawn velocities (S, 3) m/s.

    A curve is cubic; the drawn velocity changes linearly in time.

    start, end : x (S, 3) m and v (S, 3) m/s at both ends; s : (S,) share of the duration; duration : (S,) s
    """
    (x0, v0), (x1, v1) = start, end
    s, h = s[:, None], duration[:, None]
    x = x0 + (x1 - x0) * s * s * (3.0 - 2.0 * s) + h * s * (1.0 - s) * (v0 * (1.0 - s) - v1 * s)
    return x, v0 * (1.0 - s) + v1 * s
