"""Compute the share of rocks that pass places beyond the toe, and their energies and heights, to design fences."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.statistics import wilson_interval
from rpf3d_core.hazard.maps import FEWEST_ROCKS
from rpf3d_core.report.footing import Footing, footing_at
from rpf3d_core.report.run_files import RunFiles
from rpf3d_core.report.segments import (
    FOR_HEIGHTS,
    MOSTLY,
    FirstPassage,
    Segments,
    first_passages,
    largest_speeds_at_impacts,
)
from rpf3d_core.report.toe import BEYOND, FAR, STEP, BeyondToe, ResultWithIntervals, SetValues, percentile_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.height_image import height_image, heights_at
from rpf3d_core.unknowns.predictive import holding, shares_of_site

STEPS = (0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
"""Possible distances (m) between neighbouring places; the smallest that gives at most MOST_PLACES places is used."""
MOST_PLACES = 9
P95 = 95
NEAREST = 0.01
"""Smallest distance (m) of a place from the release; the misfit could otherwise put the place behind the release."""


NOT_KNOWN = ResultWithIntervals(value=None, sampling=None, predictive=None)


class FencePlace(NamedTuple):
    """The rocks that pass a place beyond the toe: their share, energies and heights.

    distance : m beyond the toe; passed : share (-) of rocks that pass the place, out of all rocks with a toe
    footing : slope of the ground on the lines of all rocks with a toe, at this distance from the toe
    energy, height : 95th percentiles (J, m) over the rocks that pass; height of the rock's centre above the ground
    crossed : number of rocks from which the energy is computed: rocks with a known path that passes the place
    source, height_source : data from which energy and height are computed, IMPACTS or KEPT (`segments`)
    passed_of, energy_of, height_of : names of the sources of these figures; "" for all rocks (`source_places`)
    """

    distance: float
    passed: ResultWithIntervals
    footing: Footing
    energy: ResultWithIntervals
    height: ResultWithIntervals
    crossed: int
    source: str
    height_source: str
    passed_of: str = ""
    energy_of: str = ""
    height_of: str = ""


def shares_beyond(beyond: BeyondToe, sets: int, distance: FloatArray) -> list[ResultWithIntervals]:
    """Return the share (-) of rocks with a toe that pass each distance beyond the toe, with its 95 % intervals.

    sets : number of parameter sets, 0 without unknowns; distance : (D,) m, in ascending order
    """
    over = beyond.distance[:, None] > distance
    counts, total = over.sum(axis=0), len(beyond.distance)
    figures = []
    low, high = _predictive(beyond, sets, distance)
    for i, count in enumerate(counts.tolist()):
        known = beyond.set is not None and np.isfinite(low[i])
        figures.append(ResultWithIntervals(
            value=count / total, sampling=wilson_interval(count, total),
            predictive=(float(low[i]), float(high[i])) if known else None,
        ))  # fmt: skip
    return figures


def _predictive(beyond: BeyondToe, sets: int, distance: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends (D,) of the predictive intervals of the shares of rocks that pass distances (D,) m.

    The rocks are displaced by draws of the misfit. Each predictive interval includes the sampling interval of its
    share. An unknown end is NaN; without unknowns, all ends are NaN. The intervals are widened with `never_rising`,
    because a rock that passes a distance also passes all smaller distances.

    sets : number of parameter sets; distance : in ascending order
    """
    places = len(distance)
    if beyond.set is None:
        return np.full(places, np.nan), np.full(places, np.nan)
    counts = np.zeros((sets, places))
    np.add.at(counts, beyond.set, beyond.displaced[:, None] > distance)
    totals = np.bincount(beyond.set, minlength=sets).astype(float)[:, None] * np.ones(places)
    flown = (beyond.distance[:, None] > distance).sum(axis=0).astype(float)
    found = holding(shares_of_site(counts, totals), flown, np.full(places, float(len(beyond.distance))))
    return never_rising(found.low, found.high)


