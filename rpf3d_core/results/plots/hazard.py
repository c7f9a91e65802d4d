"""Write hazard/*.png: maps of reach probability, energy and height over the shaded terrain, for print."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from rpf3d_core.hazard.maps import HazardMaps, Raster
from rpf3d_core.hazard.scales import FEW_COLOUR, FEW_WORDS
from rpf3d_core.results.hazard_files.sentences import words_on_empty
from rpf3d_core.results.plots.hazard_colour_bar import colour_map, draw_colour_bar, norm_of
from rpf3d_core.results.plots.hazard_themes import Theme, themes
from rpf3d_core.results.plots.shading import GroundPictures
from rpf3d_core.results.plots.sheet import (
    MOST_RELEASES,
    OVERVIEW_PIXELS,
    PIXELS,
    Picture,
    draw_areas,
    draw_barriers,
    draw_ground,
    draw_north,
    draw_overview,
    empty_figure,
    measure,
    placed,
    plan_of,
    starts_of,
    whole_window,
    window_with_areas,
)
from rpf3d_core.results.plots.style import hex_colour, save
from rpf3d_core.results.shown import MapContent
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.obstacles import NO_OBSTACLES, Obstacles
from rpf3d_core.terrain.plan_view import Window

OPACITY = 0.82
"""Opacity (-) of the hazard colours: the terrain shows through, and colours can still be compared with the scale."""

FEW = hex_colour(FEW_COLOUR)
"""Colour of cells that too few rocks reached for a value."""

RELEASE: dict[str, Any] = {"marker": "o", "color": "#1450d2", "markersize": 4.5, "markeredgecolor": "white"}
MANY_RELEASES = 100
"""Largest number of releases that are drawn as large markers; more are drawn as dots, to hide little of the map."""
DOT: dict[str, Any] = {"marker": ".", "color": "black", "markersize": 2.0, "markeredgewidth": 0.0}
"""Marker of a release if there are many. It is not blue, because blue would be hard to see on cells of colour FEW."""

TITLE_PAD = 38.0
"""Distance of the title from the map (points), so that a long title covers neither the scale bar nor its label."""


@dataclass(frozen=True, eq=False)
class MapBackground:
    """The shaded terrain behind all hazard pictures of a run, computed only once.

    window : the part of the terrain that is shown; picture : its hillshade
    whole : hillshade of the whole terrain for the overview, None if the window shows all of it
    """

    terrain: Terrain
    window: Window
    picture: Picture
    whole: Picture | None


def write_hazard_pictures(
    folder: Path,
    content: MapContent,
    maps: HazardMaps,
    releases: FloatArray,
    obstacles: Obstacles = NO_OBSTACLES,
    pictures: GroundPictures | None = None,
) -> None:
    """Write the hazard pictures into an existing folder: reach_probability.png, energy_p95.png and height_p95.png.

    A run over parameter sets has reach_probability_high.png as well, and maps with passages per metre have
    passage_per_metre.png. With several sources there are reach_probability_worst_source.png and
    energy_p95_worst_source.png, too.

    releases : (N, 2 or 3) m, release points of the rocks, local frame
    obstacles : barriers of the scene, which the pictures show as lines
    pictures : pictures of the terrain that other maps share; None to make them here
    """
    ground = _ground(content.terrain, maps, releases, content.areas, pictures)
    page = _page(ground, releases, content.areas, obstacles)  # drawn once, because it takes half of the time
    for file, theme in themes(maps).items():
        title = f"{content.name}: {theme.title}, {content.flown.describe()}"
        drawn = _draw_theme(page, title, theme, maps)
        save(page.figure, folder / f"{file}.png")
        for artist in drawn:
            artist.remove()


def hazard_figure(
    title: str,
    theme: Theme,
    ground: MapBackground,
    maps: HazardMaps,
    releases: FloatArray,
    areas: Mapping[str, Sequence[FloatArray]],
    obstacles: Obstacles = NO_OBSTACLES,
) -> Figure:
    """Draw one hazard picture: map, colour bar, legend and overview.

    releases : (N, 2 or 3) m; areas : name -> rings (N, 2) m; both in the local frame
    obstacles : barriers, which are drawn as lines
    """
    page = _page(ground, releases, areas, obstacles)
    _draw_theme(page, title, theme, maps)
    return page.figure


class HazardPage(NamedTuple):
    """A hazard picture without its quantity: the background that the hazard pictures of a run share.

    main, side : axes of the map and of the column with the legend
    starts : number of releases drawn; areas : names of the areas
    barriers : legend entry of the barriers, empty without barriers
    """

    figure: Figure
    main: Axes
    side: Axes
    ground: MapBackground
    starts: int
    areas: Sequence[str]
    barriers: Sequence[Line2D]


def _page(
    ground: MapBackground, releases: FloatArray, areas: Mapping[str, Sequence[FloatArray]], obstacles: Obstacles
) -> HazardPage:
    """Draw what all hazard pictures of a run share: terrain, areas, barriers, releases, scale bar and overview."""
    terrain, window = ground.terrain, ground.window
    figure, main, side = empty_figure(window)
    draw_ground(main, terrain, window, ground.picture)
    draw_areas(main, terrain, areas)
    barriers = draw_barriers(main, terrain, obstacles)
    starts = starts_of(releases)
    main.plot(*plan_of(terrain, starts).T, linestyle="none", **_release(len(starts)))
    measure(main, terrain, window)
    if ground.whole is not None:
        draw_overview(figure, terrain, whole_window(terrain), window, ground.whole, areas)
    draw_north(side, terrain)
    return HazardPage(
        figure=figure, main=main, side=side, ground=ground, starts=len(starts), areas=tuple(areas), barriers=barriers
    )  # fmt: skip


def _draw_theme(page: HazardPage, title: str, theme: Theme, maps: HazardMaps) -> list[Artist]:
    """Draw the cells, title, colour bar and legend of a quantity on the background that all quantities share.

    Return the drawn objects, which the caller removes before the next quantity is drawn.
    """
    cells = _draw_cells(page.main, page.ground.terrain, page.ground.window, theme, maps)
    page.main.set_title(title, loc="left", fontsize=12, pad=TITLE_PAD)
    if np.isfinite(theme.values).any():
        scale: Artist = draw_colour_bar(page.figure, page.side, theme)
    else:
        scale = _say_why_empty(page.side, maps)
    return [*cells, scale, _draw_legend(page, maps.raster, few=len(cells) > 1)]


def _ground(
    terrain: Terrain,
    maps: HazardMaps,
    releases: FloatArray,
    areas: Mapping[str, Sequence[FloatArray]],
    pictures: GroundPictures | None = None,
) -> MapBackground:
    """Return the shaded terrain behind the hazard pictures: the part that rocks reached, and areas that overlap it.

    releases : (N, 2 or 3) m; areas : name -> rings (N, 2) m; both in the local frame
    pictures : pictures of the terrain that other maps share; None to make them here
    """
    pictures, whole = pictures or GroundPictures(terrain), whole_window(terrain)
    window = window_with_areas(whole, np.concatenate([_reached(maps), releases[:, :2]]), areas)
    picture = pictures.hillshade(window, PIXELS)
    small = None if window == whole else pictures.hillshade(whole, OVERVIEW_PIXELS)
    return MapBackground(terrain, window, picture, small)


def _reached(maps: HazardMaps) -> FloatArray:
    """Return the centres (N, 2) m of the map cells that rocks reached, local frame."""
    raster = maps.raster
    row, column = np.divmod(maps.cells.cell, raster.nx)
    return np.stack([column + 0.5, row + 0.5], axis=1) * raster.cell + (raster.x, raster.y)


def _release(count: int) -> dict[str, Any]:
    """Return the marker style of release points: large markers, or dots if there are many."""
    return RELEASE if count <= MANY_RELEASES else DOT


def _draw_cells(axes: Axes, terrain: Terrain, window: Window, theme: Theme, maps: HazardMaps) -> list[AxesImage]:
    """Draw the map cells in the window; return the images.

    The first image shows the cells with a value, in the colours of the scale. A second image shows cells that too
    few rocks reached for a value, in the colour FEW; without such cells, there is no second image.
    """
    raster = maps.raster
    shown, extent = _cells_in(raster, window)
    values = theme.values.reshape(raster.ny, raster.nx)[shown]
    reached = maps.cells.everywhere(maps.cells.rocks > 0, False).reshape(raster.ny, raster.nx)[shown]
    few = reached & ~np.isfinite(values)
    where = placed(terrain, extent)
    limits = axes.get_xlim(), axes.get_ylim()
    style: dict[str, Any] = {"extent": where, "origin": "lower", "interpolation": "nearest", "alpha": OPACITY}
    images = [axes.imshow(np.ma.masked_invalid(values), cmap=colour_map(), norm=norm_of(theme.scale), **style)]
    if few.any():
        images.append(axes.imshow(np.ma.masked_where(~few, few), cmap=ListedColormap([FEW]), **style))
    axes.set_xlim(*limits[0])
    axes.set_ylim(*limits[1])
    axes.set_aspect("equal")
    return images


def _cells_in(raster: Raster, window: Window) -> tuple[tuple[slice, slice], Window]:
    """Return the rows and columns of the map cells that a window touches, and the window that these cells cover.

    Both windows are in the local frame.
    """
    first = np.floor((np.array([window.left, window.bottom]) - (raster.x, raster.y)) / raster.cell).astype(int)
    last = np.ceil((np.array([window.right, window.top]) - (raster.x, raster.y)) / raster.cell).astype(int)
    (left, bottom), (right, top) = np.maximum(first, 0), np.minimum(last, (raster.nx, raster.ny))
    x, y, cell = raster.x, raster.y, raster.cell
    covered = Window(left=x + left * cell, right=x + right * cell, bottom=y + bottom * cell, top=y + top * cell)
    return (slice(bottom, top), slice(left, right)), covered


def _say_why_empty(side: Axes, maps: HazardMaps) -> Text:
    """Write a text that explains why no cell has a value, in the place of the colour bar; return the text object."""
    return side.text(0.0, 0.9, words_on_empty(maps), transform=side.transAxes, va="top", fontsize=9, color="#c81e1e")


def _draw_legend(page: HazardPage, raster: Raster, few: bool) -> Legend:
    """Draw the legend of a hazard picture and return it.

    raster : for the cell size in the title; few : True if some cells have too few rocks for a value
    """
    releases = page.starts
    point = {**_release(releases), "markersize": RELEASE["markersize"]}
    which = f"releases ({releases} drawn)" if releases == MOST_RELEASES else "releases"
    entries: list[Any] = [Line2D([], [], linestyle="none", label=which, **point)]
    if few:
        entries.append(Patch(facecolor=FEW, alpha=OPACITY, label=FEW_WORDS))
    entries += page.barriers
    entries += [Line2D([], [], color="black", linestyle="--", label=f"area: {name}") for name in page.areas]
    return page.side.legend(handles=entries, title=f"cells of {raster.cell:g} m", title_fontsize=9, alignment="left",
                loc="upper left", bbox_to_anchor=(-0.03, 0.79), frameon=False, fontsize=9)  # fmt: skip
