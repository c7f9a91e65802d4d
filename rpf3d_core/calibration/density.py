"""Densities of simulated results at observed values: kernel estimates for one parameter set, by groups of releases.

Each field observation has a column: the density of the simulated results at the observed value. A simulated rock that
left the terrain or did not stop lowers the density of stops, because its result is wrong and not missing. The rocks of
a parameter set are divided into groups of releases. The density of each group is kept, to measure the noise that is due
to the finite number of rocks (`likelihood`).

No model is exact, so an observed stop is taken as a simulated stop plus an error. The error is the measuring error of
the field data plus the misfit, the error of the model. The size of the misfit is unknown, so densities are computed for
several misfits, and the data decides between them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

GROUPS = 16
"""Number of groups of releases; rock number j belongs to group j modulo GROUPS."""
NARROWING = 0.7
"""Factor (-) by which kernels are narrower than the rule for a single density estimate recommends.

Densities of neighbouring parameter sets are averaged afterwards, which removes noise, so kernels may be narrower.
"""
LEAST_KERNEL = 0.1
"""Smallest standard deviation of a kernel, in the unit of the values; also the smallest one of observed stops (m).

Without this limit, a kernel would have no width where all rocks stop in one place or have the same value.
"""
NORMAL_QUARTILES = 1.349
"""Distance between the lower and the upper quartile of a standard normal distribution (-)."""


MISFITS = (0.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0, 1.0 / 2.0, 1.0)
"""Misfits that are possible, as multiples of the spread of the observed stops; all are equally likely beforehand."""
LEAST_STOPS = 3
"""Smallest number of observed stops from which the misfit can be estimated."""
LEAST_RATIO = 0.25
"""Smallest ratio (-) of the standard deviations of observed stops, along and across, to compute their spread."""


def misfits_of(observed: FloatArray) -> FloatArray:
    """Return the possible misfits (M,) m of a model from observed stops (N, 2) m; a single 0 if stops are too few.

    Stops are too few if there are fewer than LEAST_STOPS. Otherwise the misfits are the spread of the stops times the
    numbers MISFITS. The spread is the geometric mean of the stops' standard deviations along and across the slope. For
    stops on one line, such as chainages or a surveyed toe, this mean would be 0, as if the model had no error. So the
    smaller standard deviation is set to at least LEAST_RATIO of the larger.
    """
    if len(observed) < LEAST_STOPS:
        return np.zeros(1)
    spread = observed.std(axis=0, ddof=1)
    spread = np.maximum(spread, max(LEAST_RATIO * float(spread.max()), LEAST_KERNEL))
    return np.asarray(np.array(MISFITS) * float(np.sqrt(np.prod(spread))))


class Stops(NamedTuple):
    """The places where the R rocks of a parameter set stopped.

    place : (R, 2) m, distances along and across the slope
    deposited : (R,) False for rocks that left the terrain or did not stop
    """

    place: FloatArray
    deposited: NDArray[np.bool_]


def kernel_widths(values: FloatArray, error: float) -> FloatArray:
    """Return the standard deviations (D,) of the kernel for R simulated values (R, D), including the measuring error.

    Each standard deviation is at least LEAST_KERNEL (0.1).

    error : standard deviation of the measuring error, in the unit of the values

    Source: Silverman 1986, Density Estimation, equations 3.30 and 4.14, times NARROWING (0.7).
    """
    count, dimensions = values.shape
    if count < 2:
        return np.full(dimensions, max(error, LEAST_KERNEL))
    quartiles = np.percentile(values, (25, 75), axis=0)
    robust = (quartiles[1] - quartiles[0]) / NORMAL_QUARTILES
    sd = values.std(axis=0)
    spread = np.where(robust > 0.0, np.minimum(robust, sd), sd)
    width = NARROWING * spread * (4.0 / ((dimensions + 2) * count)) ** (1.0 / (dimensions + 4))
    return np.asarray(np.maximum(np.hypot(width, error), LEAST_KERNEL))


def kernel_matrix(values: FloatArray, observed: FloatArray, widths: FloatArray) -> FloatArray:
    """Return the normal density (N, R) around each of R simulated values (R, D) at each of N observed values (N, D).

    The unit is 1 over the product of the units of the D axes. Both kinds of values are measured from the mean of the
    simulated values, to keep precision: the squares of coordinates of some thousand kilometres would leave no digits
    for a distance of a metre.

    widths : (D,) standard deviations of the normal densities (the kernel), from `kernel_widths`
    """
    middle = values.mean(axis=0)
    scaled, seen = (values - middle) / widths, (observed - middle) / widths
    squares = (seen**2).sum(1)[:, None] + (scaled**2).sum(1)[None, :] - 2.0 * seen @ scaled.T
    size = (2.0 * np.pi) ** (0.5 * len(widths)) * float(np.prod(widths))
    return np.asarray(np.exp(-0.5 * np.maximum(squares, 0.0)) / size)


def grouped(rows: FloatArray) -> FloatArray:
    """Return the sums (GROUPS, N) of values over the rocks of each group: rock k belongs to group k modulo GROUPS.

    rows : (N, R) N values of each of R rocks
    """
    count = rows.shape[1]
    padded = np.zeros((len(rows), -(-count // GROUPS) * GROUPS))
    padded[:, :count] = rows
    return np.asarray(padded.reshape(len(rows), padded.shape[1] // GROUPS, GROUPS).sum(axis=1).T)


def stop_densities(stops: Stops, observed: FloatArray, errors: FloatArray, alike: FloatArray | None) -> FloatArray:
    """Return the density (GROUPS, M, N), 1/m2, of each group's simulated stops at N observed stops (N, 2) m.

    The mean over the groups is the density of all rocks.

    errors : (M,) m, standard deviation of measuring error and misfit together, for each of M misfits
    alike : (N, R) weight of each of R rocks in the prediction for each observed block, >= 0; None if all weights are
        equal
    """
    weights = np.ones((1, len(stops.place))) if alike is None else alike
    share = grouped(weights).mean(axis=0)
    places = stops.place[stops.deposited]
    if not len(places):
        return np.zeros((GROUPS, len(errors), len(observed)))
    each = []
    for error in errors.tolist():
        kernel = np.zeros((len(observed), len(stops.place)))
        kernel[:, stops.deposited] = kernel_matrix(places, observed, kernel_widths(places, error))
        each.append(grouped(kernel * weights) / share)
    return np.stack(each, axis=1)


def value_densities(values: FloatArray, observed: FloatArray, error: float) -> FloatArray:
    """Return the density (GROUPS, N) of R simulated values at N observed values, such as speeds at a gate.

    The unit of the density is 1 over the unit of the values.

    values : (R,), NaN for a rock without the value, such as a rock that did not reach the gate; such rocks are left out
    error : standard deviation of the measuring error, in the unit of the values
    """
    known = ~np.isnan(values)
    if not known.any():
        return np.zeros((GROUPS, len(observed)))
    given = values[known][:, None]
    kernel = np.zeros((len(observed), len(values)))
    kernel[:, known] = kernel_matrix(given, observed[:, None], kernel_widths(given, error))
    return np.asarray(grouped(kernel) / (known.sum() / GROUPS))


def share_densities(probabilities: FloatArray) -> FloatArray:
    """Return the shares (-) of rocks that did what was counted, and of the other rocks: (GROUPS, M, 2), for M misfits.

    The mean over the groups is the share of all rocks.

    probabilities : (M, R) for each misfit, the probability that each of R rocks did what was counted, such as reaching
        an area
    """
    misfits, rocks = probabilities.shape
    both = np.stack([probabilities, 1.0 - probabilities], axis=1).reshape(2 * misfits, rocks)
    return np.asarray(grouped(both).reshape(GROUPS, misfits, 2) / (rocks / GROUPS))
