"""Comparison of simulated deposits with end points seen in the field.

Only horizontal coordinates are compared: field surveys and meshes often differ in vertical datum (reference/
validation.md section 1: by 2.3 m at Authume).
"""

from typing import Any

import numpy as np

from rpf3d_core.ensemble.flights import Deposits, FloatArray
from rpf3d_core.ensemble.statistics import percentiles, share_of
from rpf3d_core.errors import InputError
from rpf3d_core.io.point_files import read_points
from rpf3d_core.io.scene_model import ObservedSpec
from rpf3d_core.terrain.frame import Frame, Up
from rpf3d_core.values import DEPOSITED

FINE_PERCENTILES = (5, 10, 25, 50, 75, 90, 95)


def compare(observed: ObservedSpec, frame: Frame, deposits: Deposits) -> dict[str, Any]:
    """Where field and simulated rocks stopped, as position (m) along a horizontal direction of the input.

    Raises
    ------
    InputError
        If the points file is damaged, or `along` is vertical.
    """
    along = horizontal_direction(observed.along, frame.up)
    at_rest = np.isin(deposits.outcome, DEPOSITED)
    field = read_points(observed.points_file) @ along
    simulated = frame.points_to_input(deposits.x[at_rest]) @ along
    return {
        "file": observed.points_file.name,
        "along": along.tolist(),
        "compared": "horizontal position (m) along this direction of the input; heights are not compared",
        "field": _distribution(field, observed),
        "simulated": _distribution(simulated, observed),
        "mean_difference_m": float(simulated.mean() - field.mean()) if len(simulated) else None,
    }


def horizontal_direction(along: tuple[float, float, float], up: Up) -> FloatArray:
    """Unit vector (3,) of the horizontal part of a direction in the input's axes."""
    vertical = 2 if up == "z" else 1
    flat = np.array([0.0 if axis == vertical else value for axis, value in enumerate(along)])
    length = float(np.linalg.norm(flat))
    if length == 0.0:
        raise InputError(f"`observed.along` is {list(along)}, which is vertical; it must have a horizontal part")
    return flat / length


def _distribution(position: FloatArray, observed: ObservedSpec) -> dict[str, Any]:
    """Mean, standard deviation of the sample, percentiles and the share of each section, of positions (N,)."""
    count = len(position)
    return {
        **percentiles(position, FINE_PERCENTILES),
        "min": float(position.min()) if count else None,
        "mean": float(position.mean()) if count else None,
        "sd": float(position.std(ddof=1)) if count > 1 else None,
        "sections": {
            name: share_of(_number_between(position, low, high), count)
            for name, (low, high) in observed.sections.items()
        },
    }


def _number_between(position: FloatArray, low: float | None, high: float | None) -> int:
    """Number of positions (N,) in [low, high)."""
    above = position >= (-np.inf if low is None else low)
    return int((above & (position < (np.inf if high is None else high))).sum())
