"""Answer sources that the monitoring reports: fly a few rocks at once, then twice as many, until that is enough.

An answer is a function of the trigger, the ground, the scene and the seed. An interruption prevents later answers, but
changes no bit of any answer.
"""

import math
import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rpf3d_core.alerts.evidence import AreaEvidence, untouched
from rpf3d_core.alerts.origins import Origin
from rpf3d_core.ensemble.batch import NOTHING
from rpf3d_core.ensemble.flights import Flights
from rpf3d_core.ensemble.fly import flights_of
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import Shown, Stream, blocks_of, shown_of
from rpf3d_core.hazard.convergence import is_enough, step_of
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.live.areas import outlines_for_places
from rpf3d_core.live.cluster_sets import ClusterSets, tallies_of_displaced
from rpf3d_core.live.clusters import (
    ClusterTally,
    calibrated_elsewhere,
    clusters_of,
    first_of_clusters,
    least_in_total,
    pooled,
    worst_evidence,
)
from rpf3d_core.live.coverage import uncovered_shares
from rpf3d_core.live.released import Released, ReleaseSpread, released_over, releases_of
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_core.setup.rounds import doubling_rounds
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.unknowns.dealing import rocks_of_set
from rpf3d_core.values import Outcome

BLOCK = 1024
"""Rocks that fly before the next check for newer sources, which would make this answer useless.

These rocks take some tens of milliseconds. The first stage is flown even if newer sources arrive. Its rocks fly in
groups as large as in a run, because rocks that start close together use the same facets.
"""

SHOWN = 1000
"""Number of rocks of the first stage whose trajectories, impacts and deposits are kept for display in the viewer."""

Stop = Callable[[int], bool]
"""A function that returns True if the rocks of the stage with this number must not fly on, because of newer sources.

If the function returns True for stage 0, the sources get no answer.
"""


@dataclass(frozen=True)
class EnsembleSize:
    """How many rocks an answer flies: about `first` in its first stage, and at least `least` by its last stage.

    least : flown for each cluster of sources even if the target is met earlier, because the site lowers no alert level
        with fewer rocks
    cluster : side of the squares in plan whose sources are one cluster, m; 0: each source, infinite: all sources
    """

    first: int
    least: int = 0
    cluster: float = math.inf


@dataclass(frozen=True, eq=False)
class Answer:
    """The result of one stage of an answer: what the rocks flown so far did, as maps and trajectories.

    result : number of this answer; stage : from 0, each with twice the rocks of the previous one
    complete : True if the target is met, or `most_rocks` have flown; this trigger then gets no better answer
    trigger, standing : the sources, and the prepared terrain that the rocks flew over
    sources : number of sources that were released
    flights : of the rocks of the first stage that are kept for display; outcomes, maps : of all rocks
    areas : outlines of the areas of interest in the maps, local frame
    evidence : for each area, the worst of all clusters of sources; unfinished : rocks cut off in the worst cluster
    seconds : s, since the work on the trigger began; left_out : which sources were not released, and why
    doubtful : which sources are too far from the ground; elsewhere : which are far from where the scene was calibrated
    """

    result: int
    stage: int
    complete: bool
    trigger: Trigger
    standing: PreparedTerrain
    sources: int
    flights: Flights
    outcomes: Mapping[Outcome, int]
    maps: HazardMaps
    areas: Outlines
    seconds: float
    left_out: str
    evidence: tuple[AreaEvidence, ...] = ()
    unfinished: int = 0
    doubtful: str = ""
    elsewhere: str = ""

    @property
    def rocks(self) -> int:
        """Number of rocks flown so far for this answer, including the fragments of broken rocks."""
        return self.maps.flown


