"""The rocks of an ensemble at their release, in the arrays that an engine reads."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.materials.library import Materials
from rpf3d_core.materials.rock_context import RockColumns, RockKeys

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Starts(NamedTuple):
    """R rocks at their release: x (R, 3) m, v (R, 3) m/s, mass (R,) kg and radius (R,) m.

    source, rock : (R,) number of the source, and of the rock in this source; both select the rock's random numbers
    shape, pose : for bodies with a shape, (R,) number of the shape and (R, 4) orientation q_w, q_x, q_y, q_z; else None
    """

    x: Floats
    v: Floats
    source: Integers
    rock: Integers
    mass: Floats
    radius: Floats
    shape: Integers | None = None
    pose: Floats | None = None


class Launches(NamedTuple):
    """The rocks as the flight loop reads them at their release, with only the columns that the scene needs.

    x : (R, 3) m; v : (R, 3) m/s; sizes : masses (kg) and radii (m), None if not needed
    keys : keys of the random numbers, None if not needed
    shape, pose : for bodies with a shape, (R,) number of the shape and (R, 4) orientation; else None
    """

    x: Any
    v: Any
    sizes: RockColumns | None
    keys: RockKeys | None
    shape: Any = None
    pose: Any = None


def launches_of(parts: Sequence[Any], materials: Any, seed: int, starts: Starts) -> Launches:
    """Return the rocks of an ensemble at their release, as the flight loop reads them.

    Sizes or keys are None if no model or material of the scene needs them.

    parts : parameters of the models and effects of the scene; seed : seed of all random numbers
    materials : surface properties of the zones; starts : the rocks
    """
    asked = any(getattr(part, "asks_rock", False) for part in parts)
    drawn = not isinstance(materials, Materials) or any(getattr(part, "draws", False) for part in parts)
    sizes = RockColumns(starts.mass, starts.radius) if asked else None
    keys = RockKeys(seed=seed, source=starts.source, rock=starts.rock) if drawn else None
    return Launches(x=starts.x, v=starts.v, sizes=sizes, keys=keys, shape=starts.shape, pose=starts.pose)
