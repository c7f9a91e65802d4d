"""Write the posterior: the sample of parameter sets, and a scene that flies them."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.formats.yaml import read_yaml, yaml_text
from rpf3d_core.results.calibration_folder import CALIBRATED
from rpf3d_core.scene.files import files_of
from rpf3d_core.scene.model import Scene
from rpf3d_core.unknowns.parameter_sets import ParameterSets, parameter_sets, write_parameter_sets

FloatArray = NDArray[np.float64]

FEWEST_SETS, MOST_SETS = 50, 256
"""Bounds of the number of parameter sets of a sample of the posterior."""
ROCKS_A_SET = 100
"""Smallest number of rocks for each parameter set in calibrated.yaml, the scene that flies the sample."""
SAMPLE = "posterior.parquet"


def sample_of(names: tuple[str, ...], values: FloatArray, weights: FloatArray, seed: int) -> ParameterSets:
    """Draw a sample of parameter sets with equal weights from the weighted sets (S, U) of the posterior.

    The number of sets is the effective number of samples, but at least FEWEST_SETS (50) and at most MOST_SETS (256).
    Source: Kitagawa 1996, J. Comput. Graph. Stat. 5:1-25: systematic resampling.

    names : key paths of the U unknowns; values : (S, U) the U unknowns of each set; weights : (S,) of the sets, sum 1
    seed : of the random start of the resampling
    """
    count = int(np.clip(1.0 / (weights**2).sum(), FEWEST_SETS, MOST_SETS))
    start = np.random.Generator(np.random.Philox(key=[seed, 2**32 + 2])).random()
    order = np.argsort(values[:, 0])  # neighbours in the first parameter follow one another, so the sample is even
    reached = np.cumsum(weights[order])
    rows = np.searchsorted(reached, (np.arange(count) + start) / count * reached[-1])
    return parameter_sets(names, values[order[rows.clip(max=len(order) - 1)]])


def write_calibrated(out: Path, scene: Scene, sample: ParameterSets, misfit: float | None) -> None:
    """Write posterior.parquet and calibrated.yaml into a folder; calibrated.yaml names files relative to this folder.

    scene : the scene that was calibrated; sample : from `sample_of`
    misfit : m, difference of observed and simulated stops that the simulated spread does not explain; None if unknown
    """
    write_parameter_sets(out / SAMPLE, sample)
    written = read_yaml(scene.path).values
    values = {key: value for key, value in written.items() if key not in ("calibration", "unknowns", "rocks")}
    moved = _moved(values, scene.path.parent, out, {path for _, path in files_of(scene)})
    more = {key: value for key, value in (written.get("unknowns") or {}).items() if key == "priors"}
    unknowns = {**more, "sets": len(sample), "sample": SAMPLE, "misfit": None if misfit is None else round(misfit, 3)}
    rocks = max(sum(source.rocks for source in scene.sources), ROCKS_A_SET * len(sample))
    text = (
        f"# Calibrated from {scene.path.name} by `rpf3d calibrate`: `rpf3d run` flies the posterior, a sample of "
        f"{len(sample)} parameter sets.\n"
        "# calibration.json says how well they are known. `rocks` is the total over all sets.\n"
    )
    (out / CALIBRATED).write_text(text + yaml_text({**moved, "rocks": rocks, "unknowns": unknowns}), encoding="utf-8")


def _moved(value: Any, before: Path, out: Path, files: set[Path]) -> Any:
    """Return values of a scene file with file names relative to the folder `out` instead of the folder `before`.

    before : folder of the scene file; files : absolute paths of the files that the scene names
    """
    if isinstance(value, Mapping):
        return {key: _moved(inner, before, out, files) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_moved(inner, before, out, files) for inner in value]
    if isinstance(value, str) and (path := Path(os.path.abspath(before / value))) in files:
        return os.path.relpath(path, out.resolve())
    return value
