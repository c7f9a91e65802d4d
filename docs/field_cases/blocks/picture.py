"""Draw where rocks with a shape end at Authume, next to those of the calibrated point and sphere, and the blocks."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from field_cases import authume
from field_cases.rows import row_named
from rpf3d_core.ensemble.flights import FloatArray

DRAWN = 1500
"""Number of rocks in each map."""
OTHERS = {"Coulomb-limited": "point, Coulomb-limited", "rigid sphere": "rigid sphere"}
COLOURS = ("tab:green", "tab:orange", "tab:purple")


def draw(ends: FloatArray, results: Mapping[str, Any], path: Path) -> None:
    """Write the picture; ends : end points (N, 3) m of rocks with a shape; results : with the other calibrations."""
    figure = Figure(figsize=(13.0, 4.0), layout="constrained")
    FigureCanvasAgg(figure)
    maps = list(figure.subplots(1, 3, sharey=True).flat)
    shown = {OTHERS[name]: _flown(name, results) for name in OTHERS} | {"rocks with a shape": ends}
    for axes, (label, stops), colour in zip(maps, shown.items(), COLOURS, strict=True):
        _map(axes, stops, label, colour)
    maps[0].set_ylabel("z (m)")
    figure.suptitle("Authume P1, calibrated on x: where rocks and the 41 blocks end, in plan")
    figure.savefig(path, dpi=110)


def _flown(model: str, results: Mapping[str, Any]) -> FloatArray:
    """Return the end points (N, 3) m of a calibrated point or sphere."""
    row = row_named(model)
    keys = row.keys(results["authume"]["calibrations"][model]["parameters"])
    return authume.site(DRAWN, authume.REPORT_SEED).fly(keys).end


def _map(axes: Axes, stops: FloatArray, label: str, colour: str) -> None:
    field, start = authume.end_points(), authume.drop()
    axes.plot(stops[:DRAWN, 0], stops[:DRAWN, 2], ".", ms=3, alpha=0.4, color=colour)
    axes.plot(field[:, 0], field[:, 2], "k^", ms=6, fillstyle="none", label="the 41 blocks")
    axes.plot(start[0], start[2], "r*", ms=10, label="mean drop point")
    spread = authume.figures_of(authume.in_field_datum(stops))
    axes.set(xlabel="x (m)", aspect="equal", xlim=(-5, 95), ylim=(345, 415),
             title=f"{label}: lateral sd {spread['side_sd']:.1f} m")  # fmt: skip
    axes.legend(fontsize=8, loc="upper left")
