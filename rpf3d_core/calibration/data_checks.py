"""Refuse observations that cannot calibrate a scene: too few end points, or end points away from its terrain."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.density import LEAST_STOPS
from rpf3d_core.calibration.observations import Directions, Field
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.errors import InputError
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import extents
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.terrain.zones import in_plan

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

FEW_STOPS = 20
"""Number of observed stops below which a calibration warns that the stops are few."""


def check_field(scene: Scene, field: Field) -> None:
    """Refuse observations that consist of one or two end points (fewer than LEAST_STOPS) and nothing else.

    Observations without end points are accepted.

    Raises
    ------
    InputError
        There are too few end points; the message has their number and the smallest allowed number.
    """
    if 0 < len(field.stops) < LEAST_STOPS and not field.values and not field.counted:
        points = "1 end point is" if len(field.stops) == 1 else f"{len(field.stops)} end points are"
        raise InputError(f"{_points_file(scene)}: {points} too few for a calibration: the error of the model "
                         f"needs {LEAST_STOPS} or more, and {FEW_STOPS} are advised")  # fmt: skip


def check_stops(prepared: Prepared, directions: Directions, field: Field) -> None:
    """Refuse end points that all lie off the terrain.

    Raises
    ------
    InputError
        The message states where the end points lie, and where the terrain lies.
    """
    if len(field.stops) and len(off_terrain(prepared, directions, field)) == len(field.stops):
        plan = in_plan(prepared.terrain.frame, _local(directions, field))
        raise InputError(f"{_points_file(prepared.scene)}: no end point lies on the terrain: "
                         f"{extents(prepared.terrain, plan)}; end points must be in the coordinates of the "
                         "terrain")  # fmt: skip


def _points_file(scene: Scene) -> str:
    return str(scene.path if scene.observed is None else scene.observed.points_file)


def off_terrain(prepared: Prepared, directions: Directions, field: Field) -> IntArray:
    """Return the numbers (K,), from 1, of the observed stops that have no terrain below or above them."""
    return without_ground(prepared, _local(directions, field))


def without_ground(prepared: Prepared, points: FloatArray) -> IntArray:
    """Return the numbers (K,), from 1, of the points (N, 3) m, local frame, with no terrain below or above them."""
    if not len(points):
        return np.empty(0, dtype=np.int64)
    top = points.copy()
    top[:, 2] = prepared.engine.facets.high[2] + ABOVE_EVERYTHING
    return np.flatnonzero(prepared.engine.ground_below(top)[:, 1] < 0) + 1


def _local(directions: Directions, field: Field) -> FloatArray:
    """Return the observed stops (N, 3) m in the local frame, with the height 0."""
    return np.asarray((field.stops - directions.origin) @ directions.axes)
