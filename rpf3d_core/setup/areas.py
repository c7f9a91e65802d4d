"""Read the areas of interest of a scene, and check that they lie on the terrain."""

from collections.abc import Mapping
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry import MultiPolygon

from rpf3d_core.errors import InputError
from rpf3d_core.formats.polygons import local_plan, polygon_of, read_polygons
from rpf3d_core.scene.model import AreaSpec, Scene
from rpf3d_core.setup.coverage import extents, lies_off
from rpf3d_core.setup.file_keys import named_by_key
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import FloatArray, Frame

REACHED_BY = (
    "a rock reached an area if its path crosses it in plan, at whatever height: exact in flight, and along chords of "
    "slides that bend"
)


def read_areas(scene: Scene) -> dict[str, MultiPolygon]:
    """Return the polygons of each area of interest, by name, in plan coordinates of the input.

    Overlapping polygons of one area are united, so the overlap lies inside the area.

    Raises
    ------
    InputError
        A file cannot be used, as in `read_polygons`; the message names the key.
    """
    areas = {}
    for number, area in enumerate(scene.areas_of_interest):
        key = ("areas_of_interest", number, "polygons")
        with named_by_key(scene, *key) if isinstance(area.polygons, Path) else nullcontext():
            areas[area.name] = _united(area_polygons(area))
    return areas


def area_polygons(area: AreaSpec) -> MultiPolygon:
    """Return the polygons of an area of interest, from its corners or its file; errors are as in `read_polygons`."""
    if isinstance(area.polygons, Path):
        return read_polygons(area.polygons)
    return polygon_of(area.polygons)


def _united(polygons: MultiPolygon) -> MultiPolygon:
    union = shapely.union_all(list(polygons.geoms))
    return union if isinstance(union, MultiPolygon) else MultiPolygon([union])


OF_THE_INPUT = "the plan coordinates of the terrain's own input (x y, or x z where y is up)"
"""Coordinates of the areas of interest of a run, in words, for a message."""


def area_outlines(
    scene: Scene, terrain: Terrain, areas: Mapping[str, MultiPolygon], coordinates: str = OF_THE_INPUT
) -> dict[str, list[FloatArray]]:  # fmt: skip
    """Return the outlines (N, 2) m of each area of interest, in the local frame.

    areas : polygons from `read_areas`
    coordinates : the coordinates that areas must have, in words, such as OF_THE_INPUT, for the message

    Raises
    ------
    InputError
        No part of an area lies on the terrain, so this area could have no result.
    """
    for spec in scene.areas_of_interest:
        if lies_off(terrain, areas[spec.name]):
            where = extents(terrain, shapely.get_coordinates(areas[spec.name]))
            file = spec.polygons if isinstance(spec.polygons, Path) else scene.path
            raise InputError(
                f"{file}: the area of interest {spec.name!r} lies off the terrain: {where}; it must be in "
                f"{coordinates}"
            )
    return {name: local_outlines(terrain.frame, area) for name, area in areas.items()}


def outlines_on(terrain: Terrain, path: Path, key: str) -> list[FloatArray]:
    """Return the outlines (N, 2) m of the polygons in a file, holes included, in the local frame.

    Overlapping polygons are merged.

    key : path of the scene file and key that names the file of polygons, for messages

    Raises
    ------
    InputError
        The file is damaged (the message names the file), or no part of the polygons lies on the terrain (the message
        names the key).
    """
    polygons = _united(read_polygons(path))
    if lies_off(terrain, polygons):
        raise InputError(f"{key} lie off the terrain: {extents(terrain, shapely.get_coordinates(polygons))}")
    return local_outlines(terrain.frame, polygons)


def local_outlines(frame: Frame, polygons: MultiPolygon) -> list[FloatArray]:
    """Return the outlines (N, 2) m of polygons, holes included, converted from plan coordinates to the local frame."""
    return [local_plan(frame, ring) for ring in plan_rings(polygons)]


def plan_rings(polygons: MultiPolygon) -> list[FloatArray]:
    """Return the outlines (N, 2) m of polygons, holes included, in plan coordinates of the input."""
    rings = [ring for polygon in polygons.geoms for ring in (polygon.exterior, *polygon.interiors)]
    return [np.asarray(ring.coords)[:, :2] for ring in rings]
