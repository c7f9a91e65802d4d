"""Assign zones that are drawn as polygons: a facet belongs to the zone if its middle lies in the polygons."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from shapely.geometry import MultiPolygon

from rpf3d_core.errors import TerrainError
from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.scene.model import Scene
from rpf3d_core.setup.coverage import covered_share, lies_off
from rpf3d_core.terrain.facets import Terrain, area_vectors
from rpf3d_core.terrain.zones import Flags, centroids_in_plan, covered, with_zone

ALIKE = 0.2
"""Largest difference of the areas of a zone and of its polygons, as a share (-) of the latter, without a note."""


def with_drawn_zones(terrain: Terrain, scene: Scene) -> tuple[Terrain, list[str]]:
    """Return a terrain with the zones that a scene draws, and notes on zones of another size than their polygons.

    Raises
    ------
    TerrainError
        The polygons of a zone contain the middle of no facet; the message names the file.
    InputError
        A file of polygons is damaged.
    """
    if not scene.zones:
        return terrain, []
    plan, notes = centroids_in_plan(terrain), list[str]()
    for spec in scene.zones:
        polygons = read_polygons(spec.polygons)
        facets = covered(polygons, plan)
        if not facets.any():
            raise TerrainError(f"{spec.polygons}: {_why_empty(terrain, spec.zone, polygons)}")
        notes += _another_size(terrain, spec.zone, polygons, facets, spec.polygons)
        terrain = with_zone(terrain, spec.zone, facets)
    return terrain, notes


def _why_empty(terrain: Terrain, zone: str, polygons: MultiPolygon) -> str:
    """Return why polygons make no zone: they lie off the terrain, or contain the middle of no facet."""
    if lies_off(terrain, polygons):
        return (
            f"the polygons of zone {zone!r} cover no facet; they must be in the plan coordinates of the terrain's own "
            "input (x y, or x z where y is up)"
        )
    return (
        f"the polygons of zone {zone!r} contain the middle of no facet, and facets are not cut: draw larger polygons, "
        "or use a terrain with smaller facets there"
    )


def _another_size(terrain: Terrain, zone: str, polygons: MultiPolygon, facets: Flags, path: Path) -> Iterator[str]:
    """Yield a note if the area of a zone's facets in plan differs from that of its polygons by more than ALIKE.

    Parts of the polygons off the terrain do not count. Usually, the note means that facets are large compared with the
    polygons.

    facets : (F,) True for the facets of the zone; path : file of the polygons, for the note
    """
    area = float(np.abs(area_vectors(terrain.vertices, terrain.triangles[facets])[:, 2]).sum())
    drawn = float(polygons.area)
    if abs(area - drawn) <= ALIKE * drawn:
        return
    drawn *= covered_share(terrain, polygons)  # a part may lie off the terrain
    if abs(area - drawn) > ALIKE * drawn:
        yield (
            f"{path.name}: the facets of zone {zone!r} have {area:,.0f} m2 in plan, but its polygons on the terrain "
            f"{drawn:,.0f} m2: facets are not cut, and belong to a zone with their middle; use a terrain with smaller "
            "facets"
        )
