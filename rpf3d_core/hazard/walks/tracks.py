"""Tracks: the parts of a rock's path that are straight in plan, and the times at which they cross map cells.

In plan a flight is a straight line at constant speed, so it enters and leaves a square at exact times. A straight slide
has a constant acceleration. A slide that turns is a curve within one facet; chords replace the curve.
"""

import math
from typing import Any, NamedTuple

from rpf3d_core.arc import Arc
from rpf3d_core.detection.stretch import SLOWEST
from rpf3d_core.jit.dispatch import kernel
from rpf3d_core.values import Mode, Vec
from rpf3d_core.vectors import norm

FLIGHT = int(Mode.FLIGHT)
CHORDS = 8
"""Number of chords that replace a slide that bends.

The slide turns by 7 degrees at most (`kinetics.slide_path.BEND`), so 8 chords deviate from it by less than 1e-3 of its
length.
"""
STRAIGHT = 1e-6
"""Largest sine of the angle between the first direction of a straight slide and the direction to its end.

At a larger angle, the slide counts as bent.
"""


class TrackSpin(NamedTuple):
    """Twice the rotational energy of a rock per unit of mass (m^2/s^2) at both ends of a track.

    The squared speed plus this value is twice the kinetic energy per unit of mass.
    """

    begin2: float
    end2: float


class Track(NamedTuple):
    """A part of a rock's path that is straight in plan: a flight, a straight slide, or a chord of a bent slide.

    arc : position and velocity at the start; gravity is 0 on a chord
    begin, until : s since the release; duration : s, which may differ from until - begin by rounding
    start, end : speeds (m/s) at the ends of a chord, with a constant acceleration between; for a flight, both are
        its speed at the start
    spin : a `TrackSpin`, linear along the track; None if rocks do not spin

    A time along a track is exact for a flight. On a chord, such a time is the covered share of the chord's length times
    the duration, as if the speed were constant. `time_at` and `speed2_at` convert a time along a track to the time
    since the release and to the squared speed.
    """

    arc: Arc
    begin: float
    until: float
    duration: float
    start: float
    end: float
    spin: Any = None


@kernel
def tracks_of(pieces: Any, modes: Any, p: int) -> int:
    """Return the number of tracks into which the path segment in row p is divided; 0 for a segment without duration.

    pieces : (S, 10) path segments: time, position and velocity at the start, velocity at the end. The segment in row p
        ends where the segment in row p + 1 begins
    modes : (S,) how the rock moves on each segment (`values.Mode`)
    """
    if not pieces[p + 1, 0] > pieces[p, 0]:
        return 0
    if modes[p] == FLIGHT:
        return 1
    x, y = pieces[p + 1, 1] - pieces[p, 1], pieces[p + 1, 2] - pieces[p, 2]
    aside = pieces[p, 4] * y - pieces[p, 5] * x
    straight = abs(aside) <= STRAIGHT * (abs(pieces[p, 4]) + abs(pieces[p, 5])) * (abs(x) + abs(y))
    return 1 if straight else CHORDS


@kernel
def track_of(pieces: Any, modes: Any, spins: Any, p: int, k: int, count: int, gravity: float) -> Track:
    """Return track number k of the `count` tracks into which the path segment in row p is divided.

    pieces, modes : as in `tracks_of`; count : from `tracks_of`
    spins : (S, 2) twice the rotational energy per mass (m^2/s^2) at the start and the end of each segment; None if
        rocks do not spin
    gravity : m/s^2
    """
    t, duration = pieces[p, 0], pieces[p + 1, 0] - pieces[p, 0]
    v = (pieces[p, 4], pieces[p, 5], pieces[p, 6])
    if modes[p] == FLIGHT:
        arc, speed = Arc(x=(pieces[p, 1], pieces[p, 2], pieces[p, 3]), v=v, gravity=gravity), norm(v)
        return Track(
            arc=arc,
            begin=t,
            until=pieces[p + 1, 0],
            duration=duration,
            start=speed,
            end=speed,
            spin=spin_of(spins, p, 0.0, 1.0),
        )
    a, b = slide_point(pieces, p, k / count), slide_point(pieces, p, (k + 1) / count)
    step = duration / count
    chord = ((b[0] - a[0]) / step, (b[1] - a[1]) / step, (b[2] - a[2]) / step)
    before, after = norm(v), norm((pieces[p, 7], pieces[p, 8], pieces[p, 9]))
    start, end = before + (after - before) * k / count, before + (after - before) * (k + 1) / count
    until = t + (k + 1) * step if k + 1 < count else pieces[p + 1, 0]
    spin = spin_of(spins, p, k / count, (k + 1) / count)
    return Track(
        arc=Arc(x=a, v=chord, gravity=0.0),
        begin=t + k * step,
        until=until,
        duration=step,
        start=start,
        end=end,
        spin=spin,
    )


@kernel
def spin_of(spins: Any, p: int, begin: float, end: float) -> Any:
    """Return the `TrackSpin` of a track within path segment p; None without spin.

    spins : (S, 2) twice the rotational energy per mass (m^2/s^2) at the start and the end of each segment; its square
        root, which is proportional to the spin, changes linearly along the segment. None if rocks do not spin.
    begin, end : times at the ends of the track, as shares of the segment's duration (-)
    """
    if spins is None:
        return None
    first, last = math.sqrt(spins[p, 0]), math.sqrt(spins[p, 1])
    one, other = first + (last - first) * begin, first + (last - first) * end
    return TrackSpin(one * one, other * other)


