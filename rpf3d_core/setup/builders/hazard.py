"""Prepare the hazard maps of a scene: range and memory of the bins for percentiles, and counts at barriers."""

import math
from typing import Any

from rpf3d_core.effects.hooks import links_of
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.hazard.bins import Scales, scales_of
from rpf3d_core.hazard.maps import Raster
from rpf3d_core.hazard.raster import GIGABYTE
from rpf3d_core.hazard.tally import BYTES_PER_CELL, LEAST_SHARE
from rpf3d_core.scene.model import Scene
from rpf3d_core.terrain.facets import Facets

LEAST_DROP = 1e-3
"""Smallest drop that bins cover, as a share (-) of the diagonal of the terrain's box; needed for level terrain."""


def memory_of_bins(scene: Scene, raster: Raster, facets: Facets) -> float:
    """Return the memory (bytes) for the bins of percentiles: the scene's limit minus the memory of cells and facets.

    The result is at least the share LEAST_SHARE of the limit.
    """
    allowed = scene.hazard.memory_gb * GIGABYTE
    cells = len(facets.zone) + raster.nx * raster.ny
    return max(allowed - cells * BYTES_PER_CELL, LEAST_SHARE * allowed)


def empty_barriers(scene: Scene, flight: Flight, compiled: bool, sources: int = 1) -> Any:
    """Return empty counts for the barriers of a scene; None if the scene has no barriers.

    compiled : True if compiled code counts the rocks at the barriers
    sources : number of sources; if there are several, each source is also counted separately
    """
    spec = scene.effects.barriers
    if spec is None:
        return None
    from rpf3d_core.effects.barriers import Barriers  # imported only for scenes with barriers
    from rpf3d_core.hazard.barriers import BarrierTally

    barriers = next(link for link in links_of(flight.models.effects) if isinstance(link, Barriers))
    names = tuple(panel.name for panel in spec.panels)
    return BarrierTally(barriers, names, scene.gravity, compiled, sources)


def scales_over(
    facets: Facets, gravity: float, fastest: float, highest: float, masses: tuple[float, float], per_octave: int,
    spins: bool = False,
) -> Scales:  # fmt: skip
    """Return the bins that cover all energies, speeds and heights that the rocks of a scene can reach.

    facets : facets of the terrain, whose lowest point limits the drop; gravity : m/s^2
    highest : height (m) of the highest release, local frame; fastest : largest release speed (m/s)
    masses : smallest and largest mass (kg) of a rock; per_octave : number of bins from a value to its double
    spins : True if energies include rotation
    """
    drop = max(highest, facets.high[2]) - facets.low[2]
    least = LEAST_DROP * math.dist(facets.low, facets.high)
    return scales_of(max(drop, least), gravity, fastest, *masses, per_octave, spins)
