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

    Columns that the scene does not need (`Needed`) may be None: mass and radius together, source and rock together.
    """

    x: Floats
    v: Floats
    source: Integers | None
    rock: Integers | None
    mass: Floats | None
    radius: Floats | None
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


class Needed(NamedTuple):
    """The data of each rock that the models, effects and materials of a scene need.

    sizes : True if mass and radius are needed; keys : True if random numbers are drawn, which source and rock select
    """

    sizes: bool
    keys: bool


def needed_by(parts: Sequence[Any], materials: Any) -> Needed:
    """Return the data of each rock that a scene needs.

    parts : parameters of the models and effects of the scene; materials : surface properties of the zones
    """
    drawn = not isinstance(materials, Materials) or any(getattr(part, "draws", False) for part in parts)
    return Needed(sizes=any(getattr(part, "asks_rock", False) for part in parts), keys=drawn)


def launches_of(needed: Needed, seed: int, starts: Starts) -> Launches:
    """Return the rocks of an ensemble at their release, as the flight loop reads them.

    Sizes or keys are None if they are not needed.

    needed : the data that the scene needs, from `needed_by`; seed : seed of all random numbers; starts : the rocks
    """
    sizes = RockColumns(starts.mass, starts.radius) if needed.sizes else None
    keys = RockKeys(seed=seed, source=starts.source, rock=starts.rock) if needed.keys else None
    return Launches(x=starts.x, v=starts.v, sizes=sizes, keys=keys, shape=starts.shape, pose=starts.pose)
