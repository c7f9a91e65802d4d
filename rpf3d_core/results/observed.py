"""Compare simulated deposits with end points observed in the field.

Only horizontal coordinates are compared, because field surveys and meshes often differ in vertical datum (by 2.3 m in
the published data of the quarry Authume, a field case of docs/explanation/validation.md).
"""

from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.samples import Sample
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.formats.points import read_points
from rpf3d_core.scene.model import ObservedSpec
from rpf3d_core.setup.observed import horizontal_direction
from rpf3d_core.terrain.frame import Frame

FINE_PERCENTILES = (5, 10, 25, 50, 75, 90, 95)


def compare(observed: ObservedSpec, frame: Frame, stops: Sample) -> dict[str, Any]:
    """Compare simulated with observed end points along a horizontal direction; return both distributions.

    Positions in the result are in m, in the input's coordinates.

    Parameters
    ----------
    observed : the observed end points, and the direction; frame : local frame of the terrain
    stops : positions (m) of the simulated deposits along the direction, relative to the origin of the local frame

    Raises
    ------
    InputError
        The points file is damaged, or `along` is vertical.
    """
    along = horizontal_direction(observed.along, frame.up)
    field = Sample((read_points(observed.points_file, frame.up, heights=False) - _origin(frame)) @ along)
    known = field.count > 0 and stops.count > 0
    return {
        "file": observed.points_file.name,
        "along": along.tolist(),
        "compared": "horizontal position (m) along this direction of the input; heights are not compared",
        "field": _distribution(field, observed, frame),
        "simulated": _distribution(stops, observed, frame),
        "mean_difference_m": stops.mean() - field.mean() if known else None,
    }


def _origin(frame: Frame) -> FloatArray:
    """Return the origin (3,) m of the local frame, in the axes of the input."""
    return frame.directions_to_input(np.array(frame.origin))


def _distribution(position: Sample, observed: ObservedSpec, frame: Frame) -> dict[str, Any]:
    """Return the distribution of end points along a direction, in the input's coordinates (m).

    The result has percentiles, mean and standard deviation, and the share of rocks in each section of the scene. A
    section is a named range of distances along the direction (`observed.sections`).

    position : end points (m) along the direction, relative to the origin of the local frame
    """
    count = position.count
    origin = float(_origin(frame) @ horizontal_direction(observed.along, frame.up))
    summary = position.summary(FINE_PERCENTILES)
    shifted = {name: value if name == "rocks" or value is None else value + origin for name, value in summary.items()}
    values, counts = position.sorted()
    return {
        **shifted,
        "min": position.low + origin if count else None,
        "mean": position.mean() + origin if count else None,
        "sd": position.sd() if count > 1 else None,
        "sections": {
            name: share_of(_number_between(values + origin, counts, low, high), count)
            for name, (low, high) in observed.sections.items()
        },
    }


def _number_between(position: FloatArray, counts: IntArray, low: float | None, high: float | None) -> int:
    """Return the number of rocks that ended at a position of at least `low` and less than `high` (m).

    position : (N,) m, distinct positions along the direction; counts : (N,) number of rocks that ended at each
    low, high : m; None for no limit
    """
    above = position >= (-np.inf if low is None else low)
    return int(counts[above & (position < (np.inf if high is None else high))].sum())
