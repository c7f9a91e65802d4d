"""Draw the parts that all map pictures share: shaded terrain, axes, scale bar, north arrow, areas, overview."""

import io
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from rpf3d_core.ensemble.flights import FloatArray
from rpf3d_core.results.plots.style import RESOLUTION, label
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.obstacles import Obstacles
from rpf3d_core.terrain.plan_view import Window

Picture = NDArray[np.uint8]

PIXELS, OVERVIEW_PIXELS = 1000, 320
"""Number of pixels along the longer side of the map, and of the small overview."""

MARGIN = 0.12
"""Margin around the rocks on a map (-), as a share of the rocks' extent."""

LEAST_SHAPE = 0.7
"""Smallest ratio (-) of a map's sides, so that rocks on a straight line do not give a very narrow map."""

WHOLE_SHARE = 0.6
"""Share (-) of the terrain's width and height in plan above which a map shows all of the terrain, with no overview."""

LEAST_COLUMN = 7.0
"""Smallest height (inches) of the column next to the map, which contains the legend and the overview."""

MOST_POINTS = 20_000
"""Largest number of points drawn, because more would cover each other.

If there are more points, an evenly spread selection is drawn, and the legend states this.
"""

MOST_RELEASES = 250
"""Largest number of releases drawn; if there are more, an evenly spread selection is drawn, to keep the map visible."""

BARRIER = "#b3007a"
"""Colour of the lines of barriers."""

RELEASE: dict[str, Any] = {"marker": "+", "color": "black", "markersize": 4, "markeredgewidth": 0.7}


def whole_window(terrain: Terrain) -> Window:
    """Return the rectangle around the whole terrain in plan."""
    x, y = terrain.vertices[:, 0], terrain.vertices[:, 1]  # column by column takes a tenth of the time of `min(axis=0)`
    return Window(left=float(x.min()), right=float(x.max()), bottom=float(y.min()), top=float(y.max()))


def window_around(whole: Window, places: FloatArray) -> Window:
    """Return the part of the terrain that a map of given places (N, 2) m shows, with a margin.

    The result is the whole terrain if the part would cover more than WHOLE_SHARE of the terrain's width and of its
    height in plan. The result is also the whole terrain if there are no places, or if the part lies off the terrain.
    """
    if len(places) == 0:
        return whole
    low, high = places.min(axis=0), places.max(axis=0)
    half = np.maximum((high - low) / 2, LEAST_SHAPE * (high - low).max() / 2) * (1 + 2 * MARGIN)
    half += 0.01 * min(whole.width, whole.height)
    (left, bottom), (right, top) = (low + high) / 2 - half, (low + high) / 2 + half
    part = Window(
        left=max(left, whole.left),
        right=min(right, whole.right),
        bottom=max(bottom, whole.bottom),
        top=min(top, whole.top),
    )
    covers = part.width > WHOLE_SHARE * whole.width and part.height > WHOLE_SHARE * whole.height
    return whole if covers or part.width <= 0 or part.height <= 0 else part


def window_with_areas(whole: Window, places: FloatArray, areas: Mapping[str, Sequence[FloatArray]]) -> Window:
    """Return the part of the terrain that a map of places (N, 2) m shows, widened to the areas that overlap it.

    areas : name -> rings (N, 2) m. Areas outside the part are not included: an area far from all rocks makes the rocks
    too small to see. The overview shows such an area.
    """
    window = window_around(whole, places)
    cut = [ring for rings in areas.values() for ring in rings if _touches(window, ring)]
    return window_around(whole, np.concatenate([places, *cut])) if cut else window


def _touches(window: Window, ring: FloatArray) -> bool:
    (left, bottom), (right, top) = ring.min(axis=0), ring.max(axis=0)
    return bool(left <= window.right and right >= window.left and bottom <= window.top and top >= window.bottom)


def empty_figure(window: Window) -> tuple[Figure, Axes, Axes]:
    """Return an empty figure, the axes of its map and the axes of the legend's column.

    The map has the proportions of the window, limited to 1:2 and 2:1.
    """
    shape = float(np.clip(window.width / window.height, 0.5, 2.0))
    width, height = (8.4 * shape, 8.4) if shape < 1.0 else (8.4, 8.4 / shape)
    column = max(height, LEAST_COLUMN)
    across, up = width + 4.6, column + 1.5
    figure = Figure(figsize=(across, up))
    main = figure.add_axes((1.1 / across, (0.7 + column - height) / up, width / across, height / up))
    side = figure.add_axes(((width + 1.4) / across, 0.7 / up, 3.0 / across, column / up))
    side.set_axis_off()
    return figure, main, side


def warm_up() -> None:
    """Draw an empty map and discard it, so that matplotlib has loaded its fonts before the first real map is drawn."""
    figure, main, side = empty_figure(Window(left=0.0, right=1.0, bottom=0.0, top=1.0))
    label(main, "x (m)", "y (m)")
    main.imshow(np.zeros((2, 2, 4), dtype=np.uint8))
    side.text(0.0, 0.0, "rpf3d")
    FigureCanvasAgg(figure)
    figure.savefig(io.BytesIO(), dpi=RESOLUTION)


