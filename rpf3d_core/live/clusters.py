"""Judge each cluster of sources by its own rocks, so that many harmless sources do not hide one dangerous source.

A cluster contains the sources of one message within a square in plan. Its rocks are flown separately, and counted
separately in the areas of interest. Each figure of the evidence of an area is the worst figure of all clusters.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rpf3d_core.alerts.evidence import AreaEvidence, areas_in, unfinished_of
from rpf3d_core.alerts.origins import Origin, all_from
from rpf3d_core.ensemble.batch import Batch
from rpf3d_core.ensemble.batches import Watch
from rpf3d_core.ensemble.flights import Deposits, FloatArray, Impacts, IntArray
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.hazard.layers import layers_of
from rpf3d_core.hazard.maps import Layers
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.live.cluster_sets import ClusterSets, LiveSets
from rpf3d_core.live.evidence import scaled, worst_of
from rpf3d_core.live.leaving import Displace, LeavingTally
from rpf3d_core.live.released import Flags
from rpf3d_core.results.overconfidence import OF_ANOTHER_SLOPE, SOME_ELSEWHERE
from rpf3d_core.unknowns.places import are_away
from rpf3d_core.values import Outcome


def clusters_of(places: FloatArray, sound: Flags, side: float) -> list[IntArray]:
    """Return the clusters of sources at places (S, 3) m: for each cluster, an array (N,) of source numbers.

    sound : (S,) True for sources that release rocks; the others belong to no cluster
    side : m, of the squares in plan; 0 if each source is a cluster, infinite if all sources are one cluster
    """
    numbers = np.flatnonzero(sound)
    if side == 0.0:
        return [np.array([number]) for number in numbers.tolist()]
    if math.isinf(side):
        return [numbers]
    squares = np.floor(places[numbers, :2] / side)
    _, square = np.unique(squares, axis=0, return_inverse=True)
    order = np.argsort(square.ravel(), kind="stable")
    return np.split(numbers[order], np.flatnonzero(np.diff(square.ravel()[order])) + 1)


def first_of_clusters(clusters: Sequence[IntArray], sources: int, rocks: int) -> list[int]:
    """Return a list with the number of rocks of each source in the first stage; the total is at least `rocks`.

    All clusters release about the same number of rocks, because each cluster is judged separately. A source without a
    cluster releases no rocks.

    clusters : as from `clusters_of`, arrays (N,) of source numbers; sources : number of sources
    """
    counts = np.zeros(sources, dtype=np.int64)
    each = -(-rocks // max(len(clusters), 1))
    for cluster in clusters:
        counts[cluster] = -(-each // len(cluster))
    return [int(count) for count in counts]


def least_in_total(first: Sequence[int], clusters: Sequence[IntArray], least: int) -> int:
    """Return the smallest total number of rocks at which each cluster has at least `least` rocks.

    first : number of rocks of each source in the first stage; later stages keep the ratios of these numbers
    clusters : as from `clusters_of`, arrays (N,) of source numbers
    """
    fewest = min((sum(first[i] for i in cluster.tolist()) for cluster in clusters), default=1)
    return -(-least * sum(first) // fewest)


def calibrated_elsewhere(
    sets: LiveSets | None, positions: FloatArray, origin: tuple[float, float, float], clusters: Sequence[IntArray]
) -> str:
    """Return a sentence on sources far from the place where the scene was calibrated; "" if there are few or none.

    "Far" is defined in `are_away`. Far sources count if they are at least 5 % of their cluster. Clusters are tested one
    by one, so that many sources at the calibrated place do not hide a few sources elsewhere.

    sets : parameter sets of the scene, None without unknowns; positions : (S, 3) m, of the sources, map frame
    origin : m, survey coordinates of the origin of the map frame; clusters : as from `clusters_of`
    """
    if sets is None or sets.place is None or not clusters:
        return ""
    away = are_away(sets.place, (positions + np.array(origin))[:, :2])
    count = sum(int(away[cluster].sum()) for cluster in clusters if away[cluster].mean() >= SOME_ELSEWHERE)
    if not count:
        return ""
    return (f"{count} of {len(positions)} sources are away from the place where the sample was calibrated "
            f"(is map_origin right?). {OF_ANOTHER_SLOPE}")  # fmt: skip


class ClusterTally:
    """The counts of the rocks of one cluster: outcomes, visits of areas, and rocks that left the terrain.

    over_sets : counts for each parameter set of a scene with unknowns; None without unknowns
    """

    def __init__(self, sources: IntArray, tallies: Tallies, leaving: LeavingTally, origin: Origin) -> None:
        """Create the counts of a cluster, empty.

        sources : (N,) source numbers of the cluster; origin : of the cluster
        leaving : the empty count of the rocks of the cluster that left the terrain
        tallies : the empty counts of the answer. All clusters share the counts of map cells; each cluster has its own
            counts of areas
        """
        inside = tallies.inside
        self.sources, self._leaving, self._origins = sources, leaving, all_from(origin)
        self.inside = CellTally(len(inside.slot), inside.scales, inside.limit, inside.compiled)
        self.tallies = replace(tallies, inside=self.inside)
        self.outcomes: Counter[Outcome] = Counter()
        self.over_sets: ClusterSets | None = None

    def count(self, deposits: Deposits, impacts: Impacts) -> None:
        """Count the outcomes of the rocks of a block, as a `Sink` of the stream; `impacts` is not used."""
        codes, counts = np.unique(deposits.outcome, return_counts=True)
        self.outcomes.update({Outcome(code): int(n) for code, n in zip(codes, counts, strict=True)})

    def watching(self, watch: Watch, displace: Displace | None = None) -> Watch:
        """Return a function that counts the rocks of a batch that left the terrain, and then calls `watch`.

        displace : returns displaced paths; needed if `watch` counts the arrivals in areas with displaced paths
        """

        def both(batch: Batch, releases: Releases) -> FloatArray:
            self._leaving.count(batch, releases.radius[batch.rows], displace)
            return watch(batch, releases)

        return both

    @property
    def left(self) -> IntArray:
        """Number (A,) of rocks that left the terrain and may have reached each area."""
        return self._leaving.counts

    @property
    def flown(self) -> int:
        """Number of rocks flown so far."""
        return self.outcomes.total()

    def evidence(self, names: Sequence[str]) -> tuple[AreaEvidence, ...]:
        """Return the evidence of the areas with the given names from the rocks of this cluster."""
        layers = layers_of(self.inside)
        found = areas_in(layers, names, self.flown)
        left = zip(found, self.left.tolist(), strict=True)
        areas = tuple(area._replace(left=min(n, area.flown - area.reached), origins=self._origins) for area, n in left)
        return areas if self.over_sets is None else _with_ends(areas, self.over_sets, layers)


def _with_ends(areas: tuple[AreaEvidence, ...], sets: ClusterSets, layers: Layers) -> tuple[AreaEvidence, ...]:
    """Return the evidence of areas, with the figures from all parameter sets added.

    These are the number of parameter sets and, if enough rocks flew, the figures of `SafeEnds`.

    areas : the evidence without parameter sets; sets : counts of each parameter set; layers : map values of the areas
    """
    ends = sets.ends(layers)
    over_sets = [area._replace(sets=sets.count) for area in areas]
    return tuple(over_sets if ends is None else (ends.added_to(area, number) for number, area in enumerate(over_sets)))


def pooled(clusters: Sequence[ClusterTally], tallies: Tallies) -> Tallies:
    """Return the counts of an answer, with the visits of areas summed over all clusters.

    clusters : at least one; tallies : the counts of the answer without visits of areas
    """
    if len(clusters) == 1:
        return clusters[0].tallies
    inside = CellTally(len(tallies.inside.slot), tallies.inside.scales, tallies.inside.limit, tallies.inside.compiled)
    for cluster in clusters:
        inside.add(cluster.inside)
    return replace(tallies, inside=inside)


def worst_evidence(clusters: Sequence[ClusterTally], names: Sequence[str]) -> tuple[tuple[AreaEvidence, ...], int]:
    """Return the worst evidence of each area over all clusters, and the number of rocks cut off in the worst cluster.

    Numbers of rocks are scaled as if each cluster had flown as many rocks as the cluster with the fewest.

    clusters : at least one; names : of the areas, in the order in which visits are counted
    """
    flown = min(cluster.flown for cluster in clusters)
    unfinished = max(scaled(unfinished_of(each.outcomes), each.flown, flown) for each in clusters)
    rows = [cluster.evidence(names) for cluster in clusters]
    if len(clusters) == 1:
        return rows[0], unfinished
    return tuple(_of_clusters(list(column), flown) for column in zip(*rows, strict=True)), unfinished


def _of_clusters(column: list[AreaEvidence], flown: int) -> AreaEvidence:
    return worst_of(column, flown)._replace(
        clusters=len(column),
        pooled_flown=sum(area.flown for area in column),
        pooled_reached=sum(area.reached for area in column),
    )
