"""The conclusions from the findings of a calibration: warnings, the refusal, and the verdict in one paragraph."""

import math
from itertools import combinations

import numpy as np

from rpf3d_core.calibration.findings import Estimate, Findings
from rpf3d_core.calibration.folds import Score, covered
from rpf3d_core.calibration.sampling import FLOOR, MOST_ROUNDS
from rpf3d_core.ensemble.two_shares import log_choose

STRONG = 0.8
"""Smallest absolute correlation (-) of two parameters for the warning that only a combination is determined."""
AT_EDGE = 0.2
"""Smallest share (-) of a posterior in the lowest or highest 5 % of its prior's range to warn that the prior decides.

A uniform posterior has a share of 0.05 there.
"""
MANY_LEFT = 0.02
"""Smallest share (-) of simulated rocks that left the terrain, or did not stop, for which a calibration warns."""
NOISY = 1.5
"""Noise of the log-likelihood (-) above which a refused calibration is advised to fly more rocks for each set, too."""
SURELY = 2.0
"""Number of standard errors by which a score must exceed another score to count as better.

The other score is that of a normal curve without physics, or that of the book values.
"""
LITTLE = 0.1
"""Shrinkage (-) below which the data does not determine a parameter."""
BY_CHANCE = 0.05
"""Least probability (-), without a warning, that correct 90 % intervals contain as few kept-out blocks as found."""
FEWEST_TO_CONDEMN = 8
"""Least number of kept-out observations to warn that a score is clearly worse, or that stops lie to one side.

With fewer observations, chance alone causes such differences too often.
"""
ASIDE = 3.0
"""Number of standard errors by which observed stops must lie to one side of the predicted stops for a warning."""
JUDGED = 0.5
"""Fewest effective samples, as a share (-) of FLOOR, for the advice of a refused calibration to remove an unknown."""
VALID = "valid for this model, this slope, these blocks"
MORE = (
    "end points of a second slope, kept out of the fit",
    "speeds, heights or energies at a gate, because end points alone leave combinations of parameters open",
    "masses and shapes of the observed blocks",
)
"""Observations that would allow further conclusions, as parts of a sentence."""


def is_refused(found: Findings) -> bool:
    """Return True if the effective samples are too few for a result."""
    return found.effective < FLOOR


def warnings_of(found: Findings) -> list[str]:
    """Return the warnings that a user must read before using a calibration, as sentences."""
    of_data = [*found.of_data, *found.left_out]
    return [*_of_predictions(found), *of_data, *_combinations(found), *_of_parameters(found)]


def _combinations(found: Findings) -> list[str]:
    """Return a sentence for each pair of parameters that the data determines only in combination."""
    pairs = combinations(range(len(found.estimates)), 2)
    names = [estimate.name for estimate in found.estimates]
    return [
        f"{names[i]} and {names[j]} correlate at {found.correlation[i, j]:.2f}: only a combination of them is "
        "determined, so change neither alone"
        for i, j in pairs
        if abs(found.correlation[i, j]) >= STRONG
    ]


def _of_parameters(found: Findings) -> list[str]:
    """Return a sentence for each parameter at an edge of its prior, and for each parameter that is not determined."""
    sentences = []
    for estimate in found.estimates:
        for share, end in zip(estimate.edge, ("min", "max"), strict=True):
            if share >= AT_EDGE:
                sentences.append(f"{estimate.name} lies at the edge of its prior ({100 * share:.0f} % of the posterior "
                                 f"next to {end} {estimate.prior[end]:g}): the prior decides, not the data; widen it "
                                 "if the ground allows")  # fmt: skip
        if estimate.shrinkage < LITTLE:
            sentences.append(f"{estimate.name} is not determined: its interval shrank by "
                             f"{100 * max(estimate.shrinkage, 0.0):.0f} %")  # fmt: skip
    return sentences


