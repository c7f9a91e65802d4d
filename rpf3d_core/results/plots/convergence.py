"""Draw convergence.png: how the sampling uncertainty of shares and energies shrinks with the number of rocks."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from rpf3d_core.hazard.convergence import Step
from rpf3d_core.results.plots.style import label, save

if TYPE_CHECKING:
    from rpf3d_core.scene.model import TargetSpec

SHOWN = 8
"""Number of places drawn: the zones or areas with the widest intervals in the last step."""
JOULE_PER_KJ = 1000.0


def write_convergence(path: Path, name: str, steps: Sequence[Step], target: "TargetSpec") -> None:
    """Write convergence.png: widths of intervals, and 95th percentiles of energy, against the number of rocks.

    name : name of the scene and number of rocks, for the title; steps : at least one, in order of the number of rocks
    """
    figure = Figure(figsize=(8.0, 8.0), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(2, 1, sharex=True)
    places = sorted(steps[-1].places, key=lambda place: -steps[-1].places[place].half_width)[:SHOWN]
    for place in places:
        _draw_half_widths(upper, place, steps)
        _draw_energies(lower, place, steps)
    rocks = [step.rocks for step in steps]
    fall = [steps[-1].half_width * (rocks[-1] / n) ** 0.5 for n in rocks]
    upper.plot(rocks, fall, color="0.6", linestyle=":", label="as 1 / square root of rocks")
    upper.axhline(target.half_width, color="0.3", linestyle="--", label=f"target {target.half_width:g}")
    label(upper, "", "half-width of the 95 % sampling interval (-)")
    label(lower, "rocks flown", "p95 of energy (kJ)")
    upper.set(xscale="log", yscale="log")  # after `label`, which can only set plain numbers on linear axes
    upper.legend(fontsize=8)
    for axis in (upper.xaxis, upper.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axis.set_minor_formatter(NullFormatter())
    upper.set_title(f"{name}: what the number of rocks leaves open", loc="left")
    save(figure, path)


def _draw_half_widths(axes: Axes, place: str, steps: Sequence[Step]) -> None:
    known = [(step.rocks, step.places[place].half_width) for step in steps if place in step.places]
    axes.plot(*zip(*known, strict=True), marker="o", markersize=3, label=place)


def _draw_energies(axes: Axes, place: str, steps: Sequence[Step]) -> None:
    known = [
        (step.rocks, energy / JOULE_PER_KJ)
        for step in steps
        if place in step.places and (energy := step.places[place].energy_p95) is not None
    ]
    if known:
        axes.plot(*zip(*known, strict=True), marker="o", markersize=3, label=place)
