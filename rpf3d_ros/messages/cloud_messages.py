"""Convert named columns to a PointCloud2; `cloud_reading` does the reverse."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from rpf3d_core.live.survey import GridSurvey


def cloud_of_columns(header: Header, columns: Mapping[str, NDArray[Any]]) -> PointCloud2:
    """Return a point cloud message with one field for each column.

    All columns have the same shape: (N,) for an unorganised cloud, (H, W) for an organised cloud. Floats become
    FLOAT32, integers UINT32. A cloud with a NaN or an infinite value in any column is marked as not dense.
    """
    shape = next(iter(columns.values())).shape
    height, width = shape if len(shape) == 2 else (1, *shape)
    layout = np.dtype([(name, _published_type(column)) for name, column in columns.items()])
    points = np.empty(shape, dtype=layout)
    for name, column in columns.items():
        points[name] = column
    return PointCloud2(
        header=header,
        height=int(height),
        width=int(width),
        fields=[_published_field(name, layout) for name in columns],
        is_bigendian=False,
        point_step=layout.itemsize,
        row_step=layout.itemsize * int(width),
        data=points.tobytes(),  # rclpy copies an ndarray element by element, but not bytes
        is_dense=all(bool(np.isfinite(column).all()) for column in columns.values()),
    )


def cloud_of_grid(header: Header, survey: GridSurvey) -> PointCloud2:
    """Return a survey of points in rows as an organised point cloud, float32; NaN marks a hole."""
    return cloud_of_columns(header, {name: survey.points[..., i] for i, name in enumerate("xyz")})


def _published_type(column: NDArray[Any]) -> str:
    return "<f4" if column.dtype.kind == "f" else "<u4"


def _published_field(name: str, layout: np.dtype[Any]) -> PointField:
    datatype = PointField.FLOAT32 if layout[name].kind == "f" else PointField.UINT32
    fields = layout.fields
    assert fields is not None  # the layout has named fields
    offset = fields[name][1]
    return PointField(name=name, offset=offset, datatype=datatype, count=1)
