"""cost.png: what accuracy costs, error against seconds, both logarithmic."""

from collections.abc import Sequence
from itertools import cycle
from pathlib import Path
from typing import Protocol

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from rpf3d_core.io.plots_profiles import save

LOOKS = {"geometric": ("tab:green", "s"), "statistical": ("tab:blue", "o")}
"""Colour and marker of the series that are one of their kind; those of fixed steps have one each, in turn."""
STEPS = ("#fdae61", "#f46d43", "#a50026", "#7b3294", "0.65", "0.4", "tab:brown", "tab:pink", "tab:olive")
NOTHING = 1e-4
"""Where an error of 0 is drawn: logarithms have no place for it."""


class DrawnSeries(Protocol):
    """What is drawn of a series; `accuracy.series.Series` has it."""

    @property
    def name(self) -> str:
        """For the legend."""

    @property
    def kind(self) -> str:
        """One of numerical, geometric, statistical."""

    @property
    def seconds(self) -> Sequence[float]:
        """Of each point, s."""

    @property
    def errors(self) -> Sequence[float]:
        """Of each point (-)."""

    @property
    def words(self) -> Sequence[str]:
        """Beside each point."""


def write_cost(path: Path, name: str, series: Sequence[DrawnSeries], target: float) -> None:
    """Write the picture; `name` : of the scene, for the title; `target` : (-), drawn as a line."""
    figure = Figure(figsize=(10.0, 7.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    steps = cycle(STEPS)
    for one in series:
        colour, marker = LOOKS.get(one.kind, ("", "^"))
        if one.name == "events":
            colour, marker = "black", "*"
        _draw(axes, one, colour or next(steps), marker)
    axes.axhline(target, color="0.3", linestyle="--", linewidth=1.0, label=f"target {target:g}")
    axes.set(xscale="log", yscale="log", ylim=(0.6 * NOTHING, 1.5))
    axes.set_xlabel("seconds of one core (fixed steps, triangles: for 1,000 rocks; number of rocks: for that many)")
    axes.set_ylabel("error of the map of reach probability (-)")
    axes.grid(which="major", color="0.9")
    figure.legend(fontsize=8, loc="outside lower center", ncols=4)  # inside, it would hide points
    axes.set_title(f"{name}: what accuracy costs", loc="left")
    save(figure, path)


def _draw(axes: Axes, one: DrawnSeries, colour: str, marker: str) -> None:
    errors = [max(error, NOTHING) for error in one.errors]
    size = 14 if one.name == "events" else 5
    axes.plot(one.seconds, errors, color=colour, marker=marker, markersize=size, linewidth=1.2, label=one.name)
    for x, y, error, word in zip(one.seconds, errors, one.errors, one.words, strict=True):
        text = f"{word}: 0" if error == 0.0 else word
        left = one.kind == "geometric"  # these and the numbers of rocks lie side by side
        axes.annotate(
            text, (x, y), xytext=(-5 if left else 4, 4), textcoords="offset points", fontsize=6.5, color=colour,
            ha="right" if left else "left",
        )  # fmt: skip
