"""Find the distances beyond the toe of the first face at which rocks stop, with their intervals.

The toe of a rock is the foot of the first face below its release, along the straight line in plan from its release to
its end (`terrain.faces`). At the foot, the ground becomes less steep for a metre, after a stretch that is steep and
high.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.report.run_files import Ends, RunFiles
from rpf3d_core.terrain.faces import FLAT, foot_of_face
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import HeightImage, height_image, heights_at
from rpf3d_core.unknowns.predictive import ranked_if_enough

MOST_ROCKS = 100_000
"""Largest number of rocks whose toe is searched; if there are more, an evenly spread selection is used."""
AT_ONCE = 200_000
"""Largest number of points on lines that are processed together, to limit memory."""
STEP = 0.25
"""Distance (m) between the points on a rock's line at which the toe is searched.

It is also the finest pixel of the image of the ground (`terrain.height_image`).
"""
NEAR = 50.0
"""Length (m) of the first part of a line to be searched; most faces end within this length."""
LEAST_REACH = 10.0
"""Smallest length (m) of the line on which the toe of a rock is searched."""
SHORTEST = 1.0
"""Runout (m) below which a rock gets the mean direction of the rocks of its source in place of its own direction."""
BEYOND = 1e9
"""Value (m) in place of the distance of a rock that did not stop, or of an unknown height; larger than any terrain."""
FEWEST_WITH_TOE, LEAST_WITH_TOE = 20, 0.05
"""Smallest number of rocks with a toe, and their smallest share (-) of all rocks, to state distances beyond the toe."""
DESIGN = 90
"""Percentage of the rocks that stop within the main distance of a report."""
FAR = 1e6
"""A resulting distance of at least this value (m) means that the rocks did not stop on the terrain."""


class ResultWithIntervals(NamedTuple):
    """A result with its 95 % sampling and predictive intervals; a value, end or interval that is not known is None."""

    value: float | None
    sampling: tuple[float | None, float | None] | None
    predictive: tuple[float | None, float | None] | None


class BeyondToe(NamedTuple):
    """The distances beyond the toe at which N rocks stop.

    The N rocks are the rocks with a toe among an evenly spread selection of all rocks.

    rows : (N,) rows of the rocks in `Ends`; along : (N, 2) unit vectors in plan, from release to end
    source : (N,) number of each rock's source
    toe : (N,) m from the release to the toe
    distance : (N,) m from the toe to the stop, negative before the toe, BEYOND if the rock did not stop
    shift : (N,) m, displacement of each rock along its line, drawn from the misfit for its parameter set; 0 without a
        misfit
    set : (N,) parameter set of each rock; None without unknowns
    further : (N,) True for a rock that went down a further face below the first one
    of : number of rocks whose toe was searched
    """

    rows: NDArray[np.int64]
    along: FloatArray
    source: NDArray[np.int64]
    toe: FloatArray
    distance: FloatArray
    shift: FloatArray
    set: NDArray[np.int64] | None
    further: NDArray[np.bool_]
    of: int

    @property
    def enough(self) -> bool:
        """True if enough rocks have a toe for the distances to describe all rocks of the run."""
        return bool(enough_with_toe(np.array(len(self.rows)), np.array(self.of)))

    def select(self, selected: NDArray[np.bool_], searched: int) -> "BeyondToe":
        """Return a `BeyondToe` with only the selected rocks.

        selected : (N,) True for the rocks to keep; searched : number of rocks in the selection whose toe was searched
        """
        arrays = {name: values[selected] for name, values in self._asdict().items() if isinstance(values, np.ndarray)}
        return self._replace(**arrays, of=searched)

    @property
    def displaced(self) -> FloatArray:
        """Distances (N,) m beyond the toe, displaced by draws of the misfit, for predictive intervals."""
        return self.distance + self.shift


def enough_with_toe(count: NDArray[np.int64], searched: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return flags (N,), one for each group of rocks: True if enough rocks have a toe to state distances beyond it.

    count : (N,) number of rocks of the group for which a toe was found
    searched : (N,) number of rocks of the group for which a toe was searched
    """
    fewest = np.maximum(1, np.minimum(FEWEST_WITH_TOE, searched))
    return np.asarray(count >= np.maximum(fewest, LEAST_WITH_TOE * searched))


def evenly_spread(rocks: int, most: int) -> NDArray[np.int64]:
    """Return the numbers (N,), from 0, of at most `most` rocks, evenly spread over all; rocks : number of all rocks."""
    return np.unique(np.linspace(0, rocks - 1, most).astype(np.int64))


