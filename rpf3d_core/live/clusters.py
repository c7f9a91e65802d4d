"""Judge each cluster of sources by its own rocks: one dangerous source among many harmless ones must not be diluted.

A cluster holds the sources of one message within a square in plan. Its rocks fly by themselves and are counted by
themselves in the areas of interest. The evidence of an area is the worst of all clusters, figure by figure.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rpf3d_core.alerts.evidence import AreaEvidence, areas_in, unfinished_of
from rpf3d_core.alerts.origins import Origin, all_from
from rpf3d_core.ensemble.flights import Deposits, Impacts, IntArray
from rpf3d_core.hazard.layers import layers_of
from rpf3d_core.hazard.maps import Layers
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.hazard.tally import CellTally
from rpf3d_core.live.areas import AreaOutline
from rpf3d_core.live.cluster_sets import ClusterSets, LiveSets
from rpf3d_core.live.evidence import scaled, worst_of
from rpf3d_core.live.leaving import left_ahead_of
from rpf3d_core.live.released import Flags
from rpf3d_core.results.overconfidence import OF_ANOTHER_SLOPE, SOME_ELSEWHERE
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.unknowns.places import are_away
from rpf3d_core.values import Outcome


def clusters_of(places: FloatArray, sound: Flags, side: float) -> list[IntArray]:
    """Return the clusters of the sound sources at places (S, 3) m: the numbers of the sources of each.

    side : side of the squares in plan (m); 0 if each source is a cluster, infinite if all sources are one
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
    """Return how many rocks each of the sources releases in the first stage, at least `rocks` in total.

    All clusters release about the same number of rocks, because each is judged by its own. Sources without a cluster
    release none.

    clusters : as from `clusters_of`, arrays (N,) of numbers of sources
    """
    counts = np.zeros(sources, dtype=np.int64)
    each = -(-rocks // max(len(clusters), 1))
    for cluster in clusters:
        counts[cluster] = -(-each // len(cluster))
    return [int(count) for count in counts]


def least_in_total(first: Sequence[int], clusters: Sequence[IntArray], least: int) -> int:
    """Return the rocks that must fly in total, shared out as in `first`, until each cluster has `least` rocks.

    clusters : as from `clusters_of`, arrays (N,) of numbers of sources
    """
    fewest = min((sum(first[i] for i in cluster.tolist()) for cluster in clusters), default=1)
    return -(-least * sum(first) // fewest)


def calibrated_elsewhere(
    sets: LiveSets | None, positions: FloatArray, origin: tuple[float, float, float], clusters: Sequence[IntArray]
) -> str:
    """Return a sentence on the sources away from the place where the sample of the scene was calibrated; "" if few.

    As in a run, 5 % of the rocks are enough. The rocks are those of a cluster, because many sources at the place must
    not hide a few elsewhere. All sources of a cluster release the same number of rocks.

    sets : of the scene, None without unknowns; positions : (S, 3) m, of the sources, map frame
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
    """The counts of the rocks of one cluster: outcomes, visits of areas, and rocks that left with an area ahead.

    left : (A,) rocks that left the terrain with each area ahead of them
    over_sets : what each parameter set of a scene with unknowns did; None without unknowns
    """

    def __init__(self, sources: IntArray, tallies: Tallies, areas: Sequence[AreaOutline], origin: Origin) -> None:
        """Begin without rocks.

        tallies : the empty counts of the answer, whose maps the rocks of all clusters share; origin : of the rocks
        """
        inside = tallies.inside
        self.sources, self._areas, self._origins = sources, areas, all_from(origin)
        self.inside = CellTally(len(inside.slot), inside.scales, inside.limit, inside.compiled)
        self.tallies = replace(tallies, inside=self.inside)
        self.outcomes: Counter[Outcome] = Counter()
        self.left = np.zeros(len(areas), dtype=np.int64)
        self.over_sets: ClusterSets | None = None

    def count(self, deposits: Deposits, impacts: Impacts) -> None:
        """Count how the rocks of a block ended."""
        codes, counts = np.unique(deposits.outcome, return_counts=True)
        self.outcomes.update({Outcome(code): int(n) for code, n in zip(codes, counts, strict=True)})
        self.left = self.left + left_ahead_of(deposits, self._areas)

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
    """Return the evidence of areas with their ends over the parameter sets, where enough rocks have flown.

    layers : map values of the areas
    """
    ends = sets.ends(layers)
    over_sets = [area._replace(sets=sets.count) for area in areas]
    return tuple(over_sets if ends is None else (ends.added_to(area, number) for number, area in enumerate(over_sets)))


def pooled(clusters: Sequence[ClusterTally], tallies: Tallies) -> Tallies:
    """Return the counts of an answer with the visits of areas by the rocks of all clusters."""
    if len(clusters) == 1:
        return clusters[0].tallies
    inside = CellTally(len(tallies.inside.slot), tallies.inside.scales, tallies.inside.limit, tallies.inside.compiled)
    for cluster in clusters:
        inside.add(cluster.inside)
    return replace(tallies, inside=inside)


def worst_evidence(clusters: Sequence[ClusterTally], names: Sequence[str]) -> tuple[tuple[AreaEvidence, ...], int]:
    """Return the worst evidence of each area over all clusters, and the number of rocks cut off in the worst cluster.

    All numbers are as if each cluster had flown as many rocks as the smallest.
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