def draw_ground(axes: Axes, terrain: Terrain, window: Window, ground: Picture) -> None:
    """Draw the shaded terrain as the background of a map; ground : (H, W, 4) RGBA, row 0 is at the bottom."""
    extent = placed(terrain, window)
    axes.imshow(ground, extent=extent, origin="lower", interpolation="nearest", aspect="equal")
    axes.set_xlim(extent.left, extent.right)
    axes.set_ylim(extent.bottom, extent.top)


def placed(terrain: Terrain, window: Window) -> Window:
    """Return a rectangle of the local frame, `window` (m), in the coordinates of a map's axes (m).

    The coordinates of a map's axes are the input's coordinates, turned so that z is up.
    """
    east, north, _ = terrain.frame.origin
    return Window(
        left=window.left + east, right=window.right + east, bottom=window.bottom + north, top=window.top + north
    )


def plan_of(terrain: Terrain, points: FloatArray) -> FloatArray:
    """Return points (N, 2 or 3) m, local frame, in the coordinates of a map's axes (N, 2) m.

    The result is in the input's coordinates, turned so that z is up.
    """
    return np.asarray(points[:, :2] + np.array(terrain.frame.origin[:2]))


def draw_areas(axes: Axes, terrain: Terrain, areas: Mapping[str, Sequence[FloatArray]]) -> None:
    """Draw the outlines of areas of interest on a map; areas : rings (N, 2) m in the local frame."""
    for rings in areas.values():
        moved = [plan_of(terrain, ring) for ring in rings]
        axes.add_collection(PolyCollection(moved, facecolors="none", edgecolors="black", linestyles="--"))


def draw_barriers(axes: Axes, terrain: Terrain, obstacles: Obstacles) -> list[Line2D]:
    """Draw the barriers of a scene as lines on a map; return their legend entry in a list, [] without barriers."""
    if not obstacles.lines:
        return []
    lines = [plan_of(terrain, points) for _, points in obstacles.lines]
    axes.add_collection(LineCollection(lines, colors=BARRIER, linewidths=1.8))
    return [Line2D([], [], color=BARRIER, linewidth=1.8, label="barrier")]


def selection(count: int) -> Any:
    """Return the rows (N,) of the points to draw: all, or MOST_POINTS evenly spread rows if there are more."""
    return np.linspace(0, count - 1, min(count, MOST_POINTS)).round().astype(np.int64)


def starts_of(releases: FloatArray) -> FloatArray:
    """Return the release points (N, 2) m to draw on a map, local frame, at most MOST_RELEASES.

    Each distinct point is returned once. If there are more than MOST_RELEASES distinct points, the result has the
    release points of MOST_RELEASES evenly spread rocks.

    releases : (R, 2 or 3) m
    """
    places = np.unique(releases[:, :2], axis=0)
    if len(places) <= MOST_RELEASES:
        return places
    return np.asarray(releases[np.linspace(0, len(releases) - 1, MOST_RELEASES).astype(np.int64), :2])


def measure(axes: Axes, terrain: Terrain, window: Window) -> None:
    """Draw the axes of a map in the input's coordinates, and a scale bar outside the map."""
    upright = terrain.frame.up == "z"
    label(axes, "x (m)", "y (m)" if upright else "z (m)")
    axes.grid(visible=False)
    if not upright:  # seen from above, the input's z axis points down the page
        axes.yaxis.set_major_formatter(lambda value, _: f"{-value:g}")
    _scale_bar(axes, placed(terrain, window))


def draw_north(axes: Axes, terrain: Terrain) -> None:
    """Draw the north arrow next to a map; if y is up, the arrow shows the axis -z instead.

    An input with y up does not define north.
    """
    name = "N" if terrain.frame.up == "z" else "-z"
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
    """Return a round length for a scale bar: 1, 2 or 5 times a power of ten, at most `length` > 0 (m)."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= length * (1 + 1e-12)) * power)


def draw_overview(
    figure: Figure,
    terrain: Terrain,
    whole: Window,
    window: Window,
    ground: Picture,
    areas: Mapping[str, Sequence[FloatArray]],
) -> None:
    """Draw the small overview of a map: the whole terrain, all areas, and a frame around the part that the map shows.

    ground : picture (H, W, 4) RGBA of the whole terrain; areas : name -> rings (N, 2) m, local frame
    """
    width, height = figure.get_size_inches()
    inset = figure.add_axes(((width - 3.2) / width, 0.5 / height, 2.9 / width, 2.9 / height))
    draw_ground(inset, terrain, whole, ground)
    draw_areas(inset, terrain, areas)
    corner = placed(terrain, window)[::2]
    inset.add_patch(Rectangle(corner, window.width, window.height, fill=False, color="#c81e1e", linewidth=1.6))
    inset.set_xticks([])
    inset.set_yticks([])
    inset.set_title(f"whole terrain, {whole.width:,.0f} x {whole.height:,.0f} m", fontsize=9)
