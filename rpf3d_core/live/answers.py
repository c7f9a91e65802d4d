"""Answer sources that the monitoring reports: fly a few rocks, then twice as many, until the result is accurate enough.

The figures of a stage depend only on the inputs of `answers` and the number of the stage, not on the speed of the
machine or the number of threads. An interruption prevents later stages, but does not change a stage that has been
yielded.
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
from rpf3d_core.live.coverage import grounds_of
from rpf3d_core.live.leaving import LeavingTally
from rpf3d_core.live.released import Draw, Released, ReleaseSpread, drawn_for, released_over
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_core.setup.rounds import doubling_rounds
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.unknowns.dealing import rocks_of_set
from rpf3d_core.values import Outcome

BLOCK = 1024
"""Approximate number of rocks in a block after the first stage; a block takes some tens of milliseconds.

Between two blocks, the simulator checks for newer sources, which make this answer useless. Newer sources do not stop
the first stage, so its rocks fly in larger blocks, as in a run. This is faster, because rocks that start close together
use the same facets.
"""

SHOWN = 1000
"""Number of rocks of the first stage whose trajectories, impacts and deposits are kept for display in the viewer."""

Stop = Callable[[int], bool]
"""A function that returns True if the flight of the stage with this number must stop, for example for newer sources.

If the function returns True for stage 0, the sources get no answer.
"""


@dataclass(frozen=True)
class EnsembleSize:
    """Number of rocks of an answer, and size of the clusters into which its sources are divided.

    first : approximate number of rocks in the first stage, of all clusters together
    least : smallest number of rocks of each cluster from the second stage on, even if the result of fewer rocks is
        accurate enough: an answer with fewer rocks cannot lower an alert level (`evidence.fewest_rocks` of the site
        file)
    cluster : m, side of the squares in plan whose sources form one cluster; 0: each source is a cluster; infinite: all
        sources are one cluster
    """

    first: int
    least: int = 0
    cluster: float = math.inf


@dataclass(frozen=True, eq=False)
class Answer:
    """The result of one stage of an answer: what the rocks flown so far did, as maps and trajectories.

    result : number of this result; each stage of an answer has its own number
    stage : number of the stage, from 0. Each stage has about twice the rocks of the previous stage; the second stage
        may have more, to reach `EnsembleSize.least`
    complete : True if this is the last answer to the trigger: the result is as accurate as `target` of the scene
        demands, the next stage would have more rocks than `target.most_rocks`, or the trigger has no sources
    trigger, standing : the sources, and the prepared terrain that the rocks flew over
    sources : number of sources that released rocks
    flights : flights of some rocks of the first stage, for display
    outcomes : number of rocks with each outcome; maps : hazard maps; both are of all rocks flown so far
    areas : outlines of the areas of interest in the maps, local frame
    evidence : for each area, the worst figures of all clusters of sources
    unfinished : number of rocks whose flight was cut off, in the worst cluster; scaled as if this cluster had as many
        rocks as the cluster with the fewest rocks
    seconds : s, since the work on the trigger began
    left_out : a sentence on the sources that release no rocks, and why; "" if there are none
    doubtful : a sentence on the sources that are too far from the ground, "" if there are none
    elsewhere : a sentence on the sources that are far from the place where the scene was calibrated, "" if there are
        few or none
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
    """Fly rocks for the sources of one message, and yield a better answer after each stage, with about twice the rocks.

    If the message has no sources, the function yields one answer, without rocks.

    Parameters
    ----------
    standing : the prepared terrain; trigger : the sources; around : how rocks are spread around each source
    size : numbers of rocks, and the size of a cluster
    areas : live areas of interest, rings (P, 2) m, map frame, in addition to the scene's own; a live area replaces an
        area of the scene with the same name
    stop : called with the number of the stage in flight; once it returns True, the stage is given up and no further
        answer is yielded
    results : yields a number for each result, that is for each stage of an answer

    Raises
    ------
    InputError
        There are sources, but none can release rocks; the message states why.
    """
    began, scene = time.perf_counter(), standing.scene
    released = released_over(standing, trigger, around)
    outlines, digests = standing.areas_with(areas), standing.digests_with(areas)
    highest = released.highest(standing.ground.facets.high[2])
    tallies = standing.empty_tallies(outlines, released.fastest, highest, trigger.diameters)
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
        draw = drawn_for(standing, released, (first, last))
        for cluster in clusters:
            if not _fly(stream, standing, draw, cluster, (first, last), BLOCK if stage else None):
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
    """Return empty counts for each cluster of sources; an empty list if the message has no sources.

    tallies : the counts of the answer; outlines : rings of all areas of interest, local frame
    side : m, of the squares in plan whose sources form one cluster
    """
    if not len(released.places):
        return []
    places, groups = outlines_for_places(outlines), clusters_of(released.places, released.sound, side)
    lowest = [ground.lowest for ground in grounds_of(standing, outlines).values()]
    clusters = [
        ClusterTally(
            sources, tallies, LeavingTally(places, lowest, standing.scene.gravity),
            _origin(standing, trigger, released.places[sources]),
        )
        for sources in groups
    ]  # fmt: skip
    if standing.sets is not None:
        displaced = tallies_of_displaced(standing.sets, tallies)
        for one in clusters:
            one.over_sets = ClusterSets(standing.sets, one.tallies, displaced, standing.ground.engine)
    return clusters