def answers(
    standing: PreparedTerrain,
    trigger: Trigger,
    around: ReleaseSpread,
    areas: Outlines,
    size: EnsembleSize,
    stop: Stop,
    results: Iterator[int],
) -> Iterator[Answer]:
    """Fly rocks for the sources of one message, and yield a better answer after each stage, with twice as many rocks.

    Parameters
    ----------
    standing : the prepared terrain; around : how rocks are spread around each source
    areas : live areas of interest, rings (P, 2) m, map frame, in addition to the scene's own
    stop : called with the number of the stage in flight; once it returns True, the stage is given up and no further
        answer is yielded
    results : yields the numbers of the answers

    Raises
    ------
    InputError
        No source can be released; the message says which and why.
    """
    began, scene = time.perf_counter(), standing.scene
    released = released_over(standing, trigger, around)
    outlines, digests = standing.areas_with(areas), standing.digests_with(areas)
    tallies = standing.empty_tallies(outlines, released.fastest, released.highest, trigger.diameters)
    clusters = _clusters(standing, trigger, released, tallies, outlines, size.cluster)
    names, groups = tuple(outlines), [cluster.sources for cluster in clusters]
    elsewhere = calibrated_elsewhere(standing.sets, trigger.positions, around.map_origin, groups)

    def answer(stage: int, complete: bool, flights: Flights, maps: HazardMaps) -> Answer:
        areas, unfinished = _evidence(standing, clusters, outlines, digests)
        seconds = time.perf_counter() - began
        return Answer(
            next(results), stage, complete, trigger, standing, int(released.sound.sum()), flights, _outcomes(clusters),
            maps, outlines, seconds, released.left_out, areas, unfinished, released.doubtful, elsewhere,
        )  # fmt: skip

    if not clusters:
        yield answer(0, True, no_flights(standing), tallies.maps(0, names))
        return
    counts = first_of_clusters(groups, len(released.places), size.first)
    least = least_in_total(counts, groups, max(size.least, standing.least_rocks))
    plan = doubling_rounds(counts, scene.target.most_rocks, least)
    stream, steps = _stream(standing, plan[0][1]), []
    for stage, (first, last) in enumerate(plan):
        stream.stop = partial(stop, stage)
        for cluster in clusters:
            if not _fly(stream, standing, released, cluster, (first, last), BLOCK if stage else None):
                return
        if stop(stage):
            return
        outcomes = _outcomes(clusters)
        maps = pooled(clusters, tallies).maps(sum(outcomes.values()), names, outcomes.get(Outcome.LOST_TO_HOLE, 0))
        steps.append(step_of(maps, standing.ground.terrain.zones))
        enough = sum(last) >= least and is_enough(steps, scene.target.half_width, scene.target.p95_energy)
        complete = stage == len(plan) - 1 or enough
        yield answer(stage, complete, stream.flights(0.0, time.perf_counter() - began), maps)
        if complete:
            return


def _clusters(
    standing: PreparedTerrain, trigger: Trigger, released: Released, tallies: Tallies, outlines: Outlines, side: float
) -> list[ClusterTally]:
    """Return the empty counts of each cluster of sources; side : of the squares that hold a cluster (m)."""
    if not len(released.places):
        return []
    places, groups = outlines_for_places(outlines), clusters_of(released.places, released.sound, side)
    clusters = [
        ClusterTally(sources, tallies, places, _origin(standing, trigger, released.places[sources]))
        for sources in groups
    ]
    if standing.sets is not None:
        displaced = tallies_of_displaced(standing.sets, tallies)
        for one in clusters:
            one.over_sets = ClusterSets(standing.sets, one.tallies, displaced, standing.ground.engine)
    return clusters


def _origin(standing: PreparedTerrain, trigger: Trigger, places: FloatArray) -> Origin:
    """Return the origin of the rocks of a cluster with sources at places (N, 3) m, local frame."""
    ground = standing.ground
    x, y, z = ground.terrain.frame.points_to_input(places.mean(axis=0)).tolist()
    return Origin(
        topic=trigger.topic, place=(x, y, z), sources=len(places), sources_digest=trigger.digest,
        terrain_digest=ground.digest, terrain_stamp_ns=ground.whole_ns,
    )  # fmt: skip


