"""Names and places of the obstacles of a scene, for the code that writes and draws them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray


class Wall(NamedTuple):
    """The upright surface of a barrier, for views; vertices : (V, 3) m, local frame; triangles : (F, 3)."""

    vertices: FloatArray
    triangles: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Obstacles:
    """The obstacles of a scene (barriers and trees), N of them, numbered over all effects.

    names : such as "barriers.fence_1" or "forest"; several obstacles may share a name
    owner : (N,) for each obstacle, the index of its name in `names`
    lines : name and points (P, 3) m along the foot of each obstacle that is a line
    stems : (T, 4) m, foot (x, y, z) and diameter of each tree
    heights : height (m) of the panel on each line in `lines`

    Coordinates are in the terrain's local frame.
    """

    names: tuple[str, ...]
    owner: NDArray[np.int64]
    lines: tuple[tuple[str, FloatArray], ...]
    stems: FloatArray
    heights: tuple[float, ...] = ()

    @property
    def walls(self) -> list[Wall]:
        """The vertical surfaces of all obstacles that stand along a line and are higher than 0."""
        return [
            standing_wall(foot, height)
            for (_, foot), height in zip(self.lines, self.heights, strict=False) if height > 0.0
        ]  # fmt: skip


def standing_wall(foot: FloatArray, height: float) -> Wall:
    """Return the surface of a vertical wall.

    foot : (P, 3) m, P >= 2, points along the foot of the wall; height : of the wall (m)
    """
    points = len(foot)
    first = np.arange(points - 1)
    lower = np.stack([first, first + 1, first + points], axis=1)
    upper = np.stack([first + 1, first + points + 1, first + points], axis=1)
    vertices = np.concatenate([foot, foot + np.array([0.0, 0.0, height])])
    return Wall(vertices=vertices, triangles=np.concatenate([lower, upper]).astype(np.int32))


def all_of(parts: Sequence[Obstacles]) -> Obstacles:
    """Return the obstacles of several effects in one record, numbered in the order of the effects."""
    names = tuple(name for part in parts for name in part.names)
    before = np.cumsum([0, *(len(part.names) for part in parts)])
    owners = [part.owner + n for part, n in zip(parts, before[:-1], strict=True)]
    lines = tuple(line for part in parts for line in part.lines)
    return Obstacles(
        names, np.concatenate([NO_OBSTACLES.owner, *owners]), lines,
        np.concatenate([NO_OBSTACLES.stems, *(part.stems for part in parts)]),
        tuple(height for part in parts for height in part.heights),
    )  # fmt: skip


NO_OBSTACLES = Obstacles((), np.empty(0, dtype=np.int64), (), np.empty((0, 4)))
