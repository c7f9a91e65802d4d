"""Convert the hazard maps of an ensemble to nav_msgs/OccupancyGrid and sensor_msgs/PointCloud2, map frame."""

from array import array

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import MapMetaData, OccupancyGrid
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header

from rpf3d_core.hazard.maps import HazardMaps, reach_probability
from rpf3d_core.live.cells import TerrainCells
from rpf3d_core.terrain.frame import FloatArray, Frame
from rpf3d_ros.messages.cloud_messages import cloud_of_columns

UNKNOWN, NOT_REACHED, LEAST_REACHED, PERCENT = -1, 0, 1, 100
"""Values of a map cell (%): no ground; no rock; least value of a cell with rocks; all rocks."""


def occupancy_grid(header: Header, maps: HazardMaps, cells: TerrainCells, frame: Frame, made: Time) -> OccupancyGrid:
    """Return the map of reach probability as a grid message, in percent, for RViz and navigation.

    Rows go northwards, and the cells of a row eastwards, from the south-west corner of the raster. The grid
    lies at the height of the lowest ground, so that it hides nothing.

    header : frame and stamp of the message; maps : the hazard maps of the result
    cells : which cells of the maps lie over ground, and the height of the ground
    frame : the terrain's local frame, z up
    made : time when the result was made
    """
    raster = maps.raster
    west, south, zero = frame.origin
    lowest = float(np.nanmin(cells.height, initial=np.inf)) if len(cells.height) else 0.0
    corner = Point(x=raster.x + west, y=raster.y + south, z=zero + (lowest if np.isfinite(lowest) else 0.0))
    info = MapMetaData(
        map_load_time=made, resolution=raster.cell, width=raster.nx, height=raster.ny,
        origin=Pose(position=corner, orientation=Quaternion(w=1.0)),
    )  # fmt: skip
    return OccupancyGrid(header=header, info=info, data=array("b", percentages(maps, cells).tobytes()))


def percentages(maps: HazardMaps, cells: TerrainCells) -> NDArray[np.int8]:
    """Return the reach probability of all C map cells, (C,) %, for the grid message; `UNKNOWN` without ground.

    A cell that at least one rock reached has at least `LEAST_REACHED`, however low its probability.
    """
    shown = np.where(cells.covered, np.int8(NOT_REACHED), np.int8(UNKNOWN))
    share = np.round(PERCENT * reach_probability(maps.cells, maps.flown))
    shown[maps.cells.cell] = np.clip(share, LEAST_REACHED, PERCENT).astype(np.int8)
    return shown


def hazard_points(header: Header, maps: HazardMaps, cells: TerrainCells, frame: Frame, result: int) -> PointCloud2:
    """Return the map cells that rocks reached as a point cloud: one point in the middle of each cell, on the ground.

    Fields: x, y, z (m, map frame), reach_probability (-), p95_energy (J; NaN if fewer than 20 rocks reached the cell),
    first_arrival (s), rocks (number of rocks), result (number of the result).
    """
    layers = maps.cells
    points = _middles(maps, cells, frame)
    columns = {
        **{name: points[:, i] for i, name in enumerate("xyz")},
        "reach_probability": reach_probability(layers, maps.flown),
        "p95_energy": layers.energy.p95,
        "first_arrival": layers.first_arrival,
        "rocks": layers.rocks,
        "result": np.full(len(layers.cell), result, dtype=np.uint32),
    }
    return cloud_of_columns(header, columns)


def _middles(maps: HazardMaps, cells: TerrainCells, frame: Frame) -> FloatArray:
    """Return the centres (S, 3) m of the S map cells that rocks reached, on the ground, map frame."""
    raster, cell = maps.raster, maps.cells.cell
    row, column = np.divmod(cell, raster.nx)
    x, y = raster.x + (column + 0.5) * raster.cell, raster.y + (row + 0.5) * raster.cell
    return frame.points_to_input(np.stack([x, y, cells.height[cell].astype(np.float64)], axis=-1))
