"""Names and places of the obstacles of a scene, for the code that writes and draws them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The obstacles of a scene (barriers and trees), N of them, numbered over all effects.

    names : such as "barriers.fence_1" or "forest"; owner : (N,) for each obstacle, the index of its name in `names`
    lines : name and points (P, 3) m along the foot of each obstacle that is a line
    stems : (T, 4) m, foot (x, y, z) and diameter of each tree

    Coordinates are in the terrain's local frame.
    """

    names: tuple[str, ...]
    owner: NDArray[np.int64]
    lines: tuple[tuple[str, FloatArray], ...]
    stems: FloatArray


def all_of(parts: Sequence[Obstacles]) -> Obstacles:
    """Return the obstacles of several effects in one record, numbered consecutively."""
    names = tuple(name for part in parts for name in part.names)
    before = np.cumsum([0, *(len(part.names) for part in parts)])
    owners = [part.owner + n for part, n in zip(parts, before[:-1], strict=True)]
    lines = tuple(line for part in parts for line in part.lines)
    return Obstacles(
        names, np.concatenate([NO_OBSTACLES.owner, *owners]), lines,
        np.concatenate([NO_OBSTACLES.stems, *(part.stems for part in parts)]),
    )  # fmt: skip


NO_OBSTACLES = Obstacles((), np.empty(0, dtype=np.int64), (), np.empty((0, 4)))
