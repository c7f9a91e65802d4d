"""Draw profiles of paths: height and speed against horizontal distance, as in figure 3-3 b, c of the thesis (Peik).

`overview.png` shows all rocks whose paths are drawn. `sections.png` shows at most three of these rocks, each with the
terrain under its path. The CSV files of the same names contain the points of the curves.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from rpf3d_core.ensemble.colours import OUTCOME_COLOURS
from rpf3d_core.ensemble.flights import Flights, FloatArray, IntArray
from rpf3d_core.ensemble.paths import PathSamples, display_step, run_starts, sample_paths
from rpf3d_core.ensemble.totals import runout
from rpf3d_core.results.plots.path_profiles import PathProfiles, profile_of, terrain_below, typical_rows
from rpf3d_core.results.plots.style import GROUND, PATH, hex_colour, label, save, scale_in_words
from rpf3d_core.results.shown import RunCounts
from rpf3d_core.results.tables import write_profiles
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import DEPOSITED, Outcome

DISTANCE = "horizontal distance travelled (m)"
FINER = 4
"""Ratio (-): the largest distance between path points in the overview, divided by that in a section."""


def write_profile_plots(
    folder: Path,
    sources: Sequence[str],
    terrain: Terrain,
    flights: Flights,
    samples: PathSamples,
    gravity: float,
    flown: RunCounts,
) -> None:
    """Write the profile pictures and their points: overview.png, overview.csv, sections.png and sections.csv.

    Parameters
    ----------
    sources : (sources,) str
        Names of the scene's sources.
    samples : PathSamples
        Paths of the rocks in the overview. The sections show at most three of these rocks: the rocks of shortest,
        median and longest runout.
    gravity : float
        Gravity of the scene (m/s^2).
    flown : RunCounts
        Numbers of rocks, for the titles.
    """
    deposits = flights.deposits
    profile = profile_of(terrain, samples)
    write_profiles(folder / "overview.csv", sources, deposits, vars(profile))
    of = flown.describe_some(len(samples.starts))
    save(overview(profile, deposits.outcome, f"Paths of {of}"), folder / "overview.png")

    kept = samples.row[samples.starts]
    rows = typical_rows(deposits, kept, runout(deposits))
    chosen = sample_paths(flights.paths, rows, display_step(flights.paths) / FINER, gravity)
    ground = terrain_below(terrain, chosen.x) + terrain.frame.origin[2]
    section = profile_of(terrain, chosen)
    write_profiles(folder / "sections.csv", sources, deposits, {**vars(section), "terrain": ground})
    titles = {int(row): _title(sources, flights, row) for row in rows}
    rested = np.isin(deposits.outcome[kept], DEPOSITED)
    some = ", of those that came to rest" if rested.any() and not rested.all() else ""
    which = f"Shortest, median and longest runout of {of}{some}"
    save(sections(section, ground, titles, which), folder / "sections.png")


def overview(profile: PathProfiles, outcome: IntArray, title: str) -> Figure:
    """Draw the profiles of many rocks in one picture: elevation and speed against distance, coloured by outcome.

    outcome : (R,) index of `values.Outcome`, by row in `Deposits`
    """
    figure, axes = _panels(1, (10.0, 8.0))
    upper, lower = axes[:, 0]
    rows = profile.row[run_starts(profile.row)]
    colours = [hex_colour(OUTCOME_COLOURS[Outcome(value)]) for value in outcome[rows]]
    width, opacity = (1.0, 0.8) if len(rows) <= 20 else (0.5, 0.3)
    for panel, values in ((upper, profile.elevation), (lower, profile.speed)):
        lines = _lines(profile.row, profile.distance, values)
        panel.add_collection(LineCollection(lines, colors=colours, linewidths=width, alpha=opacity))
        panel.margins(0.03)
        panel.autoscale_view()
    lower.set_ylim(bottom=0.0)
    label(upper, "", "elevation (m)")
    label(lower, DISTANCE, "speed (m/s)")
    upper.set_title(f"{title}; {scale_in_words(_exaggeration(upper))}", loc="left", fontsize=11)
    figure.legend(handles=_outcome_lines(outcome[rows]), loc="lower center", ncols=4, frameon=False)
    return figure


def sections(profile: PathProfiles, ground: FloatArray, titles: Mapping[int, str], which: str) -> Figure:
    """Draw the profiles of a few rocks side by side: above, the path and the terrain under it; below, the speed.

    The picture has a column for each rock in `titles`.

    ground : (S,) m, elevation of the terrain under the path; titles : row of the rock in `Deposits` -> title
    which : text below the columns that explains the choice of the rocks
    """
    columns = max(1, len(titles))
    figure, axes = _panels(columns, (5.2 * columns, 7.5))
    for upper, lower, (row, title) in zip(axes[0], axes[1], titles.items(), strict=False):
        one = profile.row == row
        _height_panel(upper, profile, ground, one)
        upper.set_title(f"{title}\n{scale_in_words(_exaggeration(upper))}", loc="left", fontsize=10)
        lower.plot(profile.distance[one], profile.speed[one], color=PATH, linewidth=1.0)
        lower.set_ylim(bottom=0.0)
        label(lower, DISTANCE, "speed (m/s)")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="lower center", ncols=3, frameon=False,
                  title=which)  # fmt: skip
    return figure


def _panels(columns: int, size: tuple[float, float]) -> tuple[Figure, NDArray[Any]]:
    """Return a figure of profiles with axes (2, columns): height above, speed below.

    size : width and height, inches. Margins are fixed in inches, because a layout engine takes longer than the drawing.
    """
    figure = Figure(figsize=size)
    axes = figure.subplots(2, columns, sharex="col", squeeze=False, height_ratios=(3, 2))
    width, height = size
    figure.subplots_adjust(
        left=0.85 / width, right=1 - 0.2 / width, bottom=1.0 / height, top=1 - 0.6 / height, hspace=0.06, wspace=0.22
    )
    return figure, axes


def _height_panel(axes: Axes, profile: PathProfiles, ground: FloatArray, one: NDArray[np.bool_]) -> None:
    distance, elevation, below = profile.distance[one], profile.elevation[one], ground[one]
    floor = np.nanmin(np.append(below, elevation)) - 0.05 * (np.ptp(elevation) + 1.0)
    axes.fill_between(distance, np.nan_to_num(below, nan=floor), floor, color=GROUND, alpha=0.35, linewidth=0)
    axes.plot(distance, below, color=GROUND, linewidth=1.6, label="terrain under the path")
    axes.plot(distance, elevation, color=PATH, linewidth=1.0, label="path of the rock")
    axes.plot(distance[-1:], elevation[-1:], "o", color="#c81e1e", markersize=5, label="end")
    label(axes, "", "elevation (m)")


def _exaggeration(axes: Axes) -> float:
    """Return the factor (-) by which a panel draws heights larger than lengths."""
    panel = axes.get_position()
    assert isinstance(axes.figure, Figure)
    (width, height), (left, right), (low, high) = axes.figure.get_size_inches(), axes.get_xlim(), axes.get_ylim()
    return float((panel.height * height / (high - low)) / (panel.width * width / (right - left)))


def _lines(row: IntArray, x: FloatArray, y: FloatArray) -> list[NDArray[np.float64]]:
    """Return one line for each rock: an array (N, 2) of its points x, y, as matplotlib draws them.

    row : (S,) row of the rock of each point, grouped by rock; x, y : (S,) coordinates of the points in the panel
    """
    return np.split(np.stack([x, y], axis=1), run_starts(row)[1:])


def _outcome_lines(outcome: IntArray) -> list[Line2D]:
    """Return a legend entry for each outcome that occurs, labelled with the number of rocks; outcome : (N,)."""
    values, counts = np.unique(outcome, return_counts=True)
    return [
        Line2D([], [], color=hex_colour(OUTCOME_COLOURS[Outcome(value)]), label=f"{_words(Outcome(value))} ({count:,})")
        for value, count in zip(values, counts, strict=True)
    ]


def _title(sources: Sequence[str], flights: Flights, row: int) -> str:
    deposits = flights.deposits
    length = float(runout(deposits)[row])
    outcome = _words(Outcome(deposits.outcome[row]))
    return f"{sources[deposits.source[row]]}, rock {deposits.rock[row]}: {outcome}, runout {length:.1f} m"


def _words(outcome: Outcome) -> str:
    return outcome.name.lower().replace("_", " ")
