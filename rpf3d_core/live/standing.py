"""Prepare a terrain once for many answers, so that an answer takes only the time to fly its rocks.

Work that takes longer for a larger terrain is done once for each terrain: in `stand_on`, and in `PreparedTerrain.cells`
on first use. After a patch, `stand_after` computes only the changed part again.
"""

import math
import queue
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.detection.bucket_locator import bucket_locator
from rpf3d_core.ensemble.batches import Flight
from rpf3d_core.ensemble.releases import ABOVE_EVERYTHING
from rpf3d_core.ensemble.sizes import UNIT_SPHERE_VOLUME, DrawnRock, mass_range
from rpf3d_core.hazard.areas import areas_of
from rpf3d_core.hazard.bins import FINE, PER_OCTAVE, Binning
from rpf3d_core.hazard.tallies import Tallies, tallies_over, with_reach_only
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.ground import ground_after, ground_over
from rpf3d_core.live.areas import AreaGround
from rpf3d_core.live.cells import TerrainCells, cells_after, cells_over
from rpf3d_core.live.cluster_sets import LiveSets, live_sets
from rpf3d_core.live.ground import Changed
from rpf3d_core.live.outlines import outline_digest
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.areas import area_outlines, plan_rings, read_areas
from rpf3d_core.setup.builders.hazard import empty_barriers, memory_of_bins, scales_over
from rpf3d_core.setup.prepared import scene_flight, scene_raster
from rpf3d_core.setup.sources import rock_of
from rpf3d_core.simulation.engines import Compiled, Engine, spins_of
from rpf3d_core.terrain.facets import Facets, Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Rock

Outlines = Mapping[str, Sequence[FloatArray]]
"""Outlines of areas of interest: name of each area -> its rings (P, 2) m in plan, holes included."""


class Surveyed(Protocol):
    """The attributes that a terrain must have to be prepared for answers (`live.ground.LiveTerrain` has them)."""

    @property
    def terrain(self) -> Terrain:
        """The terrain that rocks fly over."""

    @property
    def facets(self) -> Facets:
        """The terrain's facets as arrays."""

    @property
    def engine(self) -> Engine:
        """The engine that flies rocks over the facets."""

    @property
    def digest(self) -> str:
        """Digest (SHA-256, hex) of all surveys of the terrain, which identifies the terrain in logs."""

    @property
    def whole_ns(self) -> int:
        """Time stamp (ns) of the whole survey, from which the age of the terrain follows."""

    @property
    def patches(self) -> int:
        """Number of patches since the terrain was built from a whole survey."""

    @property
    def changed(self) -> Changed | None:
        """Part of the terrain that the last patch changed; None if the terrain was built from a whole survey."""


NEXT_FACET = 0.01
"""Depth (m) below a facet from which the search for the next facet below begins."""

OF_THE_MAP = "the map frame (x y): map_origin is not applied to areas_of_interest of a live scene"
"""Coordinates of the scene's areas of interest over live terrain, for messages."""


