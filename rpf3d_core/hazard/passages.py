"""Passages per metre: how often a falling rock passes a metre of width on average, whatever the cell size.

The unit is passages per metre of width, per falling rock. `reach_probability` refers to a whole cell, so it grows with
the cell. The number of passages per metre is the density of the rocks' paths in plan (length over area,
`hazard.walks.ways`), whose definition has no cell. Take the width of an object across the rocks' path plus the rock's
own diameter. This width times the passages per metre is the number of hits on the object per falling rock. The number
of hits is the object's reach probability if the object is narrower than the scale on which the density changes, and if
rocks do not return.
"""

from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.statistics import wilson_intervals
from rpf3d_core.hazard.maps import HazardMaps, StatisticArray
from rpf3d_core.hazard.walks.ways import SQUARE, WAY
from rpf3d_core.terrain.frame import FloatArray


class Passage(NamedTuple):
    """Passages per metre in the S cells that rocks reached, with their uncertainty.

    value : (S,) 1/m; low, high : (S,) 1/m, the ends of the value's 95 % interval
    """

    value: StatisticArray
    low: StatisticArray
    high: StatisticArray


def passage_per_metre(maps: HazardMaps) -> Passage:
    """Return the passages per metre (S,) 1/m of map cells, with intervals, from the path lengths counted there.

    The value is the mean over N rocks of l / A, the length l of each rock's path in the cell over the cell's area A.
    With k = (sum of l)^2 / sum of l^2, the relative variance of that mean is (N / k - 1) / N. A share of k out of N
    rocks has the same relative variance. So the interval is the Wilson interval of this share, scaled to the value. If
    the paths of all rocks that cross the cell have one length, k is the number of these rocks. If all lengths in a cell
    are 0, the interval is computed from a share of 0 out of N rocks whose paths are one cell width long.

    Raises
    ------
    ValueError
        The maps were made without path lengths.
    """
    if not maps.cells.has_ways:
        raise ValueError("these maps have no passages per metre: their tallies did not gather ways (`with_ways`)")
    rocks, cell = max(maps.flown, 1), maps.raster.cell
    way, square = maps.cells.ways[:, WAY], maps.cells.ways[:, SQUARE]
    went = (way > 0.0) & (square > 0.0)
    alike = np.minimum(np.divide(way * way, square, out=np.zeros(len(way)), where=went), rocks)
    length: FloatArray = np.divide(way, alike, out=np.ones(len(way)), where=went)
    low, high = wilson_intervals(alike, rocks)
    return Passage(value=way / (rocks * cell), low=low * length / cell, high=high * length / cell)


def reached_over(maps: HazardMaps, width: float) -> FloatArray:
    """Return, for each of S cells, the share (S,) (-) of all rocks that would hit an object in the cell; at most 1.

    width : width of the object across the rocks' path, plus the diameter of a rock (m)
    """
    return np.minimum(passage_per_metre(maps).value * width, 1.0)
