"""Screening by Morris: how much a result changes on average if one unknown changes by two thirds of its range.

Sources
-------
Morris 1991, Technometrics 33:161-174: elementary effects along random trajectories on a grid.
Campolongo, Cariboni & Saltelli 2007, Environ. Model. Softw. 22:1509-1518: the mean of their absolute values, mu*.

The range of an unknown is measured in quantiles of its prior, from 0 to 1. mu* is a change per whole range of the
unknown. Here, mu* is multiplied by the step that was flown, two thirds of the range, because mu* alone can be larger
than any possible change: if a share changes from 0 to 1 in a step, mu* is 150 %.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEVELS = 4
"""Number of levels of each unknown in the grid of the trajectories."""
STEP = LEVELS / (2.0 * (LEVELS - 1.0))
"""Step (-) of an unknown's quantile: two thirds of the range, so that all levels are equally likely."""
REDRAWS = 1000
"""Number of times that the trajectories are drawn again, for intervals."""
ENDS = (2.5, 97.5)
"""Percentiles at the ends of the 95 % intervals."""


class Effects(NamedTuple):
    """Effects of U unknowns on Y results.

    size : (U, Y) mean absolute change of the result, in the unit of the result, if the unknown moves by STEP (2/3) of
        its range: Morris' mu* times STEP
    low, high : (U, Y) ends of the 95 % interval of `size`
    spread : (U, Y) standard deviation of the changes, which shows curvature and interactions
    """

    size: FloatArray
    low: FloatArray
    high: FloatArray
    spread: FloatArray


def trajectories(count: int, unknowns: int, seed: int) -> FloatArray:
    """Return random trajectories (T, U + 1, U) (-) in the unit cube; each step moves one unknown by STEP (2/3).

    Each coordinate is one of LEVELS (4) evenly spaced levels from 0 to 1.

    count : number T of trajectories; unknowns : number U of unknowns; seed : of the random numbers
    """
    random = np.random.Generator(np.random.Philox(key=[seed, 2**33]))
    paths = np.empty((count, unknowns + 1, unknowns))
    for path in paths:
        low = random.integers(0, LEVELS // 2, unknowns) / (LEVELS - 1.0)
        up = random.random(unknowns) < 0.5
        path[0] = np.where(up, low, low + STEP)
        for row, unknown in enumerate(random.permutation(unknowns), start=1):
            path[row] = path[row - 1]
            path[row, unknown] += STEP if up[unknown] else -STEP
    return paths


def effects_of(paths: FloatArray, results: FloatArray, seed: int) -> Effects:
    """Return the effects of U unknowns on Y results, with intervals by the bootstrap over the trajectories.

    paths : (T, U + 1, U) (-) trajectories; results : (T, U + 1, Y) at the points of the trajectories
    seed : of the random draws for the intervals
    """
    moved = np.argmax(np.abs(np.diff(paths, axis=1)), axis=2)
    up = np.sign(np.take_along_axis(np.diff(paths, axis=1), moved[:, :, None], axis=2))
    changes = np.empty((len(paths), paths.shape[2], results.shape[2]))
    np.put_along_axis(changes, moved[:, :, None], np.diff(results, axis=1) * up, axis=1)
    random = np.random.Generator(np.random.Philox(key=[seed, 2**33 + 1]))
    again = np.stack([np.abs(changes[random.integers(0, len(paths), len(paths))]).mean(axis=0) for _ in range(REDRAWS)])
    low, high = np.percentile(again, ENDS, axis=0)
    return Effects(size=np.abs(changes).mean(axis=0), low=low, high=high, spread=changes.std(axis=0, ddof=1))
