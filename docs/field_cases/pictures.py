"""Draw the pictures of the validation page."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from field_cases import authume, chant_sura, tschamut
from field_cases.flying import Ends
from field_cases.measuring import Measured
from field_cases.models import AUTHUME, CALIBRATED, CHANT_SURA, HOEK, POINTS_AND_SPHERES, STONE, TSCHAMUT
from rpf3d_core.ensemble.flights import FloatArray

MODEL_COLOURS = {"constant": "tab:blue", "coulomb_limited": "tab:green", "rigid sphere": "tab:orange",
                 "rocks with a shape": "tab:purple"}  # fmt: skip
MODEL_MARKS = {"constant": ("o", 10), "coulomb_limited": ("s", 7), "rigid sphere": ("x", 5),
               "rocks with a shape": ("D", 6)}  # fmt: skip
"""Model -> marker and its size (points); the sizes differ, so that markers at the same place stay visible."""
REBOUND_COLOURS = {model.impact: MODEL_COLOURS[model.name] for model in POINTS_AND_SPHERES}
OTHER_COLOURS = ("tab:red", "tab:purple", "tab:brown", "tab:pink", "tab:gray", "tab:olive", "tab:cyan")
STYLES = {HOEK: ":", STONE: "--", CALIBRATED: "-"}
DRAWN = 1500
"""Largest number of rocks in a map."""
ASIDE = 0.6
"""Width of the group of markers at one impact, as a share of the distance between two impacts (-)."""


def draw_all(measured: Measured, folder: Path) -> None:
    """Write the pictures of all sites, validation_<site>.png, into a folder."""
    _authume(measured.ends[AUTHUME]).savefig(folder / "validation_authume.png", dpi=110)
    _tschamut(measured.ends[TSCHAMUT]).savefig(folder / "validation_tschamut.png", dpi=110)
    _chant_sura(measured.results[CHANT_SURA]).savefig(folder / "validation_chant_sura.png", dpi=110)


def _figure(rows: int, columns: int, width: float, height: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure, list(figure.subplots(rows, columns).flat)


def _authume(ends: Mapping[str, Ends]) -> Figure:
    figure, (along, aside, plan) = _figure(1, 3, 19.0, 6.4)
    field = authume.end_points()
    _shares_below(along, field[:, 0], {label: flown.end[:, 0] for label, flown in ends.items()})
    for x in (30.0, 45.0):
        along.axvline(x, color="0.6", lw=0.8)
    along.set(xlabel="x of end points (m)", title="along the profile", xlim=(0, 165))
    calibrated = {label: authume.seen(flown.end).across for label, flown in ends.items() if CALIBRATED in label}
    _shares_below(aside, authume.seen(field).across, calibrated)
    aside.set(xlabel="z of end points less z of the mean drop point (m)", title="across the profile", xlim=(-15, 35))
    _stops_in_plan(plan, ends)
    figure.suptitle("Authume P1: where rocks end")
    return figure


def _shares_below(axes: Axes, field: FloatArray, simulated: Mapping[str, FloatArray]) -> None:
    """Draw cumulative distributions of positions (m), of the field and of simulated rocks.

    field : (N,) positions of blocks; simulated : "model, values" -> positions of rocks
    """
    field = np.sort(field)
    axes.fill_betweenx(_steps(len(field)), *_band(field), color="0.85", label="field, bootstrap 95 %", step="mid")
    axes.step([field[0], *field], np.arange(len(field) + 1) / len(field), "k-", lw=2, where="post",
              label="field, 41 blocks")  # fmt: skip
    for label, values in simulated.items():
        model, source = label.split(", ")
        x = np.sort(values)
        axes.plot(x, _steps(len(x)), STYLES[source], color=MODEL_COLOURS[model], label=label)
    axes.set(ylabel="share below (-)", ylim=(0, 1.02))
    axes.legend(fontsize=8, loc="lower right")


def _band(field: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lower and upper limit (N,) of the 95 % bootstrap band of the sorted positions of N blocks."""
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
            axes.plot(x, z, ".", ms=3, alpha=0.4, color=MODEL_COLOURS[model], label=f"{label}, {len(x):,} of the rocks")
    field, start = authume.end_points(), authume.drop()
    axes.plot(field[:, 0], field[:, 2], "k^", ms=6, fillstyle="none", label="field")
    axes.plot(start[0], start[2], "r*", ms=10, label="mean drop point")
    axes.set(xlabel="x (m)", ylabel="z (m)", title="in plan", aspect="equal", xlim=(-5, 75), ylim=(350, 400))
    shown = axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.15), ncols=2)
    for handle in shown.legend_handles:
        handle.set(alpha=1.0)
        handle.set_markersize(7)


