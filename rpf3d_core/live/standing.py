"""What is worked out once for a ground and kept while sources come and go, so that an answer costs what its rocks do.

Nothing here takes longer the larger the terrain is, but for `stand_on`, which is called once a ground.
"""

import math
import queue
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Protocol

import numpy as np

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.sizes import UNIT_SPHERE_VOLUME, DrawnRock, mass_range
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE
from rpf3d_core.hazard.tallies import Tallies, tallies_over
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.ground import ground_after, ground_over
from rpf3d_core.live.cells import TerrainCells, cells_after, cells_over
from rpf3d_core.live.ground import Changed
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.areas import area_outlines
from rpf3d_core.setup.builders.hazard import empty_barriers, memory_of_bins, scales_over
from rpf3d_core.setup.prepared import scene_flight, scene_raster
from rpf3d_core.setup.sources import rock_of
from rpf3d_core.simulation.engines import Compiled, Engine, spins_of
from rpf3d_core.terrain.facets import Facets, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Rock

Outlines = Mapping[str, Sequence[FloatArray]]
"""Name of an area of interest -> its rings (P, 2) m in plan, holes among them."""


class Surveyed(Protocol):
    """What is asked of a ground (`live.ground.Ground`)."""

    @property
    def terrain(self) -> Terrain:
        """The terrain."""

    @property
    def facets(self) -> Facets:
        """Its facets as arrays."""

    @property
    def engine(self) -> Engine:
        """An engine over them."""

    @property
    def digest(self) -> str:
        """Of all that was surveyed."""

    @property
    def stamp_ns(self) -> int:
        """When it was surveyed."""

    @property
    def changed(self) -> Changed | None:
        """Where the last patch has changed something; None where it was made whole."""


@dataclass(eq=False)
class PreparedTerrain:
    """A ground with all that answers over it share; for one thread at a time, which throws what it answers away first.

    areas : rings of the scene's own areas of interest, local frame
    before : the cells of the ground that this one was patched from
    """

    ground: Surveyed
    scene: Scene
    flight: Flight
    rock: Rock | DrawnRock
    areas: Outlines
    tallies: Tallies
    before: TerrainCells | None = None

    def areas_with(self, live_areas: Outlines) -> Outlines:
        """All areas of interest, local frame: the scene's own, then those with rings (P, 2) m in the map frame."""
        shift = np.array(self.ground.terrain.frame.origin[:2])
        live = {name: [np.asarray(ring) - shift for ring in rings] for name, rings in live_areas.items()}
        return {**self.areas, **live}

    def empty_tallies(
        self, outlines: Outlines, fastest: float, highest: float, diameters: FloatArray | None
    ) -> Tallies:
        """Tallies in the memory of the last ones.

        outlines : of all areas of interest, as `areas_with`
        fastest, highest : bounds of what is released, m/s and m, local
        diameters : (S,) m, of rocks beside the scene's own; None for none
        """
        facets, scene = self.ground.facets, self.scene
        areas, masses, old = areas_of(outlines), _masses(self.rock, diameters), self.tallies
        scales, fine = (
            scales_over(facets, scene.gravity, fastest, max(highest, facets.high[2]), masses, bins, old.spins)
            for bins in (PER_OCTAVE, FINE)
        )
        limit, compiled = memory_of_bins(scene, old.ground.raster, facets), self.compiled
        same = len(areas.boxes) == len(old.areas.boxes)
        self.tallies = replace(
            old,
            areas=areas,
            squares=old.squares.emptied(scales, 0.5 * limit),
            facets=old.facets.emptied(scales, 0.5 * limit),
            zones=old.zones.emptied(fine, math.inf),
            inside=CellTally(len(areas.boxes), fine, math.inf, compiled),
            idle=old.idle if same else queue.SimpleQueue(),
            barriers=empty_barriers(scene, self.flight, compiled),
        )
        return self.tallies

    @cached_property
    def cells(self) -> TerrainCells:
        """Where the raster of the maps lies over ground, and how high; worked out when it is first asked for."""
        terrain, walked = self.ground.terrain, self.tallies.ground
        known, self.before = self.before, None
        changed = self.ground.changed
        if known is None or changed is None:
            return cells_over(terrain, walked.raster)
        return cells_after(known, terrain, walked.raster, walked.locator, changed.low, changed.high)

    @property
    def compiled(self) -> bool:
        """Whether numba flies and counts."""
        return isinstance(self.ground.engine, Compiled)