def never_rising(low: FloatArray, high: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the ends (D,) of intervals of a quantity that never rises, widened so that no end rises either.

    An upper end becomes at least each upper end after it, and a lower end at most each lower end before it.

    low, high : (D,) lower and upper ends of the intervals, such as shares (-), in the order in which the quantity does
        not rise; an unknown end is NaN, and stays NaN
    """
    lowest = np.where(np.isnan(low), np.nan, np.fmin.accumulate(low))
    highest = np.where(np.isnan(high), np.nan, np.fmax.accumulate(high[::-1])[::-1])
    return lowest, highest


def places_for(beyond: BeyondToe) -> FloatArray:
    """Return round distances (D,) m beyond the toe for the table of fences, up to the 99th percentile of the stops.

    There are at most MOST_PLACES (9) distances; the first is 0.
    """
    stopped = beyond.distance[beyond.distance < FAR]
    last = max(float(np.percentile(stopped, 99)), 1.0) if len(stopped) else 10.0
    step = next((step for step in STEPS if last / step <= MOST_PLACES - 1), STEPS[-1])
    return np.arange(0.0, last + 1e-9, step)[:MOST_PLACES]


def places_beyond(
    run: RunFiles, beyond: BeyondToe, choices: Sequence[Segments], distances: FloatArray | None = None
) -> list[FencePlace]:
    """Return a `FencePlace` (share, energies and heights of the rocks that pass) for each distance beyond the toe.

    choices : possible path segments, from `segments_of`; distances : (D,) m, ascending; None for those of `places_for`
    """
    at = places_for(beyond) if distances is None else distances
    passed = shares_beyond(beyond, run.sets, at)
    return [_place(run, beyond, choices, distance, share) for distance, share in zip(at.tolist(), passed, strict=True)]


def segments_at(
    run: RunFiles, beyond: BeyondToe, choices: Sequence[Segments], distance: float
) -> tuple[Segments, Segments]:
    """Return the path segments for the energy, and those for the height, at a distance (m) beyond the toe.

    Segments from impacts are used for the energy if at least the share MOSTLY (0.9) of the passages at this distance
    are flights. These segments are also used for the p95 height if the share of flights is above FOR_HEIGHTS (0.95),
    because the height of other passages is not known. In all other cases the last item of `choices` is used.

    choices : possible path segments, from `segments_of`
    """
    for segments in choices[:-1]:
        flies = _passages(run, beyond, segments, distance).flies
        if len(flies) and flies.mean() >= MOSTLY:
            return segments, segments if flies.mean() > FOR_HEIGHTS else choices[-1]
    return choices[-1], choices[-1]


def _place(
    run: RunFiles, beyond: BeyondToe, choices: Sequence[Segments], distance: float, passed: ResultWithIntervals
) -> FencePlace:
    """Return share, energy and height of the rocks that pass a distance (m) beyond the toe.

    Energy and height are unknown if fewer than FEWEST_ROCKS rocks with known paths pass.

    choices : possible path segments, from `segments_of`; passed : the share, from `shares_beyond`
    """
    segments, for_height = segments_at(run, beyond, choices, distance)
    energy, crossed = energy_at(run, beyond, segments, distance)
    return FencePlace(
        distance=distance, passed=passed, crossed=crossed, source=segments.source, height_source=for_height.source,
        footing=_footing(run, beyond, distance), energy=energy, height=height_at(run, beyond, for_height, distance),
    )  # fmt: skip


def energy_at(run: RunFiles, beyond: BeyondToe, segments: Segments, distance: float) -> tuple[ResultWithIntervals, int]:
    """Return the p95 energy (J) of the rocks that pass a distance (m) beyond the toe, and the number of these rocks.

    The energy is unknown for fewer than FEWEST_ROCKS rocks.
    """
    rows, energy, _ = passing(run, beyond, segments, distance)
    if len(rows) < FEWEST_ROCKS:
        return NOT_KNOWN, len(rows)
    return percentile_of(energy, P95, _displaced(run, beyond, segments, distance)), len(rows)


def height_at(run: RunFiles, beyond: BeyondToe, segments: Segments, distance: float) -> ResultWithIntervals:
    """Return the p95 height (m) of the rocks that pass a distance (m) beyond the toe.

    The height is unknown for fewer than FEWEST_ROCKS rocks.
    """
    rows, _, height = passing(run, beyond, segments, distance)
    return percentile_of(height, P95, _with_sets(run, rows, height)) if len(rows) >= FEWEST_ROCKS else NOT_KNOWN


def _footing(run: RunFiles, beyond: BeyondToe, distance: float) -> Footing:
    """Return the slope of the ground at a distance (m) beyond the toe, on the lines in plan of all rocks with a toe."""
    away = np.maximum(beyond.toe + distance, NEAREST)[:, None] * beyond.along
    return footing_at(run.terrain, run.ends.release[beyond.rows, :2] + away)


def _with_sets(run: RunFiles, rows: NDArray[np.int64], values: FloatArray) -> SetValues | None:
    """Return values (M,) of rocks with the parameter sets of the rocks; None if the scene has no unknowns.

    rows : (M,) row of each rock in `Ends`
    """
    return None if run.ends.set is None else SetValues(values=values, set=run.ends.set[rows], sets=run.sets)


def _displaced(run: RunFiles, beyond: BeyondToe, segments: Segments, distance: float) -> SetValues | None:
    """Return the energies (J) and parameter sets of rocks that pass a distance (m) beyond the toe.

    Each rock is displaced by the random displacement of its parameter set. The result is used for a predictive
    interval; it is None without unknowns.
    """
    if run.ends.set is None:
        return None
    rows, energy, _ = passing(run, beyond._replace(toe=beyond.toe - beyond.shift), segments, distance)
    return _with_sets(run, rows, energy)


def passing(
    run: RunFiles, beyond: BeyondToe, segments: Segments, distance: float
) -> tuple[NDArray[np.int64], FloatArray, FloatArray]:
    """Return the rocks that pass a distance (m) beyond the toe: row in `Ends` (N,), energy (N,) J and height (N,) m.

    Each rock counts at its first passage. Energy is translational. If the rock strikes the ground within STEP (0.25 m)
    of the distance, the larger of its energies just before and after the impact counts, because the place of the toe is
    not known more accurately. Height is measured from the ground to the centre of the rock. An unknown height is
    BEYOND, so that percentiles count an unknown height as larger than all known heights.
    """
    reach, along = _reach(run, beyond, distance)
    start = run.ends.release[:, :2]
    found = first_passages(segments, start, along, reach)
    if len(found.row) == 0:
        return found.row, np.empty(0), np.empty(0)
    ground = heights_at(height_image(run.terrain, found.x[:, :2], 1.0), found.x[:, :2])
    height = np.nan_to_num(np.maximum(found.x[:, 2] - ground, 0.0), nan=BEYOND)
    struck = largest_speeds_at_impacts(segments, start, along, reach, STEP)[found.row]
    speed = np.maximum(found.speed, struck)
    return found.row, 0.5 * run.ends.mass[found.row] * speed**2, height


def _passages(run: RunFiles, beyond: BeyondToe, segments: Segments, distance: float) -> FirstPassage:
    """Return the first passage of each rock at a distance (m) beyond its toe."""
    reach, along = _reach(run, beyond, distance)
    return first_passages(segments, run.ends.release[:, :2], along, reach)


def _reach(run: RunFiles, beyond: BeyondToe, distance: float) -> tuple[FloatArray, FloatArray]:
    """Return the distance (R,) m from each rock's release to a place beyond its toe, and the direction (R, 2) there.

    The direction is a unit vector in plan. Distance and direction are NaN for rocks without a toe.

    distance : of the place beyond the toe (m)
    """
    reach, along = np.full(len(run.ends.runout), np.nan), np.full((len(run.ends.runout), 2), np.nan)
    reach[beyond.rows], along[beyond.rows] = np.maximum(beyond.toe + distance, NEAREST), beyond.along
    return reach, along
