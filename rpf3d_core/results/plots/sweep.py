"""Draw the picture of a sweep: a panel for each result, with a curve for each combination of values of further keys."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.results.plots.style import save
from rpf3d_core.results.series import Curve, Panel

COLUMNS = 3
"""Number of panels side by side."""
COLOURS = ("#1f4e9c", "#c8501e", "#2e7d32", "#7b3fa0", "#9a7b00", "#00838f", "#ad1457", "#555555")
MARKERS = "osD^vP*X"
INTERVAL = {True: "95 % predictive interval, unknowns included", False: "95 % sampling interval of the number of rocks"}
DRAWN = {True: "bands", False: "bars"}
"""Style in which intervals are drawn, by `Curve.is_predictive`: predictive intervals do not look like sampling ones."""
CAP, BROAD = 6.0, 9.0
"""Width (points) of the ends of a bar, and of the bar that replaces the band at a point without known neighbours."""
UNKNOWN, BESIDE = "?", 7.0
"""Text next to a point at an unknown end of its interval, and its distance (points) from the point."""


def write_curves(path: Path, title: str, key: str, panels: Sequence[Panel]) -> None:
    """Write sweep.png: the curves of all panels over the values of a varied key; key : name and unit of this key."""
    rows = -(-len(panels) // COLUMNS)
    figure = Figure(figsize=(13.0, 3.4 * rows + 1.0), layout="constrained")
    places = figure.subplots(rows, COLUMNS, squeeze=False).ravel()
    at = _places_of(panels)
    for axes, panel in zip(places, panels, strict=False):
        _draw(axes, panel, at, key)
    for axes in places[len(panels) :]:
        axes.set_axis_off()
    figure.suptitle(f"{title}; {_bands(panels)}", x=0.01, ha="left", fontsize=11)
    if any(curve.name for panel in panels for curve in panel.curves):
        handles, names = places[len(panels) - 1].get_legend_handles_labels()
        figure.legend(handles, names, loc="outside lower center", ncols=4, fontsize=9)
    save(figure, path)


def _bands(panels: Sequence[Panel]) -> str:
    """Return a text for the title: which intervals the bands and the bars of the panels show."""
    kinds = {curve.is_predictive for panel in panels for curve in panel.curves if curve.values}
    words = [f"{DRAWN[kind]}: {INTERVAL[kind]}" for kind in (True, False) if kind in kinds]
    ends = [end for panel in panels for curve in panel.curves for end in (*curve.low, *curve.high)]
    if None in ends:
        words.append(f"{UNKNOWN}: unknown interval or end")
    return "; ".join(words) or "no intervals"


def _places_of(panels: Sequence[Panel]) -> dict[str, float]:
    """Return the position on the horizontal axis of each value of the varied key, by the value as text.

    If all values are numbers, each number is its own position; else the positions are 0, 1, 2, ...
    """
    values: dict[str, Any] = {str(at): at for panel in panels for curve in panel.curves for at in curve.at}
    if all(isinstance(value, int | float) and not isinstance(value, bool) for value in values.values()):
        return {text: float(value) for text, value in values.items()}
    return {text: float(number) for number, text in enumerate(values)}


def _draw(axes: Axes, panel: Panel, at: dict[str, float], key: str) -> None:
    axes.set_title(panel.title, loc="left", fontsize=10)
    axes.set_xlabel(key, fontsize=9)
    axes.set_ylabel(panel.axis, fontsize=9)
    if all(value is None for curve in panel.curves for value in curve.values):
        axes.text(0.5, 0.5, panel.unknown, transform=axes.transAxes, ha="center", va="center")
        axes.set(xticks=[], yticks=[])  # without values, matplotlib's ticks would be meaningless numbers around 0
        return
    for number, curve in enumerate(panel.curves):
        _draw_curve(axes, curve, at, number)
    if has_unknown_ends := any(None in (*curve.low, *curve.high) for curve in panel.curves):
        axes.margins(y=0.12)  # room for the question marks
    axes.set_ylim(bottom=0.0)
    if "(%)" in panel.axis:
        axes.set_ylim(top=112.0 if has_unknown_ends else 104.0)
    if [float(text) for text in at if _is_number(text)] != list(at.values()):
        axes.set_xticks(list(at.values()), list(at), fontsize=8)
    elif all(place.is_integer() for place in at.values()):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    axes.grid(visible=True, color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)


def _draw_curve(axes: Axes, curve: Curve, at: dict[str, float], number: int) -> None:
    """Draw a curve with its intervals: predictive intervals as a band, sampling intervals as a bar at each point.

    at : from `_places_of`; number : number of the curve in its panel, which sets colour and marker
    """
    colour, marker = COLOURS[number % len(COLOURS)], MARKERS[number % len(MARKERS)]
    order = sorted(range(len(curve.at)), key=lambda k: at[str(curve.at[k])])
    x = np.array([at[str(curve.at[k])] for k in order])
    y, low, high = (
        np.array([np.nan if each[k] is None else each[k] for k in order], dtype=float)
        for each in (curve.values, curve.low, curve.high)
    )
    axes.plot(x, y, color=colour, marker=marker, markersize=5, linewidth=1.4, label=curve.name)
    # an interval with one known end is drawn from this end to the value
    bottom, top = np.where(np.isnan(low) & ~np.isnan(high), y, low), np.where(np.isnan(high) & ~np.isnan(low), y, high)
    if curve.is_predictive:
        _draw_band(axes, x, low, high, colour)
        alone = _are_alone(low, high) & ~np.isnan(bottom + top)
        axes.vlines(x[alone], bottom[alone], top[alone], color=colour, linewidth=BROAD, alpha=0.25)
    else:
        axes.vlines(x, bottom, top, color=colour, linewidth=1.0)
        for end in (low, high):
            axes.plot(x, end, color=colour, linestyle="", marker="_", markersize=CAP)
    _mark_unknown_ends(axes, np.column_stack([x, y, low, high]), colour)


def _draw_band(axes: Axes, x: FloatArray, low: FloatArray, high: FloatArray, colour: str) -> None:
    """Draw the band of a curve with P points: only between neighbouring points with known intervals.

    x : (P,) positions on the axis; low, high : (P,) lower and upper ends of the intervals; NaN if unknown
    """
    axes.fill_between(x, low, high, where=~np.isnan(low + high), color=colour, alpha=0.15, linewidth=0)
    for end in (low, high):
        axes.plot(x, np.where(np.isnan(low + high), np.nan, end), color=colour, linewidth=0.7, alpha=0.7)


def _are_alone(low: FloatArray, high: FloatArray) -> NDArray[np.bool_]:
    """Return flags (P,), True for a point without a band to a neighbour.

    A band connects neighbouring points with known intervals. So the interval of the point is unknown, or the intervals
    of both neighbours are unknown.

    low, high : (P,) lower and upper ends of the intervals; NaN if unknown
    """
    known = np.concatenate([[False], ~np.isnan(low + high), [False]])
    return np.asarray(~known[1:-1] | (~known[:-2] & ~known[2:]))


def _mark_unknown_ends(axes: Axes, points: FloatArray, colour: str) -> None:
    """Write a question mark next to each point of a curve whose interval has an unknown end.

    The question mark is above the point if the upper end or both ends are unknown, and below the point if only the
    lower end is unknown. A point with an unknown value has none.

    points : (P, 4) position on the axis, value, lower and upper end; unknown numbers are NaN
    """
    for x, y, low, high in points:
        if np.isnan(y) or not np.isnan([low, high]).any():
            continue
        side = 1 if np.isnan(high) else -1
        axes.annotate(
            UNKNOWN, (x, y), xytext=(0.0, side * BESIDE), textcoords="offset points", color=colour, ha="center",
            va="bottom" if side > 0 else "top", fontsize=10, fontweight="bold", annotation_clip=False,
        )  # fmt: skip


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
