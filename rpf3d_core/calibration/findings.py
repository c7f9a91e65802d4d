"""The findings of a calibration: parameters with intervals, correlations, scores and coverage, from its flown sets."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.calibration.data_warnings import data_warnings
from rpf3d_core.calibration.density import Stops
from rpf3d_core.calibration.flying import Flown, Slope, anywhere_density
from rpf3d_core.calibration.folds import (
    LEAST_VALUES,
    Score,
    covered,
    curve_score,
    folds_of,
    misfit_weights,
    predictive_score,
    ranks,
    weights_without,
)
from rpf3d_core.calibration.normal_space import values_of
from rpf3d_core.calibration.rounds import Result
from rpf3d_core.ensemble.even_rounds import words_on_left_out
from rpf3d_core.materials.distributions import Distribution, quantiles
from rpf3d_core.scene.calibration import CalibrationSpec

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LOW, HIGH = 0.05, 0.95
"""Probabilities of the ends of a parameter's interval: a 90 % interval."""
FINE = 10_000
"""Number of quantiles from which mean and standard deviation of a prior are computed."""


@dataclass(frozen=True, eq=False)
class Estimate:
    """The estimate of one parameter by a calibration: its posterior in numbers, next to its prior.

    name : key path; prior : the prior's keys and values, as in the scene
    mean, low, high : mean of the posterior, and ends of its 90 % interval, in the unit of the parameter
    shrinkage : 1 minus the ratio of two standard deviations, posterior over prior (-); 0 if the data showed nothing
    edge : share (-) of the posterior in the lowest 5 % of the prior's range, and share in the highest 5 %
    """

    name: str
    prior: dict[str, float]
    mean: float
    low: float
    high: float
    shrinkage: float
    edge: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Findings:
    """All findings of a calibration.

    estimates : of the U parameters; correlation : (U, U) of the parameters in the posterior (-)
    effective, noise : as in `sampling.Posterior`
    held_out : score of kept-out observations under the calibrated model; prior : score under the priors
    book : score under the book values, None if the scene has no book values
    curve : score under a normal curve without physics, None if no end points were observed
    held_out, prior, book, curve : all None if the calibration has too few observations to keep any out
    rank : (K, 2) for each observed stop, the predicted probability that a rock stops at a smaller coordinate, along and
        across the slope. Each prediction is made without this observed stop. The prediction includes the measuring
        error but not the misfit, because the stops of a run do not include the misfit either. None if no end points
        were kept out; K is 0 if no observed stop has a prediction
    whole_rank : (K, 2) as `rank`, but with the misfit added to the measuring error
    misfit : m, mean error of the model over the posterior; None if there were too few end points to estimate it
    left : share (-) of the simulated rocks that left the terrain or did not stop, with the sets weighted by the
        posterior
    sets, rocks : number of flown parameter sets, and number of rocks of each set
    of_data : warnings about the observations, as sentences; left_out : sentences on sources without a flown rock
    unpredicted : number of observed stops without a prediction, because hardly a rock of their kind stopped; they are
        not in `rank`
    all_rounds : True if all rounds are flown, so that more time adds nothing
    """

    estimates: list[Estimate]
    correlation: FloatArray
    effective: float
    noise: float
    held_out: Score | None
    prior: Score | None
    book: Score | None
    curve: Score | None
    rank: FloatArray | None
    whole_rank: FloatArray | None
    misfit: float | None
    left: float
    sets: int
    rocks: int
    of_data: tuple[str, ...]
    left_out: tuple[str, ...] = ()
    unpredicted: int = 0
    all_rounds: bool = False

    @property
    def blocks(self) -> int:
        """Number of observed stops that were kept out, whether or not they have a prediction.

        0 if the calibration kept no stop out, because it has too few observations.
        """
        return self.unpredicted + (0 if self.rank is None else len(self.rank))

    @property
    def predicts_stops(self) -> bool:
        """True if at least one observed stop has a prediction."""
        return self.blocks > self.unpredicted

    def coverage(self) -> dict[str, Any] | None:
        """Return the shares (-) of kept-out blocks within their 50 and 90 % predictive intervals.

        The result is None if no end points were kept out. A block without a prediction counts as outside its intervals.

        The keys "50" and "90" have the shares by direction ("along" and "across" the slope); "blocks" is the number of
        kept-out blocks. "with_misfit" has the shares for intervals that include the misfit, and the "misfit" (m).
        """
        if self.rank is None or self.whole_rank is None:
            return None
        whole = {**_shares_inside(self.whole_rank, self.blocks), "misfit": self.misfit}
        return {**_shares_inside(self.rank, self.blocks), "blocks": self.blocks, "with_misfit": whole}


