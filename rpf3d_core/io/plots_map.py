"""map.png: the terrain from above, coloured by zone under slanting light, with paths, releases and deposits."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from rpf3d_core.ensemble.colours import OUTCOME_COLOURS, zone_colours, zone_groups
from rpf3d_core.ensemble.flights import Deposits, FloatArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.io.plan_view import Window, seen_from_above, shaded
from rpf3d_core.io.plots_profiles import hex_colour, label, save
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.values import Outcome

PIXELS, OVERVIEW_PIXELS = 1000, 320
"""Along the longer side of the map and of the overview."""

MARGIN = 0.12
"""Room around the rocks, over their extent (-)."""

LEAST_SHAPE = 0.7
"""Least ratio (-) of the map's sides, so that a straight fall does not make a sliver of a map."""

WHOLE_SHARE = 0.6
"""If the rocks take up this share of the terrain's length and width, the map shows all of it and needs no overview."""

MOST_POINTS = 20_000
"""More deposits than this only paint each other over; an even selection is drawn, and the legend says so."""

MARKERS = "o^sDvPX*"
"""By outcome, in order of value."""

PATH = "#10203a"
RELEASE: dict[str, Any] = {"marker": "+", "color": "black", "markersize": 4, "markeredgewidth": 0.7}


def write_map(
    path: Path,
    title: str,
    terrain: Terrain,
    deposits: Deposits,
    samples: PathSamples,
    areas: Mapping[str, Sequence[FloatArray]],
) -> None:
    """Write the map.

    Parameters
    ----------
    areas : name -> rings (N, 2) m
        Outlines of areas of interest, local frame.

    Notes
    -----
    Drawn in z-up input coordinates, so that the ticks are round numbers of the survey.
    """
    whole = whole_window(terrain)
    window = rocks_window(whole, deposits, samples)
    figure, main, side = _sheet(window)
    _draw_ground(main, terrain, window, PIXELS)
    _draw_areas(main, terrain, areas)
    _draw_rocks(main, terrain, deposits, samples)
    _measure(main, terrain, window)
    main.set_title(title, loc="left", fontsize=12)
    if window != whole:
        _draw_overview(figure, terrain, whole, window)
    handles = _legend_entries(terrain, deposits, areas)
    _north_arrow(side, "N" if terrain.frame.up == "z" else "-z")
    side.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 0.9), frameon=False, fontsize=9)
    save(figure, path)


def whole_window(terrain: Terrain) -> Window:
    """The terrain's extent in plan."""
    low, high = terrain.vertices[:, :2].min(axis=0), terrain.vertices[:, :2].max(axis=0)
    return Window(float(low[0]), float(high[0]), float(low[1]), float(high[1]))


def rocks_window(whole: Window, deposits: Deposits, samples: PathSamples) -> Window:
    """The part of the terrain with rocks in it, with a margin; all of it where that is most of it."""
    places = np.concatenate([deposits.release[:, :2], deposits.x[:, :2], samples.x[:, :2]])
    if len(places) == 0:
        return whole
    low, high = places.min(axis=0), places.max(axis=0)
    half = np.maximum((high - low) / 2, LEAST_SHAPE * (high - low).max() / 2) * (1 + 2 * MARGIN)
    half += 0.01 * min(whole.width, whole.height)
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    part = Window(max(left, whole.left), min(right, whole.right), max(bottom, whole.bottom), min(top, whole.top))
    covers = part.width > WHOLE_SHARE * whole.width and part.height > WHOLE_SHARE * whole.height
    return whole if covers or part.width <= 0 or part.height <= 0 else part


def _sheet(window: Window) -> tuple[Figure, Axes, Axes]:
    """A figure with the map on the left, shaped like its window, and a column for the legend."""
    shape = float(np.clip(window.width / window.height, 0.5, 2.0))
    width, height = (8.4 * shape, 8.4) if shape < 1.0 else (8.4, 8.4 / shape)
    sheet = (width + 4.6, height + 1.5)
    figure = Figure(figsize=sheet)
    main = figure.add_axes((1.1 / sheet[0], 0.7 / sheet[1], width / sheet[0], height / sheet[1]))
    side = figure.add_axes(((width + 1.4) / sheet[0], 0.7 / sheet[1], 3.0 / sheet[0], height / sheet[1]))
    side.set_axis_off()
    return figure, main, side


def _draw_ground(axes: Axes, terrain: Terrain, window: Window, pixels: int) -> None:
    picture = shaded(terrain, seen_from_above(terrain, window, pixels))
    extent = _placed(terrain, window)
    axes.imshow(picture, extent=extent, origin="lower", interpolation="nearest", aspect="equal")
    axes.set_xlim(extent.left, extent.right)
    axes.set_ylim(extent.bottom, extent.top)


def _placed(terrain: Terrain, window: Window) -> Window:
    """A window of the local frame in z-up input coordinates."""
    east, north, _ = terrain.frame.origin
    return Window(window.left + east, window.right + east, window.bottom + north, window.top + north)


def _plan(terrain: Terrain, points: FloatArray) -> FloatArray:
    """Plan (N, 2) in z-up input coordinates of points (N, 2 or 3) of the local frame."""
    return np.asarray(points[:, :2] + np.array(terrain.frame.origin[:2]))


