"""The conclusions from the findings of a calibration: warnings, the refusal, and the verdict in one paragraph."""

from itertools import combinations

import numpy as np

from rpf3d_core.calibration.findings import Estimate, Findings
from rpf3d_core.calibration.sampling import FLOOR, MOST_ROUNDS

STRONG = 0.8
"""Correlation (-) of two parameters at which, or above which, only a combination of them is determined."""
AT_EDGE = 0.2
"""Smallest share (-) of a posterior in the outermost twentieth of its prior's range to warn that the prior decides.

A uniform posterior has a share of 0.05 there.
"""
MANY_LEFT = 0.02
"""Smallest share (-) of simulated rocks that left the terrain, or did not stop, for which a calibration warns."""
NOISY = 1.5
"""Noise of the log-likelihood (-) above which more rocks for each set help more than more sets."""
SURELY = 2.0
"""Number of standard errors by which a score must exceed the score of a curve to count as better."""
LITTLE = 0.1
"""Shrinkage (-) below which the data does not determine a parameter."""
BAND = 0.15
"""Shortfall (-) of the coverage of 90 % intervals, compared with 0.9, above which a calibration warns."""
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
    """Return what a user must know before using a calibration, as sentences."""
    of_data = [*found.of_data, *found.left_out]
    return [*_combinations(found), *_of_parameters(found), *_of_predictions(found), *of_data]


def _combinations(found: Findings) -> list[str]:
    """Return a sentence for each pair of parameters if the data determines only a combination of both."""
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
    """Return sentences about rocks that left, the score against a curve, and coverage."""
    sentences = []
    if found.left >= MANY_LEFT:
        sentences.append(f"{100 * found.left:.0f} % of the simulated rocks left the terrain or did not stop; they "
                         "count as wrong; extend the terrain if the observed rocks may have gone there")  # fmt: skip
    if found.held_out is not None and found.curve is not None:
        gain, doubt = gain_of(found)
        if gain <= SURELY * doubt:
            sentences.append(
                f"the score of kept-out blocks ({found.held_out.mean:.2f}) is not clearly better than that of a normal "
                f"curve without physics ({found.curve.mean:.2f}; difference {gain:+.2f} +- {doubt:.2f}): the end "
                "points do not show that the physics adds anything here"
            )
    coverage = found.coverage()
    for axis in ("along", "across") if coverage else ():
        if coverage and coverage["90"][axis] < 0.9 - BAND:
            sentences.append(f"90 % intervals hold {100 * coverage['90'][axis]:.0f} % of the kept-out blocks {axis} "
                             "the slope: the model spreads its rocks too little")  # fmt: skip
    return sentences


def gain_of(found: Findings) -> tuple[float, float]:
    """Return by how much the calibrated model predicts blocks better than the curve: mean gain and its standard error.

    The gain is the difference of the log scores of a block (-). Both numbers are 0 without scores.
    """
    if found.held_out is None or found.curve is None:
        return 0.0, 0.0
    each = found.held_out.each - found.curve.each
    return float(each.mean()), float(each.std(ddof=1) / np.sqrt(len(each)))


def advice_of(found: Findings) -> list[str]:
    """Return what would help a calibration that has too few effective samples, as sentences."""
    first = _first_help(found)
    least = min(found.estimates, key=lambda estimate: estimate.shrinkage)
    drop = [f"remove {least.name} from the unknowns, which the data hardly determines"]
    more = drop if _can_drop(found, least) else []
    return [first, *more, "narrow priors that reach far beyond what the ground can be"]


def _first_help(found: Findings) -> str:
    """Return the advice that helps most: more rocks for each set, or more time while rounds are left."""
    if found.noise > NOISY:
        return f"the noise of the log-likelihood is {found.noise:.1f}: raise `calibration.rocks` above {found.rocks}"
    if found.all_rounds:
        return (f"all {MOST_ROUNDS} rounds are flown, so more time adds nothing: raise `calibration.rocks` above "
                f"{found.rocks}, in a new folder")  # fmt: skip
    return "give it more time: run the same command again with a larger --budget; flown sets are kept"


def _can_drop(found: Findings, least: Estimate) -> bool:
    return len(found.estimates) > 1 and least.shrinkage < LITTLE


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
