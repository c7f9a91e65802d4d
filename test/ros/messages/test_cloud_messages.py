"""Tests of PointCloud2 <-> columns: round trips, and clouds whose header contradicts their data."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("rclpy", reason="ROS 2 (rclpy) is not installed; install the extra `ros`")

from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import PointCloud2, PointField
from std_msgs.msg import Header

from rpf3d_ros.messages.cloud_messages import cloud_of_columns
from rpf3d_ros.messages.cloud_reading import columns_of_cloud, positions_of_cloud
from rpf3d_ros.messages.map_frame import FARTHEST
from rpf3d_ros.messages.refusals import MessageRefused

FLOAT32_STEP = 2.0**-23
"""Relative step of float32: the largest relative error of a value that passes through a cloud."""

BEYOND = 2.0 * FARTHEST


def cloud(points, kind="<f4", dense=False, **changes):
    """Return a PointCloud2 of points (H, W, 3), with the columns x, y, z of type `kind`.

    changes : fields of the message that are set afterwards
    """
    layout = np.dtype([(name, kind) for name in "xyz"])
    data = np.zeros(points.shape[:2], layout)
    for i, name in enumerate("xyz"):
        data[name] = points[..., i]
    code = {"f4": PointField.FLOAT32, "f8": PointField.FLOAT64, "i4": PointField.INT32}[kind[1:]]
    size = layout.itemsize
    fields = [PointField(name=n, offset=layout.fields[n][1], datatype=code, count=1) for n in "xyz"]
    made = PointCloud2(
        header=Header(frame_id="map"), height=points.shape[0], width=points.shape[1], fields=fields, point_step=size,
        row_step=size * points.shape[1], data=data.tobytes(), is_dense=dense, is_bigendian=kind[0] == ">",
    )  # fmt: skip
    for name, value in changes.items():
        setattr(made, name, value)
    return made


def plane(height=3, width=4):
    """Return points (height, width, 3) of a tilted plane."""
    y, x = np.mgrid[0:height, 0:width].astype(float)
    return np.stack([x, y, 0.25 * x + 7.0], axis=-1)


@given(values=st.lists(st.floats(-1e5, 1e5, width=32), min_size=1, max_size=20), rock=st.integers(0, 2**32 - 1))
def test_columns_survive_a_cloud_and_its_serialisation(values, rock):
    sent = {"x": np.array(values), "rock": np.full(len(values), rock, dtype=np.int64)}
    message = deserialize_message(serialize_message(cloud_of_columns(Header(frame_id="map"), sent)), PointCloud2)
    back = columns_of_cloud(message, ("rock", "x"))
    assert np.array_equal(back["x"].ravel(), np.float32(values))
    assert (back["rock"] == rock).all()
    assert message.is_dense


@pytest.mark.parametrize("kind", ["<f4", "<f8", ">f4", ">f8"])
def test_positions_are_read_in_either_width_and_byte_order(kind):
    assert np.allclose(positions_of_cloud(cloud(plane(), kind)), plane(), rtol=FLOAT32_STEP, atol=0.0)


def test_rows_may_be_padded():
    wide = cloud(plane(3, 6))
    wide.width = 4
    assert np.array_equal(positions_of_cloud(wide), plane(3, 6)[:, :4])


def test_a_hole_is_nan_in_a_cloud_that_is_not_dense():
    points = plane()
    points[1, 2, 2] = np.nan
    assert np.isnan(positions_of_cloud(cloud(points)))[1, 2, 2]


def test_a_cloud_with_nan_is_published_as_not_dense():
    assert not cloud_of_columns(Header(), {"x": np.array([1.0, np.nan])}).is_dense


def test_a_dense_cloud_with_nan_points_is_refused():
    points = plane()
    points[0, 0] = np.nan
    with pytest.raises(MessageRefused, match="NaN points but is_dense is true"):
        positions_of_cloud(cloud(points, dense=True))


def test_infinite_points_are_refused():
    points = plane()
    points[0, 0, 2] = np.inf
    with pytest.raises(MessageRefused, match="infinite"):
        positions_of_cloud(cloud(points))


def test_float32_survey_coordinates_are_refused_and_float64_ones_are_not():
    points = plane() + np.array([BEYOND, 0.0, 0.0])
    with pytest.raises(MessageRefused, match="float32 coordinates beyond"):
        positions_of_cloud(cloud(points))
    assert np.array_equal(positions_of_cloud(cloud(points, "<f8")), points)


@pytest.mark.parametrize("kind", ["f4", "f8"])
def test_bytes_in_the_wrong_order_are_refused_although_they_are_numbers(kind):
    """Otherwise such sources would have coordinates below 1e-30 m: they would lie at the origin of the map."""
    message = cloud(np.full((1, 1, 3), 30.0), f"<{kind}")
    message.is_bigendian = True
    with pytest.raises(MessageRefused, match="is its byte order as is_bigendian says"):
        positions_of_cloud(message)


def test_integer_positions_are_refused():
    with pytest.raises(MessageRefused, match="'x' is int32; it must be FLOAT32 or FLOAT64"):
        positions_of_cloud(cloud(plane(), "<i4"))


def field(**changes):
    values = {"name": "x", "offset": 0, "datatype": PointField.FLOAT32, "count": 1} | changes
    return PointField(**values)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"width": 0}, "holds no points"),
        ({"height": 0}, "holds no points"),
        ({"point_step": 0}, "holds no points"),
        ({"width": 2**32 - 1}, "row_step is 48"),
        ({"height": 2**32 - 1}, "announce"),
        ({"width": 2**32 - 1, "height": 2**32 - 1, "row_step": 2**32 - 1}, "row_step is"),
        ({"point_step": 2**32 - 1, "height": 1}, "announce"),
        ({"row_step": 3}, "row_step is 3"),
        ({"row_step": 2**32 - 1}, "announce"),
        ({"data": b""}, "data holds 0 bytes"),
        ({"fields": []}, "must have one field 'x'; its fields are: none"),
        ({"fields": [field(), field()]}, "must have one field 'x'"),
        ({"fields": [field(datatype=9)]}, "datatype 9"),
        ({"fields": [field(count=2)]}, "count 2"),
        ({"fields": [field(offset=9)]}, "ends outside the point"),
        ({"fields": [field(offset=2**32 - 1)]}, "ends outside the point"),
    ],
)
def test_a_cloud_that_contradicts_itself_is_refused(changes, sentence):
    with pytest.raises(MessageRefused, match=sentence):
        columns_of_cloud(cloud(plane(), **changes), ("x",))


@given(
    sizes=st.tuples(*[st.integers(0, 2**32 - 1) | st.integers(0, 64)] * 5),
    kind=st.integers(0, 255),
    data=st.binary(max_size=200),
    big=st.booleans(),
)
def test_no_sizes_make_a_cloud_be_read_outside_its_data(sizes, kind, data, big):
    height, width, step, row, offset = sizes
    message = PointCloud2(
        height=height, width=width, point_step=step, row_step=row, data=data, is_bigendian=big,
        fields=[field(offset=offset, datatype=kind)],
    )  # fmt: skip
    try:
        column = columns_of_cloud(message, ("x",))["x"]
    except MessageRefused:
        return
    assert column.size * column.dtype.itemsize <= len(data) or row < step * width
    column.sum()
