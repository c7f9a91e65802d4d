"""hazard/zones.geojson: outlines of hazard zones, along the borders of the raster's cells.

The outline of the cells themselves, not a contour drawn between their centres: a cell is what was counted, its area is
exact, and at 2 m nobody can tell the steps from a curve that would claim to know more. It comes from
`rasterio.features.shapes`, so no other library is needed.

Coordinates are the input's own plan coordinates (x y, or x z where y is up), so the file can be read back as polygons
of areas of interest. RFC 7946 knows longitude and latitude only: the reference system stands in the `crs` member of
the older GeoJSON 2008, which GIS programs read.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rasterio.crs import CRS
from rasterio.features import shapes

from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.zones import Zone, matrix_zones, reach_zones
from rpf3d_core.io.hazard_rasters import transform_of, upright
from rpf3d_core.io.reference_system import reference_system
from rpf3d_core.io.scene_hazard import HazardSpec, matrix_of
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

CELLS_THAT_TOUCH = 4
"""Cells that share a border are one polygon; those that share but a corner are two, or outlines would cross there."""


def write_hazard_zones(
    path: Path, terrain: Terrain, maps: HazardMaps, spec: HazardSpec, crs: str | None = None
) -> None:
    """Write a feature for each zone that has cells: reach probability from the lowest level, then the matrix.

    Parameters
    ----------
    spec : of the scene, for the levels and the matrix
    crs : as `terrain.crs` of the scene

    Raises
    ------
    InputError
        As `reference_system`.
    """
    system = reference_system(crs, terrain.frame.up)
    zones = hazard_zones(maps, spec)
    collection = {
        "type": "FeatureCollection",
        "name": "hazard zones",
        **({} if crs is None or system is None else {"crs": _member(system, crs)}),
        "axes": "x y" if terrain.frame.up == "z" else "x z",
        "rocks": maps.flown,
        "rocks_lost_to_holes": maps.lost,
        "cell_m": maps.raster.cell,
        "features": [_feature(zone, maps, terrain.frame) for zone in zones if zone.cells.any()],
    }
    path.write_text(json.dumps(collection, allow_nan=False) + "\n", encoding="utf-8")


def hazard_zones(maps: HazardMaps, spec: HazardSpec) -> Sequence[Zone]:
    """The zones that a scene asks for, those without cells included."""
    matrix = matrix_of(spec)
    return [*reach_zones(maps, spec.reach_levels), *([] if matrix is None else matrix_zones(maps, matrix))]


def zones_without_cells(maps: HazardMaps, spec: HazardSpec) -> list[str]:
    """A sentence for the zones that a scene asks for and no cell belongs to: the file has no feature for them."""
    missing = [zone for zone in hazard_zones(maps, spec) if not zone.cells.any()]
    levels = [f"{100.0 * zone.level:g} %" for zone in missing if zone.level is not None]
    classes = [repr(zone.name) for zone in missing if zone.name is not None]
    sentences = []
    if levels:
        sentences.append(
            f"no cell of {maps.raster.cell:g} m is reached by {' or '.join(levels)} of the rocks: zones.geojson has no "
            "such zone"
        )
    if classes:
        sentences.append(
            f"no cell of {maps.raster.cell:g} m is of the class {' or '.join(classes)}: zones.geojson has no such zone"
        )
    return sentences


def zones_section(maps: HazardMaps, spec: HazardSpec) -> list[dict[str, Any]]:
    """The zones that a scene asks for, for summary.json: those with 0 cells have no feature."""
    return [
        {
            "kind": zone.kind,
            "level": zone.level,
            "class": zone.name,
            "cells": int(zone.cells.sum()),
            "cell_m": maps.raster.cell,
            "object_width_m": zone.object_width,
        }
        for zone in hazard_zones(maps, spec)
    ]


def _feature(zone: Zone, maps: HazardMaps, frame: Frame) -> dict[str, Any]:
    """A zone as one MultiPolygon with what it is and how large."""
    cells = int(zone.cells.sum())
    properties = {
        "kind": zone.kind, "level": zone.level, "class": zone.name, "area_m2": cells * maps.raster.cell**2,
        "cells": cells, "cells_by_largest_energy": zone.guessed, "cell_m": maps.raster.cell,
        "object_width_m": zone.object_width,
    }  # fmt: skip
    geometry = {"type": "MultiPolygon", "coordinates": _polygons(zone, maps, frame)}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _polygons(zone: Zone, maps: HazardMaps, frame: Frame) -> list[Any]:
    """Rings of the polygons around the cells of a zone, in plan coordinates, m."""
    image = np.ascontiguousarray(upright(zone.cells, maps.raster, frame))
    transform = transform_of(maps.raster, frame)
    found = shapes(image.view(np.uint8), mask=image, connectivity=CELLS_THAT_TOUCH, transform=transform)
    return [geometry["coordinates"] for geometry, _ in found]


def _member(system: CRS, name: str) -> dict[str, Any]:
    """The `crs` member: an EPSG code as GeoJSON 2008 spells it, anything else as the scene does."""
    code = system.to_epsg()
    return {"type": "name", "properties": {"name": name if code is None else f"urn:ogc:def:crs:EPSG::{code}"}}
