"""Parameter sets of a live scene with unknowns: their flights, and what each set does in the areas of interest.

The rocks of a cluster of sources are shared out among the sets as in a run (`unknowns.dealing`), so the set of a rock
depends on its number and source alone. The shares of the sets give the predictive interval of an area.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import Flight, Watch
from rpf3d_core.ensemble.flights import FloatArray, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.hazard.displaced import displaced_batch, tallies_of_places
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.hazard.walks.cache_lines import LINE_ROCKS
from rpf3d_core.runs.over_sets import flights_over_sets
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.unknowns import displacements_of_scene
from rpf3d_core.simulation.engines import Engine
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.unknowns.predictive import Interval, holding, predictive_shares

ROCKS_A_SET = 50
"""Mean number of rocks of a parameter set from which a cluster has predictive intervals.

With fewer rocks, a single rock that reaches an area would move the upper end by more than the ground does.
"""


class LiveSets(NamedTuple):
    """The parameter sets of a live scene over one terrain.

    flights : of the S sets, all with the same compiled loop
    moves : (S, 2) m, displacement of the rocks of each set in plan by the misfit of the model; None if none is stated
    """

    flights: tuple[Flight, ...]
    moves: FloatArray | None

    @property
    def least_rocks(self) -> int:
        """Number of rocks of a cluster from which there are predictive intervals."""
        return ROCKS_A_SET * len(self.flights)


@dataclass(frozen=True)
class _Ready:
    """A scene with its terrain and the flight of its own values, as `setup.parameter_sets.Ready`."""

    scene: Scene
    terrain: Terrain
    flight: Flight


def live_sets(scene: Scene, terrain: Terrain, flight: Flight) -> LiveSets | None:
    """Return the parameter sets of a scene over a terrain; None if nothing is unknown.

    flight : with the scene's own values

    Raises
    ------
    InputError
        The sample is refused, or a set has a value that the scene refuses; the message names the key path.
    """
    if not scene.has_unknowns:
        return None
    sets, flights = flights_over_sets(_Ready(scene, terrain, flight))
    return LiveSets(flights=tuple(flights), moves=displacements_of_scene(scene, sets))


class ClusterSets:
    """Counts how many rocks of each parameter set of a cluster reach each area of interest."""

    def __init__(self, sets: LiveSets, tallies: Tallies, places: Tallies | None, engine: Engine) -> None:
        """Begin without rocks.

        tallies : counts of the cluster; places : empty counts of displaced paths, from `hazard.displaced`, which the
        clusters of an answer share except for their areas; None without displacements
        """
        self._sets, self._engine, self._tallies = sets, engine, tallies
        counted = [tallies.inside]
        if places is not None:
            self._places = replace(places, inside=_empty(tallies.inside))
            counted.append(self._places.inside)
        self._reached = [_Differences(tally, len(sets.flights)) for tally in counted]
        self._flown = np.zeros(len(sets.flights))
        self._left = np.zeros_like(self._reached[0].counts)

    @property
    def count(self) -> int:
        """Number of parameter sets."""
        return len(self._sets.flights)

    def watch_of(self, number: int) -> Watch:
        """Return the function that counts each batch of a set while its rocks fly."""
        moves = self._sets.moves
        if moves is None:
            return self._tallies

        def both(batch: Batch, releases: Releases) -> FloatArray:
            self._places(displaced_batch(batch, moves[number], self._engine), releases)
            return self._tallies(batch, releases)

        return both

    def end(self, number: int, flown: int, left: IntArray) -> None:
        """Add the rocks counted since the last call to the counts of a set; number : of the set.

        flown : number of its rocks, fragments included, that flew since then
        left : (A,) how many of them left the terrain with each area ahead of them
        """
        self._flown[number] += flown
        self._left[number] += left
        for reached in self._reached:
            reached.end(number)

    def predictive(self) -> Interval | None:
        """Return the predictive intervals of the share of rocks that reach each area; None for too few rocks."""
        if self._flown.sum() < self._sets.least_rocks:
            return None
        flown, totals = self._reached[0].counts, self._totals()
        found = predictive_shares(self._reached[-1].counts, totals)
        return holding(found, flown.sum(axis=0), totals.sum(axis=0))

    def left_high(self, found: Interval) -> FloatArray:
        """Return the upper ends (A,) of the predictive intervals if every rock that left the terrain had gone on.

        A rock that left the terrain with an area ahead then counts as a rock that reached this area.

        found : result of `predictive`; no upper end is below its own
        """
        totals = self._totals()
        counts = np.minimum(self._reached[-1].counts + self._left, totals)
        return np.maximum(predictive_shares(counts, totals).high, found.high)

    def _totals(self) -> FloatArray:
        """Return the number of rocks of each set, for each area: (S, A)."""
        return np.broadcast_to(self._flown[:, None], self._left.shape)


def tallies_of_displaced(sets: LiveSets | None, tallies: Tallies) -> Tallies | None:
    """Return the empty counts that displaced paths of all clusters of an answer share; None without displacements."""
    return None if sets is None or sets.moves is None else tallies_of_places(tallies)


class _Differences:
    """How many rocks of each set reached each area: (S, A), as differences of the common counts of a tally."""

    def __init__(self, tally: CellTally, sets: int) -> None:
        self._tally = tally
        self._before = np.zeros(len(tally.slot), dtype=np.int64)
        self.counts = np.zeros((sets, len(tally.slot)))

    def end(self, number: int) -> None:
        """Add the rocks counted since the last call to the counts of a set; number : of the set."""
        after = _reached_in(self._tally)
        self.counts[number] += after - self._before
        self._before = after


def _reached_in(tally: CellTally) -> NDArray[np.int64]:
    """Return how many rocks reached each of the cells (C,) of a tally."""
    counts = np.zeros(len(tally.slot), dtype=np.int64)
    counts[tally.slots.cell[: tally.used]] = tally.slots.lines.short[: tally.used, LINE_ROCKS]
    return counts


def _empty(tally: CellTally) -> CellTally:
    """Return an empty tally of the same cells with the same scales."""
    return CellTally(len(tally.slot), tally.scales, tally.limit, tally.compiled)
