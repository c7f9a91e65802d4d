"""Write a visualization_msgs/MarkerArray directly as CDR bytes (the byte format of ROS messages), to save time.

A hundred thousand triangles take half a second as Python objects and a few milliseconds as bytes.
Layout (OMG XCDR1, little endian): 00 01 00 00, then all fields. Offsets count from the first field. Every number
starts at a multiple of its own size; strings and sequences follow their length. The fields have the order of
visualization_msgs/Marker.msg (Jazzy).
"""

import struct
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from std_msgs.msg import Header
from visualization_msgs.msg import Marker

from rpf3d_core.terrain.frame import FloatArray

LITTLE_ENDIAN_CDR = bytes((0, 1, 0, 0))
NO_POINTS = np.empty((0, 3))
NO_COLOURS = np.empty((0, 4), dtype=np.float32)
WHITE = (1.0, 1.0, 1.0, 1.0)

LENGTH = struct.Struct("<I")
KIND = struct.Struct("<iii")
POSE_AND_SCALE = struct.Struct("<10d")
COLOUR = struct.Struct("<4f")
STAMP = struct.Struct("<iI")
IDENTITY = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
"""Position x, y, z and orientation x, y, z, w of a marker that does not move its points."""


class Layout(NamedTuple):
    """The fields of a marker that rpf3d sets; all others are zero or empty, and the pose does not move the points.

    namespace, number, text : `ns`, `id` and `text` of the marker
    kind, action : type and action of visualization_msgs/Marker
    scale : sizes x, y, z (m), with the meaning of Marker.msg for this type, such as x for the width of lines
    colour : red, green, blue, opacity, 0 to 1
    points : (N, 3) m
    colours : (N, 4) red, green, blue, opacity, 0 to 1; (0, 4) if `colour` applies to all points
    """

    namespace: str = ""
    number: int = 0
    kind: int = Marker.ARROW
    action: int = Marker.ADD
    scale: tuple[float, float, float] = (0.0, 0.0, 0.0)
    colour: tuple[float, float, float, float] = (0.0, 0.0, 0.0, 0.0)
    points: FloatArray = NO_POINTS
    colours: NDArray[np.float32] = NO_COLOURS
    text: str = ""


CLEARING = Layout(action=Marker.DELETEALL)
"""A marker that deletes everything that earlier messages of the topic have drawn."""


def cdr_of_markers(header: Header, markers: Sequence[Layout]) -> bytes:
    """Return the bytes of a MarkerArray whose markers share one header, ready for `Publisher.publish`."""
    data = bytearray(LENGTH.pack(len(markers)))
    heads = {name: _head(header, name) for name in {marker.namespace for marker in markers}}
    tails = {text: _tail(text) for text in {marker.text for marker in markers}}
    for marker in markers:
        _align(data, 4)
        data += heads[marker.namespace]
        _append_middle(data, marker)
        data += tails[marker.text]
    return LITTLE_ENDIAN_CDR + bytes(data)


def _head(header: Header, namespace: str) -> bytes:
    """Return the bytes of a marker's first fields, up to its namespace.

    The bytes must begin at a multiple of 4 bytes, and end at a multiple of 4 bytes.
    """
    data = bytearray(STAMP.pack(header.stamp.sec, header.stamp.nanosec))
    _append_string(data, header.frame_id)
    _append_string(data, namespace)
    _align(data, 4)
    return bytes(data)


def _append_middle(data: bytearray, marker: Layout) -> None:
    """Append the middle fields of a marker, which differ between markers: number, type, points and colours.

    Afterwards, `data` ends at a multiple of 4 bytes.
    """
    data += KIND.pack(marker.number, marker.kind, marker.action)
    _align(data, 8)
    data += POSE_AND_SCALE.pack(*IDENTITY, *marker.scale)
    data += COLOUR.pack(*marker.colour)
    data += STAMP.pack(0, 0)  # lifetime: until the marker is deleted
    data += b"\0"  # frame_locked
    _append_array(data, marker.points, "<f8")
    _append_array(data, marker.colours, "<f4")


def _tail(text: str) -> bytes:
    """Return the bytes of a marker's fields after `colors`, with its text; they must begin at a multiple of 4 bytes."""
    data = bytearray()
    _append_string(data, "")  # texture_resource
    _align(data, 4)
    data += STAMP.pack(0, 0)  # texture.header, .format, .data
    _append_string(data, "")
    _append_string(data, "")
    _append_length(data, 0)
    _append_length(data, 0)  # uv_coordinates
    _append_string(data, text)
    _append_string(data, "")  # mesh_resource
    _append_string(data, "")  # mesh_file.filename, .data
    _append_length(data, 0)
    data += b"\0"  # mesh_use_embedded_materials
    return bytes(data)


def _align(data: bytearray, size: int) -> None:
    data += bytes(-len(data) % size)


def _append_length(data: bytearray, length: int) -> None:
    _align(data, LENGTH.size)
    data += LENGTH.pack(length)


def _append_string(data: bytearray, text: str) -> None:
    """Append a text as CDR bytes: its length, which counts a final zero byte, and the text."""
    encoded = text.encode() + b"\0"
    _append_length(data, len(encoded))
    data += encoded


def _append_array(data: bytearray, rows: NDArray[np.floating], kind: str) -> None:
    """Append rows of numbers as CDR bytes: the number of rows, then the rows; kind : NumPy type of the numbers."""
    _append_length(data, len(rows))
    if len(rows):
        numbers = np.ascontiguousarray(rows, dtype=kind)
        _align(data, numbers.itemsize)
        data += numbers.tobytes()