def _origin(standing: PreparedTerrain, trigger: Trigger, places: FloatArray) -> Origin:
    """Return the origin of a cluster: mean place of its sources, message that contained the sources, and terrain.

    places : (N, 3) m, of the sources of the cluster, local frame
    """
    ground = standing.ground
    x, y, z = ground.terrain.frame.points_to_input(places.mean(axis=0)).tolist()
    return Origin(
        topic=trigger.topic, place=(x, y, z), sources=len(places), sources_digest=trigger.digest,
        terrain_digest=ground.digest, terrain_stamp_ns=ground.whole_ns,
    )  # fmt: skip


def _fly(
    stream: Stream,
    standing: PreparedTerrain,
    draw: Draw,
    cluster: ClusterTally,
    numbers: tuple[Sequence[int], Sequence[int]],
    size: int | None,
) -> bool:
    """Fly the next rocks of a cluster, and add them to its counts; return False if the flight was stopped.

    stream : flies the rocks; draw : returns their releases
    numbers : two lists over all sources: number of the first rock to fly, and the number after the last rock
    size : approximate number of rocks in a block; None for blocks of the same size as in a run. The flight may stop
        after each block. With unknowns, `size` has no effect
    """
    sources = cluster.sources
    first, last = ([column[i] for i in sources.tolist()] for column in numbers)
    stream.watch, stream.sink = cluster.watching(cluster.tallies), cluster.count
    if standing.sets is not None and cluster.over_sets is not None:
        return _fly_sets(stream, standing, draw, cluster, (first, last))
    return stream.fly(draw(some, sources) for some in blocks_of(first, last, size))


def _fly_sets(
    stream: Stream,
    standing: PreparedTerrain,
    draw: Draw,
    cluster: ClusterTally,
    numbers: tuple[Sequence[int], Sequence[int]],
) -> bool:
    """Fly the next rocks of a cluster, one parameter set after another; return False if the flight was stopped.

    The rocks are added to the counts of the cluster and to the counts of their sets.

    stream : flies the rocks; draw : returns their releases
    numbers : two lists over the sources of the cluster: number of the first rock to fly, and the number after the last
    """
    sets, over, sources = standing.sets, cluster.over_sets, cluster.sources
    assert sets is not None and over is not None
    for number, flight in enumerate(sets.flights):
        dealt = [
            rocks_of_set(number, len(sets.flights), first, last, source)
            for source, first, last in zip(sources.tolist(), *numbers, strict=True)
        ]
        releases = draw(dealt, sources)
        stream.flight = flight
        stream.watch = cluster.watching(over.watch_of(number), over.displacement_of(number))
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
    """Return the evidence of each area from all clusters, and the number of rocks cut off in the worst cluster.

    The evidence includes the share of the area without terrain, and the digest of the outline of the area.

    outlines : rings of all areas of interest, local frame; digests : for each area, the digest of its outline
    """
    names = tuple(outlines)
    areas, unfinished = worst_evidence(clusters, names) if clusters else (untouched(names), 0)
    grounds = grounds_of(standing, outlines)
    described = (area._replace(uncovered=grounds[area.name].uncovered, outline=digests[area.name]) for area in areas)
    return tuple(described), unfinished


def no_flights(standing: PreparedTerrain) -> Flights:
    """Return the flights of an answer in which no rock flew, because there were no sources."""
    none = np.empty(0, dtype=np.int64)
    releases = Releases(none, none, np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0))
    return flights_of([NOTHING], releases, standing.ground.engine.name)


def _stream(standing: PreparedTerrain, first: Sequence[int]) -> Stream:
    """Return the object that flies the rocks of an answer, and keeps the flights of some rocks for display.

    The kept rocks are rocks of the first stage.

    first : number of rocks of each source in the first stage
    """
    shown: Shown = shown_of(sum(first), SHOWN, SHOWN)
    return Stream(standing.ground.engine, standing.flight, shown, impacts=False)


def warm_answers(standing: PreparedTerrain, trigger: Trigger, around: ReleaseSpread, rocks: int) -> float:
    """Fly the first stage of an answer and discard it, so that all code is compiled before the first real answer.

    Return the duration (s). A triangle around the first source serves as area of interest, so that the code for areas
    is compiled, too.

    trigger : sources, at least one; around : how rocks are spread around each source
    rocks : number of rocks, so large that the cells that rocks reach have more than `hazard.layers.FEW` bins in total;
        for fewer bins the code uses NumPy, and the loop would not be compiled
    """
    began = time.perf_counter()
    centre = np.asarray(trigger.positions)[0, :2]
    ring = centre + np.array([[-5.0, -5.0], [5.0, -5.0], [0.0, 5.0]])
    size, numbers = EnsembleSize(rocks), iter(range(1, 100))
    for _ in answers(standing, trigger, around, {"warm": [ring]}, size, lambda stage: False, numbers):
        return time.perf_counter() - began
    return time.perf_counter() - began
