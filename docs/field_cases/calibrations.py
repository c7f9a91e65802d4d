"""Calibrate every model at Authume and Tschamut with `rpf3d calibrate`, and read the results that the page needs."""

import json
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from field_cases.models import AUTHUME, MODELS, TSCHAMUT, Model
from field_cases.scenes import name_of, scene_file
from rpf3d_core.errors import InputError
from rpf3d_core.unknowns.parameter_sets import ParameterSets, parameter_sets, read_parameter_sets

BUDGET = 3600.0
"""Time (s) that a calibration may take at most."""
SETS = 64
"""Number of parameter sets of each calibration with which the predictions of the page are simulated."""
PREFIX = "materials.*."
"""Start of the key path of each coefficient; the coefficient has one value for all zones."""


def calibrate(folder: Path, say: Callable[[str], None]) -> dict[str, dict[str, Any]]:
    """Calibrate each model at both sites, unless the folder has the result; return the results by site and model.

    folder : receives a folder for each calibration, such as tschamut_coulomb_limited, and a file with its scene. If a
        scene has changed, its calibration is repeated. Delete the folder after a change of the simulation
    say : called with a line of text on the progress

    Raises
    ------
    InputError
        A calibration was refused, or failed.
    """
    return {site: {model.name: _calibrated(folder, site, model, say) for model in MODELS}
            for site in (AUTHUME, TSCHAMUT)}  # fmt: skip


def _calibrated(folder: Path, site: str, model: Model, say: Callable[[str], None]) -> dict[str, Any]:
    scene, out = scene_file(site, model).read_text(encoding="utf-8"), folder / name_of(site, model)
    flown = out.with_suffix(".yaml")
    if not flown.exists() or flown.read_text(encoding="utf-8") != scene:
        say(f"{site}, {model.name}: rpf3d calibrate")
        words = ["calibrate", str(scene_file(site, model)), "--out", str(out), "--budget", f"{BUDGET:g}"]
        if subprocess.run([sys.executable, "-m", "rpf3d_core.cli", *words], check=False).returncode:
            raise InputError(f"{site}, {model.name}: the calibration was refused or failed, as it says above")
        flown.write_text(scene, encoding="utf-8")
    found = json.loads((out / "calibration.json").read_text(encoding="utf-8"))
    return {**_summary(found), "sets": _equal_sets(read_parameter_sets(out / "posterior.parquet"))}


def _summary(found: Mapping[str, Any]) -> dict[str, Any]:
    """Return the parts of calibration.json that the page shows; key paths of coefficients are without PREFIX."""
    coverage = found["coverage"]
    return {
        "parameters": {name.removeprefix(PREFIX): of for name, of in found["parameters"].items()},
        "effective_samples": found["effective_samples"],
        "strongest": _strongest(found["correlation"]),
        "gain": found["gain"],
        "score": found["score"],
        "kept_out": {**coverage["90"], "misfit": coverage["with_misfit"]["misfit"],
                     "with_misfit": coverage["with_misfit"]["90"]},
    }  # fmt: skip


def _strongest(correlation: Mapping[str, Mapping[str, float]]) -> dict[str, Any]:
    """Return the names of the two coefficients with the strongest correlation, and this correlation (-)."""
    names = list(correlation)
    pairs = {(one, other): correlation[one][other] for k, one in enumerate(names) for other in names[k + 1 :]}
    both, value = max(pairs.items(), key=lambda pair: abs(pair[1]))
    return {"names": [name.removeprefix(PREFIX) for name in both], "correlation": value}


def _equal_sets(sample: ParameterSets) -> dict[str, list[float]]:
    """Return the values of SETS parameter sets of equal weight by key path, by systematic resampling (Kitagawa 1996).

    A set with a large weight may occur more than once.
    """
    summed = np.cumsum(sample.shares)
    rows = np.minimum(np.searchsorted(summed, (np.arange(SETS) + 0.5) / SETS), len(summed) - 1)
    return {name: sample.values[rows, column].tolist() for column, name in enumerate(sample.names)}


def sample_of(calibration: Mapping[str, Any]) -> ParameterSets:
    """Return the parameter sets in a result of `calibrate` for one site and model."""
    sets = calibration["sets"]
    return parameter_sets(list(sets), np.stack(list(sets.values()), axis=1))
