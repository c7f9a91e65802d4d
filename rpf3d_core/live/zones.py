"""Hazard zones as they are shown: facets of each level of reach probability, as they lie, and their outlines."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class ShownZone:
    """name : of the level; corners : (F, 3, 3) m of its facets; outline : (E, 2, 3) m, edges; map frame."""

    name: str
    corners: FloatArray
    outline: FloatArray


def shown_zones(maps: HazardMaps, terrain: Terrain, levels: Sequence[float]) -> list[ShownZone]:
    """A zone for each level (-, ascending) of reach probability.

    Its facets are those of at least this level and below the next one, so that no two zones lie upon each other; its
    outline goes around all of at least this level.
    """
    share = reach_probability(maps.facets, maps.flown)
    band = np.searchsorted(levels, share, side="right")
    zones = []
    for number, level in enumerate(levels, start=1):
        inside, within = maps.facets.cell[band == number], maps.facets.cell[band >= number]
        corners = terrain.vertices[terrain.triangles[inside]]
        outline = terrain.vertices[outer_edges(terrain.triangles[within])]
        zones.append(ShownZone(f"{level:g}", *(terrain.frame.points_to_input(part) for part in (corners, outline))))
    return zones


def outer_edges(triangles: IntArray) -> IntArray:
    """The edges (E, 2), by their vertices, that only one of some triangles (F, 3) has."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    one, other = sides.T
    edges = np.sort(np.minimum(one, other) << 32 | np.maximum(one, other))
    differs = np.ones(len(edges) + 1, dtype=np.bool_)
    differs[1:-1] = edges[1:] != edges[:-1]
    single = edges[differs[1:] & differs[:-1]]
    return np.stack([single >> 32, single & 0xFFFFFFFF], axis=-1)