@kernel
def slide_point(pieces: Any, p: int, share: float) -> Vec:
    """Return the position (3,) m of a rock on slide p after a share of the slide's time (-).

    The position lies on the cubic curve with the positions and velocities at both ends of the slide.

    pieces : (S, 10) path segments: time, position and velocity at the start, velocity at the end; p : row of the slide
    """
    if share >= 1.0:
        return pieces[p + 1, 1], pieces[p + 1, 2], pieces[p + 1, 3]
    T, rest = pieces[p + 1, 0] - pieces[p, 0], 1.0 - share
    turn = share * share * (3.0 - 2.0 * share)
    out, into = T * share * rest * rest, -T * share * share * rest
    return (
        pieces[p, 1] + (pieces[p + 1, 1] - pieces[p, 1]) * turn + out * pieces[p, 4] + into * pieces[p, 7],
        pieces[p, 2] + (pieces[p + 1, 2] - pieces[p, 2]) * turn + out * pieces[p, 5] + into * pieces[p, 8],
        pieces[p, 3] + (pieces[p + 1, 3] - pieces[p, 3]) * turn + out * pieces[p, 6] + into * pieces[p, 9],
    )


@kernel
def speed2_at(track: Track, t: float) -> float:
    """Return the squared speed (m^2/s^2) at the time t (s) along a track; on a chord it changes linearly."""
    v, g = track.arc.v, track.arc.gravity
    if g == 0.0:
        start2, end2 = track.start * track.start, track.end * track.end
        return start2 + (end2 - start2) * (t / track.duration)
    z = v[2] - g * t
    return v[0] * v[0] + v[1] * v[1] + z * z


@kernel
def time_at(track: Track, t: float) -> float:
    """Return the time since the release (s) for the time t (s) along a track; at the track's end, exactly `until`.

    A share f of a chord takes f (u + w) / (u + v) of the duration, with the speeds u at the start of the chord, v after
    the share f, and w at the end of the chord.
    """
    if t >= track.duration:
        return track.until
    if track.arc.gravity == 0.0 and t > 0.0:
        speed = math.sqrt(speed2_at(track, t))
        if track.start + speed > 0.0:
            return track.begin + t * (track.start + track.end) / (track.start + speed)
    return track.begin + t


@kernel
def top_speed2(track: Track, begin: float, end: float) -> float:
    """Return the largest squared speed (m^2/s^2) from the time `begin` to the time `end` along a track (s).

    The largest value occurs at one of the two times, because the squared speed is a convex function of time.
    """
    return max(speed2_at(track, begin), speed2_at(track, end))


@kernel
def top_energy2(track: Track, begin: float, end: float) -> float:
    """Return twice the largest kinetic energy (J/kg), with rotation, from `begin` to `end` along a track (s)."""
    return max(_energy2_at(track.spin, track, begin), _energy2_at(track.spin, track, end))


@kernel
def _energy2_at(spin: Any, track: Track, t: float) -> float:
    """Return twice the kinetic energy (J/kg) at the time t (s) along a track; spin : `Track.spin`."""
    if spin is None:
        return speed2_at(track, t)
    share = t / track.duration if track.duration > 0.0 else 0.0
    return float(speed2_at(track, t) + spin.begin2 + (spin.end2 - spin.begin2) * share)


@kernel
def pace_of(v: float) -> float:
    """Return the time per metre (s/m) of a velocity v (m/s) along an axis, with the sign of v.

    The result is inf, whatever the sign, if v is too small to cross a cell.
    """
    return 1.0 / v if abs(v) > SLOWEST else math.inf


@kernel
def square_at(value: float, origin: float, side: float, count: int) -> int:
    """Return the row or column that contains a coordinate (m); outside the grid, the nearest row or column.

    origin : coordinate of the grid's border (m); side : of a cell (m); count : number of rows or columns
    """
    return min(max(math.floor((value - origin) / side), 0), count - 1)


@kernel
def leaving_time(index: int, count: int, origin: float, side: float, x: float, pace: float) -> float:
    """Return the time (s) at which a moving coordinate leaves row or column `index` of a grid; inf if never.

    The outermost rows and columns extend without end.

    origin : coordinate of the grid's border (m); side : of a cell (m); count : number of rows or columns
    x : coordinate at time 0, m; pace : s/m, from `pace_of`
    """
    if pace == math.inf or index == (count - 1 if pace > 0.0 else 0):
        return math.inf
    return (origin + (index + 1 if pace > 0.0 else index) * side - x) * pace


@kernel
def next_square(i: int, j: int, leave_i: float, leave_j: float, v: Vec) -> tuple[int, int]:
    """Return the column and row of the grid square that a track with velocity v (m/s) enters next.

    leave_i, leave_j : times (s) at which the track leaves column i and row j
    """
    if leave_i <= leave_j:
        return (i + 1 if v[0] > 0.0 else i - 1), j
    return i, (j + 1 if v[1] > 0.0 else j - 1)