def _draw_areas(axes: Axes, terrain: Terrain, areas: Mapping[str, Sequence[FloatArray]]) -> None:
    for rings in areas.values():
        placed = [_plan(terrain, ring) for ring in rings]
        axes.add_collection(PolyCollection(placed, facecolors="none", edgecolors="black", linestyles="--"))


def _draw_rocks(axes: Axes, terrain: Terrain, deposits: Deposits, samples: PathSamples) -> None:
    lines = np.split(_plan(terrain, samples.x), samples.starts[1:])
    axes.add_collection(LineCollection(lines, colors=PATH, linewidths=0.7, alpha=0.7))
    some = _selection(len(deposits.x))
    for outcome in np.unique(deposits.outcome):
        ended = some[deposits.outcome[some] == outcome]
        axes.plot(*_plan(terrain, deposits.x[ended]).T, linestyle="none", **_marker(Outcome(outcome)))
    axes.plot(*_plan(terrain, deposits.release[some]).T, linestyle="none", **RELEASE)


def _selection(count: int) -> Any:
    """Rows of at most MOST_POINTS of `count` rocks."""
    return np.linspace(0, count - 1, min(count, MOST_POINTS)).round().astype(np.int64)


def _marker(outcome: Outcome) -> dict[str, Any]:
    edge = {"markeredgecolor": "white", "markeredgewidth": 0.4}
    return {"marker": MARKERS[outcome], "color": hex_colour(OUTCOME_COLOURS[outcome]), "markersize": 4.5, **edge}


def _measure(axes: Axes, terrain: Terrain, window: Window) -> None:
    """Coordinates of the input and a scale bar, outside the data."""
    upright = terrain.frame.up == "z"
    label(axes, "x (m)", "y (m)" if upright else "z (m)")
    axes.grid(visible=False)
    if not upright:  # seen from above, the input's z runs down the page
        axes.yaxis.set_major_formatter(lambda value, _: f"{-value:g}")
    _scale_bar(axes, _placed(terrain, window))


def _north_arrow(axes: Axes, name: str) -> None:
    """At the top of the legend's column; an input that points up along y names no north, so its axis is named."""
    arrow = {"arrowstyle": "-|>", "color": "black", "linewidth": 1.5, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", xy=(0.09, 1.0), xytext=(0.09, 0.93), xycoords="axes fraction", arrowprops=arrow)
    axes.text(0.14, 0.965, name, transform=axes.transAxes, ha="left", va="center", fontsize=12)


def _scale_bar(axes: Axes, window: Window) -> None:
    length = round_length(window.width / 5)
    right, height = window.right, 1.02
    axes.plot([right - length, right], [height, height], color="black", linewidth=3, solid_capstyle="butt",
              transform=axes.get_xaxis_transform(), clip_on=False)  # fmt: skip
    axes.text(right - length / 2, height + 0.008, f"{length:g} m", ha="center", va="bottom", fontsize=9,
              transform=axes.get_xaxis_transform())  # fmt: skip


def round_length(length: float) -> float:
    """The largest 1, 2 or 5 times a power of ten that is not longer than `length` > 0."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= length * (1 + 1e-12)) * power)


def _draw_overview(figure: Figure, terrain: Terrain, whole: Window, window: Window) -> None:
    """The whole terrain, small, with a frame around the part that the map shows."""
    width, height = figure.get_size_inches()
    inset = figure.add_axes(((width - 3.2) / width, 0.5 / height, 2.9 / width, 2.9 / height))
    _draw_ground(inset, terrain, whole, OVERVIEW_PIXELS)
    corner = _placed(terrain, window)[::2]
    inset.add_patch(Rectangle(corner, window.width, window.height, fill=False, color="#c81e1e", linewidth=1.6))
    inset.set_xticks([])
    inset.set_yticks([])
    inset.set_title(f"whole terrain, {whole.width:.0f} x {whole.height:.0f} m", fontsize=9)


def _legend_entries(terrain: Terrain, deposits: Deposits, areas: Mapping[str, Any]) -> list[Any]:
    drawn = len(_selection(len(deposits.x)))
    shown = "" if drawn == len(deposits.x) else f" ({drawn} of {len(deposits.x)} drawn)"
    entries: list[Any] = [Line2D([], [], linestyle="none", label=f"release{shown}", **RELEASE)]
    values, counts = np.unique(deposits.outcome, return_counts=True)
    for value, count in zip(values, counts, strict=True):
        name = Outcome(value).name.lower().replace("_", " ")
        entries.append(Line2D([], [], linestyle="none", label=f"{name} ({count})", **_marker(Outcome(value))))
    entries.append(Line2D([], [], color=PATH, linewidth=0.8, label="path"))
    entries += [Line2D([], [], color="black", linestyle="--", label=f"area: {name}") for name in areas]
    return entries + _zone_entries(terrain)


def _zone_entries(terrain: Terrain) -> list[Patch]:
    """One entry a group of zones, with the number of zones in it."""
    groups, group = zone_groups(terrain.zones)
    colours = zone_colours(terrain.zones)
    entries = []
    for index, name in enumerate(groups):
        members = np.flatnonzero(group == index)
        text = terrain.zones[members[0]] if len(members) == 1 else f"{name} ({len(members)} zones)"
        entries.append(Patch(facecolor=colours[members[0]] / 255.0, edgecolor="#666666", label=text))
    return entries
