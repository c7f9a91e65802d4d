"""Answer sources: fly a small ensemble at once, then double the number of rocks until the answer is good enough.

An answer is a function of the trigger, the ground, the scene and the seed. An interruption prevents later answers, but
changes no bit of any answer.
"""

import time
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rpf3d_core.ensemble.batch import NOTHING
from rpf3d_core.ensemble.flights import Deposits, Flights, Impacts
from rpf3d_core.ensemble.fly import flights_of
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import Shown, Stream, blocks_of, shown_of
from rpf3d_core.hazard.convergence import is_enough, step_of
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.live.released import ReleaseSpread, released_over, releases_of
from rpf3d_core.live.standing import Outlines, PreparedTerrain
from rpf3d_core.live.triggers import Trigger
from rpf3d_core.setup.rounds import doubling_rounds
from rpf3d_core.values import Outcome

BLOCK = 1024
"""Rocks that fly before the next check for a newer trigger: some tens of milliseconds.

The first stage is flown even if a newer trigger arrives. Its blocks are as large as the blocks of a run, because rocks
that start close together use the same facets.
"""

SHOWN = 1000
"""Number of rocks of the first stage whose trajectories, impacts and deposits are kept for display."""

Stop = Callable[[int], bool]
"""Function of a stage's number that returns True if the stage must be given up while its rocks fly.

If the function returns True for stage 0, the trigger stays unanswered.
"""


@dataclass(frozen=True)
class EnsembleSize:
    """The approximate number of rocks of the first answer, and the least number of rocks of the last answer.

    least : rocks to fly even if the target is met earlier, because the site clears no level with fewer rocks
    """

    first: int
    least: int = 0


@dataclass(frozen=True, eq=False)
class Answer:
    """The result of one stage of an answer.

    result : number of this answer; stage : from 0, each with twice the rocks of the previous one
    complete : True if the target is met, or `most_rocks` have flown; this trigger then gets no better answer
    trigger, standing : the sources, and the prepared terrain that the rocks flew over
    sources : number of sources that were released
    flights : of the rocks of the first stage that are kept for display; outcomes, maps : of all rocks
    areas : outlines of the areas of interest in the maps, local frame
    seconds : s, since the work on the trigger began; left_out : which sources were not released, and why
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

    @property
    def rocks(self) -> int:
        """Number of rocks flown, including the fragments of broken rocks."""
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
    """Yield the answers to a trigger: the first with about `size.first` rocks, then each with twice as many.

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
    outlines, outcomes = standing.areas_with(areas), Counter[Outcome]()
    tallies = standing.empty_tallies(outlines, released.fastest, released.highest, trigger.diameters)
    names = tuple(outlines)

    def answer(stage: int, complete: bool, flights: Flights, maps: HazardMaps) -> Answer:
        seconds = time.perf_counter() - began
        return Answer(
            next(results), stage, complete, trigger, standing, int(released.sound.sum()), flights, dict(outcomes),
            maps, outlines, seconds, released.left_out,
        )  # fmt: skip

    if not len(released.places):
        yield answer(0, True, no_flights(standing), tallies.maps(0, names))
        return
    plan = doubling_rounds(released.first_round(size.first), scene.target.most_rocks, size.least)
    stream, steps = _stream(standing, tallies, outcomes, plan[0][1]), []
    for stage, (first, last) in enumerate(plan):
        blocks, stream.stop = blocks_of(first, last, BLOCK if stage else None), partial(stop, stage)
        if not stream.fly(releases_of(standing, released, some, scene.seed) for some in blocks) or stop(stage):
            return
        maps = tallies.maps(outcomes.total(), names, outcomes[Outcome.LOST_TO_HOLE])
        steps.append(step_of(maps, standing.ground.terrain.zones))
        enough = sum(last) >= size.least and is_enough(steps, scene.target.half_width, scene.target.p95_energy)
        complete = stage == len(plan) - 1 or enough
        yield answer(stage, complete, stream.flights(0.0, time.perf_counter() - began), maps)
        if complete:
            return


def no_flights(standing: PreparedTerrain) -> Flights:
    """Return the flights of an ensemble without rocks."""
    none = np.empty(0, dtype=np.int64)
    releases = Releases(none, none, np.empty((0, 3)), np.empty((0, 3)), np.empty(0), np.empty(0))
    return flights_of([NOTHING], releases, standing.ground.engine.name)


def _stream(standing: PreparedTerrain, tallies: Tallies, outcomes: Counter[Outcome], first: Sequence[int]) -> Stream:
    """Return the stream that flies the rocks; the rocks kept for display are spread over the first stage."""
    shown: Shown = shown_of(sum(first), SHOWN, SHOWN)

    def count(deposits: Deposits, impacts: Impacts) -> None:
        codes, counts = np.unique(deposits.outcome, return_counts=True)
        outcomes.update({Outcome(code): int(n) for code, n in zip(codes, counts, strict=True)})

    return Stream(standing.ground.engine, standing.flight, shown, tallies, count, impacts=False)


def warm_answers(standing: PreparedTerrain, trigger: Trigger, around: ReleaseSpread, rocks: int) -> float:
    """Fly a small ensemble and discard it, so that all code of an answer is compiled; return the seconds it took.

    rocks : enough to reach cells with more than `hazard.layers.FEW` bins, so that the compiled loop is used, too
    """
    began = time.perf_counter()
    centre = np.asarray(trigger.positions)[0, :2]
    ring = centre + np.array([[-5.0, -5.0], [5.0, -5.0], [0.0, 5.0]])
    size, numbers = EnsembleSize(rocks), iter(range(1, 100))
    for _ in answers(standing, trigger, around, {"warm": [ring]}, size, lambda stage: False, numbers):
        return time.perf_counter() - began
    return time.perf_counter() - began