def _tschamut(ends: Mapping[str, Ends]) -> Figure:
    figure, (plan, runouts) = _figure(1, 2, 13.0, 5.6)
    _tschamut_in_plan(plan, {label: flown for label, flown in ends.items() if CALIBRATED in label})
    seen = tschamut.runs().seen().runout
    longest = float(seen.max())
    for label, flown in ends.items():
        model, values = label.split(", ")
        simulated = seen + tschamut.errors_of(flown)
        longest = max(longest, float(simulated.max()))
        mark = {HOEK: "x", STONE: "+", CALIBRATED: "o"}[values]
        runouts.plot(seen, simulated, mark, color=MODEL_COLOURS[model], label=label, fillstyle="none")
    limit = 1.05 * longest
    runouts.plot([0, limit], [0, limit], "k-", lw=0.8)
    runouts.set(xlabel="runout seen (m)", ylabel="mean runout simulated (m)", title="18 runs", aspect="equal",
                ylim=(-3, limit), xlim=(0, limit))  # fmt: skip
    runouts.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.02, 0.5))
    return figure


def _tschamut_in_plan(axes: Axes, ends: Mapping[str, Ends]) -> None:
    """Draw releases, the field's end points, and the mean end point of each run and model, in plan."""
    field = tschamut.runs()
    _contours(axes)
    for i in field.distinct():
        axes.plot(*zip(field.release[i, :2], field.end[i, :2], strict=True), color="0.8", lw=0.8)
    axes.plot(*field.release[:, :2].T, "r*", label="release")
    axes.plot(*field.end[:, :2].T, "k^", ms=5, label="field")
    for label, flown in ends.items():
        model = label.split(", ")[0]
        axes.plot(*tschamut.mean_ends(flown)[:, :2].T, MODEL_MARKS[model][0], color=MODEL_COLOURS[model],
                  fillstyle="none", label=f"{label}, mean of each run")  # fmt: skip
    axes.set(xlabel="x (m)", ylabel="y (m)", title="Tschamut 2014, in plan", aspect="equal", xlim=(-10, 180),
             ylim=(95, 275))  # fmt: skip
    axes.legend(fontsize=8, loc="upper center", bbox_to_anchor=(0.5, -0.1), ncols=2)


def _contours(axes: Axes) -> None:
    """Draw contour lines of the terrain at Tschamut, every 5 m."""
    heights = tschamut.heights()
    y, x = (tschamut.CELL * np.arange(n) for n in heights.shape)
    west, south = tschamut.CORNER
    lines = axes.contour(west + x, south + y, heights, np.arange(0.0, 200.0, 5.0), colors="tan", linewidths=0.5)
    axes.clabel(lines, lines.levels[::2], fontsize=6)


def _chant_sura(results: Mapping[str, Any]) -> Figure:
    figure, (published, contacts) = _figure(1, 2, 14.0, 5.6)
    _energy_ratios(published, results)
    _speeds(contacts, results)
    return figure


def _energy_ratios(axes: Axes, results: Mapping[str, Any]) -> None:
    """Draw the energy ratios of the six impacts, for the field, models with published values and calibrated models."""
    names = [impact.name for impact in chant_sura.published()]
    place = np.arange(len(names))
    # On level ground, `thesis_literal` gives the same results as `constant`.
    lines = [line for line in results["lines"] if line["values"] == HOEK and line["model"] != "thesis_literal"]
    for k, line in enumerate(lines):
        aside = ASIDE * ((k + 0.5) / len(lines) - 0.5)
        colour = REBOUND_COLOURS.get(line["model"], OTHER_COLOURS[k % len(OTHER_COLOURS)])
        axes.plot(place + aside, line["published"]["ratios"], "_", ms=8, mew=2.5, color=colour,
                  label=f"{line['model']}, {HOEK}")  # fmt: skip
    for model, found in results["calibrations"].items():
        mark, size = MODEL_MARKS[model]
        axes.plot(place, found["published"]["ratios"], mark, ms=size, fillstyle="none", color=MODEL_COLOURS[model],
                  label=f"{model}, calibrated on the eleven")  # fmt: skip
    axes.plot(place, results["field"]["published"], "k^", ms=8, label="field")
    axes.axhline(1.0, color="0.6", lw=0.8)
    axes.set_xticks(place, names)
    axes.set(xlabel="impact", ylabel="energy after / before (-)", title="six impacts of 780 kg", ylim=(0, 2.0))
    axes.legend(fontsize=8, ncols=2, loc="upper right")


def _speeds(axes: Axes, results: Mapping[str, Any]) -> None:
    """Draw the predicted speed after each of the eleven contacts against the measured speed, for calibrated models."""
    seen = [impact.speed_after for impact in chant_sura.contacts()]
    for model, found in results["calibrations"].items():
        mark, size = MODEL_MARKS[model]
        axes.plot(seen, chant_sura.calibrated_speeds(model, found["parameters"]), mark, ms=size,
                  color=MODEL_COLOURS[model], fillstyle="none", label=f"{model}, calibrated on these")  # fmt: skip
    axes.plot([0, 9], [0, 9], "k-", lw=0.8)
    axes.set(xlabel="speed after, measured (m/s)", ylabel="speed after, predicted (m/s)", title="eleven contacts",
             xlim=(0, 9), ylim=(0, 9), aspect="equal")  # fmt: skip
    axes.legend(fontsize=8)
