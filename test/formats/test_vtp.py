"""Tests of VTP files, read with VTK and compared with the flights."""

import numpy as np
import pytest
from flights.flights_on_a_floor import FRAMES, SOURCES, floor, none_thrown, thrown
from hazards.hazard_layers import laid_out, lines_of_rocks, maps_of
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonCore import VTK_DOUBLE
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader

from rpf3d_core.ensemble.paths import sample_paths
from rpf3d_core.formats import vtp as vtp_file
from rpf3d_core.formats.vtp import PolyData, Scattered, write_poly_data
from rpf3d_core.results.trace_map import write_terrain, write_trajectories


@pytest.fixture(params=FRAMES, ids=lambda frame: f"{frame.up}-up at {frame.origin[0]:.0f}")
def terrain(request):
    return floor(request.param)


def read(path):
    reader = vtkXMLPolyDataReader()
    reader.SetFileName(str(path))
    reader.Update()
    assert reader.GetErrorCode() == 0
    return reader.GetOutput()


def array(attributes, name):
    return vtk_to_numpy(attributes.GetArray(name))


def names_of(data, field):
    strings = data.GetFieldData().GetAbstractArray(field)
    return [strings.GetValue(i) for i in range(strings.GetNumberOfValues())]


def test_the_terrain_comes_back_in_double_precision_and_input_coordinates(terrain, tmp_path):
    write_terrain(tmp_path / "terrain.vtp", terrain, thrown(terrain).impacts)
    data = read(tmp_path / "terrain.vtp")
    assert data.GetPoints().GetDataType() == VTK_DOUBLE
    np.testing.assert_array_equal(
        vtk_to_numpy(data.GetPoints().GetData()), terrain.frame.points_to_input(terrain.vertices)
    )
    corners = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
    np.testing.assert_array_equal(corners, terrain.triangles)


def test_the_trace_map_counts_the_impacts_of_each_facet(terrain, tmp_path):
    impacts = thrown(terrain).impacts
    write_terrain(tmp_path / "terrain.vtp", terrain, impacts)
    cells = read(tmp_path / "terrain.vtp").GetCellData()
    expected = np.zeros(len(terrain.triangles), dtype=int)
    for facet in impacts.facet:
        expected[facet] += 1
    assert expected.max() > 1
    np.testing.assert_array_equal(array(cells, "impacts"), expected)
    np.testing.assert_array_equal(array(cells, "hit"), expected > 0)
    np.testing.assert_array_equal(array(cells, "facet"), np.arange(len(expected)))
    np.testing.assert_array_equal(array(cells, "zone"), terrain.zone)


def test_zone_names_are_field_data(terrain, tmp_path):
    write_terrain(tmp_path / "terrain.vtp", terrain, thrown(terrain).impacts)
    assert names_of(read(tmp_path / "terrain.vtp"), "zone_names") == ["bench_1", "floor"]


def test_hazard_lies_on_the_facets_by_the_names_of_the_rasters(terrain, tmp_path):
    maps = maps_of(terrain, lines_of_rocks(terrain), 2.0)
    write_terrain(tmp_path / "terrain.vtp", terrain, none_thrown().impacts, maps)
    cells, facets = read(tmp_path / "terrain.vtp").GetCellData(), laid_out(maps.facets)
    np.testing.assert_array_equal(array(cells, "reach_probability"), (facets.rocks / 300).astype(np.float32))
    np.testing.assert_array_equal(array(cells, "first_arrival_s"), facets.first_arrival.astype(np.float32))
    for name in ("passages", "deposits", "impacts"):  # counts of all rocks, not only of the stored impacts
        np.testing.assert_array_equal(array(cells, name), getattr(facets, name))
    np.testing.assert_array_equal(array(cells, "hit"), facets.impacts > 0)
    assert facets.impacts.max() > 0 and facets.deposits.max() > 0
    for quantity, spread in (("energy_j", facets.energy), ("speed_m_s", facets.speed), ("height_m", facets.height)):
        for name in ("max", "mean", "p50", "p90", "p95", "p99"):
            found, expected = array(cells, f"{quantity}_{name}"), getattr(spread, name.replace("max", "largest"))
            assert found.dtype == np.float32 and np.isfinite(found).any()
            np.testing.assert_array_equal(found, expected.astype(np.float32))
    np.testing.assert_array_equal(array(cells, "zone"), terrain.zone)


def test_without_maps_there_is_nothing_but_the_trace_map(tmp_path):
    terrain = floor()
    write_terrain(tmp_path / "terrain.vtp", terrain, thrown(terrain).impacts)
    cells = read(tmp_path / "terrain.vtp").GetCellData()
    found = {cells.GetArrayName(number) for number in range(cells.GetNumberOfArrays())}
    assert found == {"facet", "zone", "impacts", "hit"}


