"""Find how far beyond the toe of the face rocks stop, and how fast and high they pass there.

The toe of a rock is the foot of the first face below its release, along the straight line in plan from its release to
its end (`terrain.faces`): where the ground is less steep for a metre after a stretch that is steep and high.
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
"""Largest number of rocks whose toe is searched; more are represented by an even selection."""
AT_ONCE = 200_000
"""Number of points on lines that are processed together, which limits the memory."""
STEP = 0.25
"""Distance (m) between points on the line of a rock, from which the toe is found: the finest pixel of the ground."""
NEAR = 50.0
"""Length (m) of the line that is searched first, because most faces end before it."""
LEAST_REACH = 10.0
"""Least length (m) of the line on which the toe of a rock is searched."""
SHORTEST = 1.0
"""Runout (m) below which the direction of a rock is not its own, but the mean of all rocks."""
BEYOND = 1e9
"""Distance (m) that stands for rocks that did not stop: farther than any terrain."""
DESIGN = 90
"""The percentile that the summary of a report states: the distance that holds 90 % of the rocks."""
FAR = 1e6
"""Distance (m) from which a result means beyond the terrain."""


class Figure(NamedTuple):
    """A result with both 95 % intervals; an end or interval that is not known is None."""

    value: float | None
    sampling: tuple[float | None, float | None] | None
    predictive: tuple[float | None, float | None] | None


class BeyondToe(NamedTuple):
    """How far N rocks, an even selection of all, stop beyond the toe.

    rows : (N,) rows of the rocks in `Ends`; along : (N, 2) unit vectors in plan
    toe : (N,) m from the release to the toe; distance : (N,) m beyond the toe, negative before it, BEYOND if the rock
        did not stop
    shift : (N,) m by which the displacement of a rock's parameter set moves its path along its line; 0 without a misfit
    set : (N,) parameter set of each rock; None without unknowns
    further : (N,) True for a rock that went down a further face below the first one
    """

    rows: NDArray[np.int64]
    along: FloatArray
    toe: FloatArray
    distance: FloatArray
    shift: FloatArray
    set: NDArray[np.int64] | None
    further: NDArray[np.bool_]

    @property
    def displaced(self) -> FloatArray:
        """Distances (N,) m beyond the toe as predictive intervals take them: with a draw of the model's misfit."""
        return self.distance + self.shift


def beyond_toe(run: RunFiles) -> BeyondToe:
    """Return how far rocks stop beyond the toe; rocks that have no face below them are left out."""
    rows = np.unique(np.linspace(0, len(run.ends.runout) - 1, MOST_ROCKS).astype(np.int64))
    along = directions(run.ends)[rows]
    toe = toes(run, run.ends.release[rows], along, run.ends.runout[rows])
    distance = np.where(run.ends.at_rest[rows], run.ends.runout[rows] - toe, BEYOND)
    known = np.isfinite(toe)
    rows, along = rows[known], along[known]
    return BeyondToe(
        rows=rows, along=along, toe=toe[known], distance=distance[known], shift=_shift(run, rows, along),
        set=None if run.ends.set is None else run.ends.set[rows],
        further=_further(run, rows, along, toe[known]),
    )  # fmt: skip


def _further(run: RunFiles, rows: NDArray[np.int64], along: FloatArray, toe: FloatArray) -> NDArray[np.bool_]:
    """Return flags (N,): a rock went on beyond its toe (m) and down a further face, on its line (N, 2) to its end."""
    rest = run.ends.runout[rows] - toe
    further, on = np.zeros(len(rows), dtype=bool), np.flatnonzero(rest > FLAT)
    if len(on):
        start = run.ends.release[rows[on], :2] + toe[on, None] * along[on]
        ends = start + rest[on, None] * along[on]
        image = height_image(run.terrain, np.concatenate([start, ends]), LEAST_REACH)
        further[on] = np.isfinite(_feet(image, start, along[on], rest[on]))
    return further


def _shift(run: RunFiles, rows: NDArray[np.int64], along: FloatArray) -> FloatArray:
    """Return by how much (N,) m the misfit of the model moves rocks along their lines (N, 2)."""
    if run.moves is None or run.ends.set is None:
        return np.zeros(len(rows))
    return np.asarray((run.moves[run.ends.set[rows]] * along).sum(axis=1))


