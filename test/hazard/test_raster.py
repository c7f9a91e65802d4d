"""Tests that rasters cover the terrain, lie on round coordinates, and are refused if memory is too small."""

import re

import numpy as np
import pytest
from flights.flights_on_a_floor import FRAMES, SIDE, SURVEY, floor
from hazards.hazard_layers import cell_of

from rpf3d_core.errors import InputError
from rpf3d_core.hazard import raster as module
from rpf3d_core.hazard.raster import check_memory, raster_over, round_cells, typical_size
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame

BYTES = 1000
"""Bytes per cell that the tests assume for a tally."""


def shifted(by: tuple[float, float], frame: Frame) -> Terrain:
    """Return the floor, moved in plan (m) in its frame."""
    flat = floor(frame)
    return Terrain(flat.vertices + np.array([*by, 0.0]), flat.triangles, flat.zone, flat.zones, frame)


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("cell", [0.25, 3.0, 7.0, 50.0])
def test_borders_lie_on_whole_multiples_of_the_cell_in_input_coordinates(frame, cell):
    raster = raster_over(shifted((0.3, -1.7), frame), cell)
    east, north, _ = frame.origin
    for border in (raster.x + east, raster.y + north):
        assert border / cell == pytest.approx(round(border / cell), abs=1e-9)
    assert raster.cell == cell


@pytest.mark.parametrize("cell", [0.5, 5.0, 7.0, 100.0])
def test_every_point_of_the_terrain_has_a_cell_and_no_row_or_column_is_spare(cell):
    terrain = floor(SURVEY)
    raster = raster_over(terrain, cell)
    cells = cell_of(raster, terrain.vertices[:, :2])
    assert (cells >= 0).all()
    rows, columns = np.divmod(cells, raster.nx)
    assert (rows.min(), columns.min()) == (0, 0)
    assert (rows.max(), columns.max()) == (raster.ny - 1, raster.nx - 1)


def test_maps_of_two_surveys_with_their_own_origins_lie_cell_on_cell():
    one = raster_over(floor(SURVEY), 2.0)
    moved = Frame((SURVEY.origin[0] + 13.0, SURVEY.origin[1] - 7.0, 3.0))
    other = raster_over(floor(moved), 2.0)
    apart = np.array([one.x - other.x, one.y - other.y]) - (13.0, -7.0)
    np.testing.assert_allclose(apart / 2.0, np.round(apart / 2.0), atol=1e-9)


@pytest.mark.parametrize(("cells", "size", "cell"), [(8, 5.0, 2.0), (4, 10.0, 5.0), (100, 0.4, 0.25)])
def test_a_cell_that_nobody_chose_is_half_the_median_facets_size_or_the_next_below(cells, size, cell):
    terrain = floor(cells=cells)
    assert typical_size(terrain) == pytest.approx(size)
    assert raster_over(terrain).cell == cell


def test_a_cell_that_nobody_chose_keeps_the_raster_small(monkeypatch):
    assert raster_over(floor()).cell == 2.0
    monkeypatch.setattr(module, "MOST_CELLS", 100)
    raster = raster_over(floor())
    assert raster.cell == 5.0 and raster.nx * raster.ny == 81
    monkeypatch.setattr(module, "MOST_CELLS", 80)
    raster = raster_over(floor())
    assert raster.cell == 10.0 and raster.nx * raster.ny <= 80


def test_cells_are_round_numbers():
    sizes = round_cells()
    assert [next(sizes) for _ in range(10)] == [0.25, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0]


def test_maps_that_need_more_memory_than_allowed_are_refused_with_a_cell_that_then_fits():
    terrain = floor(SURVEY)
    raster, facets = raster_over(terrain, 0.25), len(terrain.triangles)
    needed = (raster.nx * raster.ny + facets) * BYTES / 1e9
    with pytest.raises(InputError) as refused:
        check_memory(raster, facets, 0.003, BYTES)
    sentence = str(refused.value)
    told = float(re.search(r"need ([\d.]+) GB", sentence)[1])
    assert needed <= told <= 1.1 * needed
    assert "memory_gb allows 0.003 GB" in sentence and "161 x 161 cells of 0.25 m" in sentence
    cell = float(re.search(r"a cell of ([\d.]+) m fits", sentence)[1])
    check_memory(raster_over(terrain, cell), facets, 0.003, BYTES)
    with pytest.raises(InputError):  # the next finer raster does not fit, so the advice is as fine as possible
        check_memory(raster_over(terrain, 0.5), facets, 0.003, BYTES)
    assert cell == 1.0


@pytest.mark.parametrize("memory", [2e-4, 3e-4, 1e-3, 5e-3])
@pytest.mark.parametrize("by", [(0.0, 0.0), (0.7, 0.2), (13.3, -2.9)])
def test_the_cell_that_is_named_fits_wherever_the_terrain_lies(memory, by):
    terrain = shifted(by, SURVEY)
    facets = len(terrain.triangles)
    with pytest.raises(InputError) as refused:
        check_memory(raster_over(terrain, 0.25), facets, memory, BYTES)
    cell = float(re.search(r"set cell to ([\d.]+)", str(refused.value))[1])
    check_memory(raster_over(terrain, cell), facets, memory, BYTES)


def test_a_cell_that_would_fit_only_if_the_terrain_began_on_its_border_is_not_named():
    flat = floor(SURVEY)
    wide = Terrain(flat.vertices * (42.0 / SIDE) + (20.0, 20.0, 0.0), flat.triangles, flat.zone, flat.zones, SURVEY)
    facets = len(flat.triangles)
    assert raster_over(wide, 20.0).nx == 4  # from -1 m to 41 m, and not 3 as from 0 m to 42 m
    memory = (facets + 10) * BYTES / 1e9
    with pytest.raises(InputError) as refused:
        check_memory(raster_over(wide, 0.25), facets, memory, BYTES)
    cell = float(re.search(r"set cell to ([\d.]+)", str(refused.value))[1])
    check_memory(raster_over(wide, cell), facets, memory, BYTES)


def test_where_the_facets_alone_need_more_no_cell_is_named_but_the_memory_that_does():
    terrain = floor()
    facets = len(terrain.triangles)
    with pytest.raises(InputError, match="no cell fits") as refused:
        check_memory(raster_over(terrain, 1.0), facets, 1e-4, BYTES)
    assert "set cell" not in str(refused.value)
    memory = float(re.search(r"facets alone need ([\d.]+) GB: set memory_gb to at least that", str(refused.value))[1])
    check_memory(raster_over(terrain, 2 * SIDE), facets, memory, BYTES)


def test_maps_that_fit_exactly_are_not_refused():
    raster = raster_over(floor(), 1.0)
    cells = raster.nx * raster.ny + 128
    check_memory(raster, 128, cells * BYTES / 1e9, BYTES)
    with pytest.raises(InputError):
        check_memory(raster, 128, (cells - 1) * BYTES / 1e9, BYTES)