def test_trajectories_are_a_line_a_rock_with_speed_time_rock_and_mode(terrain, tmp_path):
    flights = thrown(terrain)
    samples = sample_paths(flights.paths, [1, 5])
    write_trajectories(tmp_path / "t.vtp", SOURCES, terrain, flights.deposits, samples)
    data = read(tmp_path / "t.vtp")
    points = data.GetPointData()
    assert data.GetNumberOfLines() == 2
    assert data.GetPoints().GetDataType() == VTK_DOUBLE
    np.testing.assert_array_equal(vtk_to_numpy(data.GetPoints().GetData()), terrain.frame.points_to_input(samples.x))
    np.testing.assert_array_equal(array(points, "time"), samples.t)
    np.testing.assert_array_equal(array(points, "speed"), samples.speed)
    np.testing.assert_array_equal(array(points, "mode"), samples.mode)
    np.testing.assert_array_equal(array(points, "rock"), flights.deposits.rock[samples.row])
    np.testing.assert_array_equal(array(data.GetCellData(), "outcome"), [0, 1])
    np.testing.assert_array_equal(array(data.GetCellData(), "row"), [1, 5])
    assert names_of(data, "source_names") == SOURCES
    assert names_of(data, "mode_names")[:2] == ["flight", "settling"]


def test_each_line_holds_the_points_of_its_own_rock(tmp_path):
    terrain = floor()
    flights = thrown(terrain)
    samples = sample_paths(flights.paths)
    write_trajectories(tmp_path / "t.vtp", SOURCES, terrain, flights.deposits, samples)
    lines = read(tmp_path / "t.vtp").GetLines()
    offsets = vtk_to_numpy(lines.GetOffsetsArray())
    for i in range(6):
        own = vtk_to_numpy(lines.GetConnectivityArray())[offsets[i] : offsets[i + 1]]
        np.testing.assert_array_equal(own, np.flatnonzero(samples.row == i))


def test_no_rocks_are_a_trace_map_without_traces_and_no_lines(tmp_path):
    terrain, flights = floor(), none_thrown()
    write_terrain(tmp_path / "terrain.vtp", terrain, flights.impacts)
    write_trajectories(tmp_path / "t.vtp", SOURCES, terrain, flights.deposits, sample_paths(flights.paths))
    assert array(read(tmp_path / "terrain.vtp").GetCellData(), "hit").max() == 0
    assert read(tmp_path / "t.vtp").GetNumberOfLines() == 0


def test_a_file_that_cannot_be_written_is_an_error(tmp_path):
    with pytest.raises(OSError, match="could not be written"):
        write_terrain(tmp_path / "nowhere" / "terrain.vtp", floor(), none_thrown().impacts)


def test_a_file_of_many_blocks_comes_back_whole_whatever_few_cells_differ(tmp_path, monkeypatch):
    monkeypatch.setattr(vtp_file, "BLOCK", 64)  # 16 whole numbers
    terrain = floor(cells=7)
    count, cell = len(terrain.triangles), np.array([0, 15, 16, 97])
    assert count == 98, "the last block is a part of one"
    few = Scattered(count, cell, np.array([3, 2**31 - 1, 7, 1]), 0)
    some = few._replace(values=np.array([0.5, np.nan, np.inf, -1.0], np.float32), elsewhere=np.nan)
    none = few._replace(cell=cell[:0], values=np.empty(0), elsewhere=-2.5)
    every = np.arange(count) * 1000
    names = {"of_zones": ["berm", "Böschung & <ramp>", ""]}
    data = {"few": few, 'so "me': some, "none": none, "every": every}
    ends, corners = np.arange(3, 3 * count + 1, 3, dtype=np.int32), terrain.triangles.ravel()
    path = tmp_path / "mesh.vtp"
    write_poly_data(path, PolyData(terrain.vertices, "Polys", ends, corners, {}, data, names))
    found = read(path)
    cells, laid_out = found.GetCellData(), np.zeros(count, int)
    laid_out[cell] = few.values
    np.testing.assert_array_equal(array(cells, "few"), laid_out)
    partly = np.full(count, np.nan, np.float32)
    partly[cell] = some.values
    np.testing.assert_array_equal(array(cells, 'so "me'), partly)
    np.testing.assert_array_equal(array(cells, "none"), np.full(count, -2.5))
    np.testing.assert_array_equal(array(cells, "every"), every)
    np.testing.assert_array_equal(vtk_to_numpy(found.GetPoints().GetData()), terrain.vertices)
    np.testing.assert_array_equal(vtk_to_numpy(found.GetPolys().GetConnectivityArray()), corners)
    assert names_of(found, "of_zones") == names["of_zones"] and cells.GetScalars().GetName() == "few"
