"""Measure the numerical error of fixed time steps: fly the same rocks with exact contacts and in fixed steps.

In this package, "by events" means with exact contacts, without a time step.
"""

import time
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.accuracy.differences import AnswerDifference, difference, map_distance
from rpf3d_core.accuracy.flown import FlownSample, flight_seconds, fly, spread, with_engine
from rpf3d_core.accuracy.from_above import highest_ground
from rpf3d_core.accuracy.geometric import put_back
from rpf3d_core.accuracy.on_raster import on_raster
from rpf3d_core.ensemble.flights import Deposits
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.ensemble.releases import Releases
from rpf3d_core.ensemble.stream import taken
from rpf3d_core.hazard.raster import raster_over
from rpf3d_core.setup.prepared import Prepared
from rpf3d_core.simulation.capped import engine_over
from rpf3d_core.simulation.engines import Engine, Reference, stepping
from rpf3d_core.terrain.facet_geometry import NEAR
from rpf3d_core.values import Outcome

BUDGET = 1.5
"""Time budget (s of one core) to measure the error of a setting; the measurement of the cost has the same budget."""
TIMED_ROCKS = 10
"""Largest number of rocks to measure the cost of a setting, with every step tested for contact."""


class Steps(NamedTuple):
    """A setting of the thesis' fixed-step method, as in `method.stepping` of a scene.

    dt : time step, s; threshold : contact distance, m, or its square, m2, if `squared`
    squared : True if the squared distance is compared with `threshold`, as in the thesis' code
    """

    dt: float
    threshold: float
    squared: bool = False


SETTINGS = (
    *(Steps(dt=dt, threshold=threshold) for threshold in (0.5, 0.05, 0.005) for dt in (1e-1, 1e-2, 1e-3, 1e-4, 1e-5)),
    Steps(dt=1e-3, threshold=0.05, squared=True),
    Steps(dt=1e-4, threshold=0.05, squared=True),  # the thesis' own code with its own defaults (appendix; section 3.1)
)


class OnRaster(NamedTuple):
    """A setting of the fixed-step method on a raster of heights; cell : side of a cell, m; dt : time step, s."""

    cell: float
    dt: float


RASTER_CELLS, RASTER_STEPS = (4.0, 1.0), (1e-2, 1e-3, 1e-4)
"""Rasters to measure: cell sizes as multiples of the scene's finest map cell (`raster_over`), and time steps (s)."""
MOST_NODES = 2_000_000
"""Largest number of heights of a raster; a finer raster is not measured, because it takes too long."""
GUESSED_STEP = 2e-5
"""Assumed computing time (s) of a time step before the first measurement: that of VTK called from Python."""


class Price(NamedTuple):
    """The computing time of a fixed-step setting, if every step is tested for contact.

    seconds_per_1000 : s of one core for 1,000 rocks; step : s of one core for one step of one rock
    by_clock : True if a step of this setting was timed; False if `step` is the time of a step in an earlier setting, or
        GUESSED_STEP without an earlier setting
    """

    seconds_per_1000: float
    step: float
    by_clock: bool


class MeasuredSetting(NamedTuple):
    """The measured error and cost of one fixed-step setting.

    off : difference from the result of the same rocks with exact contacts
    setting : the measured setting; rocks : number of rocks flown with it
    tunnelled : share of rocks (-) that ended under the ground; steps : mean number of steps of a rock
    vtk : price if VTK, called from Python, finds the closest facet, as in the thesis; None on a raster, which needs no
        closest facet
    compiled : price with the compiled engine
    """

    setting: Steps | OnRaster
    rocks: int
    off: AnswerDifference
    tunnelled: float
    steps: float
    vtk: Price | None
    compiled: Price


def stepped_answers(
    prepared: Prepared, releases: Releases, exact: FlownSample, settings: tuple[Steps, ...] = SETTINGS
) -> Iterator[MeasuredSetting]:
    """Yield the error and the cost of each fixed-step setting, compared with exact contacts for the same rocks.

    exact : result of all releases with exact contacts; settings : the fixed-step settings to measure
    """
    # VTK's own locator over the same terrain: only this measurement needs it, to time the method of the thesis.
    by_vtk = with_engine(prepared, engine_over(Reference.name, prepared.terrain))
    same, step_vtk, step_compiled = {len(exact.rows): exact}, GUESSED_STEP, GUESSED_STEP
    for setting in settings:
        found = fly(with_engine(prepared, _stepping(prepared.engine, setting)), releases, BUDGET, paths=True)
        rocks = len(found.rows)
        if rocks not in same:
            same[rocks] = fly(prepared, taken(releases, found.rows), paths=True)
        steps = flight_seconds(found.flights) / rocks / setting.dt
        vtk = price_of(by_vtk, releases, setting, steps, step_vtk)
        compiled = price_of(prepared, releases, setting, steps, step_compiled)
        step_vtk, step_compiled = vtk.step, compiled.step
        lost = float(under_ground(found.flights.deposits, prepared.engine).mean())
        yield MeasuredSetting(
            setting=setting,
            rocks=rocks,
            off=difference(found, same[rocks], prepared.scene.gravity),
            tunnelled=lost,
            steps=steps,
            vtk=vtk,
            compiled=compiled,
        )


