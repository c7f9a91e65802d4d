"""Write the result of a calibration: calibration.json, the report, the pictures, and the calibrated scene."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rpf3d_core.calibration.calibrated_scene import sample_of, write_calibrated
from rpf3d_core.calibration.findings import Findings
from rpf3d_core.calibration.flying import Slope
from rpf3d_core.calibration.normal_space import values_of
from rpf3d_core.calibration.report import report_text
from rpf3d_core.calibration.rounds import Result
from rpf3d_core.calibration.state import RESULTS
from rpf3d_core.calibration.verdict import gain_of, is_refused, verdict_of, warnings_of
from rpf3d_core.results.calibration_folder import FOUND, REPORT
from rpf3d_core.scene.calibration import CalibrationSpec
from rpf3d_core.scene.model import Scene

ESTIMATED = ("mean", "low", "high", "shrinkage")
"""Keys of a parameter in calibration.json that are null if the calibration is refused."""


def content_of(found: Findings) -> dict[str, Any]:
    """Return the content of calibration.json; docs/reference/calibration.md lists its keys.

    A refused calibration has all keys, but null for every number that a reader could mistake for a result,
    and no warnings.
    """
    names = [estimate.name for estimate in found.estimates]
    known = not is_refused(found)
    scores = {name: getattr(found, name) for name in ("held_out", "prior", "book", "curve")}
    gain = dict(zip(("over_curve", "standard_error"), gain_of(found), strict=True))
    return {
        "parameters": {
            one.name: {"prior": one.prior, **{key: getattr(one, key) if known else None for key in ESTIMATED}}
            for one in found.estimates
        },
        "correlation": {
            name: {other: value if known else None for other, value in zip(names, row, strict=True)}
            for name, row in zip(names, found.correlation.tolist(), strict=True)
        },
        "effective_samples": found.effective,
        "noise": found.noise,
        "score": {name: score.mean if known and score is not None else None for name, score in scores.items()},
        "gain": gain if known and found.curve else None,
        "coverage": found.coverage() if known else None,
        "verdict": verdict_of(found),
        "warnings": warnings_of(found) if known else [],
    }


def import_writers() -> None:
    """Import the modules that write the result, in advance, because the import takes about a second."""
    import rpf3d_core.results.plots.calibration
    import rpf3d_core.unknowns.sample_files  # noqa: F401


def write_result(out: Path, scene: Scene, slope: Slope, spec: CalibrationSpec, result: Result, found: Findings) -> None:
    """Write all files of a calibration into `out`; for a refused calibration, only calibration.json and report.md.

    Result files of an earlier call are deleted first.

    out : folder of the calibration
    """
    for name in RESULTS:
        (out / name).unlink(missing_ok=True)
    if not is_refused(found):
        priors = [prior.distribution for prior in spec.unknowns.values()]
        values = values_of(priors, result.posterior.z)
        sample = replace(sample_of(slope.names, values, result.posterior.weights, scene.seed), place=slope.place)
        _write_pictures(out, slope, result, found, (values, np.asarray(sample.values)))
        write_calibrated(out, scene, sample, found.misfit)
    (out / REPORT).write_text(report_text(scene, found), encoding="utf-8")
    text = json.dumps(content_of(found), indent=2, allow_nan=False) + "\n"
    (out / FOUND).write_text(text, encoding="utf-8")


def _write_pictures(out: Path, slope: Slope, result: Result, found: Findings, values: tuple[Any, Any]) -> None:
    """Write posterior.png, predicted.png and coverage.png; only posterior.png if no observed stop has a prediction.

    values : values of the U unknowns in the S flown sets (S, U), and in the P sets of the posterior's sample (P, U)
    """
    # Imported here, because the import of matplotlib takes most of a second.
    from rpf3d_core.results.plots.calibration import Predicted, write_coverage, write_pairs, write_predicted

    every, sample = values
    first = np.array(result.numbers) == 0
    write_pairs(out / "posterior.png", slope.names, every[first], sample)
    if found.rank is None or not found.predicts_stops:
        return
    weights = {"prior": first / first.sum(), "posterior": result.posterior.weights}
    prior, posterior = (Predicted(*_stops_of(result, share)) for share in weights.values())
    write_predicted(out / "predicted.png", slope.field.stops, prior, posterior)
    write_coverage(out / "coverage.png", found.rank, found.blocks)


def _stops_of(result: Result, weights: Any) -> tuple[Any, Any]:
    """Return the simulated stops (M, 2) m of all sets, and the weights (M,) of the stops, whose sum is 1.

    Rocks that left the terrain or did not stop are left out.

    weights : (S,) weight of each set, which is divided equally among the rocks of the set
    """
    places = [one.stops.place[one.stops.deposited] for one in result.flown]
    each = [np.full(len(place), w / max(len(one.stops.place), 1))
            for place, w, one in zip(places, weights, result.flown, strict=True)]  # fmt: skip
    joined = np.concatenate(each)
    return np.concatenate(places), joined / max(joined.sum(), 1e-300)
