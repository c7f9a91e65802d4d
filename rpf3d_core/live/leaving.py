"""Count the rocks that left the terrain and may have reached an area of interest over unknown ground.

A rock that leaves over the boundary of the survey, or into a hole, may move on over unknown ground in any direction:
for example, a ditch may lead the rock around a dump. Such a rock counts for an area, unless one of these is true:

- Its path had a part inside the area before the rock left, so the rock is counted as arrived.
- Its energy does not suffice to climb to the lowest ground of the area.
"""

import threading
from collections.abc import Callable, Sequence

import numpy as np

from rpf3d_core.alerts.evidence import LEFT
from rpf3d_core.ensemble.batch import Batch, only
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.spin import spins_squared
from rpf3d_core.live.areas import AreaOutline

CODES = [int(outcome) for outcome in LEFT]

Displace = Callable[[Batch], Batch]
"""A function that returns a batch with displaced paths."""


class LeavingTally:
    """Counts, for each area of interest, rocks that left the terrain and may have reached the area; thread-safe."""

    def __init__(self, areas: Sequence[AreaOutline], lowest: Sequence[float], gravity: float) -> None:
        """Create the counts, with no rocks counted.

        areas : the A areas of interest
        lowest : height (m, local frame) of the lowest ground of each area, -infinite if unknown
        gravity : m/s^2, of the scene
        """
        self._areas, self._lowest, self._gravity = areas, lowest, gravity
        self._lock = threading.Lock()
        self.counts: IntArray = np.zeros(len(areas), dtype=np.int64)

    def count(self, batch: Batch, radius: FloatArray, displace: Displace | None = None) -> None:
        """Count, for each area, the rocks of a batch that left the terrain and may have reached the area.

        A rock is not counted if it arrived in the area before it left, or if its energy cannot lift it to the area.

        batch : N rocks with complete paths; radius : (N,) m, of the rocks
        displace : returns displaced paths; a rock then arrived only if its own path and its displaced path both had a
            part inside the area. None if only a rock's own path counts
        """
        left = np.isin(batch.counts[:, 0], CODES)
        if not left.any() or not self._areas:
            return
        gone = only(batch, left)
        heads = energy_heads(gone, radius[left], self._gravity)
        paths = [gone] if displace is None else [gone, displace(gone)]
        with self._lock:  # an `AreaOutline` is for one thread at a time
            found = [
                (~_arrived(area, paths) & (heads >= low)).sum()
                for area, low in zip(self._areas, self._lowest, strict=True)
            ]
            self.counts = self.counts + np.array(found, dtype=np.int64)


def energy_heads(batch: Batch, radius: FloatArray, gravity: float) -> FloatArray:
    """Return the heights (N,) m, local frame, to which rocks could climb with their energy at the ends of their paths.

    The energy includes the rotation of rocks that spin.

    batch : N rocks with their paths; radius : (N,) m; gravity : m/s^2
    """
    end = batch.first[1:, 1] - 1
    last = batch.pieces[end]
    speed2 = (last[:, 4:7] ** 2).sum(axis=1) + spins_squared(batch, radius).pieces[end, 0]
    return np.asarray(last[:, 3] + speed2 / (2.0 * gravity))


def _arrived(area: AreaOutline, paths: Sequence[Batch]) -> np.ndarray:
    """Return flags (N,), True for a rock whose path has a part inside the area in every batch.

    paths : batches of the same N rocks, such as with simulated and with displaced paths
    """
    crossed = [area.is_crossed_by(np.ascontiguousarray(each.pieces[:, 1:3]), each.first[:-1, 1]) for each in paths]
    return np.asarray(np.logical_and.reduce(crossed))
