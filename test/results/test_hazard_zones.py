"""Tests that the zones in the file equal the cells from which they were made, as valid polygons."""

import json
from dataclasses import replace

import numpy as np
import pytest
from flights.flights_on_a_floor import FRAMES, SURVEY, SURVEY_Y_UP, floor
from hazards.hazard_layers import laid_out, lines_of_rocks, maps_of
from shapely.geometry import shape

from rpf3d_core.formats.polygons import read_polygons
from rpf3d_core.hazard.maps import HazardMaps, Raster
from rpf3d_core.results.hazard_files.zones_geojson import (
    CELLS_SAY,
    hazard_zones,
    write_hazard_zones,
    zones_without_cells,
)
from rpf3d_core.scene.hazard import HazardSpec
from rpf3d_core.terrain.zones import covered, in_plan

CELL = 2.0
SPEC = HazardSpec.model_validate({
    "reach_levels": [0.01, 0.05, 0.2, 1.0],
    "matrix": {
        "energy_levels_kj": [30.0, 300.0],
        "probability_levels": [0.05],
        "classes": [["low", "low"], ["low", "middle"], [None, "high"]],
    },
})  # fmt: skip


@pytest.fixture(params=FRAMES, ids=lambda frame: f"{frame.up}-up at {frame.origin[0]:.0f}")
def terrain(request):
    return floor(request.param)


def zones_of(folder, terrain, maps, spec=SPEC, crs=None):
    write_hazard_zones(folder / "zones.geojson", terrain, maps, spec, crs)
    return json.loads((folder / "zones.geojson").read_text())


def centres(terrain, raster):
    row, column = np.divmod(np.arange(raster.nx * raster.ny), raster.nx)
    local = np.stack([raster.x + (column + 0.5) * raster.cell, raster.y + (row + 0.5) * raster.cell], axis=1)
    return in_plan(terrain.frame, np.append(local, np.zeros((len(local), 1)), axis=1))


def test_each_zone_covers_exactly_its_cells(tmp_path, terrain):
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    features = zones_of(tmp_path, terrain, maps)["features"]
    zones = [zone for zone in hazard_zones(maps, SPEC) if zone.cells.any()]
    kinds = [(f["properties"]["kind"], f["properties"]["level"], f["properties"]["class"]) for f in features]
    assert kinds == [(zone.kind, zone.level, zone.name) for zone in zones]
    assert ("reach_probability", 1.0, None) not in kinds and ("matrix", None, "high") in kinds
    for feature, zone in zip(features, zones, strict=True):
        figure, facts = shape(feature["geometry"]), feature["properties"]
        assert figure.is_valid
        assert facts["cells"] == zone.cells.sum() and facts["area_m2"] == zone.cells.sum() * CELL**2
        assert figure.area == pytest.approx(facts["area_m2"], rel=1e-9)
        np.testing.assert_array_equal(covered(figure, centres(terrain, maps.raster)), zone.cells)


def speckled(cells: np.ndarray) -> HazardMaps:
    """Return maps whose true cells (rows, columns) every rock reached, and whose other cells no rock reached."""
    rows, columns = cells.shape
    maps = maps_of(floor(), lines_of_rocks(floor(), 1), CELL)
    cell = np.flatnonzero(cells)
    layers = replace(maps.cells, count=cells.size, cell=cell, rocks=np.full(len(cell), maps.flown))
    return HazardMaps(**{**vars(maps), "raster": Raster(-20.0, -20.0, 0.5, columns, rows), "cells": layers})


@pytest.mark.parametrize("share", [0.1, 0.4, 0.6, 0.9])
def test_speckled_cells_with_holes_and_touching_corners_still_make_valid_polygons(tmp_path, share):
    cells = np.random.default_rng(3).random((80, 60)) < share
    maps = speckled(cells)
    (feature,) = zones_of(tmp_path, floor(), maps, HazardSpec(reach_levels=(0.5,)))["features"]
    figure = shape(feature["geometry"])
    assert figure.is_valid
    assert figure.area == pytest.approx(cells.sum() * 0.25)
    assert any(len(polygon.interiors) for polygon in figure.geoms) == (share > 0.3)


def test_zones_can_be_read_back_as_areas_of_interest(tmp_path, terrain):
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    zones_of(tmp_path, terrain, maps, HazardSpec(reach_levels=(0.05,)))
    polygons = read_polygons(tmp_path / "zones.geojson")
    reached = laid_out(maps.cells).rocks >= 0.05 * maps.flown
    np.testing.assert_array_equal(covered(polygons, centres(terrain, maps.raster)), reached)


def test_the_file_says_in_which_reference_system_it_is(tmp_path):
    terrain = floor(SURVEY)
    maps = maps_of(terrain, lines_of_rocks(terrain), CELL)
    content = zones_of(tmp_path, terrain, maps, crs="EPSG:31287")
    assert content["crs"] == {"type": "name", "properties": {"name": "urn:ogc:def:crs:EPSG::31287"}}
    assert (content["axes"], content["rocks"], content["cell_m"]) == ("x y", 300, CELL)
    assert "crs" not in zones_of(tmp_path, terrain, maps)
    upright = floor(SURVEY_Y_UP)
    content = zones_of(tmp_path, upright, maps_of(upright, lines_of_rocks(upright), CELL), crs="EPSG:31287")
    assert "crs" not in content and content["axes"] == "x z"


def test_without_a_matrix_there_are_zones_of_reach_probability_only(tmp_path):
    maps = maps_of(floor(), lines_of_rocks(floor()), CELL)
    features = zones_of(tmp_path, floor(), maps, HazardSpec())["features"]
    assert {feature["properties"]["kind"] for feature in features} == {"reach_probability"}


def test_cells_whose_class_rests_on_their_largest_energy_are_counted(tmp_path):
    maps = maps_of(floor(), lines_of_rocks(floor()), CELL)
    features = zones_of(tmp_path, floor(), maps)["features"]
    told = sum(feature["properties"]["cells_by_largest_energy"] for feature in features)
    assert told == sum(zone.guessed for zone in hazard_zones(maps, SPEC)) > 0


def test_a_level_that_no_cell_reaches_says_nothing_about_areas_and_names_their_shares():
    terrain = floor()
    points = lines_of_rocks(terrain)
    x, never = points.plan[:, 0], HazardSpec(reach_levels=(1.0,))
    areas = [("west", x <= 5.0), ("nowhere", x > 1e6), ("east", x > 5.0), ("all", x > -1e6), ("none", x > 1e6)]
    (note,) = zones_without_cells(terrain, maps_of(terrain, points, CELL), never)
    assert note.startswith("no cell of ") and note.endswith(CELLS_SAY), "a scene without areas"
    (note,) = zones_without_cells(terrain, maps_of(terrain, points, CELL, areas), never)
    named = note.partition(f"{CELLS_SAY}: ")[2].split(", ")
    shares = [float(words.partition(" % (")[0]) for words in named[:3]]
    assert shares == sorted(shares, reverse=True) and shares[0] == 100.0
    assert {words.rpartition(" ")[2] for words in named[:3]} == {"west", "east", "all"}
    assert named[3] == "2 more areas are in benches.csv"
    assert zones_without_cells(terrain, maps_of(terrain, points, CELL, areas), HazardSpec(reach_levels=(1e-6,))) == []