def raster_answers(prepared: Prepared, releases: Releases, exact: FlownSample) -> Iterator[MeasuredSetting]:
    """Yield the error and the cost of fixed steps on rasters of several cell sizes, for several time steps.

    On each raster, the rocks start at the same heights above the ground as on the scene's terrain. A raster with more
    than MOST_NODES (2 million) heights, or with nothing but holes, is left out.

    exact : result of all releases with exact contacts, over the scene's own terrain
    """
    finest = raster_over(prepared.terrain).cell
    for cell in (times * finest for times in RASTER_CELLS):
        low, high = prepared.engine.facets.low, prepared.engine.facets.high
        if (high[0] - low[0]) * (high[1] - low[1]) > MOST_NODES * cell * cell:
            continue
        for dt in RASTER_STEPS:
            raster = on_raster(prepared, cell, dt)
            if raster is None:
                continue
            found = fly(raster, put_back(releases, prepared.engine, raster.engine), paths=True)
            off = difference(found, exact, prepared.scene.gravity)
            lost = float(under_ground(found.flights.deposits, raster.engine).mean())
            steps = flight_seconds(found.flights) / len(found.rows) / dt
            price = Price(
                seconds_per_1000=found.seconds_per_1000,
                step=found.seconds_per_1000 / 1000.0 / max(steps, 1.0),
                by_clock=True,
            )
            yield MeasuredSetting(
                setting=OnRaster(cell, dt),
                rocks=len(found.rows),
                off=off,
                tunnelled=lost,
                steps=steps,
                vtk=None,
                compiled=price,
            )


def _stepping(engine: Engine, setting: Steps, every_step: bool = False) -> Engine:
    return stepping(engine, setting.dt, setting.threshold, setting.squared, every_step)


def price_of(prepared: Prepared, releases: Releases, setting: Steps, steps: float, step: float) -> Price:
    """Return the computing time of a fixed-step setting, timed with a few rocks.

    If one rock would exceed the time budget (BUDGET), no rock is timed, and the time of a step is `step`.

    steps : mean number of steps of a rock, over all rocks. The time of a rock is this number times the time of a step,
        so the result does not depend on how long the few timed rocks fly
    step : s, time of a step in an earlier setting, or GUESSED_STEP
    """
    if steps * step > BUDGET:
        return Price(seconds_per_1000=1000.0 * steps * step, step=step, by_clock=False)
    rocks = int(np.clip(BUDGET / max(steps * step, 1e-9), 1, TIMED_ROCKS))
    engine, flight = _stepping(prepared.engine, setting, every_step=True), prepared.flight
    some = taken(releases, spread(np.arange(len(releases.x)), rocks))
    began = time.process_time()
    flights = fly_ensemble(engine, flight, some)
    seconds = time.process_time() - began
    took = seconds * setting.dt / max(flight_seconds(flights), setting.dt)
    return Price(seconds_per_1000=1000.0 * max(steps, 1.0) * took, step=took, by_clock=True)


def under_ground(deposits: Deposits, engine: Engine) -> NDArray[np.bool_]:
    """Return flags (R,) for R rocks: True for a rock that passed through the ground and so left the terrain below it.

    A rock that passes through the lowest ground leaves the terrain's box immediately, at most one tolerance below
    the ground. Such a rock is also flagged, unless it leaves the box at a side.

    deposits : of the R rocks; engine : engine over the terrain on which the rocks flew
    """
    slack = NEAR * engine.facets.tolerance
    depth = np.nan_to_num(highest_ground(engine, deposits.x).z - deposits.x[:, 2], nan=-np.inf)
    low, high = np.array(engine.facets.low[:2]) + slack, np.array(engine.facets.high[:2]) - slack
    within = ((deposits.x[:, :2] > low) & (deposits.x[:, :2] < high)).all(axis=1)
    below = (depth > slack) | (within & (depth > -slack))
    return np.asarray(below & (deposits.outcome == Outcome.LEFT_TERRAIN))


def rounding(prepared: Prepared, releases: Releases, exact: FlownSample) -> float:
    """Return an upper bound (-) for the effect of rounding errors on the map of reach probability.

    The bound is the distance between two maps: of the rocks as released, and of the rocks released one tolerance (m)
    farther east. One tolerance is some thousand times the rounding error of an impact, which `accuracy.precise`
    measures. So this distance is an upper bound, even in a scene in which small differences grow fast.

    exact : result of the releases with exact contacts
    """
    moved = replace(releases, x=releases.x + np.array([prepared.engine.facets.tolerance, 0.0, 0.0]))
    return map_distance(fly(prepared, moved).reached, exact.reached)
