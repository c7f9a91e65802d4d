"""The probability that each simulated rock did what was counted in the field, with the error of the model.

"What was counted" is that rocks passed a gate, or reached or stopped in an area or a section of the slope. A simulated
stop or passage has the error of the model (the misfit), as in the densities of single stops (`density`). So for a rock
near the end of a section, the probability is between 0 and 1. Without an error, the probability is 0 or 1.
"""

from collections.abc import Callable
from functools import cache, reduce
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.calibration.density import GROUPS
from rpf3d_core.calibration.flown_passages import contained
from rpf3d_core.calibration.normal_space import normal_of, probability_below
from rpf3d_core.calibration.observations import Directions
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.unknowns.points import spread_points
from rpf3d_core.values import DEPOSITED

FloatArray = NDArray[np.float64]
Section = tuple[float | None, float | None]

COPIES = 16
"""Number of displaced copies of each rock that are compared with an area.

The displacements, in units of the misfit, are the same for all rocks and sets.
"""


class PathExtents(NamedTuple):
    """Extent of the path of each of R rocks along the slope, as distances in the input's coordinates.

    begin : (R,) m, distance along the slope at which the path begins
    least, most : (R,) m, smallest and largest distance along the slope on the path
    """

    begin: FloatArray
    least: FloatArray
    most: FloatArray


def deposited_in(batch: Batch) -> NDArray[np.bool_]:
    """Return flags (R,): True for a rock that stopped on the terrain or was caught."""
    return np.isin(batch.counts[:, 0], [int(outcome) for outcome in DEPOSITED])


def extent_of(batch: Batch, directions: Directions) -> PathExtents:
    """Return the extent of each rock's recorded path along the slope; only ends of path segments are compared."""
    rows = np.repeat(np.arange(len(batch.rows)), np.diff(batch.first[:, 1]))
    distance = directions.places(batch.pieces[:, 1:4])[:, 0]
    begin, least, most = (directions.places(batch.finals[:, 1:4])[:, 0] for _ in range(3))
    np.minimum.at(least, rows, distance)
    np.maximum.at(most, rows, distance)
    recorded, first = np.unique(rows, return_index=True)
    begin[recorded] = distance[first]
    return PathExtents(begin=begin, least=least, most=most)


def passed(extent: PathExtents, at: float, misfits: FloatArray) -> FloatArray:
    """Return the probability (M, R) that each rock passed a gate, for each misfit (M,) m.

    The farthest point of a path has the error of the model. The beginning of a path is known and has no error. So a
    rock that begins beyond the gate passes the gate only if the simulated path crosses the gate.

    extent : how far each rock went; at : m, distance of the gate along the slope
    misfits : (M,) m, standard deviations of the error of the model
    """
    before = extent.begin < at
    return np.stack([np.where(before, _beyond(extent.most - at, sd), extent.least < at) for sd in misfits.tolist()])


def reached_section(extent: PathExtents, section: Section, misfits: FloatArray) -> FloatArray:
    """Return the probability (M, R) that each rock began beyond the lower end of a section, or went past this end.

    The probability is 1 if the section has no lower end. As in `passed`, the farthest point of a path has the error of
    the model, and its beginning has no error.

    section : lower and upper end (m) along the slope, None where it has no end; misfits : (M,) m
    """
    low = section[0]
    if low is None:
        return np.ones((len(misfits), len(extent.begin)))
    return np.where(extent.begin >= low, 1.0, passed(extent, low, misfits))


def stopped_in_section(
    along: FloatArray, deposited: NDArray[np.bool_], section: Section, misfits: FloatArray
) -> FloatArray:
    """Return the probability (M, R) that each rock stopped in a section, for each misfit (M,) m.

    section : lower and upper end (m) along the slope, None where it has no end
    along : (R,) m, where rocks stopped; deposited : (R,) False for rocks that left the terrain or did not stop
    misfits : (M,) m, standard deviations of the error of the model
    """
    low, high = section
    from_low = np.ones((len(misfits), len(along))) if low is None else _all_beyond(along - low, misfits)
    from_high = 0.0 if high is None else _all_beyond(along - high, misfits)
    return np.asarray((from_low - from_high) * deposited)


def stopped_in_area(batch: Batch, outlines: list[FloatArray], misfits: FloatArray) -> FloatArray:
    """Return the probability (M, R) that each rock stopped in an area, for each misfit (M,) m.

    The stop of a rock is copied, and each copy is displaced in plan by an error of the model. The probability is the
    share of the copies in the area.

    outlines : closed outlines (P, 2) m of the area, local frame
    misfits : (M,) m, standard deviations of the error of the model
    """
    deposited, stops = deposited_in(batch), batch.finals[:, 1:3]
    return np.stack([_share(lambda by: contained(stops + by, outlines), sd) * deposited for sd in misfits.tolist()])


