"""The report's pictures."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from field_cases import authume, chant_sura, tschamut
from field_cases.flying import Ends
from field_cases.measuring import CALIBRATED, Measured
from field_cases.rows import HOEK
from rpf3d_core.ensemble.flights import FloatArray

MODEL_COLOURS = {"constant": "tab:blue", "rigid sphere": "tab:orange"}
STYLES = {HOEK: ":", "STONE": "--", CALIBRATED: "-"}
DRAWN = 1500
"""Rocks in a map at most."""


def draw_all(measured: Measured, folder: Path) -> None:
    """Write validation_<site>.png into a folder."""
    _authume(measured.results["authume"], measured.ends["authume"]).savefig(folder / "validation_authume.png", dpi=110)
    _tschamut(measured.ends["tschamut"]).savefig(folder / "validation_tschamut.png", dpi=110)
    _chant_sura(measured.results["chant_sura"]).savefig(folder / "validation_chant_sura.png", dpi=110)


def _figure(columns: int, width: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, 4.4), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(1, columns))


def _authume(results: Mapping[str, Any], ends: Mapping[str, Ends]) -> Figure:
    figure, (shares, plan, curves) = _figure(3, 15.0)
    _shares_below(shares, ends)
    _stops_in_plan(plan, ends)
    for R_n, means in results["sensitivity"]["curves"].items():
        curves.plot(authume.STEPS_OF_R_T, means, "o-", label=f"R_n {R_n}")
    angle = results["calibrations"]["constant"]["parameters"]["friction_angle_deg"]
    curves.axhspan(*results["field"]["mean_interval"], color="0.85", label="field, 95 %")
    curves.set(xlabel="R_t (-)", ylabel="mean x of ends (m)", title=f"constant, friction angle {angle:g} degrees")
    curves.legend(fontsize=8)
    return figure


def _shares_below(axes: Axes, ends: Mapping[str, Ends]) -> None:
    field = np.sort(authume.end_points()[:, 0])
    axes.fill_betweenx(_steps(len(field)), *_band(field), color="0.85", label="field, bootstrap 95 %", step="mid")
    axes.plot(field, _steps(len(field)), "k-", lw=2, drawstyle="steps-post", label="field, 41 blocks")
    for label, flown in ends.items():
        model, values = label.split(", ")
        x = np.sort(flown.end[:, 0])
        axes.plot(x, _steps(len(x)), STYLES[values], color=MODEL_COLOURS[model], label=label)
    for x in (30.0, 45.0):
        axes.axvline(x, color="0.6", lw=0.8)
    axes.set(xlabel="x of ends (m)", ylabel="share below (-)", title="Authume P1: where rocks end", xlim=(0, 180))
    axes.legend(fontsize=7, loc="lower right")


def _band(field: FloatArray) -> tuple[FloatArray, FloatArray]:
    """95 % band (2 x N) of the sorted positions of N blocks."""
    draws = np.random.default_rng(1).integers(0, len(field), (2000, len(field)))
    low, high = np.percentile(np.sort(field[draws], axis=1), (2.5, 97.5), axis=0)
    return low, high


def _steps(n: int) -> FloatArray:
    return (np.arange(n) + 0.5) / n


def _stops_in_plan(axes: Axes, ends: Mapping[str, Ends]) -> None:
    for label, flown in ends.items():
        model, values = label.split(", ")
        if values == CALIBRATED:
            x, z = flown.end[:DRAWN, 0], flown.end[:DRAWN, 2]
            axes.plot(x, z, ".", ms=4, alpha=0.3, color=MODEL_COLOURS[model], label=f"{label}, {len(x):,} of the rocks")
    field = authume.end_points()
    axes.plot(field[:, 0], field[:, 2], "k^", ms=5, label="field")
    start = authume.drop()
    axes.plot(start[0], start[2], "r*", ms=10, label="drop")
    axes.set(xlabel="x (m)", ylabel="z (m)", title="in plan", aspect="equal", xlim=(-5, 75), ylim=(335, 400))
    axes.legend(fontsize=7, loc="lower left", markerscale=1.5)


def _tschamut(ends: Mapping[str, Ends]) -> Figure:
    figure, (plan, runouts) = _figure(2, 11.0)
    field, seen = tschamut.runs(), tschamut.runs().seen().runout
    _contours(plan)
    for i in field.distinct():
        plan.plot(*zip(field.release[i, :2], field.end[i, :2], strict=True), color="0.8", lw=0.8)
    plan.plot(*field.release[:, :2].T, "r*", label="release")
    plan.plot(*field.end[:, :2].T, "k^", ms=5, label="field")
    longest = 0.0
    for label, flown in ends.items():
        model, values = label.split(", ")
        simulated = seen + tschamut.errors_of(flown)
        longest = max(longest, float(simulated.max()))
        mark = {HOEK: "x", "STONE": "+", CALIBRATED: "o"}[values]
        runouts.plot(seen, simulated, mark, color=MODEL_COLOURS[model], label=label, fillstyle="none")
        if values == CALIBRATED:
            plan.plot(*tschamut.mean_ends(flown)[:, :2].T, "o", color=MODEL_COLOURS[model], fillstyle="none",
                      label=f"{label}, mean of each run")  # fmt: skip
    limit = 1.05 * max(longest, float(seen.max()))
    runouts.plot([0, limit], [0, limit], "k-", lw=0.8)
    runouts.set(xlabel="runout seen (m)", ylabel="mean runout simulated (m)", title="18 runs",
                ylim=(0, limit), xlim=(0, 125))  # fmt: skip
    runouts.legend(fontsize=7)
    plan.set(xlabel="x (m)", ylabel="y (m)", title="Tschamut 2014, in plan", aspect="equal", xlim=(-10, 180),
             ylim=(110, 275))  # fmt: skip
    plan.legend(fontsize=7, loc="upper right")
    return figure


def _contours(axes: Axes) -> None:
    """Heights of the proxy terrain, every 5 m."""
    heights = tschamut.heights()
    y, x = (tschamut.CELL * np.arange(n) for n in heights.shape)
    west, south = tschamut.CORNER
    lines = axes.contour(west + x, south + y, heights, np.arange(0.0, 200.0, 5.0), colors="tan", linewidths=0.5)
    axes.clabel(lines, lines.levels[::4], fontsize=6)


def _chant_sura(results: Mapping[str, Any]) -> Figure:
    figure, (published, contacts) = _figure(2, 12.0)
    seen = results["field"]["published"]
    names = [impact.name for impact in chant_sura.published()]
    published.plot(names, seen, "k^", ms=8, label="field")
    for line in results["lines"]:
        if line["values"] == HOEK and line["model"] != "thesis_literal":  # on level ground it is the constant one
            published.plot(names, line["published"]["ratios"], "_", ms=16, mew=1.5, label=f"{line['model']}, {HOEK}")
    for model, found in results["calibrations"].items():
        published.plot(names, found["published"]["ratios"], "o", fillstyle="none", color=MODEL_COLOURS[model],
                       label=f"{model}, calibrated on the eleven")  # fmt: skip
    published.axhline(1.0, color="0.6", lw=0.8)
    published.set(xlabel="impact", ylabel="energy after / before (-)", title="six impacts of 780 kg", ylim=(0, 1.9))
    published.legend(fontsize=7, ncols=2, loc="upper right")
    _speeds(contacts, results)
    return figure


def _speeds(axes: Axes, results: Mapping[str, Any]) -> None:
    """Speed after each of the eleven contacts, predicted by the calibrated models."""
    impacts = chant_sura.contacts()
    seen = [impact.speed_after for impact in impacts]
    for model, found in results["calibrations"].items():
        axes.plot(seen, chant_sura.calibrated_speeds(model, found["parameters"]), "o", color=MODEL_COLOURS[model],
                  fillstyle="none", label=f"{model}, calibrated on these")  # fmt: skip
    axes.plot([0, 9], [0, 9], "k-", lw=0.8)
    axes.set(xlabel="speed after, measured (m/s)", ylabel="speed after, predicted (m/s)", title="eleven contacts",
             xlim=(0, 9), ylim=(0, 9), aspect="equal")  # fmt: skip
    axes.legend(fontsize=7)