@dataclass(eq=False)
class PreparedTerrain:
    """A terrain with all data that its answers share; for one thread and one answer at a time.

    ground, scene : the terrain and the live scene; rock : mass and radius of the scene's rocks, or how they are drawn
    flight : materials, settings and models of the rocks; with unknowns, those of the first parameter set
    areas : rings of the scene's own areas of interest, local frame
    tallies : counts for the maps of the current answer, emptied for the next answer
    before : map cells of the terrain before the last patch; None without a patch, and after `cells` has been computed
    area_grounds : the terrain below areas of interest; the key is the outline as bytes (`live.coverage`)
    sets : parameter sets of a scene with unknowns; None without unknowns
    area_digests : digest of the outline of each of the scene's own areas, by name
    """

    ground: Surveyed
    scene: Scene
    flight: Flight
    rock: Rock | DrawnRock
    areas: Outlines
    tallies: Tallies
    before: TerrainCells | None = None
    area_grounds: dict[bytes, AreaGround] = field(default_factory=dict)
    sets: LiveSets | None = None
    area_digests: Mapping[str, str] = field(default_factory=dict)

    def has_ground(self, places: FloatArray) -> NDArray[np.bool_]:
        """Return flags (N,), True for places (N, 2) m in plan, local frame, with ground above or below them."""
        return np.asarray(self.ground.engine.ground_below(self._above(places))[:, 1] >= 0)

    def lowest_ground(self, places: FloatArray) -> FloatArray:
        """Return the height (N,) m, local frame, of the lowest corner of all facets above or below each place.

        The height is +infinite at a place without a facet. places : (N, 2) m in plan, local frame
        """
        lowest, x = np.full(len(places), np.inf), self._above(places)
        facets, at = self.ground.facets, np.arange(len(places))
        while len(at):  # one facet of each place after another, from the top down
            below = self.ground.engine.ground_below(x)
            there = (below[:, 1] >= 0) & (x[:, 2] > facets.low[2])
            at, x, below = at[there], x[there], below[there]
            corners = np.asarray(facets.corners)[below[:, 1].astype(np.int64), 2::3]
            lowest[at] = np.minimum(lowest[at], corners.min(axis=1, initial=np.inf))
            x[:, 2] -= np.maximum(below[:, 0], 0.0) + NEXT_FACET
        return lowest

    def _above(self, places: FloatArray) -> FloatArray:
        """Return points (N, 3) m above the whole terrain, over places (N, 2) m."""
        return np.column_stack([places, np.full(len(places), self.ground.facets.high[2] + ABOVE_EVERYTHING)])

    def areas_with(self, live_areas: Outlines) -> Outlines:
        """Return the rings (P, 2) m, local frame, of all areas by name: first the scene's areas, then the live areas.

        A live area replaces an area of the scene with the same name. live_areas : rings (P, 2) m, map frame
        """
        shift = np.array(self.ground.terrain.frame.origin[:2])
        live = {name: [np.asarray(ring) - shift for ring in rings] for name, rings in live_areas.items()}
        return {**self.areas, **live}

    def digests_with(self, live_areas: Outlines) -> dict[str, str]:
        """Return the digest of the outline of each area in `areas_with`, by name; no digest depends on the terrain."""
        return {**self.area_digests, **{name: outline_digest(rings) for name, rings in live_areas.items()}}

    def empty_tallies(
        self, outlines: Outlines, fastest: float, highest: float, diameters: FloatArray | None
    ) -> Tallies:
        """Return empty counts for the maps of a new answer, in the memory of the previous answer's counts (`tallies`).

        The new counts replace `tallies`; do not use the counts of the previous answer afterwards.

        outlines : of all areas of interest, as from `areas_with`
        fastest, highest : upper bounds of the speed (m/s) and height (m, local frame) at release
        diameters : (S,) m, of the rocks of each source, NaN for the scene's own rocks; None if all are the scene's own
        """
        facets, scene = self.ground.facets, self.scene
        areas, masses, old = areas_of(outlines), _masses(self.rock, diameters), self.tallies
        coarse, fine = (
            scales_over(facets, scene.gravity, fastest, max(highest, facets.high[2]), masses, bins, old.spins)
            for bins in (PER_OCTAVE, FINE)
        )
        limit, compiled = memory_of_bins(scene, old.ground.raster, facets), self.compiled
        same = len(areas.boxes) == len(old.areas.boxes)
        self.tallies = replace(
            old,
            areas=areas,
            squares=old.squares.emptied(coarse, 0.5 * limit),
            reach=None if old.reach is None else old.reach.emptied(),
            zones=old.zones.emptied(fine, math.inf),
            inside=CellTally(len(areas.boxes), fine, math.inf, compiled),
            idle=old.idle if same else queue.SimpleQueue(),
            barriers=empty_barriers(scene, self.flight, compiled),
        )
        return self.tallies

    @cached_property
    def cells(self) -> TerrainCells:
        """The map cells that lie over ground, with the height of the ground, for display; computed on first use."""
        terrain, walked = self.ground.terrain, self.tallies.ground
        known, self.before = self.before, None
        changed = self.ground.changed
        if known is None or changed is None:
            return cells_over(terrain, walked.raster)
        return cells_after(known, terrain, walked.raster, walked.locator, changed.low, changed.high)

    @property
    def least_rocks(self) -> int:
        """Smallest number of rocks with which a cluster of sources gets predictive intervals; 0 without unknowns."""
        return 0 if self.sets is None else self.sets.least_rocks

    @property
    def compiled(self) -> bool:
        """True if the compiled engine is in use."""
        return isinstance(self.ground.engine, Compiled)


