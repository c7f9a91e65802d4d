"""Make pictures of the terrain from above under slanting light, as backgrounds of maps."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.colours import zone_colours
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plan_view import PlanView, Window, seen_from_above

Picture = NDArray[np.uint8]

LIGHT = np.array([-0.5, 0.5, 0.7071])
"""Direction (3,) towards the light: from the north-west, 45 degrees high, as in hill-shaded maps."""

AMBIENT = 0.6
"""Brightness (-) of a facet in full shade."""

GREY, GREY_AMBIENT = 218, 0.68
"""Grey (0 to 255) of level terrain under hazard colours, and brightness (-) of a facet in full shade.

The grey is light, so that the colours on it stay true, but darker than white paper.
"""


class GroundPictures:
    """Pictures of one terrain from above; a view that two maps share is computed once."""

    def __init__(self, terrain: Terrain) -> None:
        """Start without any picture; `shaded` and `hillshade` compute them."""
        self._terrain = terrain
        self._views: dict[tuple[Window, int], _LitView] = {}

    def shaded(self, window: Window, pixels: int) -> Picture:
        """Return the terrain of a window from above, in zone colours under slanting light, (H, W, 4) RGBA.

        pixels : number of pixels along the longer side of the window
        """
        return _shaded(self._terrain, self._view(window, pixels))

    def hillshade(self, window: Window, pixels: int) -> Picture:
        """Return the terrain of a window from above, in grey under slanting light, (H, W, 4) RGBA.

        pixels : number of pixels along the longer side of the window
        """
        return _hillshade(self._terrain, self._view(window, pixels))

    def _view(self, window: Window, pixels: int) -> "_LitView":
        if (window, pixels) not in self._views:
            self._views[window, pixels] = _lit(self._terrain, seen_from_above(self._terrain, window, pixels))
        return self._views[window, pixels]


def shaded(terrain: Terrain, view: PlanView) -> Picture:
    """Return the terrain from above in zone colours under slanting light: (H, W, 4) RGBA.

    Pixels without terrain are transparent.
    """
    return _shaded(terrain, _lit(terrain, view))


def hillshade(terrain: Terrain, view: PlanView) -> Picture:
    """Return the terrain from above in grey under slanting light: (H, W, 4) RGBA, as a background of hazard colours.

    Pixels without terrain are transparent.
    """
    return _hillshade(terrain, _lit(terrain, view))


class _LitView(NamedTuple):
    """The terrain from above under slanting light: the facet of each pixel, and the brightness of each facet.

    facets : (N,) the facets that pixels show; pixel : (H, W) index into `facets`, N for a pixel without terrain
    light : (N,) brightness (-) of the facets: 0 in full shade, 1 if level, more if turned to the light
    """

    facets: NDArray[np.int64]
    pixel: NDArray[np.int64]
    light: FloatArray


def _lit(terrain: Terrain, view: PlanView) -> _LitView:
    """Return a view from above with the brightness of its facets."""
    number = np.zeros(len(terrain.triangles) + 1, dtype=np.int64)  # last entry: pixels without terrain (facet -1)
    number[view.facet] = 1
    facets = np.flatnonzero(number[:-1])
    number[facets] = np.arange(len(facets))
    number[-1] = len(facets)
    towards = upward_normals(terrain.vertices, terrain.triangles[facets]) @ LIGHT
    return _LitView(facets=facets, pixel=number[view.facet], light=np.clip(towards, 0.0, 1.0) / LIGHT[2])


def _shaded(terrain: Terrain, view: _LitView) -> Picture:
    return _coloured(terrain, view, zone_colours(terrain.zones), AMBIENT)


def _hillshade(terrain: Terrain, view: _LitView) -> Picture:
    return _coloured(terrain, view, np.full((len(terrain.zones), 3), GREY, dtype=np.uint8), GREY_AMBIENT)


def _coloured(terrain: Terrain, view: _LitView, zone_colour: NDArray[np.uint8], ambient: float) -> Picture:
    """Return a view in the given zone colours (Z, 3): (H, W, 4) RGBA.

    ambient : brightness (-) of a facet in full shade
    """
    brightness = ambient + (1.0 - ambient) * view.light
    colours = np.zeros((len(view.facets) + 1, 4), dtype=np.uint8)
    colours[:-1, :3] = np.clip(zone_colour[terrain.zone[view.facets]] * brightness[:, None], 0, 255)
    colours[:-1, 3] = 255
    return colours[view.pixel]


def upward_normals(vertices: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    """Return the unit normals (F, 3) of facets on their upper side; zero for a facet without area.

    vertices : (V, 3) m; triangles : (F, 3) indices of vertices

    This function does not use compiled code of the engines, because a process that only draws pictures loads none.
    """
    corners = vertices[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(area, axis=1) * np.where(area[:, 2] < 0.0, -1.0, 1.0)
    return np.asarray(np.divide(area, length[:, None], out=np.zeros_like(area), where=length[:, None] != 0.0))