def beyond_toe(run: RunFiles, selected: NDArray[np.int64] | None = None) -> BeyondToe:
    """Return the distances beyond the toe at which rocks stop; rocks with no face below their release are left out.

    selected : (R,) rows in `Ends` of the rocks whose toe is searched; None for an evenly spread selection of all rocks
    """
    rows = evenly_spread(len(run.ends.runout), MOST_ROCKS) if selected is None else selected
    of = len(rows)
    along = directions(run.ends)[rows]
    toe = toes(run, run.ends.release[rows], along, run.ends.runout[rows], run.ends.source[rows])
    distance = np.where(run.ends.at_rest[rows], run.ends.runout[rows] - toe, BEYOND)
    known = np.isfinite(toe)
    rows, along = rows[known], along[known]
    return BeyondToe(
        rows=rows, along=along, source=run.ends.source[rows], toe=toe[known], distance=distance[known],
        shift=_shift(run, rows, along),
        set=None if run.ends.set is None else run.ends.set[rows],
        further=_further(run, rows, along, toe[known]),
        of=of,
    )  # fmt: skip


def _further(run: RunFiles, rows: NDArray[np.int64], along: FloatArray, toe: FloatArray) -> NDArray[np.bool_]:
    """Return flags (N,): True for a rock that went down a further face between its toe and its end.

    rows : (N,) rows of the rocks in `Ends`
    along : (N, 2) unit vectors in plan; toe : (N,) m from the release
    """
    rest = run.ends.runout[rows] - toe
    further, on = np.zeros(len(rows), dtype=bool), np.flatnonzero(rest > FLAT)
    if len(on):
        start = run.ends.release[rows[on], :2] + toe[on, None] * along[on]
        ends = start + rest[on, None] * along[on]
        image = height_image(run.terrain, np.concatenate([start, ends]), LEAST_REACH)
        further[on] = np.isfinite(_feet(image, start, along[on], rest[on]))
    return further


def _shift(run: RunFiles, rows: NDArray[np.int64], along: FloatArray) -> FloatArray:
    """Return the distance (N,) m by which the misfit displaces the end of each rock along its line; 0 without a misfit.

    The distance is positive away from the release.

    rows : (N,) rows of the rocks in `Ends`; along : (N, 2) unit vectors in plan, from release to end
    """
    if run.moves is None or run.ends.set is None:
        return np.zeros(len(rows))
    return np.asarray((run.moves[run.ends.set[rows]] * along).sum(axis=1))


def directions(ends: Ends) -> FloatArray:
    """Return the unit vector (N, 2) in plan from the release to the end of each rock.

    Rocks with a runout below SHORTEST (1 m) get the mean direction of all rocks of their source, or (1, 0) if no rock
    of the source has moved.
    """
    way = ends.end[:, :2] - ends.release[:, :2]
    length = np.linalg.norm(way, axis=1)
    mean = np.empty_like(way)
    for mine in rows_of_sources(ends.source):
        total = way[mine].sum(axis=0)
        mean[mine] = total / np.linalg.norm(total) if np.any(total) else (1.0, 0.0)
    long = length >= SHORTEST
    return np.where(long[:, None], way / np.where(long, length, 1.0)[:, None], mean)


def rows_of_sources(source: NDArray[np.int64]) -> list[NDArray[np.int64]]:
    """Return for each source with rocks the positions (n,) of its rocks, ascending; source : (N,) of each rock."""
    order = np.argsort(source, kind="stable")
    return [rows for rows in np.split(order, np.flatnonzero(np.diff(source[order])) + 1) if len(rows)]


def toes(
    run: RunFiles, release: FloatArray, along: FloatArray, runout: FloatArray, source: NDArray[np.int64]
) -> FloatArray:
    """Return the distance (N,) m in plan from each release to the foot of the first face; NaN where there is none.

    The search ends at the largest of: the runout, the 95th percentile of the runouts of the source, LEAST_REACH.

    release : (N, 3) m; along : (N, 2) unit vectors; runout : (N,) m; source : (N,) number of each rock's source
    """
    if len(runout) == 0:
        return np.empty(0)
    length = np.empty_like(runout)
    for mine in rows_of_sources(source):
        length[mine] = np.maximum(runout[mine], max(float(np.percentile(runout[mine], 95)), LEAST_REACH))
    ends = release[:, :2] + length[:, None] * along
    image = height_image(run.terrain, np.concatenate([release[:, :2], ends]), LEAST_REACH)
    toe = _feet(image, release[:, :2], along, np.minimum(length, NEAR))
    # If no foot was found well within the first part of a line, the whole line is searched.
    again = np.flatnonzero((length > NEAR) & ~(toe < NEAR - FLAT - STEP))
    toe[again] = _feet(image, release[again, :2], along[again], length[again])
    return toe