def _shares_inside(rank: FloatArray, blocks: int) -> dict[str, dict[str, float]]:
    """Return the shares (-) of blocks within their 50 and 90 % intervals, along and across the slope.

    The keys are "50" and "90", and for each of them "along" and "across".

    rank : (K, 2) of the blocks that have a prediction
    blocks : number of all blocks; a block without a prediction counts as outside its intervals
    """
    inside = {percent: covered(rank, percent / 100.0, blocks) for percent in (50, 90)}
    return {str(percent): {"along": float(two[0]), "across": float(two[1])} for percent, two in inside.items()}


def findings_of(slope: Slope, spec: CalibrationSpec, result: Result, book: Flown | None, seed: int) -> Findings:
    """Return the findings of a calibration from its flown sets.

    result : the flown sets with their posterior; book : the flown parameter set of the book values, or None
    seed : of the random order in which observations are divided into folds
    """
    post, priors = result.posterior, [prior.distribution for prior in spec.unknowns.values()]
    values = values_of(priors, post.z)
    kept = _kept_out(slope, result, book, seed) if _columns(slope) >= LEAST_VALUES else dict[str, Any]()
    deposited = np.array([one.stops.deposited.mean() for one in result.flown])
    return Findings(
        estimates=[
            _estimate(name, spec.unknowns[name].model_dump(exclude_none=True), prior, values[:, k], post.weights)
            for k, (name, prior) in enumerate(zip(slope.names, priors, strict=True))
        ],
        correlation=correlation_of(values, post.weights), effective=post.effective, noise=post.noise,
        held_out=kept.get("held_out"), prior=kept.get("prior"), book=kept.get("book"), curve=kept.get("curve"),
        rank=kept.get("rank"), whole_rank=kept.get("whole_rank"), unpredicted=kept.get("unpredicted", 0),
        misfit=float(post.misfits @ slope.misfits) if len(slope.misfits) > 1 else None,
        left=float(1.0 - post.weights @ deposited), sets=len(post.z), rocks=slope.rocks,
        of_data=data_warnings(slope, result.flown),
        left_out=tuple(words_on_left_out(slope.prepared.sources, slope.rocks, result.rounds, "calibration.rocks")),
        all_rounds=result.is_complete,
    )  # fmt: skip


def _columns(slope: Slope) -> int:
    """Return the number of observations that may be kept out: all end points or, without them, all values at gates."""
    return len(slope.field.stops) or sum(len(one.observed) for one in slope.field.values)


def _counts_of_rocks(slope: Slope) -> IntArray:
    """Return the numbers (K,), from 0, of the observations that are counts of rocks; empty without end points.

    The numbers are in the order of `Flown.densities`. If there are end points, no fold uses these counts, because a
    count may include rocks whose end points are kept out.
    """
    first = len(slope.field.stops) + sum(len(one.observed) for one in slope.field.values)
    counts = 2 * len(slope.field.counted) if len(slope.field.stops) else 0  # each count has two columns
    return np.arange(first, first + counts)


