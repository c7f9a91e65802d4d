"""What the hazard maps of a scene need beside their cells: scales of their bins, memory, and tallies of barriers."""

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
"""Of the diagonal, that maps tell heights over even where the terrain is level and rocks lie on it."""


def memory_of_bins(scene: Scene, raster: Raster, facets: Facets) -> float:
    """Bytes that the bins of a scene's maps may take: what it allows, less what all cells and facets take."""
    allowed = scene.hazard.memory_gb * GIGABYTE
    cells = len(facets.zone) + raster.nx * raster.ny
    return max(allowed - cells * BYTES_PER_CELL, LEAST_SHARE * allowed)


def empty_barriers(scene: Scene, flight: Flight, compiled: bool) -> Any:
    """A tally of a scene's barriers, None where it names none."""
    spec = scene.effects.barriers
    if spec is None:
        return None
    from rpf3d_core.effects.barriers import Barriers  # for scenes that name them only
    from rpf3d_core.hazard.barriers import BarrierTally

    barriers = next(link for link in links_of(flight.models.effects) if isinstance(link, Barriers))
    names = tuple(panel.name for panel in spec.panels)
    return BarrierTally(barriers, names, scene.gravity, compiled)


def scales_over(
    facets: Facets, gravity: float, fastest: float, highest: float, masses: tuple[float, float], per_octave: int,
    spins: bool = False,
) -> Scales:  # fmt: skip
    """Scales of rocks released over facets no higher than `highest` (m, local) and no faster than `fastest` (m/s).

    masses : least and greatest (kg); spins : whether energies count rotation
    """
    drop = max(highest, facets.high[2]) - facets.low[2]
    least = LEAST_DROP * math.dist(facets.low, facets.high)
    return scales_of(max(drop, least), gravity, fastest, *masses, per_octave, spins)