def _feet(image: HeightImage, start: FloatArray, along: FloatArray, length: FloatArray) -> FloatArray:
    """Return the distance (N,) m from the start of each line to the foot of the first face; NaN where there is none.

    image : heights of the ground; start : (N, 2) m; along : (N, 2) unit vectors in plan; length : (N,) m
    """
    if len(length) == 0:
        return np.empty(0)
    distance = np.arange(0.0, float(length.max()) + STEP, STEP)
    rows, found = max(1, AT_ONCE // len(distance)), []
    for begin in range(0, len(length), rows):
        some = slice(begin, begin + rows)
        ground = heights_at(image, start[some, None, :] + distance[:, None] * along[some, None, :])
        for heights, end in zip(ground, length[some], strict=True):
            on = slice(0, int(end / STEP) + 2)
            found.append(foot_of_face(distance[on], heights[on]))
    return np.array(found)


class SetValues(NamedTuple):
    """Values (N,) of rocks for a predictive interval.

    set : (N,) number of each rock's parameter set; sets : number of parameter sets of the run
    """

    values: FloatArray
    set: NDArray[np.int64]
    sets: int


def percentile_of(values: FloatArray, wanted: int, set_values: SetValues | None) -> ResultWithIntervals:
    """Return a percentile of values (N,) of rocks, with its sampling interval and its predictive interval.

    The predictive interval includes the sampling interval. Without values, the percentile is None.

    wanted : the percentile, such as 90
    set_values : the values with parameter sets, displaced by the misfit if one is known; None without unknowns
    """
    if len(values) == 0:
        return ResultWithIntervals(value=None, sampling=None, predictive=None)
    sample = Sample(values)
    sampling = sample.interval(wanted)
    over = None if set_values is None else _over_sets(set_values.values, set_values.set, set_values.sets, wanted)
    return ResultWithIntervals(
        value=sample.percentiles((wanted,))[0], sampling=sampling,
        predictive=None if over is None else _holding(over, sampling),
    )  # fmt: skip


def held_beyond(beyond: BeyondToe, sets: int, wanted: int) -> ResultWithIntervals:
    """Return the distance (m) beyond the toe within which a wanted percentage of the rocks stops, with its intervals.

    All values are None if too few rocks have a toe. A rock has no toe if no face ends on its line below the release.

    wanted : the percentage, such as 90; sets : number of parameter sets
    """
    if not beyond.enough:
        return ResultWithIntervals(value=None, sampling=None, predictive=None)
    set_values = None if beyond.set is None else SetValues(values=beyond.displaced, set=beyond.set, sets=sets)
    return percentile_of(beyond.distance, wanted, set_values)


def _holding(
    over: tuple[float, float], sampling: tuple[float | None, float | None]
) -> tuple[float | None, float | None]:
    """Return a predictive interval: an interval over parameter sets, widened to include the sampling interval.

    An end is None if this end of the sampling interval is unknown.

    over : interval over the parameter sets; sampling : sampling interval, None for an unknown end
    """
    low, high = sampling
    return None if low is None else min(over[0], low), None if high is None else max(over[1], high)


def _over_sets(values: FloatArray, sets: NDArray[np.int64], count: int, wanted: int) -> tuple[float, float] | None:
    """Return the interval of a percentile over parameter sets; None if fewer than 39 sets have enough rocks.

    A set has enough rocks if at least one of its rocks is expected beyond the percentile.

    values : (N,); sets : (N,) parameter set of each value; count : number of parameter sets
    wanted : the percentile, such as 90
    """
    fewest = math.ceil(100.0 / (100.0 - wanted))
    each = np.full((count, 1), np.nan)
    for number in range(count):
        mine = values[sets == number]
        if len(mine) >= fewest:
            each[number, 0] = np.percentile(mine, wanted, method="inverted_cdf")
    low, high = ranked_if_enough(each)
    return None if math.isnan(low[0]) else (float(low[0]), float(high[0]))
