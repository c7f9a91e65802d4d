"""What one run leaves for publishing: columns of numbers in the map frame, no messages."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import NDArray

from rpf3d_core.live.zones import ShownZone

Columns = Mapping[str, NDArray[Any]]
"""Channel name -> (N,) values; x, y, z in m, t in s, speed in m/s, energy in J, rock counted from 0."""


@dataclass(frozen=True, eq=False)
class Results:
    """trajectories : x, y, z, t, rock, speed, energy; grouped by rock, in order of time
    impacts : x, y, z, t, rock, speed, energy, just before each impact
    deposits : x, y, z, t, rock, runout, speed, energy; the greatest speed and energy of each rock that stayed
    hazard : zones, those that rocks only passed first
    """

    trajectories: Columns
    impacts: Columns
    deposits: Columns
    hazard: Sequence[ShownZone]
