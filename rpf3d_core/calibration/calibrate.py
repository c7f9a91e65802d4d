"""Calibrate the unknowns of a scene on its observations, within a given time; `rpf3d calibrate` uses this module."""

import math
import time
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from rpf3d_core.calibration.files import import_writers, write_result
from rpf3d_core.calibration.findings import Findings, findings_of
from rpf3d_core.calibration.flying import Flown, Slope, fly_set, releases_of_round, slope_of, workers_of
from rpf3d_core.calibration.observations import calibration_of
from rpf3d_core.calibration.reserve import LARGEST
from rpf3d_core.calibration.rounds import Control, Result, fly_rounds
from rpf3d_core.calibration.sampling import sets_of_round
from rpf3d_core.calibration.state import check_folder, open_state
from rpf3d_core.errors import InputError
from rpf3d_core.materials.distributions import Distribution, quantiles
from rpf3d_core.scene.calibration import CalibrationSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import with_choices

BUDGET_S = 900.0
"""Default time (s) of one call of a calibration, from reading the scene to writing the results."""
LEAST_BUDGET_S = 10.0
"""Smallest allowed budget (s): enough for points on a small terrain, if the compiled code is in the cache."""
END_S = 4.0
"""Time (s) that a small calibration takes for scores, pictures and files, to suggest a budget that is long enough."""

SOME_ROUNDS = 3
"""Number of rounds for which the message on a too short budget estimates the time; fewer rounds are of little use."""


class Calibrated(NamedTuple):
    """A calibration that has ended or was interrupted.

    found : the findings, None if the calibration was interrupted
    sets : number of flown parameter sets, which are kept on disk
    """

    found: Findings | None
    sets: int


def calibrate(scene: Scene | str | Path, out: str | Path, control: Control, engine: str | None = None) -> Calibrated:
    """Calibrate a scene and write the result into a folder.

    Parameter sets that an earlier call has flown are read from the folder, and not flown again. A calibration that the
    user interrupts keeps its flown sets in the folder, but writes no result.

    Parameters
    ----------
    scene : the scene, or its file
    out : new or empty folder, or the folder of an earlier calibration of the same scene, which continues
    control : deadline, progress and interruption
    engine : "reference" or "compiled"; None for the engine of the scene: `auto` means compiled if numba is installed

    Raises
    ------
    InputError
        The scene, its observations or the folder are refused; or the time was too short to fly a single set.
    """
    began = time.monotonic()
    chosen = with_choices(scene if isinstance(scene, Scene) else read_scene(scene), None, engine, None)
    spec, folder = calibration_of(chosen), Path(out)
    check_folder(folder, chosen)
    slope = slope_of(_many(chosen))
    prepared_s = time.monotonic() - began
    import_writers()  # imported here, so that the import takes no time after the flights
    state = open_state(folder, chosen)
    priors = [prior.distribution for prior in spec.unknowns.values()]

    def end(result: Result) -> float:
        found = findings_of(slope, spec, result, _book(slope, spec), chosen.seed)
        scored = time.monotonic()
        with TemporaryDirectory() as folder:
            write_result(Path(folder), chosen, slope, spec, result, found)
        return time.monotonic() - scored

    result = fly_rounds(slope, priors, chosen.seed, state, control._replace(began=began), end)
    if control.stop():
        return Calibrated(found=None, sets=0 if result is None else len(result.flown))
    if result is None:
        raise InputError(f"{chosen.path}: {_too_short(slope, priors, prepared_s, control)}")
    found = findings_of(slope, spec, result, _book(slope, spec), chosen.seed)
    write_result(folder, chosen, slope, spec, result, found)
    return Calibrated(found=found, sets=len(result.flown))


def deadline_after(budget: float | None) -> float:
    """Return the end of a time budget that starts now, as `time.monotonic()` (s).

    budget : s; None for BUDGET_S (900 s)

    Raises
    ------
    InputError
        The budget is shorter than LEAST_BUDGET_S (10 s), infinite or NaN.
    """
    if budget is not None and not LEAST_BUDGET_S <= budget < float("inf"):
        raise InputError(f"--budget is {budget:g}; it must be at least {LEAST_BUDGET_S:g} (seconds for one call)")
    return time.monotonic() + (BUDGET_S if budget is None else budget)


def _too_short(slope: Slope, priors: list[Distribution], prepared_s: float, control: Control) -> str:
    """Return a message on a budget that ended before the first flight: what took the time, and which budget is enough.

    "Enough" is a budget for the first SOME_ROUNDS (3) rounds; to estimate the time of a round, one parameter set is
    flown.

    priors : prior of each unknown; prepared_s : s, time of reading and compiling; control : with the number of threads
    """
    prepared, began = slope.prepared, time.monotonic()
    middle = [float(quantiles(prior, np.array([0.5]))[0]) for prior in priors]
    fly_set(slope, middle, releases_of_round(slope, 0))
    sets = sum(sets_of_round(number, len(priors)) for number in range(SOME_ROUNDS))
    fly_s = (time.monotonic() - began) * sets / workers_of(slope, control.threads)
    read_s = prepared.read_s + prepared.index_s
    least = max((read_s + fly_s + END_S) / (1.0 - LARGEST), LEAST_BUDGET_S)
    return (f"the budget ended before one parameter set was flown: reading took {read_s:.1f} s, compiling or loading "
            f"compiled code {max(prepared_s - read_s, 0.0):.1f} s. Compiled code is kept. The first {SOME_ROUNDS} "
            f"rounds, {sets} parameter sets of {slope.rocks:,} rocks, need about {fly_s:.0f} s; give at least --budget "
            f"{5 * math.ceil(least / 5):.0f}")  # fmt: skip


def _many(scene: Scene) -> Scene:
    """Return the scene with a number of rocks for which `engine: auto` selects the compiled engine.

    The number of rocks has no other effect: a calibration flies its own number of rocks. A scene whose `engine` is
    not `auto` is returned unchanged.
    """
    return scene if scene.engine != "auto" else with_choices(scene, max(100_000, len(scene.sources)), None, None)


def _book(slope: Slope, spec: CalibrationSpec) -> Flown | None:
    """Fly the parameter set of the book values, `calibration.book`, and return its result; None without book values.

    Unknowns without a book value keep the value of the scene.
    """
    if not spec.book:
        return None
    from dataclasses import replace

    booked = replace(slope, names=tuple(spec.book))
    return fly_set(booked, list(spec.book.values()), releases_of_round(slope, 0))
