"""Draw where calibrated rocks end at Authume: points, spheres and rocks with a shape, and the blocks."""

from collections.abc import Mapping
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from field_cases import authume
from field_cases.flying import Ends
from field_cases.measuring import label
from field_cases.models import CALIBRATED, COULOMB_LIMITED, SHAPES, SPHERE
from rpf3d_core.ensemble.flights import FloatArray

DRAWN = 1500
"""Number of rocks in each map, evenly among all."""
COLOURS = {COULOMB_LIMITED: "tab:green", SPHERE: "tab:orange", SHAPES: "tab:purple"}


def draw(ends: Mapping[str, Ends], path: Path) -> None:
    """Write the picture; ends : end points at Authume by the label of a line, as `measuring.Measured` has them."""
    figure = Figure(figsize=(13.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    maps = list(figure.subplots(1, 3, sharey=True).flat)
    for axes, (model, colour) in zip(maps, COLOURS.items(), strict=True):
        _map(axes, ends[label({"model": model.name, "values": CALIBRATED})].end, model.name, colour)
    maps[0].set_ylabel("z (m)")
    figure.suptitle("Authume P1, calibrated: where rocks of 64 parameter sets and the 41 blocks end, in plan")
    figure.savefig(path, dpi=110)


def _map(axes: Axes, stops: FloatArray, name: str, colour: str) -> None:
    field, start = authume.end_points(), authume.drop()
    drawn = stops[:: max(len(stops) // DRAWN, 1)]
    axes.plot(drawn[:, 0], drawn[:, 2], ".", ms=3, alpha=0.4, color=colour)
    axes.plot(field[:, 0], field[:, 2], "k^", ms=6, fillstyle="none", label="the 41 blocks")
    axes.plot(start[0], start[2], "r*", ms=10, label="mean drop point")
    spread = authume.figures_of(authume.in_field_datum(stops))
    axes.set(xlabel="x (m)", aspect="equal", xlim=(-5, 95), ylim=(345, 415),
             title=f"{name}: lateral sd {spread['side_sd']:.1f} m")  # fmt: skip
    axes.legend(fontsize=8, loc="upper left")
