"""Make pictures of the terrain from above under slanting light, as backgrounds of maps."""

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.ensemble.colours import zone_colours
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plan_view import PlanView

LIGHT = np.array([-0.5, 0.5, 0.7071])
"""Direction (3,) towards the light: from the north-west, 45 degrees high, as in hill-shaded maps."""

AMBIENT = 0.6
"""Brightness (-) of a facet in full shade."""

GREY, GREY_AMBIENT = 218, 0.68
"""Grey (0 to 255) of level terrain under hazard colours, and brightness (-) of a facet in full shade.

The grey is light, so that the colours on it stay true, but darker than white paper.
"""


def shaded(terrain: Terrain, view: PlanView) -> NDArray[np.uint8]:
    """Return the terrain from above in zone colours under slanting light: (H, W, 4) RGBA.

    Pixels without terrain are transparent.
    """
    return _lit(terrain, view, zone_colours(terrain.zones), AMBIENT)


def hillshade(terrain: Terrain, view: PlanView) -> NDArray[np.uint8]:
    """Return the terrain from above in grey under slanting light: (H, W, 4) RGBA, as a background of hazard colours.

    Pixels without terrain are transparent.
    """
    return _lit(terrain, view, np.full((len(terrain.zones), 3), GREY, dtype=np.uint8), GREY_AMBIENT)


def _lit(terrain: Terrain, view: PlanView, zone_colour: NDArray[np.uint8], ambient: float) -> NDArray[np.uint8]:
    """Return the terrain from above under slanting light, in the given zone colours (Z, 3): (H, W, 4) RGBA.

    ambient : brightness (-) of a facet in full shade
    """
    shown = view.facet >= 0
    facets, place = np.unique(view.facet[shown], return_inverse=True)
    towards = np.clip(upward_normals(terrain.vertices, terrain.triangles[facets]) @ LIGHT, 0.0, 1.0)
    brightness = ambient + (1.0 - ambient) * towards / LIGHT[2]
    colour = np.clip(zone_colour[terrain.zone[facets]] * brightness[:, None], 0, 255)
    picture = np.zeros((*view.facet.shape, 4), dtype=np.uint8)
    picture[shown, :3], picture[shown, 3] = colour[place], 255
    return picture


def upward_normals(vertices: FloatArray, triangles: NDArray[np.integer]) -> FloatArray:
    """Return the unit normals (F, 3) of facets on their upper side; zero for a facet without area.

    Not the compiled loop of the engines: a process that only draws pictures loads no compiled code.
    """
    corners = vertices[triangles]
    area = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(area, axis=1) * np.where(area[:, 2] < 0.0, -1.0, 1.0)
    return np.asarray(np.divide(area, length[:, None], out=np.zeros_like(area), where=length[:, None] != 0.0))
