"""Draw the critical section of a report: terrain and paths, and below them the shares of rocks that pass distances."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from rpf3d_core.ensemble.outward import short_length
from rpf3d_core.results.plots.style import GROUND, PATH, label, scale_in_words

FloatArray = NDArray[np.float64]
PANEL, NARROWEST, SHARES = 6.6, 3.4, 1.9
"""Largest and smallest width of the panels, and height of the lower panel (inches): letters stay readable on paper."""
LOWEST, HIGHEST = 1.8, 4.4
"""Smallest and largest height (inches) of the upper panel; within these limits, lengths and heights have the same
scale. A section that is higher than HIGHEST has narrower panels instead."""
TOP, BETWEEN, BELOW, LEFT, RIGHT = 0.35, 0.75, 0.6, 0.75, 0.15
"""Sizes (inches) of the title, of the labels between, below and left of the panels, and of the margin on the right."""
ONE_ROW, ROW = 5.2, 0.2
"""Width (inches) of the panels from which the legend of the lower panel has one row, and height of a second row."""
LONGEST = 12
"""Largest number of letters of the name of a source in a legend."""
LIMIT, BAND, FENCE, CRITICAL = "#b3007a", "#9bb8e0", "#111111", "#d1480f"


class SectionDrawing(NamedTuple):
    """The content of the picture of a critical section; distances (m) are horizontal and start at `origin`.

    distance, ground : (S,) m, distance and elevation of the terrain, NaN without terrain
    paths : each (P, 2) m, distance and elevation of the points of a path
    path : (P, 2) m, the path of the rock that stopped farthest from its release; None if the path is not known
    held : distance (m) within which 90 % of the rocks stop, drawn as a line; None to draw no line
    at : (D,) m, distances; passed : (D,) share (-) of the rocks that pass each distance
    sampling, predictive : (2, D) lower and upper ends of the intervals of `passed`; predictive is None if unknown
    origin : name of the place where distances start: the toe, or the release if there is no toe
    fences : name, distance (m), and elevations (m) of foot and top of each barrier that crosses the section
    source : name of the source whose rocks `held` and `passed` count; "" for all rocks
    """

    distance: FloatArray
    ground: FloatArray
    paths: Sequence[FloatArray]
    held: float | None
    at: FloatArray
    passed: FloatArray
    sampling: FloatArray
    predictive: FloatArray | None
    origin: str
    fences: Sequence[tuple[str, float, float, float]] = ()
    path: FloatArray | None = None
    source: str = ""

    @property
    def from_source(self) -> str:
        """The source as text, such as `from crest`; long names are cut, so that legends fit; "" for all rocks."""
        name = self.source if len(self.source) <= LONGEST else f"{self.source[:LONGEST]}..."
        return f"from {name}" if name else ""


def section_figure(drawing: SectionDrawing) -> Figure:
    """Draw the critical section above, and the share of rocks that pass each distance below."""
    length = float(drawing.distance[-1] - drawing.distance[0])
    floor, top = _heights(drawing)
    across = min(max(HIGHEST * length / (top - floor), NARROWEST), PANEL)
    true = across * (top - floor) / length
    height = min(max(true, LOWEST), HIGHEST)
    columns = 3 if across >= ONE_ROW or drawing.predictive is None else 2
    between = BETWEEN if columns == 3 else BETWEEN + ROW
    wide, whole = LEFT + across + RIGHT, height + SHARES + TOP + between + BELOW
    figure = Figure(figsize=(wide, whole))
    upper, lower = figure.subplots(2, 1, height_ratios=(height, SHARES))
    figure.subplots_adjust(
        left=LEFT / wide, right=1.0 - RIGHT / wide, top=1.0 - TOP / whole, bottom=BELOW / whole,
        hspace=between / (0.5 * (height + SHARES)),
    )  # fmt: skip
    upper.set_ylim(floor, top)
    _draw_section(upper, drawing, floor, height / true)
    _draw_shares(lower, drawing, columns)
    for axes in (upper, lower):
        axes.axvline(0.0, color="#444444", linewidth=0.8, linestyle=":")
        if drawing.held is not None:
            axes.axvline(drawing.held, color=LIMIT, linewidth=1.2, linestyle="--")
        axes.set_xlim(drawing.distance[0], drawing.distance[-1])
        if across < ONE_ROW:
            axes.xaxis.label.set_size(8)  # else the label is wider than the picture
    return figure


def _heights(drawing: SectionDrawing) -> tuple[float, float]:
    """Return the elevations (m) of the lower and the upper edge of the section: its contents plus a margin."""
    tops = np.array([top for _, _, _, top in drawing.fences])
    heights = np.concatenate([drawing.ground, tops, *(path[:, 1] for path in _paths(drawing))])
    low, high = float(np.nanmin(heights)), float(np.nanmax(heights))
    room = 0.08 * (high - low) + 0.5
    return low - room, high + room


def _paths(drawing: SectionDrawing) -> list[FloatArray]:
    """Return all paths of the picture, each (P, 2) m."""
    return [*drawing.paths, *([] if drawing.path is None else [drawing.path])]


def _draw_section(axes: Axes, drawing: SectionDrawing, floor: float, exaggerated: float) -> None:
    """Draw the terrain's profile, the paths, the barriers that cross the section, and the legend.

    floor : lowest elevation of the panel (m)
    exaggerated : factor (-) by which heights are drawn larger than lengths, 1 for equal scales
    """
    ground = drawing.ground
    axes.fill_between(drawing.distance, np.nan_to_num(ground, nan=floor), floor, color=GROUND, alpha=0.35, linewidth=0)
    axes.plot(drawing.distance, ground, color=GROUND, linewidth=1.8, label="terrain")
    axes.add_collection(LineCollection(list(drawing.paths), colors=PATH, linewidths=0.6, alpha=0.5))
    axes.plot([], [], color=PATH, linewidth=0.8, label=f"kept paths in the strip ({len(drawing.paths):,})")
    if drawing.path is not None:
        axes.plot(*drawing.path.T, color=CRITICAL, linewidth=1.6, zorder=3, label="rock that stopped farthest away")
    for name, distance, foot, top in drawing.fences:
        axes.plot([distance, distance], [foot, top], color=FENCE, linewidth=3.0, solid_capstyle="butt", zorder=4,
                  label=f"barrier {name}: {top - foot:g} m high")  # fmt: skip
    if drawing.held is not None:
        of = drawing.from_source or "of the rocks"
        axes.plot([], [], color=LIMIT, linestyle="--", label=f"holds 90 % {of}: {short_length(drawing.held)} m")
    label(axes, _distance(drawing), "elevation (m)")
    axes.set_title(scale_in_words(exaggerated), loc="left", fontsize=10)
    axes.legend(loc="upper right", framealpha=0.9, fontsize=8)


def _distance(drawing: SectionDrawing) -> str:
    """Return the label of the axis of distances."""
    return f"horizontal distance beyond {drawing.origin} (m)"


def _draw_shares(axes: Axes, drawing: SectionDrawing, columns: int) -> None:
    """Draw the share of rocks that pass each distance, with the predictive band behind the sampling band.

    The legend is above the panel, because the curve may be anywhere in it; columns : number of columns of the legend
    """
    if drawing.predictive is not None:
        axes.fill_between(drawing.at, *(100.0 * drawing.predictive), color=BAND, alpha=0.5, linewidth=0,
                          label="95 % predictive interval")  # fmt: skip
    axes.fill_between(drawing.at, *(100.0 * drawing.sampling), color=PATH, alpha=0.35, linewidth=0,
                      label="95 % sampling interval")  # fmt: skip
    rocks = drawing.from_source or "rocks of all sections"
    axes.plot(drawing.at, 100.0 * drawing.passed, color=PATH, linewidth=1.4, label=rocks)
    axes.set_ylim(0.0, 100.0)
    label(axes, _distance(drawing), "rocks that pass (%)")
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=columns, frameon=False, fontsize=8,
                borderaxespad=0.2, columnspacing=1.2, handlelength=1.6)  # fmt: skip
