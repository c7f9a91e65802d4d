"""Fly the rocks of a prepared scene, round by round, and return the finished run."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rpf3d_core.ensemble.batches import Progress
from rpf3d_core.ensemble.flights import Deposits, Flights, Impacts
from rpf3d_core.ensemble.fly import spread_over
from rpf3d_core.ensemble.stream import Shown, Sink, Stream, shown_of
from rpf3d_core.ensemble.totals import Totals
from rpf3d_core.hazard.convergence import Step, is_enough, step_of
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.tallies import Tallies
from rpf3d_core.results.findings import Run
from rpf3d_core.results.painting import Painting
from rpf3d_core.setup.precompiler import Precompiler
from rpf3d_core.setup.prepared import (
    Prepared,
    check_releases,
    empty_tallies,
    empty_totals,
    places_of,
    releases_in_ranges,
)
from rpf3d_core.setup.rounds import AnyRound, growing_rounds, rounds_of
from rpf3d_core.values import Outcome


@dataclass(frozen=True)
class RunControl:
    """Settings with which a caller controls a run: functions that report progress or stop the run, threads, rounds.

    progress : called before the rocks of a round fly; see `ensemble.batches.Progress`
    stop : called while rocks fly; after `stop` has returned True, no further group of rocks starts
    writing : called after the last rock has flown, before the files of a result are written
    threads : number of threads for the compiled engine; None for one thread for each core
    first : approximate number of rocks of the first round. Each further round about doubles the number of rocks flown,
        and after each round the rocks flown represent all rocks (`setup.rounds.growing_rounds`). None for the rounds
        that the scene itself asks for; ignored with `rocks: auto`
    after_round : called after each round except the last, with the result so far
    painting : object that draws the pictures; None if `run_scene` should make such an object itself
    checks_in_turn : True to check the releases of a later round only before this round, so that the first rocks fly
        soon; the reference engine checks about 1,500 releases in a second. The run may then be refused after a round
    """

    progress: Progress | None = None
    stop: Callable[[], bool] | None = None
    writing: Callable[[], None] | None = None
    threads: int | None = None
    first: int | None = None
    after_round: Callable[[Run], None] | None = None
    painting: Painting | None = None
    checks_in_turn: bool = False


UNCONTROLLED = RunControl()
"""The default: a run without progress reports and without a way to stop it."""


def fly_scene(
    prepared: Prepared,
    precompiler: Precompiler,
    shown: int | None,
    sink: Sink | None = None,
    control: RunControl = UNCONTROLLED,
    rounds: Sequence[AnyRound] | None = None,
) -> Run:
    """Fly the rocks of a prepared scene, round by round, and return the finished run.

    A round is a number of rocks after which results are checked; with `rocks: auto` or `control.first` there are
    several. The run ends when all rocks have flown, when the target of `rocks: auto` is reached, or when `control.stop`
    returns True.

    precompiler : compiles the loops that the run needs
    shown : number of rocks to keep in memory, None for all
    sink : function that receives the deposits and impacts of each block of rocks; None for no function
    rounds : rounds to fly; None for the rounds of the scene, or of `control.first`

    Raises
    ------
    InputError
        A rock starts under the ground or off the terrain, or a parameter set is refused.
    """
    scene = prepared.scene
    of_sets = _flights_over_sets(prepared) if scene.has_unknowns else None
    prepared = prepared if of_sets is None else replace(prepared, flight=of_sets[1][0])
    tallies, totals = empty_tallies(prepared), empty_totals(prepared)
    plan = rounds or _plan(prepared, control.first, 0 if of_sets is None else len(of_sets[0]))
    compile_s = precompiler.compile(prepared, tallies, lambda: _check_known(prepared, plan, control))
    kept = _kept(prepared, plan, shown)
    stream = Stream(
        engine=prepared.engine, flight=prepared.flight, shown=kept, watch=tallies, sink=counted_and(totals, sink),
        stop=control.stop, threads=control.threads,
        # A run in memory keeps the impacts of all rocks. A run on disk needs them only for impacts.parquet.
        impacts=scene.outputs.impacts or shown is None,
    )  # fmt: skip
    flyer = _flyer(prepared, stream, of_sets, tallies)
    began = time.perf_counter()

    def so_far(planned: int, steps: Sequence[Step]) -> Run:
        totals.dust = stream.dust
        flights = stream.flights(compile_s, time.perf_counter() - began)
        return finished_run(prepared, tallies, totals, flights, planned, steps, flyer.figures())

    return so_far(*_fly_rounds(
        prepared, stream, flyer.fly, plan, control, lambda: tallies.places(totals.rocks, prepared.area_names), so_far
    ))  # fmt: skip


def _plan(prepared: Prepared, first: int | None, sets: int) -> Sequence[AnyRound]:
    """Return the rounds of a run.

    first : approximate number of rocks of the first round, as in `RunControl`
    sets : number of parameter sets, 0 without unknowns

    With `rocks: auto`, `first` is ignored, because the rounds of the scene already double.
    """
    scene = prepared.scene
    if first is None or scene.rocks == "auto":
        return rounds_of(scene, places_of(prepared))
    return growing_rounds([source.rocks for source in scene.sources], places_of(prepared), first, sets)


def _kept(prepared: Prepared, plan: Sequence[AnyRound], shown: int | None) -> Shown:
    """Return which rocks to keep in memory for the pictures, and which of them with their paths.

    plan : rounds of the run; shown : number of rocks to keep, None for all
    """
    paths = prepared.scene.outputs.trajectories
    if prepared.scene.rocks == "auto" or len(plan) == 1:
        # All kept rocks belong to the first round, because with `rocks: auto` the number of later rocks is unknown.
        return shown_of(plan[0].rocks, shown, paths)
    rocks = sum(each.rocks for each in plan)
    some = spread_over(rocks, rocks if shown is None else shown)
    drawn = np.arange(min(paths, rocks))  # the rocks that fly first, so that the first results have paths
    return Shown(None if shown is None else np.union1d(some, drawn), drawn)


@dataclass(frozen=True)
class _Flyer:
    """Flies the rounds of a scene without unknowns."""

    prepared: Prepared
    stream: Stream

    def fly(self, rocks: AnyRound) -> bool:
        """Fly the rocks of a round, block after block; return False if the run was stopped before the last rock."""
        return self.stream.fly(releases_in_ranges(self.prepared, ranges) for ranges in rocks.blocks())

    def figures(self) -> None:
        """Return None, because a scene without unknowns has no figures of parameter sets."""


def _flights_over_sets(prepared: Prepared) -> Any:
    """Return the parameter sets of a scene with unknowns, and the flight settings of each set."""
    from rpf3d_core.runs.over_sets import flights_over_sets  # imported only if the scene has unknowns

    return flights_over_sets(prepared)


def _flyer(prepared: Prepared, stream: Stream, of_sets: Any, tallies: Tallies) -> Any:
    """Return the object that flies the rounds: a SetFlyer if the scene has unknowns, else a _Flyer.

    of_sets : from `_flights_over_sets`; None without unknowns
    """
    if of_sets is None:
        return _Flyer(prepared, stream)
    from rpf3d_core.runs.over_sets import SetFlyer, set_tally

    sets, flights = of_sets
    assert stream.sink is not None
    return SetFlyer(
        prepared=prepared, stream=stream, flights=flights, tally=set_tally(prepared, sets, tallies), sink=stream.sink,
        further=counted_and,
    )  # fmt: skip


def _fly_rounds(
    prepared: Prepared, stream: Stream, fly: Callable[[AnyRound], bool], plan: Sequence[AnyRound], control: RunControl,
    places: Callable[[], HazardMaps], so_far: Callable[[int, Sequence[Step]], Run],
) -> tuple[int, list[Step]]:  # fmt: skip
    """Fly round after round until the target is reached, all rounds have flown, or the run is stopped.

    Return the number of planned rocks, and with `rocks: auto` the convergence after each round.

    The caller has checked the releases of all rounds, or only of the first round if `_are_checked_in_turn`. Each later
    round is then checked before it flies: an InputError is raised if a rock starts under the ground or off the terrain.

    plan : the rounds; control : progress reports, and the function that is called after each round
    fly : function that flies a round, and returns False if the run was stopped
    places : function that returns the hazard maps of all rocks flown so far, with shares of rocks in zones and areas
    so_far : function that returns the result so far, given the number of planned rocks and the convergence
    """
    scene, steps, planned, whole = prepared.scene, list[Step](), 0, sum(each.rocks for each in plan)
    for number, each in enumerate(plan):
        planned += each.rocks
        if stream.stopped():
            break
        if number and _are_checked_in_turn(prepared, control):
            _check_all(prepared, each)
        stream.advance = control.progress(each.rocks) if control.progress else None
        if not fly(each):
            break
        if scene.rocks == "auto":
            steps.append(step_of(places(), prepared.terrain.zones))
            if is_enough(steps, scene.target.half_width, scene.target.p95_energy):
                break
        if control.after_round and each is not plan[-1]:
            control.after_round(so_far(whole, steps))
    return whole if scene.rocks != "auto" else planned, steps


def finished_run(
    prepared: Prepared, tallies: Tallies, totals: Totals, flights: Flights, planned: int, steps: Sequence[Step] = (),
    sets: Any = None,
) -> Run:  # fmt: skip
    """Return the finished run of a prepared scene, with its maps; the wall time of the run ends at this call.

    tallies, totals, flights : counts for the maps, sums and kept flights of all rocks flown
    planned : number of rocks that were to fly, without fragments; steps : convergence after each round
    sets : figures of the parameter sets, if the scene has unknowns
    """
    maps = tallies.maps(totals.rocks, prepared.area_names, totals.outcomes[Outcome.LOST_TO_HOLE])
    maps = maps if sets is None else replace(maps, sets=sets, reach_band=sets.reach(maps))
    return Run(
        prepared=prepared, flights=flights, totals=totals, maps=maps, planned=planned + totals.pieces,
        wall_s=time.perf_counter() - prepared.began, steps=tuple(steps),
    )  # fmt: skip


def _check_known(prepared: Prepared, plan: Sequence[AnyRound], control: RunControl) -> None:
    """Raise an InputError if a rock starts under the ground or off the terrain.

    All rounds are checked, but only the first round if `_are_checked_in_turn`.
    """
    for each in plan[:1] if _are_checked_in_turn(prepared, control) else plan:
        _check_all(prepared, each)


def _are_checked_in_turn(prepared: Prepared, control: RunControl) -> bool:
    """Return True if the releases of each later round are checked just before this round flies, not at the start.

    This is so with `checks_in_turn`, and with `rocks: auto`, because then only the first round is certain to fly.
    """
    return prepared.scene.rocks == "auto" or control.checks_in_turn


def _check_all(prepared: Prepared, rocks: AnyRound) -> None:
    """Raise an InputError if a rock of a round starts under the ground or off the terrain."""
    for ranges in rocks.blocks():
        check_releases(prepared, releases_in_ranges(prepared, ranges))


def counted_and(totals: Totals, sink: Sink | None) -> Sink:
    """Return a function of (deposits, impacts) that adds the deposits to `totals`, and passes both on to a sink.

    sink : function that receives the deposits and impacts; None to pass nothing on
    """

    def take(deposits: Deposits, impacts: Impacts) -> None:
        totals.add(deposits)
        if sink:
            sink(deposits, impacts)

    return take
