"""Measure how much two results of the same rocks differ, such as those of two methods, in shares and in metres."""

from typing import NamedTuple

import numpy as np

from rpf3d_core.accuracy.flown import FlownSample, Reached
from rpf3d_core.ensemble.flights import Flights, FloatArray, IntArray
from rpf3d_core.hazard.convergence import Step
from rpf3d_core.values import DEPOSITED, Mode


class Metres(NamedTuple):
    """Median and 95th percentile (m) of the distance between two results of the same rock, over many rocks.

    Both are None if the distance is known for no rock.
    """

    median: float | None
    p95: float | None


class AnswerDifference(NamedTuple):
    """The error of a setting: the difference of its result from the exact result of the same rocks.

    of_map : difference of the maps of reach probability (-), from `map_distance`
    of_shares : largest difference (-) of the share of rocks that reach a zone or area of interest, or stop there
    first_impact, stop : m, distance between the first impacts and between the stopping places of the same rock
    bounce : m, difference of the heights of the first bounce; other_outcome : share of rocks with other outcomes (-)
    """

    of_map: float
    of_shares: float
    first_impact: Metres
    stop: Metres
    bounce: Metres
    other_outcome: float


def map_distance(a: Reached, b: Reached) -> float:
    """Return the difference of two maps of reach probability, from 0 (the same) to 1 (no cell in common).

    The distance is the sum of |p - q| over all cells, divided by the sum of p + q, where p and q are the reach
    probabilities of a cell in the two maps: the share of all visits to cells that the two maps do not have in common.
    A cell that many rocks reach has a large weight; cells without rocks do not change the distance.
    (In ecology: the dissimilarity of Bray and Curtis 1957, Ecol. Monogr. 27:325-349.)
    """
    cells = np.union1d(a.cells, b.cells)
    p, q = (_shares(some, cells) for some in (a, b))
    total = float((p + q).sum())
    return float(np.abs(p - q).sum()) / total if total > 0.0 else 0.0


def _shares(some: Reached, cells: IntArray) -> FloatArray:
    """Return the reach probability (S,) (-) of a map in each of S cells; 0 in a cell that no rock reached.

    some : the map; cells : (S,) numbers of cells, ascending; they must include all reached cells of the map
    """
    shares = np.zeros(len(cells))
    shares[np.searchsorted(cells, some.cells)] = some.rocks / max(some.flown, 1)
    return shares


def share_distance(a: Step, b: Step) -> float:
    """Return the largest difference (-) between two results in the share of rocks that reach or stop in a place.

    A place is a zone or an area of interest. If a result does not contain a place, the shares of this place are 0.

    a, b : the two results
    """
    return max((abs(x - y) for name in {*a.places, *b.places} for x, y in _pairs(a, b, name)), default=0.0)


def _pairs(a: Step, b: Step, name: str) -> list[tuple[float, float]]:
    both = [(step.places[name].reached, step.places[name].stopped) if name in step.places else (0.0, 0.0)
            for step in (a, b)]  # fmt: skip
    return list(zip(*both, strict=True))


def difference(found: FlownSample, exact: FlownSample, gravity: float) -> AnswerDifference:
    """Return the difference of a result from the exact result of the same rocks.

    The stopping places are compared only for rocks that stop, or are caught, in both results.

    found : the result to judge; exact : the exact result; gravity : m/s^2
    """
    mine, theirs = found.flights, exact.flights
    at_rest = np.isin(mine.deposits.outcome, DEPOSITED) & np.isin(theirs.deposits.outcome, DEPOSITED)
    stop = np.linalg.norm(mine.deposits.x - theirs.deposits.x, axis=1)
    return AnswerDifference(
        of_map=map_distance(found.reached, exact.reached),
        of_shares=share_distance(found.places, exact.places),
        first_impact=metres(np.linalg.norm(first_impacts(mine) - first_impacts(theirs), axis=1)),
        stop=metres(stop[at_rest]),
        bounce=metres(np.abs(first_bounces(mine, gravity) - first_bounces(theirs, gravity))),
        other_outcome=float((mine.deposits.outcome != theirs.deposits.outcome).mean()),
    )


def first_impacts(flights: Flights) -> FloatArray:
    """Return the place of the first impact on the ground of each of R rocks: (R, 3) m; NaN for a rock that had none."""
    return _first_of(flights, flights.impacts.x)


def _first_of(flights: Flights, values: FloatArray) -> FloatArray:
    """Return values (R, 3) for R rocks: the values of each rock's first impact on the ground; NaN if there was none.

    values : (I, 3) a row for each of the I impacts of `flights`, such as its place
    """
    some = np.full((len(flights.deposits.rock), 3), np.nan)
    struck = np.flatnonzero(flights.impacts.facet >= 0)
    rows, first = np.unique(flights.impacts.row[struck], return_index=True)
    some[rows] = values[struck[first]]
    return some


def _rows_that_struck_first(flights: Flights) -> IntArray:
    """Return the rows (N,) in `Deposits` of the rocks whose first impact was on the ground, not on an obstacle."""
    rows, first = np.unique(flights.impacts.row, return_index=True)
    return np.asarray(rows[flights.impacts.facet[first] >= 0])


def first_bounces(flights: Flights, gravity: float) -> FloatArray:
    """Return the bounce height (R,) m of each rock after its first impact, to compare the results of two methods.

    The height is v^2 / (2 gravity), where v is the speed along the facet's normal after the impact: the rise of a rock
    that leaves level ground with this speed. The real rise is not used, because it may be 0 on a steep facet. NaN if
    the rock did not fly after the impact, hit an obstacle first, or has no path.

    flights : flights of R rocks, with impacts and paths; gravity : m/s^2
    """
    rises = np.full(len(flights.deposits.rock), np.nan)
    paths = flights.paths
    _, first = np.unique(paths.row, return_index=True)
    second = first + 1  # every path has at least its end
    second = second[paths.mode[second] == Mode.FLIGHT]
    second = second[np.isin(paths.row[second], _rows_that_struck_first(flights))]
    row = paths.row[second]
    away = (paths.v[second] * _first_of(flights, flights.impacts.normal)[row]).sum(axis=1)
    rises[row] = away**2 / (2.0 * gravity)
    return rises


def metres(distances: FloatArray) -> Metres:
    """Return median and 95th percentile of distances (N,) m between two results; NaN values are ignored.

    Both are None if no distance is known.
    """
    known = distances[np.isfinite(distances)]
    if len(known) == 0:
        return Metres(None, None)
    return Metres(float(np.median(known)), float(np.percentile(known, 95)))