def reached_area(batch: Batch, outlines: list[FloatArray], misfits: FloatArray) -> FloatArray:
    """Return the probability (M, R) that each rock crossed an area or stopped in the area, for each misfit (M,) m.

    The path of a rock is copied, and each copy is displaced by an error of the model. The probability is the share of
    the copies that cross or touch the area. The beginning of a path is known, so the displacement grows from 0 at the
    beginning to the whole error at the end.

    outlines : closed outlines (P, 2) m of the area, local frame
    misfits : (M,) m, standard deviations of the error of the model
    """
    area, paths = _area_of(outlines), _paths_of(batch)

    def flags_at(by: FloatArray) -> NDArray[np.bool_]:
        moved = paths.points + paths.share[:, None] * by
        return np.asarray(shapely.intersects(area, shapely.linestrings(moved, indices=paths.rows)))

    return np.stack([_share(flags_at, sd) for sd in misfits.tolist()])


class _Paths(NamedTuple):
    """The paths of R rocks in plan, from event to event, with at least two points each.

    points : (P, 2) m, local frame, rock by rock; rows : (P,) the rock of each point
    share : (P,) (-), for each point the length of the path before the point, divided by the length of the whole path
    """

    points: FloatArray
    rows: NDArray[np.int64]
    share: FloatArray


def _paths_of(batch: Batch) -> _Paths:
    """Return the recorded paths of all rocks in plan, as points from event to event.

    The end of each path is stored twice, so that a rock without a recorded event also has two points.
    """
    ends = np.arange(len(batch.rows))
    rows = np.concatenate([np.repeat(ends, np.diff(batch.first[:, 1])), ends, ends])
    order = np.argsort(rows, kind="stable")
    points = np.concatenate([batch.pieces[:, 1:3], batch.finals[:, 1:3], batch.finals[:, 1:3]])[order]
    rows = rows[order]
    steps = np.where(np.diff(rows) == 0, np.linalg.norm(np.diff(points, axis=0), axis=1), 0.0)
    gone = np.concatenate([np.zeros(min(len(rows), 1)), np.cumsum(steps)])
    begin, end = gone[np.searchsorted(rows, ends)], gone[np.searchsorted(rows, ends, side="right") - 1]
    share = (gone - begin[rows]) / np.maximum(end - begin, 1e-300)[rows]
    return _Paths(points=points, rows=rows, share=share)


def _area_of(outlines: list[FloatArray]) -> Any:
    """Return an area as a prepared polygon, from closed outlines (P, 2) m; an outline inside another is a hole."""
    area = reduce(shapely.symmetric_difference, shapely.make_valid([shapely.polygons(ring) for ring in outlines]))
    shapely.prepare(area)
    return area


@cache
def unit_displacements() -> FloatArray:
    """Return the displacements in plan (COPIES, 2) of the copies of a path or stop, in units of the misfit (-).

    In x and in y, the mean is 0 and the standard deviation 1.
    """
    normal = normal_of(np.clip(spread_points(COPIES, 2, GROUPS), 0.5 / COPIES, 1.0 - 0.5 / COPIES))
    unit = np.asarray((normal - normal.mean(axis=0)) / normal.std(axis=0))
    unit.flags.writeable = False  # all callers share this array
    return unit


def _share(flags_at: Callable[[FloatArray], NDArray[np.bool_]], sd: float) -> FloatArray:
    """Return, for each of R rocks, the share (R,) (-) of its displaced copies for which `flags_at` returns True.

    If sd is 0, the result is 1 or 0: the flag of the rock itself.

    flags_at : returns flags (R,) of the copies with a displacement in plan (2,) m
    sd : m, standard deviation of the displacements in each direction
    """
    if sd == 0.0:
        return flags_at(np.zeros(2)).astype(float)
    return np.asarray(np.mean([flags_at(sd * by) for by in unit_displacements()], axis=0))


def _all_beyond(distance: FloatArray, misfits: FloatArray) -> FloatArray:
    """Return the probability (M, R) that each distance (R,) m is at least 0, if its error is the misfit (M,) m."""
    return np.stack([_beyond(distance, sd) for sd in misfits.tolist()])


def _beyond(distance: FloatArray, sd: float) -> FloatArray:
    """Return the probability (R,) that a distance (R,) m with an error of standard deviation sd (m) is at least 0."""
    return probability_below(distance / sd) if sd > 0.0 else (distance >= 0.0).astype(float)
