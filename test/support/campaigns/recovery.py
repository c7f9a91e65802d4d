"""Run small calibrations with known true values, and count how often the 90 % intervals contain the true values.

PYTHONPATH=test/support:. python -m campaigns.recovery --count 100

Each calibration has true values from the prior and its own observed stops, so that the intervals of a correct sampler
contain 90 % of the true values. Intervals miss true values in the corners of the prior more often than elsewhere. So
the true values of all calibrations are evenly spread over the prior: with random true values, the count would depend on
how many of them lie in the corners. The observed stops come from an ordinary run, not from code of the calibration.
"""

import argparse
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rpf3d_core.calibration.calibrate import deadline_after
from rpf3d_core.calibration.findings import Findings, findings_of
from rpf3d_core.calibration.flying import slope_of
from rpf3d_core.calibration.observations import calibration_of
from rpf3d_core.calibration.rounds import Control, fly_rounds
from rpf3d_core.calibration.state import open_state
from rpf3d_core.ensemble.fly import fly_ensemble
from rpf3d_core.scene.reading import read_scene
from rpf3d_core.setup.prepared import prepare, releases_in_ranges
from rpf3d_core.unknowns.points import spread_points

SLOPE = """\
v 0 -60 40
v 0 60 40
v 50 -60 5
v 50 60 5
v 160 -60 0
v 160 60 0
f 1 3 2
f 2 3 4
f 3 5 4
f 4 5 6
"""
SCENE = """\
terrain: {{files: [{{path: slope.obj, zone: default}}]}}
materials: {{default: {{normal_restitution: {R_n}, tangential_restitution: {R_t}, friction_angle_deg: 32}}}}
rock: {{density: 2700, mass: 500}}
sources: [{{name: top, points_file: top.csv, rocks: {rocks}, velocity: [1, 0, 0], spread: [1, 2, 1]}}]
rebound: constant
ground: sliding
stop_speed: 0.5
engine: compiled
seed: {seed}
"""
ASKED = """\
observed: {{points_file: stops.csv, along: [1, 0, 0]}}
calibration:
  unknowns:
    materials.default.normal_restitution: {{min: {R_n[0]}, max: {R_n[1]}}}
    materials.default.tangential_restitution: {{min: {R_t[0]}, max: {R_t[1]}}}
  measuring_error: {error}
  rocks: 400
"""
BLOCKS = 30
"""Number of observed stops."""
ERROR = 0.5
"""Standard deviation (m) of the measuring error of the observed stops."""
R_N, R_T = (0.2, 0.6), (0.6, 0.95)
"""Ranges of the uniform priors of the two unknowns; the true values lie in these ranges."""
TRUTHS = 18
"""Seed of the evenly spread true values: calibration number i has point number i - 1."""
MIDDLE = (0.5, 0.5)
"""Places of true values in the middle of their priors, where a 90 % interval misses them least often."""
OTHER_SEED = 1_000_003
"""Number added to the seed of the calibration, so that the observed rocks share no random number with the calibration.
"""


def known_scene(
    folder: Path, seed: int, at: tuple[float, float] | None = None
) -> tuple[Path, dict[str, float]]:  # fmt: skip
    """Write a scene with observed stops to a folder; return its file, and the true values of its unknowns by key path.

    seed : number of the calibration, from 1
    at : places of the true values in the ranges of their priors, from 0 to 1; None for those of the campaign
    """
    random = np.random.default_rng([seed, 18])
    u = spread_points(seed, 2, TRUTHS)[seed - 1] if at is None else at
    names = ("normal_restitution", "tangential_restitution")
    truth = {name: low + (high - low) * float(at) for name, (low, high), at in zip(names, (R_N, R_T), u, strict=True)}
    (folder / "slope.obj").write_text(SLOPE)
    (folder / "top.csv").write_text("x,y,z\n2,0,41\n2,3,41\n2,-3,41\n")
    flown = folder / "flown.yaml"
    flown.write_text(SCENE.format(R_n=truth["normal_restitution"], R_t=truth["tangential_restitution"],
                                  rocks=BLOCKS, seed=seed + OTHER_SEED))  # fmt: skip
    prepared = prepare(read_scene(flown))
    stops = fly_ensemble(prepared.engine, prepared.flight, releases_in_ranges(prepared, [range(BLOCKS)])).deposits.x
    stops = prepared.terrain.frame.points_to_input(stops) + random.normal(0.0, ERROR, (BLOCKS, 3))
    (folder / "stops.csv").write_text("x,y,z\n" + "\n".join(",".join(f"{value:.3f}" for value in x) for x in stops))
    scene = folder / "asked.yaml"
    scene.write_text(SCENE.format(R_n=0.4, R_t=0.8, rocks=100, seed=seed)
                     + ASKED.format(R_n=R_N, R_t=R_T, error=ERROR))  # fmt: skip
    return scene, {f"materials.default.{name}": value for name, value in truth.items()}


def found_in(
    folder: Path, seed: int, budget: float = 120.0, at: tuple[float, float] | None = None
) -> tuple[Findings, dict[str, float]]:
    """Calibrate a scene with known true values; return the findings, and the true values by key path.

    folder : receives scene and calibration; budget : longest time (s); seed, at : as in `known_scene`
    """
    path, truth = known_scene(folder, seed, at)
    scene = read_scene(path)
    spec, slope = calibration_of(scene), slope_of(scene)
    priors = [prior.distribution for prior in spec.unknowns.values()]
    state = open_state(folder / "out", scene)
    result = fly_rounds(slope, priors, scene.seed, state, Control(deadline=deadline_after(budget), threads=1))
    assert result is not None
    return findings_of(slope, spec, result, None, scene.seed), truth


def recovered(seed: int, at: tuple[float, float] | None = None) -> tuple[dict[str, bool], float, int]:
    """Run one calibration, and compare its 90 % intervals with the true values.

    Returns a dictionary from key path to True if the interval contains the true value, the number of effective samples,
    and the number of parameter sets flown. seed, at : as in `known_scene`
    """
    with TemporaryDirectory() as folder:
        found, truth = found_in(Path(folder), seed, at=at)
    inside = {one.name: one.low <= truth[one.name] <= one.high for one in found.estimates}
    return inside, found.effective, found.sets


def campaign(count: int, processes: int) -> Iterator[tuple[dict[str, bool], float, int]]:
    """Yield the results of `recovered` for the seeds 1 to `count`."""
    with ProcessPoolExecutor(processes) as pool:
        yield from pool.map(recovered, range(1, count + 1))


def main() -> int:
    parser = argparse.ArgumentParser(description="calibrate with known answers, and count how often they are found")
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--processes", type=int, default=2)
    asked, began = parser.parse_args(), time.monotonic()
    results = list(campaign(asked.count, asked.processes))
    low, high = 0.85 * asked.count, 0.95 * asked.count
    fine = True
    for name in results[0][0]:
        held = sum(inside[name] for inside, _, _ in results)
        fine &= low <= held <= high
        print(f"{name}: the 90 % interval holds the true value in {held} of {asked.count} calibrations")
    effective = np.array([effective for _, effective, _ in results])
    sets = np.array([sets for _, _, sets in results])
    print(f"effective samples: median {np.median(effective):.0f}, smallest {effective.min():.0f}; "
          f"parameter sets: median {np.median(sets):.0f}; {time.monotonic() - began:.0f} s")  # fmt: skip
    return 0 if fine else 1


if __name__ == "__main__":
    sys.exit(main())
