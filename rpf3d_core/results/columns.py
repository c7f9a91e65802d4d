"""Make the columns that several tables of a run share, and state the units of columns."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.results.orientations import orientations_to_input
from rpf3d_core.simulation.record import FIRST_OBSTACLE
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.values import Mode, Outcome

QUATERNION = ("q_w", "q_x", "q_y", "q_z")
"""Names of the four columns of an orientation, a unit quaternion."""

UNITS = {
    "t": "s", "x": "m", "y": "m", "z": "m", "path_m": "m", "runout_m": "m", "max_height": "m",
    "max_speed": "m/s", "entered_ground_at_speed": "m/s", "speed": "m/s", "speed_in": "m/s", "speed_out": "m/s",
    "max_energy_j": "J", "energy_in_j": "J", "energy_out_j": "J",
    "max_rotational_energy_j": "J", "max_total_energy_j": "J",
    "spin_in": "rad/s", "spin_out": "rad/s", "rotational_energy_in_j": "J", "total_energy_in_j": "J",
    "mass_kg": "kg", "diameter_m": "m", "release_x": "m", "release_y": "m", "release_z": "m",
}  # fmt: skip


def zones_of_facets(terrain: Terrain, facet: NDArray[np.integer]) -> NDArray[np.integer]:
    """Return the index (N,) of the zone in which each facet lies; -1 for a negative facet.

    facet : (N,) facet of the terrain that each rock touched, or a negative number if the rock touched none
    """
    return np.where(facet < 0, -1, terrain.zone[np.maximum(facet, 0)])


def struck_of(facet: NDArray[np.integer], obstacles: Obstacles) -> NDArray[np.integer]:
    """Return the target (I,) of each impact: 0 for the ground, 1 + k for the obstacle named `obstacles.names[k]`.

    facet : (I,) struck facet of the terrain or, for an obstacle, FIRST_OBSTACLE minus the number of the obstacle (< 0)
    """
    struck = np.zeros(len(facet), dtype=np.int64)
    met = facet < 0
    struck[met] = obstacles.owner[FIRST_OBSTACLE - facet[met]] + 1
    return struck


def lower_names(names: type[Outcome] | type[Mode]) -> list[str]:
    """Return the names of outcomes or modes as the files spell them, in lower case, in the order of their numbers."""
    return [member.name.lower() for member in names]


def xyz_of(points: FloatArray, prefix: str = "") -> dict[str, FloatArray]:
    """Return points (N, 3) as three columns of a table, one for each axis; prefix : start of the columns' names."""
    return {f"{prefix}{axis}": points[:, i] for i, axis in enumerate("xyz")}


def quaternions_of(terrain: Terrain, q: FloatArray | None) -> dict[str, FloatArray]:
    """Return orientations as four columns of a table, relative to the input's axes; {} if q is None.

    q : (N, 4) quaternions w, x, y, z in the local frame
    """
    if q is None:
        return {}
    return dict(zip(QUATERNION, orientations_to_input(terrain.frame, q).T, strict=True))
