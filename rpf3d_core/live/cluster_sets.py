"""Parameter sets of a live scene with unknowns: their flights, and the counts of each set in the areas of interest.

The rocks of a cluster of sources are shared out among the sets as in a run (`unknowns.dealing`), so the set of a rock
depends on its number and source alone. The predictive interval of an area follows from the shares of rocks of each set
that reach the area. The upper end of the energy in the area follows from the p95 energy of each set.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.alerts.evidence import AreaEvidence
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import Flight, Watch
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.hazard.by_set.displaced import displaced_batch, tallies_of_places
from rpf3d_core.hazard.by_set.set_places import PlaceTally
from rpf3d_core.hazard.layers import layers_of
from rpf3d_core.hazard.maps import FEWEST_ROCKS, Layers
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.runs.over_sets import flights_over_sets
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.unknowns import displacements_of_scene, place_of_sample
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.unknowns.places import Surroundings
from rpf3d_core.unknowns.predictive import Interval, holding, predictive_shares, ranked_if_enough

Flags = NDArray[np.bool_]

ROCKS_A_SET = 50
"""Smallest mean number of rocks per parameter set with which a cluster gets predictive intervals.

With fewer rocks, a single rock that reaches an area would change the upper end more than the unknowns do.
"""


class LiveSets(NamedTuple):
    """The parameter sets of a live scene over one terrain.

    flights : for each of the S sets, the materials, settings and models; all sets use the same compiled loop
    moves : (S, 2) m, displacement in plan of the paths of each set by the misfit; None if the scene states no misfit
    place : where the sample of the scene was calibrated, survey coordinates; None if that is not known
    """

    flights: tuple[Flight, ...]
    moves: FloatArray | None
    place: Surroundings | None = None

    @property
    def least_rocks(self) -> int:
        """Smallest number of rocks of a cluster with which the cluster gets predictive intervals."""
        return ROCKS_A_SET * len(self.flights)


@dataclass(frozen=True)
class _Ready:
    """The input of `flights_over_sets` (`setup.parameter_sets.Ready`): a scene, its terrain and its flight settings."""

    scene: Scene
    terrain: Terrain
    flight: Flight


def live_sets(scene: Scene, terrain: Terrain, flight: Flight) -> LiveSets | None:
    """Return the parameter sets of a scene over a terrain; None if the scene has no unknowns.

    flight : materials, settings and models with the scene's own values

    Raises
    ------
    InputError
        The sample is refused, or a set has a value that the scene refuses; the message names the key path.
    """
    if not scene.has_unknowns:
        return None
    sets, flights = flights_over_sets(_Ready(scene, terrain, flight))
    moves, place = displacements_of_scene(scene, sets), place_of_sample(scene)
    return LiveSets(flights=tuple(flights), moves=moves, place=place)


class SafeEnds(NamedTuple):
    """The figures of a cluster in A areas, from all parameter sets, to compare with the site's limits.

    Unknown energies and arrivals are NaN. An unknown interval of the share is 0 to 1, with 1 as its `left_high`.

    share : lower and upper ends (A,) (-) of the predictive intervals of the share of rocks that reach each area
    left_high : (A,) upper ends (-) of these intervals if every rock that left the terrain had reached all areas that it
        may have reached
    energy_high : (A,) J, upper ends of the p95 energy; energy_sets : (A,) number of sets that have a p95 energy
    first_arrival : (A,) s, of the fastest rock of all sets, on displaced paths if the scene states a misfit
    """

    share: Interval
    left_high: FloatArray
    energy_high: FloatArray
    energy_sets: IntArray
    first_arrival: FloatArray

    def added_to(self, area: AreaEvidence, number: int) -> AreaEvidence:
        """Return the evidence of an area with these figures added.

        `energy_high` is at least the energy of all rocks together. `first_arrival_low_s` is at most the first arrival
        of all rocks together.

        number : index of the area in the arrays
        """
        energies = _known(area.pooled_energy, self.energy_high[number])
        arrivals = _known(area.first_arrival_s, self.first_arrival[number])
        return area._replace(
            predictive_low=float(self.share.low[number]),
            predictive_high=float(self.share.high[number]),
            left_high=float(self.left_high[number]),
            energy_high=max(energies, default=None),
            energy_sets=int(self.energy_sets[number]),
            first_arrival_low_s=min(arrivals, default=None),
        )


def _known(pooled: float | None, end: float) -> list[float]:
    """Return a list of the given figures that are known, that is, neither None nor NaN.

    pooled : figure of all rocks; end : figure over the parameter sets
    """
    return [float(value) for value in (pooled, end) if value is not None and not np.isnan(value)]


class ClusterSets:
    """Counts what the rocks of each parameter set of a cluster do in each area of interest."""

    def __init__(self, sets: LiveSets, tallies: Tallies, places: Tallies | None, engine: Engine) -> None:
        """Create the counts of all parameter sets, empty.

        tallies : counts of the cluster; engine : finds the ground at displaced places
        places : empty counts of displaced paths from `tallies_of_displaced`, None without displacements. All clusters
            of an answer use the same `places`, but each cluster has its own counts of areas
        """
        self._sets, self._engine, self._tallies = sets, engine, tallies
        counted = [tallies.inside]
        if places is not None:
            self._places = replace(places, inside=_empty(tallies.inside))
            counted.append(self._places.inside)
        self._areas = [PlaceTally(tally, len(sets.flights)) for tally in counted]
        self._flown = np.zeros(len(sets.flights))
        self._left = np.zeros_like(self._areas[0].reached)

    @property
    def count(self) -> int:
        """Number of parameter sets."""
        return len(self._sets.flights)

    def watch_of(self, number: int) -> Watch:
        """Return the function that counts each batch of a parameter set while its rocks fly; number : of the set."""
        displace = self.displacement_of(number)
        if displace is None:
            return self._tallies

        def both(batch: Batch, releases: Releases) -> FloatArray:
            self._places(displace(batch), releases)
            return self._tallies(batch, releases)

        return both

    def displacement_of(self, number: int) -> Callable[[Batch], Batch] | None:
        """Return the function that displaces the paths of a batch of a parameter set; None without displacements.

        number : of the set
        """
        moves = self._sets.moves
        return None if moves is None else partial(displaced_batch, move=moves[number], engine=self._engine)

    def end(self, number: int, flown: int, left: IntArray) -> None:
        """Add all rocks counted since the last call to the counts of one parameter set; number : of the set.

        flown : number of these rocks, including fragments
        left : (A,) number of these rocks that left the terrain and may have reached each area
        """
        self._flown[number] += flown
        self._left[number] += left
        for areas in self._areas:
            areas.end(number)

    def ends(self, flown: Layers) -> SafeEnds | None:
        """Return the figures that follow from all parameter sets; None if too few rocks flew.

        flown : map values of the areas from the simulated paths, without displacement
        """
        if self._flown.sum() < self._sets.least_rocks:
            return None
        counted = flown if self._sets.moves is None else layers_of(self._areas[-1].tally)
        share, energies = self._share(), self._areas[-1].energies(1) * (1.0 + counted.percentiles_within)
        has_p95 = self._areas[-1].reached >= FEWEST_ROCKS
        return SafeEnds(
            share=share,
            left_high=self._left_high(share),
            energy_high=np.fmin(_upper_energies(energies, has_p95), _laid_out(counted, counted.energy.largest)),
            energy_sets=has_p95.sum(axis=0),
            first_arrival=_laid_out(counted, counted.first_arrival),
        )

    def _share(self) -> Interval:
        """Return the predictive intervals (-) of the share of rocks that reach each area; 0 to 1 if unknown.

        Each interval contains the sampling interval of all rocks on their simulated paths.
        """
        flown, totals = self._areas[0].reached, self._totals()
        low, high = predictive_shares(self._areas[-1].reached, totals)
        # An unknown interval (NaN) becomes 0 to 1, because NaN would compare as below every limit.
        found = Interval(low=np.nan_to_num(low, nan=0.0), high=np.nan_to_num(high, nan=1.0))
        return holding(found, flown.sum(axis=0), totals.sum(axis=0))

    def _left_high(self, found: Interval) -> FloatArray:
        """Return the upper ends (A,) (-) of the predictive intervals if rocks that left the terrain are counted, too.

        A rock that left the terrain and may have reached an area counts as a rock that reached this area.

        found : result of `_share`; no returned end is below the upper end in `found`
        """
        totals = self._totals()
        counts = np.minimum(self._areas[-1].reached + self._left, totals)
        return np.fmax(predictive_shares(counts, totals).high, found.high)

    def _totals(self) -> FloatArray:
        """Return the number of rocks flown with each set, repeated for each area: (S, A)."""
        return np.broadcast_to(self._flown[:, None], self._left.shape)


def tallies_of_displaced(sets: LiveSets | None, tallies: Tallies) -> Tallies | None:
    """Return empty counts of displaced paths, which all clusters of an answer share; None without displacements."""
    return None if sets is None or sets.moves is None else tallies_of_places(tallies)


def _upper_energies(energies: FloatArray, has_p95: Flags) -> FloatArray:
    """Return the upper ends (A,) J of the p95 energy in areas; NaN if no rock reached the area.

    The upper end is computed from the sets with a p95, as in the tables of a run, and again from all sets. The higher
    result counts, so that sets with few rocks in the area are not ignored. If fewer than 39 sets have a p95, the upper
    end is the largest energy of all sets.

    energies : (S, A) J, p95 energy of each set, or its largest energy if too few of its rocks reached the area
    has_p95 : (S, A) False if too few rocks of the set reached the area
    """
    known = ranked_if_enough(np.where(has_p95, energies, np.nan)).high
    ends = np.fmax(known, ranked_if_enough(energies).high)
    return np.where(np.isnan(known), np.fmax.reduce(energies, axis=0), ends)


def _laid_out(layers: Layers, values: FloatArray) -> FloatArray:
    """Return values (N,) of the areas that rocks reached as an array (A,) over all areas; NaN for the other areas."""
    return layers.everywhere(np.asarray(values, dtype=float), np.nan)


def _empty(tally: CellTally) -> CellTally:
    """Return an empty tally of the same cells with the same scales."""
    return CellTally(len(tally.slot), tally.scales, tally.limit, tally.compiled)
