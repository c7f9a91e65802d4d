"""Choose the cell size of the hazard maps if the scene states none: so large that the rocks can fill the cells."""

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
"""Smallest number of rocks in the first round of `rocks: auto`, unless `most_rocks` is smaller.

Each further round doubles the number of rocks flown.
"""


def least_cell(scene: Scene, terrain: Terrain, sources: Sequence[Source]) -> float:
    """Return the smallest cell size (m) at which the rocks of a scene are enough for percentiles in the cells.

    The result is 0 without sources, and never larger than the coarsest cell that is still useful on this terrain.
    """
    if not sources:
        return 0.0
    low, high = (_corner(terrain.vertices, ends) for ends in (np.min, np.max))
    return min(filled_cell(sources, fewest_rocks(scene), low, high), round_below(coarsest_cell(low, high)))


def fewest_rocks(scene: Scene) -> int:
    """Return the smallest number of rocks that a complete run of a scene may have, to choose the cell size.

    For `rocks: auto`, this is the number after all required rounds. The number is known before the first rock flies,
    and is equal in all parts of a run.
    """
    rocks = sum(source.rocks for source in scene.sources)
    if scene.rocks != "auto":
        return rocks
    return int(min(max(rocks, FIRST_ROUND) * 2**DOUBLINGS, scene.target.most_rocks))


def _corner(points: FloatArray, ends: Callable[[FloatArray], Any]) -> Vec:
    """Return the lowest or the highest corner (3,) m of the box around points (P, 3) m.

    ends : np.min for the corner with the smallest coordinates, np.max for the corner with the largest coordinates
    """
    return float(ends(points[:, 0])), float(ends(points[:, 1])), float(ends(points[:, 2]))
