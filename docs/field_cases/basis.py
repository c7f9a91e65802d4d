"""Measure end points of field and simulation with the same function, `measured_from`.

Every distance begins at a place of the field: the mean drop point, or the release of a run. No function here uses the
release of a simulated rock. Only the end points of field blocks are known, so their spread contains the spread of the
releases. If distances of simulated rocks began at their own releases, their spread would not contain it.
"""

from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray


class Axes(NamedTuple):
    """Unit vectors (3,) in the coordinates of the input: along the profile of a site, across the profile, upwards."""

    along: FloatArray
    across: FloatArray
    up: FloatArray


class EndPoints(NamedTuple):
    """N end points as distances and angles from a start, such as the mean drop point.

    along, across : (N,) m, horizontal; runout : (N,) m, horizontal distance
    reach_angle : (N,) degrees, slope of the line from the start to the end point
    """

    along: FloatArray
    across: FloatArray
    runout: FloatArray
    reach_angle: FloatArray


def measured_from(start: FloatArray, ends: FloatArray, axes: Axes) -> EndPoints:
    """Return end points (N, 3) m as distances and angles from a start of the field, (3,) or (N, 3) m."""
    way = ends - start
    along, across, up = (way @ axis for axis in axes)
    runout = np.hypot(along, across)
    return EndPoints(along, across, runout, np.degrees(np.arctan2(-up, runout)))


def horizontal_axes(start: FloatArray, end: FloatArray) -> Axes:
    """Return the axes of a profile from a start (3,) m to an end (3,) m; z is up, `across` points to the left.

    Start and end must differ in plan.
    """
    x, y = (end - start)[:2] / np.linalg.norm((end - start)[:2])
    return Axes(np.array([x, y, 0.0]), np.array([-y, x, 0.0]), np.array([0.0, 0.0, 1.0]))


def mean_and_sd(values: FloatArray) -> tuple[float, float]:
    """Return the mean and the sample standard deviation of values (N,)."""
    return float(values.mean()), float(values.std(ddof=1))
