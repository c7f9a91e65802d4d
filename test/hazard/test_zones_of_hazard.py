"""Tests that cells belong exactly to the hazard zones that the scene's levels and matrix define."""

import numpy as np
import pytest
from flights.flights_on_a_floor import floor
from hazards.hazard_layers import laid_out, lines_of_rocks, maps_of

from rpf3d_core.hazard.maps import FEWEST_ROCKS, reach_probability
from rpf3d_core.hazard.zones import Matrix, matrix_zones, reach_zones

MATRIX = Matrix((30e3, 300e3), (0.05, 0.3), (("low", "low", None), ("low", "mid", "mid"), ("mid", "high", "high")), 95)


@pytest.fixture(scope="module")
def maps():
    return maps_of(floor(), lines_of_rocks(floor()), 2.0)


def test_a_zone_of_reach_probability_is_every_cell_of_at_least_its_level(maps):
    share = maps.cells.everywhere(reach_probability(maps.cells, maps.flown), 0.0)
    exact = float(np.sort(share)[-3])  # the exact share of a cell: a cell at the level belongs to the zone
    zones = reach_zones(maps, [0.01, exact])
    assert [zone.level for zone in zones] == [0.01, exact]
    for zone in zones:
        np.testing.assert_array_equal(zone.cells, share >= zone.level)
    assert zones[1].cells.sum() >= 3 and not (zones[1].cells & ~zones[0].cells).any()


def test_every_cell_that_rocks_came_to_has_the_class_of_its_energy_and_probability(maps):
    found = {zone.name: zone.cells for zone in matrix_zones(maps, MATRIX)}
    assert list(found) == ["high", "mid", "low"]
    share, cells = maps.cells.everywhere(reach_probability(maps.cells, maps.flown), 0.0), laid_out(maps.cells)
    seen = set()
    for cell in range(len(share)):
        energy = cells.energy.largest[cell] if cells.rocks[cell] < FEWEST_ROCKS else cells.energy.p95[cell]
        row = sum(energy >= level for level in MATRIX.energy_levels)
        column = sum(share[cell] >= level for level in MATRIX.probability_levels)
        expected = MATRIX.classes[row][column] if cells.rocks[cell] else None
        assert {name for name in found if found[name][cell]} == ({expected} - {None})
        seen.add(expected)
    assert seen == {None, "low", "mid", "high"}


def test_a_cell_with_too_few_rocks_for_a_percentile_is_not_called_safe(maps):
    cells = laid_out(maps.cells)
    few = (cells.rocks > 0) & (cells.rocks < FEWEST_ROCKS)
    assert few.any() and np.isnan(cells.energy.p95[few]).all()
    named = Matrix((1.0,), (1e-9,), (("a", "a"), ("b", "b")), 95)
    zones = {zone.name: zone for zone in matrix_zones(maps, named)}
    assert zones["b"].cells[few].all()
    assert zones["b"].guessed == few.sum()


def test_the_percentile_is_the_one_that_was_asked_for(maps):
    level = float(np.nanmedian(maps.cells.energy.p95))
    counts = []
    for percentile in (50, 99):
        matrix = Matrix((level,), (1e-9,), (("calm", "calm"), ("hard", "hard")), percentile)
        counts.append({zone.name: int(zone.cells.sum()) for zone in matrix_zones(maps, matrix)}["hard"])
    assert counts[0] < counts[1]
