"""Compute the start heights of each source's rocks above the terrain."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.simulation.engines import Engine


@dataclass(frozen=True)
class SourceHeight:
    """The start heights of one source's rocks above the terrain, which show whether the source is misplaced.

    rocks : number of rocks; checked : number of checked rocks, to which all further values apply
    lowest, highest : m, heights of the lowest and highest start above the terrain; inf and -inf if there is none
    under_ground : number of rocks below the terrain
    off_terrain : number of rocks without terrain below or above
    """

    name: str
    rocks: int
    checked: int
    lowest: float
    highest: float
    under_ground: int
    off_terrain: int

    def describe(self) -> str:
        """Return the report on the start heights of this source as one line of text."""
        found = f"{self.rocks:,} {'rock' if self.rocks == 1 else 'rocks'}"
        if self.checked < self.rocks:
            found += f" ({self.checked:,} looked at)"
        if self.lowest <= self.highest:
            low, high = f"{self.lowest:.2f}", f"{self.highest:.2f}"
            found += f", {low if low == high else f'{low} to {high}'} m above the ground"
        if self.under_ground:
            found += f"; {self.under_ground:,} UNDER THE GROUND"
        if self.off_terrain:
            found += f"; {self.off_terrain:,} OFF THE TERRAIN"
        return found


def heights_of(
    names: Sequence[str], rocks: Sequence[int], releases: Releases, below: NDArray[np.float64], engine: Engine
) -> list[SourceHeight]:
    """Return the start heights of each source's rocks above the terrain.

    names, rocks : name and number of rocks of each source; releases : of the R checked rocks
    below : (R, 3) from `Engine.ground_below`: height (m) above the ground, facet below (-1: none),
        side of this facet below the rock (1: free, -1: back)
    """
    found = [_heights(name, rocks[i], below[releases.source == i]) for i, name in enumerate(names)]
    return [_told_apart(height, i, releases, below, engine) for i, height in enumerate(found)]


def _heights(name: str, rocks: int, below: NDArray[np.float64]) -> SourceHeight:
    """Return the start heights of one source's rocks above the terrain.

    Here, `off_terrain` is 0, and `under_ground` includes the rocks off the terrain; `_told_apart` separates them.

    below : (N, 3) for the N checked rocks of this source: height (m) above the ground, facet below (-1: none), side of
        this facet below the rock (1: free, -1: back)
    """
    good = (below[:, 1] >= 0) & (below[:, 2] > 0)
    heights = below[good, 0]
    lowest, highest = (heights.min(), heights.max()) if len(heights) else (np.inf, -np.inf)
    return SourceHeight(
        name=name,
        rocks=rocks,
        checked=len(below),
        lowest=float(lowest),
        highest=float(highest),
        under_ground=int((~good).sum()),
        off_terrain=0,
    )


def _told_apart(
    found: SourceHeight, number: int, releases: Releases, below: NDArray[np.float64], engine: Engine
) -> SourceHeight:
    """Return the start heights of a source, with rocks off the terrain and rocks under the ground counted separately.

    A rock without terrain below is under the ground if there is terrain above the rock, else off the terrain. A rock
    above the back of a facet is under the ground, too.

    found : from `_heights`; number : index of the source
    releases : of all R checked rocks; below : (R, 3) for these rocks: height (m) above the ground, facet below (-1:
        none), side of this facet below the rock (1: free, -1: back)
    """
    bad = (releases.source == number) & ((below[:, 1] < 0) | (below[:, 2] <= 0))
    top = np.array(releases.x[bad])
    top[:, 2] = np.maximum(top[:, 2], engine.facets.high[2]) + 1.0
    off = int((engine.ground_below(top)[:, 1] < 0).sum()) if bad.any() else 0
    return replace(found, under_ground=found.under_ground - off, off_terrain=off)