def _fly(
    stream: Stream,
    standing: PreparedTerrain,
    released: Released,
    cluster: ClusterTally,
    numbers: tuple[Sequence[int], Sequence[int]],
    size: int | None,
) -> bool:
    """Fly the next rocks of a cluster; return False if that was stopped.

    numbers : for every source, first rock to fly and the number after the last; size : as in `blocks_of`
    """
    sources = cluster.sources
    first, last = ([column[i] for i in sources.tolist()] for column in numbers)
    stream.watch, stream.sink = cluster.tallies, cluster.count
    if standing.sets is not None and cluster.over_sets is not None:
        return _fly_sets(stream, standing, released, cluster, (first, last))
    blocks, seed = blocks_of(first, last, size), standing.scene.seed
    return stream.fly(releases_of(standing, released, some, seed, sources) for some in blocks)


def _fly_sets(
    stream: Stream,
    standing: PreparedTerrain,
    released: Released,
    cluster: ClusterTally,
    numbers: tuple[Sequence[int], Sequence[int]],
) -> bool:
    """Fly the next rocks of a cluster with one parameter set after another; return False if that was stopped.

    numbers : for every source of the cluster, first rock to fly and the number after the last
    """
    sets, over, sources = standing.sets, cluster.over_sets, cluster.sources
    assert sets is not None and over is not None
    for number, flight in enumerate(sets.flights):
        dealt = [
            rocks_of_set(number, len(sets.flights), first, last, source)
            for source, first, last in zip(sources.tolist(), *numbers, strict=True)
        ]
        releases = releases_of(standing, released, dealt, standing.scene.seed, sources)
        stream.flight, stream.watch = flight, over.watch_of(number)
        flown, left = cluster.flown, cluster.left
        if len(releases.x) and not stream.fly([releases]):
            return False
        over.end(number, cluster.flown - flown, cluster.left - left)
    return True


def _outcomes(clusters: Sequence[ClusterTally]) -> dict[Outcome, int]:
    return dict(sum((cluster.outcomes for cluster in clusters), Counter[Outcome]()))


def _evidence(
    standing: PreparedTerrain, clusters: Sequence[ClusterTally], outlines: Outlines, digests: Mapping[str, str]
) -> tuple[tuple[AreaEvidence, ...], int]:
    """Return the evidence of each area, with the share that has no terrain, and the number of rocks cut off.

    digests : of the outline of each area
    """
    names = tuple(outlines)
    areas, unfinished = worst_evidence(clusters, names) if clusters else (untouched(names), 0)
    shares = uncovered_shares(standing, outlines)
    return tuple(area._replace(uncovered=shares[area.name], outline=digests[area.name]) for area in areas), unfinished


def no_flights(standing: PreparedTerrain) -> Flights:
    """Return the flights of an answer in which no rock flew, because there were no sources."""
    none = np.empty(0, dtype=np.int64)
    releases = Releases(none, none, np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0))
    return flights_of([NOTHING], releases, standing.ground.engine.name)


def _stream(standing: PreparedTerrain, first: Sequence[int]) -> Stream:
    """Return the object that flies the rocks of an answer; it keeps rocks of the first stage for display.

    first : number of rocks of each source in the first stage
    """
    shown: Shown = shown_of(sum(first), SHOWN, SHOWN)
    return Stream(standing.ground.engine, standing.flight, shown, impacts=False)


def warm_answers(standing: PreparedTerrain, trigger: Trigger, around: ReleaseSpread, rocks: int) -> float:
    """Fly a small answer and discard it, so that all its code is compiled before the first real answer.

    Return the seconds it took.

    rocks : enough to reach cells with more than `hazard.layers.FEW` bins, so that the compiled loop is used, too
    """
    began = time.perf_counter()
    centre = np.asarray(trigger.positions)[0, :2]
    ring = centre + np.array([[-5.0, -5.0], [5.0, -5.0], [0.0, 5.0]])
    size, numbers = EnsembleSize(rocks), iter(range(1, 100))
    for _ in answers(standing, trigger, around, {"warm": [ring]}, size, lambda stage: False, numbers):
        return time.perf_counter() - began
    return time.perf_counter() - began