def _of_predictions(found: Findings) -> list[str]:
    """Return warnings about the predictions of kept-out observations.

    The warnings concern scores, blocks that lie mostly to one side of the predicted stops, the coverage of intervals,
    blocks without a prediction, and rocks that left the terrain or did not stop.
    """
    sentences = [*_of_scores(found), *_of_sides(found), *_of_coverage(found)]
    if found.unpredicted:
        blocks = "1 kept-out block has" if found.unpredicted == 1 else f"{found.unpredicted} kept-out blocks have"
        sentences.append(f"{blocks} no prediction, because hardly any simulated rock that stands for a block stopped "
                         "on the terrain; such blocks count as outside their intervals; extend the terrain if observed "
                         "rocks may have gone beyond it")  # fmt: skip
    if found.left >= MANY_LEFT:
        sentences.append(f"{100 * found.left:.0f} % of the simulated rocks left the terrain or did not stop; they "
                         "count as wrong; extend the terrain if the observed rocks may have gone there")  # fmt: skip
    return sentences


def _of_scores(found: Findings) -> list[str]:
    """Return a sentence for each simpler prediction whose score is about as good as the calibration's, or better.

    The scores are those of kept-out observations. The simpler predictions are a normal curve without physics, and the
    book values.
    """
    compared = (
        (found.curve, "a normal curve without physics", "the end points do not show that the physics adds"),
        (found.book, "the book values", "the observations do not show that the calibration adds"),
    )
    return [
        _of_score(found.held_out, other, name, f"{shown} anything here")
        for other, name, shown in compared
        if found.held_out is not None and other is not None and not _is_clearly_better(found.held_out, other)
    ]


def _is_clearly_better(score: Score, other: Score) -> bool:
    """Return True if a score exceeds another score by more than SURELY (2) standard errors of the difference."""
    gain, doubt = _gain(score, other)
    return gain > SURELY * doubt


def _of_score(score: Score, other: Score, name: str, meaning: str) -> str:
    """Return a sentence that a score is clearly worse, or not clearly better, than another score.

    name : of the other prediction; meaning : what follows if the score is not clearly worse
    """
    gain, doubt = _gain(score, other)
    rating = "not clearly better than"
    if _is_clearly_better(other, score) and len(score.each) >= FEWEST_TO_CONDEMN:
        rating, meaning = "clearly worse than", "do not use this calibration; check coordinates, sources and model"
    return (f"the score of kept-out observations ({score.mean:.2f}) is {rating} the score of {name} "
            f"({other.mean:.2f}; difference {gain:+.2f} +- {doubt:.2f}): {meaning}")  # fmt: skip


def _of_sides(found: Findings) -> list[str]:
    """Return a sentence for each direction in which the kept-out blocks lie to one side of the predicted stops.

    The directions are along and across the slope.
    """
    if found.rank is None or len(found.rank) < FEWEST_TO_CONDEMN:
        return []
    sd = np.maximum(found.rank.std(axis=0, ddof=1), math.sqrt(1.0 / 12.0))  # at least that of uniform ranks
    limits = ASIDE * sd / math.sqrt(len(found.rank))
    sides = zip(("along", "across"), found.rank.mean(axis=0).tolist(), limits.tolist(), strict=True)
    return [
        f"the kept-out blocks lie on average at percentile {100 * mean:.0f} of the predicted stops {axis} the slope, "
        "not in the middle: check the coordinates of end points and sources, or choose another model"
        for axis, mean, limit in sides
        if abs(mean - 0.5) > limit
    ]


