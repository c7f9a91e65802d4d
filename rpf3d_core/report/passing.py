"""How many rocks pass places beyond the toe, and with which energy and height: what a fence there would meet."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.toe import BeyondToe, Figure, directions, percentile_of, toes
from rpf3d_core.results.profiles import terrain_below
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.unknowns.predictive import predictive_shares

STEPS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Distances (m) between places, of which the first that gives at most MOST_PLACES is taken."""
MOST_PLACES = 9
P95 = 95


class Place(NamedTuple):
    """What passes a place beyond the toe.

    distance : m beyond the toe; passed : share of rocks that pass
    energy, height : 95th percentiles (J, m) over the kept paths that pass; crossed : number of these paths
    """

    distance: float
    passed: Figure
    energy: Figure
    height: Figure
    crossed: int


class Crossings(NamedTuple):
    """K kept paths from release to end, measured beyond the toe.

    along : for each path (P_k,) m beyond the toe at each of its points; mass : (K,) kg
    set : (K,) parameter set; None without unknowns; path : (K,) number of the path in `Paths`
    """

    along: list[FloatArray]
    mass: FloatArray
    set: NDArray[np.int64] | None
    path: list[int]


def shares_beyond(beyond: BeyondToe, sets: int, distance: FloatArray) -> list[Figure]:
    """Return the share of rocks that pass distances (D,) m beyond the toe, with both intervals."""
    over = beyond.distance[:, None] > distance
    counts, total = over.sum(axis=0), len(beyond.distance)
    figures = []
    low, high = _predictive(over, beyond.set, sets)
    for i, count in enumerate(counts.tolist()):
        known = beyond.set is not None and np.isfinite(low[i])
        figures.append(Figure(
            value=count / total, sampling=wilson_interval(count, total),
            predictive=(float(low[i]), float(high[i])) if known else None,
        ))  # fmt: skip
    return figures


def _predictive(over: NDArray[np.bool_], set_of: NDArray[np.int64] | None, sets: int) -> tuple[FloatArray, FloatArray]:
    """Return the ends (D,) of the predictive intervals of shares; over : (N, D) True if the rock counts."""
    if set_of is None:
        return np.full(over.shape[1], np.nan), np.full(over.shape[1], np.nan)
    counts = np.zeros((sets, over.shape[1]))
    np.add.at(counts, set_of, over)
    totals = np.bincount(set_of, minlength=sets).astype(float)[:, None] * np.ones(over.shape[1])
    found = predictive_shares(counts, totals)
    return found.low, found.high


def places_for(beyond: BeyondToe) -> FloatArray:
    """Return distances (m) beyond the toe for the table of fences: round numbers up to where hardly a rock comes."""
    stopped = beyond.distance[beyond.distance < 1e6]
    last = max(float(np.percentile(stopped, 99)), 1.0) if len(stopped) else 10.0
    step = next((step for step in STEPS if last / step <= MOST_PLACES - 1), STEPS[-1])
    return np.arange(0.0, last + 1e-9, step)[:MOST_PLACES]


def crossings_of(run: RunFiles) -> Crossings:
    """Return the kept paths measured beyond the toe, without those that have no face below them."""
    row = {key: i for i, key in enumerate(run.ends.key)}
    known = [(path, row[key]) for path, key in enumerate(run.paths.key) if key in row]
    rows = np.array([i for _, i in known], dtype=np.int64)
    along = directions(run.ends)[rows]
    toe = toes(run, run.ends.release[rows], along, run.ends.runout[rows])
    kept = np.flatnonzero(np.isfinite(toe))
    measured = []
    for k in kept:
        path = known[k][0]
        points = run.paths.x[run.paths.starts[path] : run.paths.starts[path + 1], :2]
        measured.append((points - run.ends.release[rows[k], :2]) @ along[k] - toe[k])
    return Crossings(
        along=measured, mass=run.ends.mass[rows[kept]], path=[known[k][0] for k in kept],
        set=None if run.ends.set is None else run.ends.set[rows[kept]],
    )  # fmt: skip


def places_beyond(run: RunFiles, beyond: BeyondToe, crossings: Crossings) -> list[Place]:
    """Return what passes at round distances beyond the toe."""
    distances = places_for(beyond)
    passed = shares_beyond(beyond, run.sets, distances)
    return [_place(run, crossings, float(d), share) for d, share in zip(distances, passed, strict=True)]


def _place(run: RunFiles, crossings: Crossings, distance: float, passed: Figure) -> Place:
    which, energy, height = passing(run, crossings, distance)
    sets = None if crossings.set is None else crossings.set[which]
    unknown = Figure(value=None, sampling=None, predictive=None)
    enough = len(which) >= FEWEST_ROCKS
    return Place(
        distance=distance, passed=passed, crossed=len(which),
        energy=percentile_of(energy, sets, run.sets, P95) if enough else unknown,
        height=percentile_of(height, sets, run.sets, P95) if enough else unknown,
    )  # fmt: skip


def passing(run: RunFiles, crossings: Crossings, distance: float) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Return which paths (N,) pass a distance (m) beyond the toe, with energy (N,) J and height (N,) m there.

    Energy is translational. Height is that of the point or the centre above the ground. Between two points of a path,
    speed and position are linear. Each rock counts at its first passage.
    """
    which, speed, place = [], [], []
    for k, along in enumerate(crossings.along):
        over = np.flatnonzero(along >= distance)
        if len(over) == 0 or over[0] == 0:
            continue
        i = int(over[0])
        part = (distance - along[i - 1]) / (along[i] - along[i - 1])
        at = int(run.paths.starts[crossings.path[k]]) + i
        which.append(k)
        speed.append((1.0 - part) * run.paths.speed[at - 1] + part * run.paths.speed[at])
        place.append((1.0 - part) * run.paths.x[at - 1] + part * run.paths.x[at])
    points = np.array(place).reshape(-1, 3)
    ground = terrain_below(run.terrain, points)
    energy = 0.5 * crossings.mass[which] * np.array(speed) ** 2 if which else np.empty(0)
    return np.array(which, dtype=np.int64), energy, np.maximum(points[:, 2] - ground, 0.0)
