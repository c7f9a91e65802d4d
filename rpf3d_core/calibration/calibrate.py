"""Calibrate the unknowns of a scene on its observations, within a time; `rpf3d calibrate` does the same."""

import time
from pathlib import Path
from typing import NamedTuple

from rpf3d_core.calibration.files import write_result
from rpf3d_core.calibration.findings import Findings, findings_of
from rpf3d_core.calibration.flying import Flown, Slope, fly_set, releases_of_round, slope_of
from rpf3d_core.calibration.observations import calibration_of
from rpf3d_core.calibration.rounds import Control, fly_rounds
from rpf3d_core.calibration.state import NEXT, SPREAD, check_folder, open_state
from rpf3d_core.ensemble.even_rounds import is_spread
from rpf3d_core.errors import InputError
from rpf3d_core.scene.calibration import CalibrationSpec
from rpf3d_core.scene.model import Scene
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.choices import with_choices

BUDGET_S = 900.0
"""Default time (s) of a whole calibration, from reading the scene to writing the results."""
LEAST_BUDGET_S = 1.0


class Calibrated(NamedTuple):
    """A finished calibration: what it found, or None if it was interrupted; sets : flown sets, which are kept."""

    found: Findings | None
    sets: int


def calibrate(scene: Scene | str | Path, out: str | Path, control: Control, engine: str | None = None) -> Calibrated:
    """Calibrate a scene and write the result into a folder; flown sets in the folder are used again.

    Parameters
    ----------
    out : new or empty folder, or the folder of an earlier calibration of the same scene, which continues
    control : deadline, progress, stop
    engine : "reference" or "compiled"; None for the scene's, where `auto` means compiled if numba is installed

    Raises
    ------
    InputError
        The scene, its observations or the folder are refused; or the time was too short to fly a single set.
    """
    chosen = with_choices(scene if isinstance(scene, Scene) else read_scene(scene), None, engine, None)
    spec, folder = calibration_of(chosen), Path(out)
    check_folder(folder, chosen)
    slope = slope_of(_many(chosen))
    state = open_state(folder, chosen, SPREAD if is_spread(slope.prepared.sources, slope.rocks) else NEXT)
    priors = [prior.distribution for prior in spec.unknowns.values()]
    result = fly_rounds(slope, priors, chosen.seed, state, control)
    if control.stop():
        return Calibrated(found=None, sets=0 if result is None else len(result.flown))
    if result is None:
        raise InputError(f"{chosen.path}: the budget ended before one parameter set was flown; reading the terrain and "
                         "compiling took all of it; give a larger --budget")  # fmt: skip
    found = findings_of(slope, spec, result, _book(slope, spec), chosen.seed)
    write_result(folder, chosen, slope, spec, result, found)
    return Calibrated(found=found, sets=len(result.flown))


def deadline_after(budget: float | None) -> float:
    """Return the `time.monotonic()` at which a budget (s) that starts now is over.

    Raises
    ------
    InputError
        The budget is not a positive time.
    """
    if budget is not None and not LEAST_BUDGET_S <= budget < float("inf"):
        raise InputError(f"--budget is {budget:g}; it must be at least {LEAST_BUDGET_S:g} (seconds for everything)")
    return time.monotonic() + (BUDGET_S if budget is None else budget)


def _many(scene: Scene) -> Scene:
    """Return the scene with a number of rocks for which `engine: auto` selects the compiled engine."""
    return scene if scene.engine != "auto" else with_choices(scene, max(100_000, len(scene.sources)), None, None)


def _book(slope: Slope, spec: CalibrationSpec) -> Flown | None:
    """Return the flight of the book's values; None if the scene names none.

    Unknowns that the book does not name keep the value of the scene.
    """
    if not spec.book:
        return None
    from dataclasses import replace

    booked = replace(slope, names=tuple(spec.book))
    return fly_set(booked, list(spec.book.values()), releases_of_round(slope, 0))
