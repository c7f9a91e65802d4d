"""Draw the pictures of a calibration: posterior pairs, predicted against observed stops, and coverage."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rpf3d_core.results.plots.style import label, save

FloatArray = NDArray[np.float64]

POSTERIOR, PRIOR, OBSERVED = "#1f4e9c", "#999999", "#c81e1e"
AXES = ("along the slope (m)", "across the slope (m)")
SHARES = 500
"""Number of points of a curve that are evenly spaced by number of stops; as many are evenly spaced by weight."""
DRAWN = 1500
"""Number of simulated stops that are drawn in plan."""


class Predicted(NamedTuple):
    """M simulated stops with weights, a sample of the predicted stops.

    place : (M, 2) m, along and across the slope; weights : (M,) (-), whose sum is 1
    """

    place: FloatArray
    weights: FloatArray


def write_pairs(path: Path, names: Sequence[str], before: FloatArray, after: FloatArray) -> None:
    """Write posterior.png: each parameter and each pair of parameters, prior in grey and posterior in blue.

    names : of the U parameters; before, after : (S, U) samples of the prior and of the posterior, with equal weights
    """
    size = len(names)
    figure = Figure(figsize=(max(2.6 * size, 4.5), max(2.6 * size, 4.5)), layout="constrained")
    grid = figure.subplots(size, size, squeeze=False)
    short = [name.replace(".", "\n") for name in names]
    for i in range(size):
        for j in range(size):
            axes = grid[i, j]
            if j > i:
                axes.set_axis_off()
            elif i == j:
                _draw_alone(axes, before[:, i], after[:, i])
            else:
                _draw_pair(axes, before[:, [j, i]], after[:, [j, i]])
            label(axes, short[j] if i == size - 1 else "", short[i] if j == 0 and i else "")
    grid[0, 0].legend(fontsize=8)
    figure.suptitle("what the data says of the parameters: prior grey, posterior blue", x=0.01, ha="left")
    save(figure, path)


def _draw_alone(axes: Axes, before: FloatArray, after: FloatArray) -> None:
    bins = np.linspace(min(before.min(), after.min()), max(before.max(), after.max()), 31)
    axes.hist(before, bins=bins.tolist(), density=True, color=PRIOR, alpha=0.5, label="prior")
    axes.hist(after, bins=bins.tolist(), density=True, color=POSTERIOR, alpha=0.6, label="posterior")
    axes.set_yticks([])


def _draw_pair(axes: Axes, before: FloatArray, after: FloatArray) -> None:
    axes.plot(*before.T, ".", color=PRIOR, markersize=2)
    axes.plot(*after.T, ".", color=POSTERIOR, markersize=4, alpha=0.6)


def write_predicted(path: Path, observed: FloatArray, prior: Predicted, posterior: Predicted) -> None:
    """Write predicted.png: shares of stops up to each distance, and stops in plan.

    observed : (N, 2) m, observed stops along and across the slope; prior, posterior : simulated stops
    """
    figure = Figure(figsize=(13.0, 4.5), layout="constrained")
    panels = figure.subplots(1, 3)
    for axis in range(2):
        _draw_shares(panels[axis], observed[:, axis], prior, posterior, axis)
    panels[0].legend(fontsize=8, loc="upper left")
    rows = _even_rows(posterior.weights)
    panels[2].plot(*posterior.place[rows].T, ".", color=POSTERIOR, markersize=2, alpha=0.4, label="predicted")
    panels[2].plot(*observed.T, "o", color=OBSERVED, markersize=4, label="observed")
    label(panels[2], *AXES)
    # Above the panel, because no corner of a plan is sure to be empty.
    panels[2].legend(fontsize=8, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, markerscale=2.0)
    panels[0].set_title("predicted against observed stops", loc="left")
    save(figure, path)


def _draw_shares(axes: Axes, observed: FloatArray, prior: Predicted, posterior: Predicted, axis: int) -> None:
    for predicted, colour, name in ((prior, PRIOR, "prior"), (posterior, POSTERIOR, "posterior")):
        axes.plot(*_reached(predicted, axis), color=colour, label=name)
    steps = np.arange(1, len(observed) + 1) / len(observed)
    axes.step(np.sort(observed), steps, where="post", color=OBSERVED, label="observed")
    margin = 0.6 * float(np.ptp(observed)) + 1.0
    axes.set_xlim(float(observed.min()) - margin, float(observed.max()) + margin)
    label(axes, AXES[axis], "share of stops nearer (-)")


def _reached(predicted: Predicted, axis: int) -> tuple[FloatArray, FloatArray]:
    """Return the points of a curve: ascending distances (K,) m, and the weight (K,) of all stops up to each distance.

    axis : 0 for distances along the slope, 1 for distances across it
    """
    order = np.argsort(predicted.place[:, axis])
    reached = np.cumsum(predicted.weights[order])
    rows = np.unique(np.linspace(0, len(order) - 1, SHARES).astype(np.int64))
    heavy = np.searchsorted(reached, (np.arange(SHARES) + 0.5) / SHARES).clip(max=len(order) - 1)
    rows = np.union1d(rows, heavy)  # both spacings together show steps and tails
    return predicted.place[order[rows], axis], reached[rows]


def _even_rows(weights: FloatArray) -> NDArray[np.int64]:
    """Return the indices (DRAWN,) of the stops to plot.

    The result is a systematic sample, without random numbers: a stop occurs in proportion to its weight.

    weights : (M,) weights of the stops
    """
    reached = np.cumsum(weights)
    share = (np.arange(DRAWN) + 0.5) / DRAWN * reached[-1]
    return np.asarray(np.searchsorted(reached, share).clip(max=len(weights) - 1))


def write_coverage(path: Path, rank: FloatArray, blocks: int) -> None:
    """Write coverage.png: how many of the observed blocks stopped within the predictive intervals of a calibration.

    The picture shows which share of the blocks stopped within intervals of each probability. The blocks were kept out
    of the fit.

    rank : (K, 2) predicted probability that a rock stops nearer than the observed block, along and across the slope
    blocks : number of all blocks, at least K; a block without a prediction is outside all intervals
    """
    figure = Figure(figsize=(10.0, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    wanted = np.linspace(0.0, 1.0, 201)
    doubt = 2.0 * np.sqrt(wanted * (1.0 - wanted) / blocks)
    left.fill_between(wanted, np.clip(wanted - doubt, 0, 1), np.clip(wanted + doubt, 0, 1), color="#dddddd",
                      label=f"chance, {blocks} blocks")  # fmt: skip
    left.plot(wanted, wanted, color="0.4", linewidth=1.0)
    for axis, colour in enumerate((POSTERIOR, OBSERVED)):
        inside = 2.0 * np.abs(rank[:, axis] - 0.5)
        left.plot(wanted, [(inside <= share).sum() / blocks for share in wanted], color=colour, label=AXES[axis])
        right.hist(rank[:, axis], bins=np.linspace(0, 1, 11).tolist(), histtype="step", color=colour, linewidth=1.8)
    right.axhline(len(rank) / 10, color="0.4", linewidth=1.0)
    label(left, "probability of the predictive interval (-)", "share of kept-out blocks inside (-)")
    label(right, "predicted probability of a nearer stop (-)", "kept-out blocks")
    left.legend(fontsize=8)
    left.set_title("do the intervals hold what was kept out?", loc="left")
    save(figure, path)
