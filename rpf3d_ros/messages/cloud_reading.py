"""Read named columns from a PointCloud2; every length of a received cloud is checked before use.

Messages are read by the names of their fields, so they may be objects of rclpy or, if read from a bag, of rosbags.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.map_frame import FARTHEST
from rpf3d_ros.messages.refusals import MessageRefused

if TYPE_CHECKING:
    from sensor_msgs.msg import PointCloud2, PointField

DATATYPES: dict[int, str] = {
    1: "i1",
    2: "u1",
    3: "i2",
    4: "u2",
    5: "i4",
    6: "u4",
    7: "f4",
    8: "f8",
}
"""The NumPy type, without byte order, of each data type of a point cloud (sensor_msgs/PointField.msg)."""

POSITION = ("x", "y", "z")
SMALLEST = 1e-36
"""Least size (m) of a coordinate other than 0; bytes in the wrong order often give smaller numbers."""


def columns_of_cloud(cloud: "PointCloud2", names: Sequence[str]) -> dict[str, NDArray[Any]]:
    """Return the named fields of a point cloud as columns (height, width), without copying the data.

    Each column has the type of its field.

    Raises MessageRefused in the cases of `check_sizes`, and if a field is missing, occurs twice, has an unknown type,
    has more than one value, or ends beyond the bytes of a point (`point_step`).
    """
    check_sizes(cloud)
    fields = [_field(cloud, name) for name in names]
    order = ">" if cloud.is_bigendian else "<"
    layout = np.dtype(
        {
            "names": list(names),
            "formats": [order + DATATYPES[field.datatype] for field in fields],
            "offsets": [field.offset for field in fields],
            "itemsize": cloud.point_step,
        }
    )
    shape, strides = (cloud.height, cloud.width), (cloud.row_step, cloud.point_step)
    points = np.ndarray(shape=shape, dtype=layout, buffer=memoryview(cloud.data), strides=strides)
    return {name: points[name] for name in names}


def positions_of_cloud(cloud: "PointCloud2") -> FloatArray:
    """Return the positions (height, width, 3) m of a point cloud in float64, in the frame of the cloud.

    Only a cloud that is not dense may contain NaN.

    Raises MessageRefused in the cases of `columns_of_cloud`, and also:
    for x, y, z that are not floating point; for infinite points; for NaN in a cloud that is marked as dense; for
    float32 coordinates beyond `FARTHEST`, which have already lost centimetres; and for coordinates below `SMALLEST`
    that are not 0, which are probably bytes in the wrong order.
    """
    columns = columns_of_cloud(cloud, POSITION)
    for name, column in columns.items():
        if column.dtype.kind != "f":
            raise MessageRefused(f"field '{name}' is {column.dtype.name}; it must be FLOAT32 or FLOAT64")
    points = np.stack([columns[name].astype(np.float64) for name in POSITION], axis=-1)
    _check_positions(points, bool(cloud.is_dense), narrow=any(c.dtype.itemsize == 4 for c in columns.values()))
    return points


def check_sizes(cloud: "PointCloud2") -> None:
    """Check the sizes that a cloud states for itself, without reading its points.

    Raises MessageRefused for a cloud without points, for several rows with a `row_step` that is too short for their
    points, for data shorter than the announced sizes, and for data with room for a further point: the publisher may
    have announced too few points, and the rest would be lost silently.
    """
    if cloud.width * cloud.height == 0 or cloud.point_step == 0:
        raise MessageRefused("the cloud holds no points; width, height and point_step must be at least 1")
    row = cloud.width * cloud.point_step
    if cloud.height > 1 and cloud.row_step < row:
        raise MessageRefused(f"row_step is {cloud.row_step}, but {cloud.width} points need {row}")
    needed = (cloud.height - 1) * cloud.row_step + row
    if len(cloud.data) < needed:
        raise MessageRefused(f"data holds {len(cloud.data)} bytes; width, height and steps announce {needed}")
    whole = max(needed, cloud.height * cloud.row_step)  # the last row, too, may be filled up
    if len(cloud.data) - whole >= cloud.point_step:
        raise MessageRefused(
            f"data holds {len(cloud.data)} bytes, room for more points than width, height and steps announce: {whole}"
        )


def _field(cloud: "PointCloud2", name: str) -> "PointField":
    found = [field for field in cloud.fields if field.name == name]
    if len(found) != 1:
        present = ", ".join(field.name for field in cloud.fields) or "none"
        raise MessageRefused(f"the cloud must have one field '{name}'; its fields are: {present}")
    field = found[0]
    if field.datatype not in DATATYPES:
        raise MessageRefused(f"field '{name}' has datatype {field.datatype}; sensor_msgs/PointField knows 1 to 8")
    if field.count > 1:
        raise MessageRefused(f"field '{name}' has count {field.count}; it must be 1")
    if field.offset + np.dtype(DATATYPES[field.datatype]).itemsize > cloud.point_step:
        raise MessageRefused(f"field '{name}' at {field.offset} ends outside the point of {cloud.point_step} bytes")
    return field


def _check_positions(points: FloatArray, dense: bool, narrow: bool) -> None:
    sizes = np.abs(points)
    if bool(np.any((sizes < SMALLEST) & (sizes > 0.0))):
        raise MessageRefused(
            f"the cloud holds coordinates below {SMALLEST:.0e} m that are not 0: is its byte order as is_bigendian "
            "says?"
        )
    if bool(np.isinf(points).any()):
        raise MessageRefused("the cloud holds infinite coordinates; mark a missing point by NaN and is_dense = false")
    if dense and bool(np.isnan(points).any()):
        raise MessageRefused("the cloud has NaN points but is_dense is true; set is_dense to false")
    if narrow and bool(np.any(sizes > FARTHEST)):
        raise MessageRefused(
            f"the cloud holds float32 coordinates beyond {FARTHEST:.0e} m, which have lost centimetres; "
            f"publish them as float64, or subtract map_origin"
        )
