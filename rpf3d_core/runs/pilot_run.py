"""Estimate the time of a run from a pilot run: the reference engine flies a few rocks of the scene."""

import time
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rpf3d_core.ensemble.flights import Flights, IntArray
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.prepared import Prepared, engine_for
from rpf3d_core.simulation.engines import Compiled, Models, is_precompiled
from rpf3d_core.values import Outcome

PILOT_ROCKS = 20
"""Number of rocks of the whole scene that the reference engine flies to measure the time of one rock."""
OF_A_SOURCE = 3
"""Smallest number of pilot rocks of a source, if the source has as many; they show whether its rocks fall."""
COMPILED_GAIN = 300.0
"""Speed-up (-) of the compiled engine over the reference engine, used to estimate the time of a run.

The value is rounded down from the speed-up measured with the demo scene (docs/explanation/performance.md).
"""
COMPILE_S = 20.0
"""Time (s) to compile a new combination of models; later runs load the compiled code in much less than 1 s."""


@dataclass(frozen=True)
class Cost:
    """The estimated time of a run, from a pilot run of a few rocks.

    rocks : number of rocks of the run; auto : True if the scene has `rocks: auto`; `rocks` is then the largest number
    engine : name of the engine of the run; fly_s : time (s) to fly all rocks
    compile_s : time (s) to compile; 0 for the reference engine, or if the compiled code is in the disk cache
    impacts : mean number of impacts of a rock; pilot : number of pilot rocks
    unresolved : number of pilot rocks with the outcome `unresolved_contact`
    """

    rocks: int
    auto: bool
    engine: str
    fly_s: float
    compile_s: float
    impacts: float
    pilot: int
    unresolved: int


class Pilot(NamedTuple):
    """A pilot run: the releases and flights of its rocks, and the estimated time of the whole run."""

    releases: Releases
    flights: Flights
    cost: Cost


def pilot_run(scene: Scene, prepared: Prepared, releases: Releases, rocks: int) -> Pilot:
    """Fly a few rocks of a scene, and estimate from their time how long a run takes.

    scene : of the run, whose engine may need compiling; prepared : this scene, prepared for the reference engine
    releases : the rocks from which the pilot rocks are chosen; rocks : number of rocks of the run
    """
    few = taken(releases, _pilots(releases.source))
    began = time.perf_counter()
    flown = fly_ensemble(prepared.engine, prepared.flight, few)
    seconds = (time.perf_counter() - began) / len(few.x)
    return Pilot(releases=few, flights=flown, cost=_cost(scene, prepared, flown, seconds, rocks))


def _pilots(source: IntArray) -> IntArray:
    """Return the rows (P,) of the pilot rocks: PILOT_ROCKS (20) evenly spread rocks, and some of each rare source.

    A rare source has fewer than OF_A_SOURCE (3) of the evenly spread rocks; up to OF_A_SOURCE of its rocks are added.
    Rocks are added for at most PILOT_ROCKS rare sources.

    source : (N,) number of the source of each checked rock
    """
    chosen = np.linspace(0, len(source) - 1, PILOT_ROCKS).astype(int)
    rare = [number for number in np.unique(source) if (source[chosen] == number).sum() < OF_A_SOURCE]
    rows = [np.flatnonzero(source == number) for number in rare[:PILOT_ROCKS]]
    more = [its[np.linspace(0, len(its) - 1, OF_A_SOURCE).astype(int)] for its in rows]
    return np.unique(np.concatenate([chosen, *more]))


def _cost(scene: Scene, prepared: Prepared, flown: Flights, seconds: float, rocks: int) -> Cost:
    """Return the estimated time of the run.

    flown : flights of the pilot rocks; seconds : mean time (s) of a pilot rock; rocks : number of rocks of the run
    """
    deposits, auto = flown.deposits, scene.rocks == "auto"
    rocks = scene.target.most_rocks if auto else rocks
    fly_s = seconds * rocks
    name = engine_for(scene, rocks)
    unresolved = int((deposits.outcome == Outcome.UNRESOLVED_CONTACT).sum())
    gain, compile_s = (COMPILED_GAIN, _compile_s(prepared.flight.models)) if name == Compiled.name else (1.0, 0.0)
    return Cost(
        rocks=rocks,
        auto=auto,
        engine=name,
        fly_s=fly_s / gain,
        compile_s=compile_s,
        impacts=float(deposits.impacts.mean()),
        pilot=len(deposits.t),
        unresolved=unresolved,
    )


def _compile_s(models: Models) -> float:
    """Return the estimated time (s) to compile the models of a scene; 0 if they are already compiled."""
    return 0.0 if is_precompiled(models) else COMPILE_S
