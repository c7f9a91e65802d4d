"""Read the reach probabilities of the map cells from a nav_msgs/OccupancyGrid; every size is checked.

The message may be an object of rclpy or, if read from a bag, of rosbags.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused

if TYPE_CHECKING:
    from nav_msgs.msg import OccupancyGrid


def percent_of_grid(grid: "OccupancyGrid", frame: MapFrame) -> NDArray[np.int8]:
    """Return the reach probability of a grid message in percent (H, W); -1 if unknown.

    The first row is the southernmost row, and the first column the westernmost column.

    Raises MessageRefused for a foreign frame, for a grid without cells, for a size that does not match the data, for a
    resolution that is not above 0 m, and for values outside -1 to 100.
    """
    frame.check(grid.header.frame_id)
    width, height = grid.info.width, grid.info.height
    if width * height == 0 or len(grid.data) != width * height:
        raise MessageRefused(f"the grid is {width} x {height} cells and holds {len(grid.data)} values")
    if not math.isfinite(grid.info.resolution) or grid.info.resolution <= 0.0:
        raise MessageRefused(f"the resolution of the grid is {grid.info.resolution}; it must be above 0 m")
    percent = np.array(grid.data, dtype=np.int8).reshape(height, width)
    if bool((percent < -1).any()) or bool((percent > 100).any()):
        raise MessageRefused("the grid holds values beyond -1 (unknown) and 0 to 100 percent")
    return percent
