"""Tests of hazard maps -> OccupancyGrid and PointCloud2."""

import time

import numpy as np
import pytest

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from builtin_interfaces.msg import Time
from nav_msgs.msg import OccupancyGrid
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import Header
from suite.slowness import slowness

from rpf3d_core.hazard.maps import CellStatistics, HazardMaps, Layers, Raster
from rpf3d_core.live.cells import TerrainCells
from rpf3d_core.terrain.frame import Frame
from rpf3d_ros.messages.cloud_reading import columns_of_cloud
from rpf3d_ros.messages.hazard_messages import hazard_points, occupancy_grid, percentages

HEADER = Header(frame_id="map", stamp=Time(sec=3))
FRAME = Frame(origin=(100.0, 200.0, 50.0))
RASTER = Raster(-2.0, 4.0, 0.5, 3, 2)
"""A raster of two rows with three cells each."""
COVERED = np.array([True, True, False, True, True, True])
CELLS = TerrainCells(COVERED, np.array([1.0, 2.0, np.nan, 4.0, 5.0, 6.0], dtype=np.float32))

LARGE = 2000
"""Number of cells along a side of the raster of a large mine."""
QUICK = 0.1
"""Longest CPU time (s) to make the message; a Python loop over the cells takes a second."""


def spread(values):
    nan = np.full(len(values), np.nan, dtype=np.float32)
    return CellStatistics(nan, nan, nan, nan, np.array(values, dtype=np.float32), nan)


def maps(cell, rocks, flown, raster=RASTER):
    n = len(cell)
    zeros = np.zeros(n, dtype=np.int64)
    cells = Layers(
        raster.nx * raster.ny, np.array(cell, dtype=np.int64), np.array(rocks, dtype=np.int64), zeros, zeros, zeros,
        np.arange(n, dtype=np.float32), *[spread(1000.0 * np.arange(n))] * 3, 0.05,
    )  # fmt: skip
    return HazardMaps(flown, raster, cells, cells, cells, cells, ())


@pytest.mark.parametrize(
    ("rocks", "flown", "percent"),
    [(1, 1_000_000, 1), (1, 100, 1), (149, 10_000, 1), (151, 10_000, 2), (999, 1000, 100), (5, 5, 100)],
)
def test_a_cell_that_a_rock_came_to_is_never_shown_as_clear(rocks, flown, percent):
    assert percentages(maps([1], [rocks], flown), CELLS).tolist() == [0, percent, -1, 0, 0, 0]


def test_a_cell_without_ground_that_a_rock_came_to_is_known():
    assert percentages(maps([2], [1], 4), CELLS)[2] == 25


def test_nothing_flown_is_clear_where_there_is_ground():
    assert percentages(maps([], [], 0), CELLS).tolist() == [0, 0, -1, 0, 0, 0]


def test_the_grid_stands_where_the_raster_does_with_its_first_row_in_the_south():
    grid = occupancy_grid(HEADER, maps([0, 5], [1, 2], 2), CELLS, FRAME, Time(sec=9))
    at = grid.info.origin.position
    assert (at.x, at.y, at.z) == (98.0, 204.0, 51.0)
    assert (grid.info.width, grid.info.height, grid.info.resolution) == (3, 2, 0.5)
    assert np.array(grid.data).reshape(2, 3).tolist() == [[50, 0, -1], [0, 0, 100]]
    assert (grid.info.map_load_time.sec, grid.header.stamp.sec, grid.header.frame_id) == (9, 3, "map")


def test_the_grid_survives_its_way():
    grid = occupancy_grid(HEADER, maps([0, 5], [1, 2], 2), CELLS, FRAME, Time(sec=9))
    assert deserialize_message(serialize_message(grid), OccupancyGrid) == grid


def test_a_large_grid_is_not_iterated_over():
    raster = Raster(0.0, 0.0, 1.0, LARGE, LARGE)
    cells = TerrainCells(np.ones(LARGE * LARGE, dtype=bool), np.zeros(LARGE * LARGE, dtype=np.float32))
    flown = maps([7], [1], 10, raster)
    slow = slowness()
    began = time.process_time()
    serialize_message(occupancy_grid(HEADER, flown, cells, FRAME, Time()))
    assert (time.process_time() - began) / slow < QUICK


def test_points_stand_on_the_ground_in_the_middle_of_their_cells():
    cloud = hazard_points(HEADER, maps([1, 5], [3, 4], 8), CELLS, FRAME, 17)
    names = ("x", "y", "z", "reach_probability", "p95_energy", "first_arrival", "rocks", "result")
    columns = {name: column.ravel().tolist() for name, column in columns_of_cloud(cloud, names).items()}
    assert [field.name for field in cloud.fields] == list(names)
    assert columns == {
        "x": [98.75, 99.25], "y": [204.25, 204.75], "z": [52.0, 56.0], "reach_probability": [0.375, 0.5],
        "p95_energy": [0.0, 1000.0], "first_arrival": [0.0, 1.0], "rocks": [3, 4], "result": [17, 17],
    }  # fmt: skip


def test_no_rocks_are_a_cloud_without_points():
    assert hazard_points(HEADER, maps([], [], 0), CELLS, FRAME, 1).width == 0
