"""Make the hazard zones for display: for each reach level of the user, the facets of the zone and its outline."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.terrain.facets import IntArray, Terrain
from rpf3d_core.terrain.frame import FloatArray


@dataclass(frozen=True, eq=False)
class ShownZone:
    """A hazard zone for display: the facets within one range of reach probability, map frame.

    name : the reach level as text; corners : (F, 3, 3) m, corners of the zone's facets
    outline : (E, 2, 3) m, both ends of each edge around all facets whose reach probability is at least the level
    """

    name: str
    corners: FloatArray
    outline: FloatArray


def shown_zones(maps: HazardMaps, terrain: Terrain, levels: Sequence[float]) -> list[ShownZone]:
    """Return a hazard zone for each reach level, for display.

    levels : reach levels (-), ascending

    The facets of a zone have a reach probability of at least the level of the zone and below the next level, so zones
    do not overlap. The outline of a zone encloses all facets whose reach probability is at least the level of the zone.
    """
    facets = maps.facets if maps.reached_facets is None else maps.reached_facets
    share = reach_probability(facets, maps.flown)
    band = np.searchsorted(levels, share, side="right")
    zones = []
    for number, level in enumerate(levels, start=1):
        inside, within = facets.cell[band == number], facets.cell[band >= number]
        corners = terrain.vertices[terrain.triangles[inside]]
        outline = terrain.vertices[outer_edges(terrain.triangles[within])]
        zones.append(ShownZone(f"{level:g}", *(terrain.frame.points_to_input(part) for part in (corners, outline))))
    return zones


def outer_edges(triangles: IntArray) -> IntArray:
    """Return the edges (E, 2) around a set of triangles (F, 3): the edges that belong to only one of the triangles."""
    sides = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    one, other = sides.T
    edges = np.sort(np.minimum(one, other) << 32 | np.maximum(one, other))
    differs = np.ones(len(edges) + 1, dtype=np.bool_)
    differs[1:-1] = edges[1:] != edges[:-1]
    single = edges[differs[1:] & differs[:-1]]
    return np.stack([single >> 32, single & 0xFFFFFFFF], axis=-1)
