"""The least cell of a scene's maps: its rocks are to fill the cells, where the scene does not give a cell."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rpf3d_core.ensemble.releases import Source
from rpf3d_core.hazard.cell_size import coarsest_cell, filled_cell
from rpf3d_core.hazard.convergence import DOUBLINGS
from rpf3d_core.hazard.raster import round_below
from rpf3d_core.scene.model import Scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.values import Vec

FIRST_ROUND = 1000
"""Rocks that `rocks: auto` begins with, at least; each further round doubles them."""


def least_cell(scene: Scene, terrain: Terrain, sources: Sequence[Source]) -> float:
    """Return the least cell (m) that a scene's rocks fill, as far as its map may be coarse; 0 without sources."""
    if not sources:
        return 0.0
    low, high = (_corner(terrain.vertices, ends) for ends in (np.min, np.max))
    return min(filled_cell(sources, fewest_rocks(scene), low, high), round_below(coarsest_cell(low, high)))


def fewest_rocks(scene: Scene) -> int:
    """Return how many rocks of a scene fly unless it is interrupted: of `rocks: auto` those of the doublings it needs.

    It is known before the first rock flies, and the same in every part of the scene.
    """
    rocks = sum(source.rocks for source in scene.sources)
    if scene.rocks != "auto":
        return rocks
    return int(min(max(rocks, FIRST_ROUND) * 2**DOUBLINGS, scene.target.most_rocks))


def _corner(points: FloatArray, ends: Callable[[FloatArray], Any]) -> Vec:
    """A corner (3,) m of the box of points (P, 3), column by column."""
    return float(ends(points[:, 0])), float(ends(points[:, 1])), float(ends(points[:, 2]))