def directions(ends: Ends) -> FloatArray:
    """Return the direction (N, 2) in plan from the release to the end of each rock; the mean of all for short ones."""
    way = ends.end[:, :2] - ends.release[:, :2]
    length = np.linalg.norm(way, axis=1)
    mean = way.sum(axis=0)
    mean = mean / np.linalg.norm(mean) if np.any(mean) else np.array([1.0, 0.0])
    long = length >= SHORTEST
    return np.where(long[:, None], way / np.where(long, length, 1.0)[:, None], mean)


def toes(run: RunFiles, release: FloatArray, along: FloatArray, runout: FloatArray) -> FloatArray:
    """Return the distance (N,) m in plan from each release to the foot of the first face; NaN where there is none.

    release : (N, 3) m; along : (N, 2) unit vectors; runout : (N,) m, by which the search is limited
    """
    if len(runout) == 0:
        return np.empty(0)
    length = np.maximum(runout, max(float(np.percentile(runout, 95)), LEAST_REACH))
    ends = release[:, :2] + length[:, None] * along
    image = height_image(run.terrain, np.concatenate([release[:, :2], ends]), LEAST_REACH)
    toe = _feet(image, release[:, :2], along, np.minimum(length, NEAR))
    # A face that goes on, or a line that goes on, may end farther away.
    again = np.flatnonzero((length > NEAR) & ~(toe < NEAR - FLAT - STEP))
    toe[again] = _feet(image, release[again, :2], along[again], length[again])
    return toe


def _feet(image: HeightImage, start: FloatArray, along: FloatArray, length: FloatArray) -> FloatArray:
    """Return the distance (N,) m to the foot of the first face on lines from points (N, 2) m; NaN where there is none.

    along : (N, 2) unit vectors; length : (N,) m of the lines
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
    """Values (N,) of rocks from which a predictive interval is taken; set : (N,) of each; sets : number of sets."""

    values: FloatArray
    set: NDArray[np.int64]
    sets: int


def percentile_of(values: FloatArray, wanted: int, set_values: SetValues | None) -> Figure:
    """Return a percentile of values (N,) of rocks, with its sampling interval and its interval over parameter sets.

    wanted : such as 90; set_values : the values with the misfit, as far as it is known; None without unknowns

    The predictive interval holds the sampling interval.
    """
    if len(values) == 0:
        return Figure(value=None, sampling=None, predictive=None)
    sample = Sample(values)
    sampling = sample.interval(wanted)
    over = None if set_values is None else _over_sets(set_values.values, set_values.set, set_values.sets, wanted)
    return Figure(
        value=sample.percentiles((wanted,))[0], sampling=sampling,
        predictive=None if over is None else _holding(over, sampling),
    )  # fmt: skip


def held_beyond(beyond: BeyondToe, sets: int, wanted: int) -> Figure:
    """Return the distance (m) beyond the toe that holds a percentage of the rocks; sets : number of parameter sets."""
    set_values = None if beyond.set is None else SetValues(values=beyond.displaced, set=beyond.set, sets=sets)
    return percentile_of(beyond.distance, wanted, set_values)


def _holding(
    over: tuple[float, float], sampling: tuple[float | None, float | None]
) -> tuple[float | None, float | None]:
    """Return an interval over parameter sets that holds the sampling interval; an end without a bound stays so."""
    low, high = sampling
    return None if low is None else min(over[0], low), None if high is None else max(over[1], high)


def _over_sets(values: FloatArray, sets: NDArray[np.int64], count: int, wanted: int) -> tuple[float, float] | None:
    """Return the predictive interval of a percentile; None if fewer than 39 sets have rocks enough for it.

    A set has rocks enough if at least one is expected beyond the percentile.
    """
    fewest = math.ceil(100.0 / (100.0 - wanted))
    each = np.full((count, 1), np.nan)
    for number in range(count):
        mine = values[sets == number]
        if len(mine) >= fewest:
            each[number, 0] = np.percentile(mine, wanted, method="inverted_cdf")
    low, high = ranked_if_enough(each)
    return None if math.isnan(low[0]) else (float(low[0]), float(high[0]))
