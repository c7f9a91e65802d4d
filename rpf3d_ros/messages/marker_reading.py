"""Read lines and facets, map frame, from a visualization_msgs/MarkerArray.

The message may be an object of rclpy or, if read from a bag, of rosbags.
"""

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.map_frame import MapFrame
from rpf3d_ros.messages.refusals import MessageRefused

if TYPE_CHECKING:
    from visualization_msgs.msg import Marker, MarkerArray

HAZARD, AREAS = "hazard/", "areas/"
"""Prefixes of the namespaces of hazard zones and of areas of interest."""

ADD, LINE_STRIP, LINE_LIST, TRIANGLE_LIST = 0, 4, 5, 11
"""Numbers of the action ADD and of three types of markers (visualization_msgs/Marker.msg)."""


Colour = tuple[float, float, float, float]
"""A colour: red, green, blue and opacity, each from 0 to 1."""


class Strip(NamedTuple):
    """One drawn trajectory.

    points : (T, 3) m, map frame, T >= 2
    colours : (T, 4) red, green, blue, opacity, 0 to 255
    """

    points: FloatArray
    colours: NDArray[np.uint8]


def strips_of_markers(array: "MarkerArray", frame: MapFrame) -> list[Strip]:
    """Return the trajectories in a marker message, in the map frame: its lines with at least two points.

    Raises MessageRefused in the cases of `MapFrame.points`, for a marker whose pose moves the points, and for points or
    colours that are not finite.
    """
    lines = [marker for marker in _shapes(array, LINE_STRIP) if len(marker.points) > 1]
    return [Strip(_positions(line, frame), _received_colours(line)) for line in lines]


def facets_of_markers(array: "MarkerArray", frame: MapFrame) -> dict[str, tuple[FloatArray, Colour]]:
    """Return the facets of hazard zones in a marker message: namespace -> corners (F, 3, 3) m, and colour.

    The corners are in the map frame. Raises MessageRefused in the cases of `strips_of_markers`, and if the number of a
    marker's points is not a multiple of 3.
    """
    found = {}
    for marker in _shapes(array, TRIANGLE_LIST):
        points = _positions(marker, frame)
        if len(points) % 3:
            raise MessageRefused(f"TRIANGLE_LIST '{marker.ns}' has {len(points)} points; a triangle needs three")
        found[marker.ns] = (points.reshape(-1, 3, 3), _colour(marker))
    return found


def outlines_of_markers(array: "MarkerArray", frame: MapFrame) -> dict[str, tuple[list[FloatArray], Colour]]:
    """Return the outlines in a marker message: namespace -> lines (T, 3) m, map frame, and colour.

    Raises MessageRefused in the cases of `strips_of_markers`, and if a LINE_LIST has an odd number of points.
    """
    found: dict[str, tuple[list[FloatArray], Colour]] = {}
    for marker in _shapes(array, LINE_STRIP, LINE_LIST):
        points = _positions(marker, frame)
        if marker.type == LINE_LIST and len(points) % 2:
            raise MessageRefused(f"LINE_LIST '{marker.ns}' has {len(points)} points; a line needs two")
        lines = list(points.reshape(-1, 2, 3)) if marker.type == LINE_LIST else [points]
        found.setdefault(marker.ns, ([], _colour(marker)))[0].extend(lines)
    return found


def _shapes(array: "MarkerArray", *kinds: int) -> "Iterator[Marker]":
    return (marker for marker in array.markers if marker.action == ADD and marker.type in kinds)


def _colour(marker: "Marker") -> Colour:
    colour = (marker.color.r, marker.color.g, marker.color.b, marker.color.a)
    if not all(math.isfinite(share) for share in colour):
        raise MessageRefused(f"marker '{marker.ns}' {marker.id} has a colour that is not finite")
    red, green, blue, opacity = (min(max(share, 0.0), 1.0) for share in colour)
    return red, green, blue, opacity


def _received_colours(marker: "Marker") -> NDArray[np.uint8]:
    each = marker.colors if len(marker.colors) == len(marker.points) else [marker.color] * len(marker.points)
    shares = np.array([(c.r, c.g, c.b, c.a) for c in each])
    if not bool(np.isfinite(shares).all()):
        raise MessageRefused(f"marker '{marker.ns}' {marker.id} has colours that are not finite")
    return (255.0 * shares.clip(0.0, 1.0)).round().astype(np.uint8)


def _positions(marker: "Marker", frame: MapFrame) -> FloatArray:
    _check_pose(marker)
    points = np.array([(p.x, p.y, p.z) for p in marker.points], dtype=float).reshape(-1, 3)
    if not bool(np.isfinite(points).all()):
        raise MessageRefused(f"marker '{marker.ns}' {marker.id} has points that are not finite")
    return frame.points(points, marker.header.frame_id)


def _check_pose(marker: "Marker") -> None:
    """Refuse a pose that moves the points; an all-zero orientation counts as the identity, as in RViz."""
    at, turn = marker.pose.position, marker.pose.orientation
    if any((at.x, at.y, at.z, turn.x, turn.y, turn.z)) or abs(turn.w) not in (0.0, 1.0):
        raise MessageRefused(
            f"marker '{marker.ns}' {marker.id} has a pose that moves its points; it must be the identity"
        )
