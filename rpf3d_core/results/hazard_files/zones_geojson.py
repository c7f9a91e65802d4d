"""Write hazard/zones.geojson: outlines of hazard zones, along the borders of the raster's cells.

The outlines follow the borders of the cells; they are not contours between cell centres. Rocks are counted in cells, so
the outlined area is exact; a smooth curve would suggest more precision than a map has. The outlines are made by
`rasterio.features.shapes`, so no other library is needed.

Coordinates are the input's own plan coordinates (x y, or x z if y is up), so the file can be read back as polygons of
areas of interest. RFC 7946 allows longitude and latitude only. The reference system is therefore in the `crs` member
of the older GeoJSON 2008, which GIS programs read.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from rpf3d_core.formats.reference_system import reference_system
from rpf3d_core.hazard.benches import AREA, share_text
from rpf3d_core.hazard.by_source.each_source import from_source, worst_benches
from rpf3d_core.hazard.maps import HazardMaps
from rpf3d_core.hazard.zones import (
    CLASS,
    REACH,
    WORST_CLASS,
    WORST_REACH,
    Zone,
    matrix_zones,
    reach_zones,
    upper_zones,
    worst_matrix_zones,
    worst_reach_zones,
)
from rpf3d_core.results.hazard_files.geotiffs import transform_of, upright
from rpf3d_core.scene.hazard import HazardSpec, matrix_of
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

if TYPE_CHECKING:  # rasterio takes 0.1 s to import, so it is imported late, while the second process draws
    from rasterio.crs import CRS

CELLS_THAT_TOUCH = 4
"""Connectivity 4 of rasterio: the cells of a polygon share sides. Outlines that join at a corner would cross there."""

CELLS_SAY = "The share of a cell shrinks with the cell, so this says nothing about how many rocks reach an area"
"""Sentence on hazard zones without cells: a zone without cells is not a sign of safety."""
MOST_AREAS = 3
"""Largest number of areas of interest that a sentence names."""


def write_hazard_zones(
    path: Path, terrain: Terrain, maps: HazardMaps, spec: HazardSpec, crs: str | None = None
) -> None:
    """Write zones.geojson: a polygon feature for each hazard zone that has cells.

    Zones of reach probability are first, lowest level first; then, in a run over parameter sets, zones of the upper end
    of the predictive interval; then the zones of the matrix, highest class first. With several sources, both kinds also
    have zones of the worst source.

    Parameters
    ----------
    spec : the scene's `hazard`, for the levels and the matrix
    crs : `terrain.crs` of the scene; None if the scene has none

    Raises
    ------
    InputError
        `crs` is unknown, or is in degrees.
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
    """Return the hazard zones that a scene asks for (levels of reach probability, matrix), also zones without cells."""
    matrix = matrix_of(spec)
    zones = [each for of in (reach_zones, upper_zones, worst_reach_zones) for each in of(maps, spec.reach_levels)]
    if matrix is not None:
        zones += [*matrix_zones(maps, matrix), *worst_matrix_zones(maps, matrix)]
    return zones


def zones_without_cells(terrain: Terrain, maps: HazardMaps, spec: HazardSpec) -> list[str]:
    """Return sentences for the user on requested hazard zones that have no cells, and so are not in zones.geojson.

    Zones of the upper end of the predictive interval are not mentioned. A zone of the worst
    source is mentioned if it has cells, but the zone of all sources together for the same level or class has none.
    """
    zones, cell = hazard_zones(maps, spec), f"no cell of {maps.raster.cell:g} m"
    missing = [zone for zone in zones if zone.kind in (REACH, CLASS) and not zone.cells.any()]
    levels = [f"{100.0 * zone.level:g} %" for zone in missing if zone.level is not None]
    classes = [repr(zone.name) for zone in missing if zone.name is not None]
    sentences = []
    if levels:
        sentences.append(
            f"{cell} is reached by {' or '.join(levels)} of the rocks: {_absent(zones, WORST_REACH, missing)}. "
            f"{_of_areas(terrain, maps)}"
        )
    if classes:
        sentences.append(f"{cell} is of the class {' or '.join(classes)}: {_absent(zones, WORST_CLASS, missing)}")
    return sentences


def _absent(zones: Sequence[Zone], kind: str, missing: Sequence[Zone]) -> str:
    """Return the end of a sentence on hazard zones that have no cells for the rocks of all sources together.

    The text states that zones.geojson does not have these zones, and for how many of them it has the zone of the worst
    source of each cell.

    zones : all requested zones; kind : kind of the zones of the worst source, for the sentence
    missing : the zones of all rocks together that have no cells
    """
    lacking = {(zone.level, zone.name) for zone in missing}
    of_worst = sum(zone.kind == kind and zone.cells.any() and (zone.level, zone.name) in lacking for zone in zones)
    if not of_worst:
        return "zones.geojson has no such zone"
    which = "such a zone" if of_worst == 1 else f"{of_worst} such zones"
    return f"zones.geojson has no such zone of all sources together, but {which} of the worst source (kind {kind})"


def _of_areas(terrain: Terrain, maps: HazardMaps) -> str:
    """Return a note that shares of cells depend on the cell size, then the shares of rocks that reach the areas.

    The largest share is first; at most MOST_AREAS areas are named.
    """
    areas = [bench for bench in worst_benches(terrain, maps) if bench.kind == AREA]
    areas.sort(key=lambda bench: -bench.reached["share"])
    named = [
        f"{share_text(bench.reached)}{from_source(bench.source)} reach {bench.name}" for bench in areas[:MOST_AREAS]
    ]
    file = "benches.csv" if maps.sources is None else "sources.csv"
    more = [f"{len(areas) - MOST_AREAS} more areas are in {file}"] if len(areas) > MOST_AREAS else []
    return f"{CELLS_SAY}{': ' if named else ''}{', '.join([*named, *more])}"


def zones_section(maps: HazardMaps, spec: HazardSpec) -> list[dict[str, Any]]:
    """Return the requested hazard zones for summary.json; zones with 0 cells have no feature in zones.geojson."""
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
    """Return a hazard zone as a GeoJSON feature: its polygons, kind, level or class, and size."""
    cells = int(zone.cells.sum())
    properties = {
        "kind": zone.kind, "level": zone.level, "class": zone.name, "area_m2": cells * maps.raster.cell**2,
        "cells": cells, "cells_by_largest_energy": zone.guessed, "cell_m": maps.raster.cell,
        "object_width_m": zone.object_width,
    }  # fmt: skip
    geometry = {"type": "MultiPolygon", "coordinates": _polygons(zone, maps, frame)}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _polygons(zone: Zone, maps: HazardMaps, frame: Frame) -> list[Any]:
    """Return the polygons around the cells of a hazard zone, as rings in plan coordinates (m)."""
    from rasterio.features import shapes

    image = np.ascontiguousarray(upright(zone.cells, maps.raster, frame))
    transform = transform_of(maps.raster, frame)
    found = shapes(image.view(np.uint8), mask=image, connectivity=CELLS_THAT_TOUCH, transform=transform)
    return [geometry["coordinates"] for geometry, _ in found]


def _member(system: "CRS", name: str) -> dict[str, Any]:
    """Return the member `crs` of GeoJSON 2008: the EPSG code of the reference system or, without a code, `name`.

    name : the reference system as the scene spells it
    """
    code = system.to_epsg()
    return {"type": "name", "properties": {"name": name if code is None else f"urn:ogc:def:crs:EPSG::{code}"}}