def _of_coverage(found: Findings) -> list[str]:
    """Return a sentence for each direction in which 90 % intervals contain fewer blocks than chance explains.

    The directions are along and across the slope. Blocks without a prediction are left out, because `_of_predictions`
    reports them.
    """
    sentences = list[str]()
    if found.rank is None or found.whole_rank is None or not found.predicts_stops:
        return sentences
    blocks = len(found.rank)
    inside = (covered(rank, 0.9, blocks).tolist() for rank in (found.rank, found.whole_rank))
    for axis, plain, whole in zip(("along", "across"), *inside, strict=True):
        if _is_too_few(plain, blocks):
            sentence = (f"90 % intervals hold {100 * plain:.0f} % of the kept-out blocks {axis} the slope: the model "
                        "spreads its rocks too little, or coordinates are wrong")  # fmt: skip
            if _is_too_few(whole, blocks):
                sentence += f"; with the misfit of the model they still hold only {100 * whole:.0f} %"
            sentences.append(sentence)
    return sentences


def _is_too_few(share: float, blocks: int) -> bool:
    """Return True if correct 90 % intervals would hardly ever contain so small a share of the blocks.

    "Hardly ever" means: with a probability below 5 %, from the binomial distribution.

    share : share (-) of the blocks inside their intervals; blocks : number of all blocks
    """
    inside = range(round(share * blocks) + 1)
    logs = (log_choose(blocks, k) + k * math.log(0.9) + (blocks - k) * math.log(0.1) for k in inside)
    return math.fsum(map(math.exp, logs)) < BY_CHANCE


def gain_of(found: Findings) -> tuple[float, float]:
    """Return by how much (-) the score exceeds the score of a normal curve without physics, and the standard error (-).

    The first result is the mean difference of the log scores of the kept-out blocks. Both results are 0 if the
    calibration has no scores, or no score of the curve.
    """
    if found.held_out is None or found.curve is None:
        return 0.0, 0.0
    return _gain(found.held_out, found.curve)


def _gain(score: Score, other: Score) -> tuple[float, float]:
    """Return the mean difference (-) of two scores over the same observations, and its standard error (-)."""
    each = score.each - other.each
    return float(each.mean()), float(each.std(ddof=1) / np.sqrt(len(each)))


def advice_of(found: Findings) -> list[str]:
    """Return advice for a calibration that has too few effective samples, as sentences."""
    least = min(found.estimates, key=lambda estimate: estimate.shrinkage)
    drop = [f"remove {least.name} from the unknowns, which the data hardly determines"]
    return [*_helps(found), *(drop if _can_drop(found, least) else []),
            "narrow priors that reach far beyond what the ground can be"]  # fmt: skip


def _helps(found: Findings) -> list[str]:
    """Return the advice that helps most, as sentences.

    While rounds are left, the advice is more time and, if the likelihood is noisy, more rocks for each set as well. If
    no round is left, the advice is more rocks for each set.
    """
    rocks = f"raise `calibration.rocks` above {found.rocks}, in a new folder"
    if found.all_rounds:
        return [f"all {MOST_ROUNDS} rounds are flown, so more time adds nothing: {rocks}"]
    time = "give it more time: run the same command again, perhaps with a larger --budget; flown sets are kept"
    if found.noise > NOISY:
        return [time, f"if that does not help, {rocks}: the noise of the log-likelihood is {found.noise:.1f}"]
    return [time]


def _can_drop(found: Findings, least: Estimate) -> bool:
    """Return True if the advice may be to remove `least`, the unknown that the data determines least.

    With very few effective samples, the advice is not given, because the samples do not show what the data determines.
    """
    return len(found.estimates) > 1 and least.shrinkage < LITTLE and found.effective >= JUDGED * FLOOR


def verdict_of(found: Findings) -> str:
    """Return the verdict as one paragraph."""
    if is_refused(found):
        helps = "; ".join(advice_of(found))
        return (f"refused: {found.effective:.0f} effective samples are fewer than {FLOOR:.0f}, so the parameters are "
                f"not known well enough. What would help: {helps}.")  # fmt: skip
    sentences = warnings_of(found)
    head = f"{VALID}. "
    if not sentences:
        return head + "No warning."
    return head + f"{len(sentences)} warning{'s' * (len(sentences) > 1)}: " + "; ".join(sentences) + "."
