"""Draw cost.png, the picture of `rpf3d cost`: the error of each setting against its computing time.

Both axes are logarithmic.
"""

from collections.abc import Sequence
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from rpf3d_core.results.plots.style import save
from rpf3d_core.results.series import LEAST, Series

MARKERS = {"numerical": "^", "geometric": "s", "statistical": "o"}
UNKNOWN = "tab:purple"
"""Colour of the line of the parametric error."""
MARGIN = 0.08
"""Free space on each side of the points (-), as a share of the width, for their labels."""


def write_cost(path: Path, name: str, series: Sequence[Series], target: float, unknown: float | None) -> None:
    """Write cost.png, from which users choose a setting: error of the map of reach probability against computing time.

    name : name of the scene, for the title; series : points of error against time, such as those of one method
    target : largest error (-) that the user accepts, drawn as a line
    unknown : error of the map (-) from unknown values of the ground, the parametric error; None if it was not measured.
        This error is drawn as a line, because no setting and no computing time reduces it.
    """
    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    axes = figure.subplots()
    for one in series:
        _draw(axes, one)
    if any(one.compiled is not None for one in series):
        axes.plot(
            [], [], color="0.5", marker="^", markerfacecolor="white", linestyle=":", label="the same steps, compiled"
        )
    axes.axhline(target, color="0.3", linestyle="--", linewidth=1.0, label=f"target {target:g}")
    if unknown is not None:
        label = f"unknown values of the ground: {unknown:.2g}"
        axes.axhline(max(unknown, LEAST), color=UNKNOWN, linestyle="-.", linewidth=1.2, label=label)
    axes.set(xscale="log", yscale="log")
    axes.set_ylim(top=1.5)
    axes.margins(x=MARGIN)
    axes.set_xlabel(
        "seconds of one core (events, steps, triangles: for 1,000 rocks; number of rocks: for that many)\n"
        "steps as in the thesis, VTK called from Python; all else is compiled"
    )
    axes.set_ylabel(f"error of the map of reach probability (-)\nerrors below {LEAST:g} are drawn at {LEAST:g}")
    axes.grid(which="major", color="0.9")
    figure.legend(fontsize=8, loc="outside lower center", ncols=4)  # inside the axes, the legend would hide points
    axes.set_title(f"{name}: what accuracy costs", loc="left")
    save(figure, path)


def _draw(axes: Axes, one: Series) -> None:
    """Draw one series of points with labels; hollow markers show the times of the compiled engine."""
    red, green, blue = one.colour
    colour = (red / 255.0, green / 255.0, blue / 255.0)
    marker, size = ("*", 14) if one.name == "events" else (MARKERS[one.kind], 5)
    axes.plot(one.seconds, one.errors, color=colour, marker=marker, markersize=size, linewidth=1.2, label=one.name)
    if one.compiled is not None:
        axes.plot(
            one.compiled, one.errors, color=colour, marker=marker, markersize=4, markerfacecolor="white", linestyle=":",
            linewidth=0.8,
        )  # fmt: skip
    below = one.name.startswith("steps, raster")  # rasters have errors close to the errors of steps on the mesh
    left = one.kind == "geometric"  # labels on the left, because points of the series "number of rocks" lie close by
    for x, y, word in zip(one.seconds, one.errors, one.words, strict=True):
        axes.annotate(
            word, (x, y), xytext=(-5 if left else 4, -10 if below else 4), textcoords="offset points", fontsize=6.5,
            color=colour, ha="right" if left else "left",
        )  # fmt: skip
