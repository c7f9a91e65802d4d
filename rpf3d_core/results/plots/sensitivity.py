"""Draw the tornado picture of a sensitivity analysis: for each result, how strongly each unknown changes it."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rpf3d_core.results.plots.style import save

FloatArray = NDArray[np.float64]

COLUMNS = 2
"""Number of panels side by side."""
BAR, DOUBT = "#1f4e9c", "#222222"
UNKNOWN_SIZE = " (unknown)"
"""Text after the name of an unknown coefficient whose effect on a result is not known."""


def write_tornado(
    path: Path, names: Sequence[str], titles: Sequence[tuple[str, str]], sizes: FloatArray, ends: FloatArray
) -> None:
    """Write tornado.png: a panel for each result, a bar for each unknown, the longest on top, unknown sizes last.

    names : names of the U unknowns; titles : for each of the Y results, the title and the axis label of its panel
    sizes : (U, Y) lengths of the bars, in the unit of the axis, NaN if unknown
    ends : (2, U, Y) ends of the intervals of these lengths
    """
    rows = max(-(-len(titles) // COLUMNS), 1)
    height = (0.35 * len(names) + 1.1) * rows
    figure = Figure(figsize=(13.0, height), layout="constrained")
    panels = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    for panel, (title, axis), y in zip(panels, titles, range(len(titles)), strict=False):
        order = np.argsort(np.nan_to_num(sizes[:, y], nan=-np.inf))
        size = sizes[order, y]
        doubt = np.abs(np.nan_to_num(ends[:, order, y] - size))
        labels = [names[k] + (UNKNOWN_SIZE if np.isnan(sizes[k, y]) else "") for k in order]
        panel.barh(labels, np.nan_to_num(size), color=BAR, xerr=doubt, ecolor=DOUBT, capsize=2.0)
        panel.tick_params(axis="y", labelsize=8)
        panel.set_title(title, loc="left", fontsize=10)
        panel.set_xlabel(axis, fontsize=8)
        panel.grid(visible=True, axis="x", color="#dddddd", linewidth=0.6)
        panel.set_axisbelow(True)
    for panel in panels[len(titles) :]:
        panel.set_axis_off()
    save(figure, path)
