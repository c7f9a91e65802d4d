"""Split the paths of rocks into segments, straight in plan, from the impacts of all rocks or from the kept paths.

The impacts of every rock are known. Between two impacts, a rock flies on a parabola that follows from the places and
times of both impacts. If the speeds do not agree with this parabola, the rock slid or rolled first. Then the larger of
the speeds at both ends counts, and the height is not known, because the rock may have left the ground over an edge.
After its last impact, a rock that stopped is on the ground. Any other rock, such as a rock that left the terrain, flies
to its end; if its speeds do not agree with a flight, its largest speed counts.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.report.run_files import Ends, ImpactRows, RunFiles, read_impacts
from rpf3d_core.terrain.frame import FloatArray

IntArray = NDArray[np.int64]
AGREES = 0.01
"""Relative difference of speeds (-) up to which a segment between two impacts is a flight."""
SLOW = 0.05
"""Difference of speeds (m/s) that is allowed in addition to the relative difference AGREES."""
MOSTLY, FOR_HEIGHTS = 0.9, 0.95
"""Limits of the share (-) of flights among the passages at a place.

The energy at the place is computed from impacts if the share is at least MOSTLY, the p95 height if the share is above
FOR_HEIGHTS; else from kept paths. The height of a passage that is not a flight is unknown.
"""
IMPACTS, KEPT = "impacts of all rocks", "kept paths"


class Segments(NamedTuple):
    """M segments of the paths of rocks, in local coordinates with z up, ordered by rock and time.

    row : (M,) row of the rock in `Ends`; begin, end : (M, 3) m
    time : (M,) s, duration of a flight; 0 on the ground and between points of kept paths; NaN for other motion
    speed : (M, 2) m/s at begin and end; gravity : m/s^2, 0 if `source` is KEPT
    rocks : number of rocks that have segments
    source : IMPACTS if the segments are from the impacts of all rocks, KEPT if from the kept paths
    impacts : impacts with recorded speeds; if `source` is KEPT, the times of impacts are NaN; None without impacts
    """

    row: IntArray
    begin: FloatArray
    end: FloatArray
    time: FloatArray
    speed: FloatArray
    gravity: float
    rocks: int
    source: str
    impacts: ImpactRows | None = None


def segments_of(run: RunFiles) -> list[Segments]:
    """Return the possible segments of a run, the best first: from the impacts of all rocks, and from the kept paths.

    The segments from impacts are left out if the run kept the paths of all rocks, or did not write impacts.
    `passing.segments_at` chooses between the possible segments at each place.
    """
    found = _from_impacts(run) if len(run.paths.key) < len(run.ends.key) else None
    return [*([] if found is None else [found]), _from_paths(run)]


def _from_impacts(run: RunFiles) -> Segments | None:
    """Return the path segments between release, impacts and end of each rock, from the table of impacts.

    None if the run has no table of impacts, or the table is empty.
    """
    found = read_impacts(run)
    if found is None:
        return None
    row, t, x, into, out = found
    first = np.append(True, row[1:] != row[:-1])
    begin = np.where(first[:, None], run.ends.release[row], np.roll(x, 1, axis=0))
    time = t - np.where(first, run.ends.since[row], np.roll(t, 1))
    launched = np.where(first, np.nan, np.roll(out, 1))
    gravity = float(run.summary["scene"]["gravity"])
    time, speed = _flights(begin, x, time, launched, into, gravity)
    ends = _to_the_ends(run.ends, found, gravity)
    order = np.argsort(np.concatenate([row, ends.row]), kind="stable")  # the segment to the end is a rock's last one
    return ends._replace(
        row=np.concatenate([row, ends.row])[order], begin=np.concatenate([begin, ends.begin])[order],
        end=np.concatenate([x, ends.end])[order], time=np.concatenate([time, ends.time])[order],
        speed=np.concatenate([speed, ends.speed])[order], impacts=found,
    )  # fmt: skip


def _to_the_ends(ends: Ends, impacts: ImpactRows, gravity: float) -> Segments:
    """Return the last segment of each rock: from its last impact, or its release if it has no impact, to its end.

    gravity : m/s^2
    """
    count = len(ends.runout)
    last = np.flatnonzero(np.append(impacts.row[1:] != impacts.row[:-1], True)[: len(impacts.row)])
    struck = impacts.row[last]
    begin, since, launched, landed = (
        ends.release.copy(), ends.since.copy(), np.full(count, np.nan), ends.max_speed.copy()
    )  # fmt: skip
    begin[struck], since[struck], launched[struck] = impacts.x[last], impacts.t[last], impacts.speed_out[last]
    landed[struck] = np.nan
    time, speed = _flights(begin, ends.end, ends.t - since, launched, landed, gravity)
    time = np.where(ends.on_ground, 0.0, time)
    slid = np.where(ends.on_ground & np.isfinite(launched), launched, ends.max_speed)
    return Segments(
        row=np.arange(count), begin=begin, end=ends.end, time=time,
        speed=np.where((time > 0.0)[:, None], speed, slid[:, None]), gravity=gravity, rocks=count, source=IMPACTS,
    )  # fmt: skip


def _flights(
    begin: FloatArray, end: FloatArray, time: FloatArray, launched: FloatArray, landed: FloatArray, gravity: float
) -> tuple[FloatArray, FloatArray]:
    """Return the durations (M,) s of segments that are flights, NaN for others, and the speeds (M, 2) m/s at both ends.

    begin, end : (M, 3) m; time : (M,) s, duration; gravity : m/s^2
    launched, landed : (M,) m/s, recorded speeds at begin and end, NaN if unknown
    """
    safe = np.maximum(time, 1e-9)
    mean = (end - begin) / safe[:, None]
    fall = np.zeros_like(mean)
    fall[:, 2] = 0.5 * gravity * time
    speeds = np.stack([np.linalg.norm(mean + fall, axis=1), np.linalg.norm(mean - fall, axis=1)], axis=1)
    recorded = np.stack([launched, landed], axis=1)
    known = np.where(np.isnan(recorded), speeds, recorded)
    agrees = (np.abs(speeds - known) <= AGREES * known + SLOW).all(axis=1) & (time > 0.0)
    slid = np.repeat(known.max(axis=1)[:, None], 2, axis=1)
    return np.where(agrees, time, np.nan), np.where(agrees[:, None], speeds, slid)


def _from_paths(run: RunFiles) -> Segments:
    """Return the segments between consecutive points of the kept paths."""
    place = {key: row for row, key in enumerate(run.ends.key)}
    rows, starts = np.array([place[key] for key in run.paths.key], dtype=np.int64), run.paths.starts
    inner = np.setdiff1d(np.arange(len(run.paths.x)), starts[1:] - 1)
    lengths = np.maximum(np.diff(starts) - 1, 0)
    row, begin, end = np.repeat(rows, lengths), run.paths.x[inner], run.paths.x[inner + 1]
    into, out = run.paths.speed[inner], run.paths.speed[inner + 1]
    struck = np.flatnonzero((begin == end).all(axis=1))  # a path has two points at the place of an impact
    return Segments(
        row=row, begin=begin, end=end, time=np.zeros(len(inner)), speed=np.stack([into, out], axis=1), gravity=0.0,
        rocks=len(rows), source=KEPT,
        impacts=ImpactRows(row[struck], np.full(len(struck), np.nan), begin[struck], into[struck], out[struck]),
    )  # fmt: skip


class FirstPassage(NamedTuple):
    """The first passage of each of N rocks past a given distance; row : (N,) row of the rock in `Ends`.

    speed : (N,) m/s, at the passage; x : (N, 3) m, place of the passage; z is NaN if the height is not known
    flies : (N,) True for a passage in a flight (`Segments.time` above 0); False for passages on kept paths
    """

    row: IntArray
    speed: FloatArray
    x: FloatArray
    flies: NDArray[np.bool_]


def first_passages(segments: Segments, origin: FloatArray, along: FloatArray, distance: FloatArray) -> FirstPassage:
    """Return the first passage of each rock past a distance along the rock's own direction.

    Each array has a row for each of the R rocks of `Ends`. The result leaves out rocks that do not pass the distance,
    and rocks with NaN in an array.

    origin : (R, 2) m, where distances start; along : (R, 2) unit vectors in plan; distance : (R,) m
    """
    row = segments.row
    start = ((segments.begin[:, :2] - origin[row]) * along[row]).sum(axis=1) - distance[row]
    stop = ((segments.end[:, :2] - origin[row]) * along[row]).sum(axis=1) - distance[row]
    over = np.flatnonzero((start < 0.0) & (stop >= 0.0))
    _, first = np.unique(row[over], return_index=True)
    some = over[first]
    part = -start[some] / (stop[some] - start[some])
    return FirstPassage(row=row[some], speed=_speed_at(segments, some, part), x=_place_at(segments, some, part),
                        flies=segments.time[some] > 0.0)  # fmt: skip


def largest_speeds_at_impacts(
    segments: Segments, origin: FloatArray, along: FloatArray, distance: FloatArray, within: float
) -> FloatArray:
    """Return the largest speed (R,) m/s of each rock just before and after its impacts near a distance.

    The speed is 0 for a rock without an impact there.

    The speeds are the recorded speeds of the impacts, not the speeds of segments: a segment that is not a flight has
    the larger speed of its ends, which may belong to another place.

    origin, along, distance : as in `first_passages`; within : largest distance (m) of an impact from `distance`
    """
    found, impacts = np.zeros(len(distance)), segments.impacts
    if impacts is not None:
        row = impacts.row
        away = ((impacts.x[:, :2] - origin[row]) * along[row]).sum(axis=1) - distance[row]
        near = np.abs(away) <= within
        np.maximum.at(found, row[near], np.maximum(impacts.speed_in, impacts.speed_out)[near])
    return found


def _place_at(segments: Segments, some: IntArray, part: FloatArray) -> FloatArray:
    """Return points (N, 3) m within segments, such as the place of a passage; z is NaN if it is not known.

    some : (N,) rows in `segments`
    part : (N,) share (-) of the segment's length in plan, 0 at its begin and 1 at its end
    """
    x = segments.begin[some] + part[:, None] * (segments.end[some] - segments.begin[some])
    x[:, 2] += 0.5 * segments.gravity * segments.time[some] ** 2 * part * (1.0 - part)
    return x


def _speed_at(segments: Segments, some: IntArray, part: FloatArray) -> FloatArray:
    """Return the speeds (N,) m/s at points within segments; some : (N,) rows of the segments in `segments`.

    part : (N,) share (-) of the segment's length in plan, 0 at its begin and 1 at its end
    """
    time = segments.time[some]
    flies = time > 0.0
    velocity = (segments.end[some] - segments.begin[some]) / np.where(flies, time, 1.0)[:, None]
    velocity[:, 2] += segments.gravity * time * (0.5 - part)
    v0, v1 = segments.speed[some].T
    return np.asarray(np.where(flies, np.linalg.norm(velocity, axis=1), (1.0 - part) * v0 + part * v1))
