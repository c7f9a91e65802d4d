"""Draw map.png: the terrain from above, coloured by zone, with paths, releases and end points of rocks."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from rpf3d_core.ensemble.colours import OUTCOME_COLOURS, zone_colours, zone_groups
from rpf3d_core.ensemble.flights import Deposits, FloatArray
from rpf3d_core.ensemble.paths import PathSamples
from rpf3d_core.results.plots.shading import GroundPictures
from rpf3d_core.results.plots.sheet import (
    OVERVIEW_PIXELS,
    PIXELS,
    RELEASE,
    draw_areas,
    draw_barriers,
    draw_ground,
    draw_north,
    draw_overview,
    empty_figure,
    measure,
    plan_of,
    selection,
    starts_of,
    whole_window,
    window_with_areas,
)
from rpf3d_core.results.plots.style import hex_colour, save
from rpf3d_core.results.shown import MapContent, RunCounts
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.terrain.plan_view import Window
from rpf3d_core.values import Outcome

MARKERS = dict(zip(Outcome, "o^sDvPX*hd", strict=True))
"""Marker of each outcome; a new outcome without a marker is an error at import, not in a run."""

PATH = "#10203a"
TREE: dict[str, Any] = {"marker": ".", "color": "#1e6b2e", "markersize": 2.5}


def write_map(
    path: Path,
    content: MapContent,
    deposits: Deposits,
    samples: PathSamples,
    obstacles: Obstacles = NO_OBSTACLES,
    ground: GroundPictures | None = None,
) -> None:
    """Write map.png in z-up input coordinates, so that its axes have the numbers of the survey.

    deposits, samples : ends and paths of the rocks to draw: all rocks flown, or a selection
    obstacles : barriers and trees of the scene
    ground : pictures of the terrain that other maps share; None to make them here
    """
    terrain, areas, flown = content.terrain, content.areas, content.flown
    ground, whole = ground or GroundPictures(terrain), whole_window(terrain)
    window = rocks_window(whole, deposits, samples, areas)
    figure, main, side = empty_figure(window)
    draw_ground(main, terrain, window, ground.shaded(window, PIXELS))
    draw_areas(main, terrain, areas)
    handles = _draw_obstacles(main, terrain, obstacles)
    _draw_rocks(main, terrain, deposits, samples)
    measure(main, terrain, window)
    main.set_title(f"{content.name}: {flown.describe()}", loc="left", fontsize=12)
    if window != whole:
        small = ground.shaded(whole, OVERVIEW_PIXELS)
        draw_overview(figure, terrain, whole, window, small, areas)
    handles += _legend_entries(terrain, deposits, len(samples.starts), areas, flown)
    draw_north(side, terrain)
    side.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.0, 0.9), frameon=False, fontsize=9)
    save(figure, path)


def rocks_window(
    whole: Window, deposits: Deposits, samples: PathSamples, areas: Mapping[str, Sequence[FloatArray]]
) -> Window:
    """Return the part of the terrain that map.png shows: all rocks, a margin, and the areas that overlap this part.

    The result is the whole terrain if the part would cover more than the share `sheet.WHOLE_SHARE` of the terrain's
    width and of its height in plan.

    areas : name -> rings (N, 2) m, local frame
    """
    places = np.concatenate([deposits.release[:, :2], deposits.x[:, :2], samples.x[:, :2]])
    return window_with_areas(whole, places, areas)


def _draw_obstacles(axes: Axes, terrain: Terrain, obstacles: Obstacles) -> list[Any]:
    """Draw barriers as lines and trees as dots; return their legend entries.

    If there are very many trees, only a selection is drawn.
    """
    entries: list[Any] = [*draw_barriers(axes, terrain, obstacles)]
    if len(obstacles.stems):
        some = selection(len(obstacles.stems))
        axes.plot(*plan_of(terrain, obstacles.stems[some, :3]).T, linestyle="none", **TREE)
        number = len(obstacles.stems)
        label = "tree" if len(some) == number else f"tree ({len(some):,} of {number:,} drawn)"
        entries.append(Line2D([], [], linestyle="none", label=label, **TREE))
    return entries


def _draw_rocks(axes: Axes, terrain: Terrain, deposits: Deposits, samples: PathSamples) -> None:
    lines = np.split(plan_of(terrain, samples.x), samples.starts[1:])
    axes.add_collection(LineCollection(lines, colors=PATH, linewidths=0.7, alpha=0.7))
    some = selection(len(deposits.x))
    for outcome in np.unique(deposits.outcome):
        ended = some[deposits.outcome[some] == outcome]
        axes.plot(*plan_of(terrain, deposits.x[ended]).T, linestyle="none", **_marker(Outcome(outcome)))
    axes.plot(*plan_of(terrain, starts_of(deposits.release)).T, linestyle="none", **RELEASE)


def _marker(outcome: Outcome) -> dict[str, Any]:
    edge = {"markeredgecolor": "white", "markeredgewidth": 0.4}
    return {"marker": MARKERS[outcome], "color": hex_colour(OUTCOME_COLOURS[outcome]), "markersize": 4.5, **edge}


def _legend_entries(
    terrain: Terrain, deposits: Deposits, paths: int, areas: Mapping[str, Any], flown: RunCounts
) -> list[Any]:
    """Return the legend entries of outcomes, paths, areas and zones, with the numbers of all and of drawn rocks.

    deposits : ends of the drawn rocks; paths : number of drawn paths; flown : numbers of all rocks
    """
    entries: list[Any] = [Line2D([], [], linestyle="none", label="release", **RELEASE)]
    for outcome in Outcome:
        if count := flown.outcomes.get(outcome, 0):
            name = outcome.name.lower().replace("_", " ")
            entries.append(Line2D([], [], linestyle="none", label=f"{name} ({count:,})", **_marker(outcome)))
    if ends := flown.drawn(len(selection(len(deposits.x)))):
        entries.append(Line2D([], [], linestyle="none", label=f"ends{ends}"))
    entries.append(Line2D([], [], color=PATH, linewidth=0.8, label=f"path{flown.drawn(paths)}"))
    entries += [Line2D([], [], color="black", linestyle="--", label=f"area: {name}") for name in areas]
    return entries + _zone_entries(terrain)


def _zone_entries(terrain: Terrain) -> list[Patch]:
    """Return a legend entry for each group of similar zones, with the number of zones in the group."""
    groups, group = zone_groups(terrain.zones)
    colours = zone_colours(terrain.zones)
    entries = []
    for index, name in enumerate(groups):
        members = np.flatnonzero(group == index)
        text = terrain.zones[members[0]] if len(members) == 1 else f"{name} ({len(members)} zones)"
        entries.append(Patch(facecolor=colours[members[0]] / 255.0, edgecolor="#666666", label=text))
    return entries