def stand_on(ground: Surveyed, scene: Scene) -> PreparedTerrain:
    """Prepare a terrain for answers: compute everything that all answers of a scene over this terrain share.

    Raises
    ------
    InputError
        A zone of the terrain has no material, an area of interest lies off the terrain, the maps are too large, or a
        parameter set of the scene is refused.
    """
    terrain, engine, facets = ground.terrain, ground.engine, ground.facets
    (flight, sets), raster = _flights(scene, terrain), scene_raster(scene, terrain, (facets.low, facets.high))
    areas, compiled = read_areas(scene), isinstance(engine, Compiled)
    outlines = area_outlines(scene, terrain, areas, OF_THE_MAP)
    locator = engine.locator if isinstance(engine, Compiled) else bucket_locator(ground.facets)
    walked = ground_over(ground.facets, locator, raster)
    rock, zones, spins = rock_of(scene.rock), len(terrain.zones), spins_of(flight.models)
    coarse, fine = (
        scales_over(ground.facets, scene.gravity, 0.0, ground.facets.high[2], mass_range(rock), bins, spins)
        for bins in (PER_OCTAVE, FINE)
    )
    binning = Binning(coarse=coarse, fine=fine, limit=memory_of_bins(scene, raster, ground.facets))
    tallies = with_reach_only(tallies_over(walked, areas_of(outlines), zones, scene.gravity, binning, compiled))
    return PreparedTerrain(
        ground, scene, flight, rock, outlines, replace(tallies, spins=spins), sets=sets,
        area_digests={name: outline_digest(plan_rings(polygons)) for name, polygons in areas.items()},
    )  # fmt: skip


def _flights(scene: Scene, terrain: Terrain) -> tuple[Flight, LiveSets | None]:
    """Return the flight of a scene over a terrain (materials, settings, models), and the parameter sets of the scene.

    Without unknowns, the parameter sets are None. With unknowns, the first set gives the flight.
    """
    flight = scene_flight(scene, terrain)
    sets = live_sets(scene, terrain, flight)
    return (flight, None) if sets is None else (sets.flights[0], sets)


def stand_after(before: PreparedTerrain, ground: Surveyed) -> PreparedTerrain:
    """Prepare a terrain for answers after a patch; only the changed part is computed again.

    Everything is computed again if the patch changes the raster of the maps or the terrain's frame, and with the
    reference engine.

    before : the prepared terrain without the patch; the result uses its memory, so `before` must not be used afterwards
    ground : the terrain with the patch
    """
    terrain, facets, engine, changed = ground.terrain, ground.facets, ground.engine, ground.changed
    scene, raster = before.scene, before.tallies.ground.raster
    if changed is None or not isinstance(engine, Compiled) or terrain.frame != before.ground.terrain.frame:
        return stand_on(ground, scene)
    if scene_raster(scene, terrain, (facets.low, facets.high)) != raster:
        return stand_on(ground, scene)
    tallies = before.tallies.after(ground_after(before.tallies.ground, facets, engine.locator, changed.block))
    flight, sets = _flights(scene, terrain)
    return replace(
        before, ground=ground, flight=flight, tallies=tallies, before=before.cells, area_grounds={}, sets=sets
    )


def mass_of(diameter: FloatArray, density: float) -> FloatArray:
    """Return the masses (R,) kg of spherical rocks with diameters (R,) m and a density (kg/m^3)."""
    radius = 0.5 * diameter
    return np.asarray(density * UNIT_SPHERE_VOLUME * (radius * radius * radius))


def density_of(rock: Rock | DrawnRock) -> float:
    """Return the density (kg/m^3) of a scene's rocks."""
    if isinstance(rock, DrawnRock):
        return rock.density
    return rock.mass / (UNIT_SPHERE_VOLUME * rock.radius**3)


def _masses(rock: Rock | DrawnRock, diameters: FloatArray | None) -> tuple[float, float]:
    """Return the smallest and largest mass (kg) of the rocks of an answer.

    diameters : (S,) m, of the rocks of each source, NaN for the scene's own rocks; None if all are the scene's own
    """
    low, high = mass_range(rock)
    if diameters is None or not np.isfinite(diameters).any():
        return low, high
    known = mass_of(diameters[np.isfinite(diameters)], density_of(rock))
    if np.isfinite(diameters).all():
        return float(known.min()), float(known.max())
    return min(low, float(known.min())), max(high, float(known.max()))