def _kept_out(slope: Slope, result: Result, book: Flown | None, seed: int) -> dict[str, Any]:
    """Return the scores and ranks of kept-out observations, by the names of the fields of `Findings`.

    Each observation is predicted from the observations outside its fold.

    book : the flown parameter set of the book values, or None
    """
    field, post = slope.field, result.posterior
    count = _columns(slope)
    folds = folds_of(count, seed)
    weights = weights_without(post.log_ratio, post.weighed, folds, _counts_of_rocks(slope))[folds]
    densities = np.stack([one.densities.mean(axis=0)[:, :count] for one in result.flown])
    stops = field.stops
    anywhere: Any = anywhere_density(slope) if len(stops) else np.concatenate(
        [np.full(len(one.observed), 0.5 / max(float(one.observed.max()), 1e-9)) for one in field.values]
    )  # fmt: skip
    first = np.array(result.numbers) == 0
    before = np.tile(first[:, None] / first.sum() / len(slope.misfits), (1, len(slope.misfits)))
    found: dict[str, Any] = {
        "held_out": predictive_score(weights, densities, anywhere),
        "prior": predictive_score(before[None], densities, anywhere),
    }
    if book is not None:
        of_book = book.densities.mean(axis=0)[:, :count]
        found["book"] = predictive_score(misfit_weights(of_book, folds, anywhere), of_book[None], anywhere)
    if len(stops):
        found["curve"] = curve_score(stops, folds, slope.error, anywhere_density(slope))
        found |= _ranks(slope, [one.stops for one in result.flown], weights)
    return found


def _ranks(slope: Slope, places: list[Stops], weights: FloatArray) -> dict[str, Any]:
    """Return `rank`, `whole_rank` and `unpredicted` of `Findings` by name, from the stops of all sets.

    places : the stops of each of S sets
    weights : (N, S, M) of the sets and misfits for each observed stop, from the stops outside its fold
    """
    observed, without = slope.field.stops, weights.sum(axis=2, keepdims=True)
    rank = ranks(places, without, observed, np.array([slope.error]), slope.alike)
    whole = ranks(places, weights, observed, np.hypot(slope.error, slope.misfits), slope.alike)
    known = np.isfinite(rank).all(axis=1) & np.isfinite(whole).all(axis=1)
    return {"rank": rank[known], "whole_rank": whole[known], "unpredicted": int((~known).sum())}


def _estimate(
    name: str, written: dict[str, float], prior: Distribution, values: FloatArray, weights: FloatArray
) -> Estimate:
    """Return the estimate of one parameter from the flown sets.

    name : key path; written : the prior's keys and values, as in the scene
    values : (S,) value of the parameter in each set; weights : (S,) posterior weight of each set, sum 1
    """
    before = quantiles(prior, (np.arange(FINE) + 0.5) / FINE)
    mean = float(weights @ values)
    sd = float(np.sqrt(weights @ (values - mean) ** 2))
    low, high = (float(value) for value in weighted_quantiles(values, weights, (LOW, HIGH)))
    margin = 0.05 * (prior.high - prior.low)
    edge = float(weights[values < prior.low + margin].sum()), float(weights[values > prior.high - margin].sum())
    return Estimate(
        name=name, prior=written, mean=mean, low=low, high=high, shrinkage=float(1.0 - sd / before.std()), edge=edge
    )


def weighted_quantiles(values: FloatArray, weights: FloatArray, shares: tuple[float, ...]) -> FloatArray:
    """Return the quantiles (K,) of values (S,) with weights (S,) whose sum is 1, linear between the values.

    shares : K probabilities (-), such as 0.05 and 0.95
    """
    order = np.argsort(values)
    middle = np.cumsum(weights[order]) - 0.5 * weights[order]
    return np.asarray(np.interp(shares, middle, values[order]))


def correlation_of(values: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the correlations (U, U) of parameters with values (S, U) and weights (S,)."""
    centred = values - weights @ values
    covariance = (centred * weights[:, None]).T @ centred
    sd = np.sqrt(np.maximum(np.diag(covariance), 1e-300))
    return np.asarray(np.clip(covariance / np.outer(sd, sd), -1.0, 1.0))