def stand_on(ground: Surveyed, scene: Scene) -> PreparedTerrain:
    """Work out what a scene's answers over a ground share.

    Raises
    ------
    InputError
        The ground's zones have no material, an area of interest lies off it, or its maps need too much memory.
    """
    terrain, engine, facets = ground.terrain, ground.engine, ground.facets
    flight, raster = scene_flight(scene, terrain), scene_raster(scene, terrain, (facets.low, facets.high))
    outlines, compiled = area_outlines(scene, terrain), isinstance(engine, Compiled)
    locator = engine.locator if isinstance(engine, Compiled) else bucket_locator(ground.facets)
    walked = ground_over(ground.facets, locator, raster)
    rock, zones, spins = rock_of(scene.rock), len(terrain.zones), spins_of(flight.models)
    scales, fine = (
        scales_over(ground.facets, scene.gravity, 0.0, ground.facets.high[2], mass_range(rock), bins, spins)
        for bins in (PER_OCTAVE, FINE)
    )
    limit = memory_of_bins(scene, raster, ground.facets)
    tallies = tallies_over(walked, areas_of(outlines), zones, scene.gravity, scales, fine, limit, compiled)
    return PreparedTerrain(ground, scene, flight, rock, outlines, replace(tallies, spins=spins))


def stand_after(before: PreparedTerrain, ground: Surveyed) -> PreparedTerrain:
    """As `stand_on`, of a ground that a patch made of that of `before`, which must not be used any more.

    What was known of the rest of the ground is still known, and lies in the same memory.
    """
    terrain, facets, engine, changed = ground.terrain, ground.facets, ground.engine, ground.changed
    scene, raster = before.scene, before.tallies.ground.raster
    if changed is None or not isinstance(engine, Compiled) or terrain.frame != before.ground.terrain.frame:
        return stand_on(ground, scene)
    if scene_raster(scene, terrain, (facets.low, facets.high)) != raster:
        return stand_on(ground, scene)
    tallies = before.tallies.after(ground_after(before.tallies.ground, facets, engine.locator, changed.block))
    return replace(before, ground=ground, flight=scene_flight(scene, terrain), tallies=tallies, before=before.cells)


def mass_of(diameter: FloatArray, density: float) -> FloatArray:
    """Masses (R,) kg of spheres of diameters (R,) m and a density (kg/m^3)."""
    radius = 0.5 * diameter
    return np.asarray(density * UNIT_SPHERE_VOLUME * (radius * radius * radius))


def density_of(rock: Rock | DrawnRock) -> float:
    """The density (kg/m^3) of a scene's rocks."""
    if isinstance(rock, DrawnRock):
        return rock.density
    return rock.mass / (UNIT_SPHERE_VOLUME * rock.radius**3)


def _masses(rock: Rock | DrawnRock, diameters: FloatArray | None) -> tuple[float, float]:
    """The least and the greatest mass (kg) among the scene's rocks and those of some diameters (NaN: the scene's)."""
    low, high = mass_range(rock)
    if diameters is None or not np.isfinite(diameters).any():
        return low, high
    known = mass_of(diameters[np.isfinite(diameters)], density_of(rock))
    if np.isfinite(diameters).all():
        return float(known.min()), float(known.max())
    return min(low, float(known.min())), max(high, float(known.max()))
