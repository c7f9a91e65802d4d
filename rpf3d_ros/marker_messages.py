"""Trajectories and hazard zones -> visualization_msgs/MarkerArray; `marker_reading` reads them.

Every array begins with DELETEALL, so that nothing of an earlier event stays on the screen.
"""

import numpy as np
from geometry_msgs.msg import Point, Pose, Quaternion, Vector3
from numpy.typing import NDArray
from std_msgs.msg import ColorRGBA, Header
from visualization_msgs.msg import Marker, MarkerArray

from rpf3d_core.ensemble.colours import speed_colours
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.results import Columns

TRAJECTORIES, HAZARD = "trajectories", "hazard/"
"""Namespaces: one for all trajectories (id = rock), one for each hazard level."""

LINE_WIDTH = 0.3
"""Width of a trajectory on the screen (m): visible on a pit of 1 km, thinner than its rocks."""

HAZARD_COLOURS = {"passed": (1.0, 0.65, 0.0, 0.5), "stopped": (0.85, 0.1, 0.1, 0.8)}
"""Red, green, blue, opacity of the facets of a level."""


def trajectory_markers(header: Header, columns: Columns, most: int, points_each: int) -> MarkerArray:
    """A LINE_STRIP a rock, coloured by speed, of at most `most` rocks and `points_each` points; ends are kept.

    More rocks than `most` are thinned evenly; trajectories/points carries all of them.
    """
    strips = np.split(np.arange(len(columns["rock"])), np.flatnonzero(np.diff(columns["rock"])) + 1)
    strips = [strips[i] for i in evenly(len(strips), most)] if len(columns["rock"]) else []
    fastest = float(np.max(columns["speed"], initial=0.0))
    markers = [delete_all(header)]
    for strip in strips:
        rows = strip[evenly(len(strip), points_each)]
        marker = _marker(header, TRAJECTORIES, int(columns["rock"][rows[0]]), Marker.LINE_STRIP)
        marker.scale = Vector3(x=LINE_WIDTH)
        marker.color = ColorRGBA(r=1.0, g=1.0, b=1.0, a=1.0)
        marker.points = _points(np.stack([columns[name][rows] for name in "xyz"], axis=-1))
        marker.colors = _colours(columns["speed"][rows], fastest)
        markers.append(marker)
    return MarkerArray(markers=markers)


def hazard_marker(header: Header, level: str, corners: FloatArray) -> Marker:
    """The facets of a level, corners (F, 3, 3) m, as one TRIANGLE_LIST in namespace hazard/<level>."""
    marker = _marker(header, HAZARD + level, 0, Marker.TRIANGLE_LIST)
    marker.scale = Vector3(x=1.0, y=1.0, z=1.0)
    r, g, b, a = HAZARD_COLOURS[level]
    marker.color = ColorRGBA(r=r, g=g, b=b, a=a)
    marker.points = _points(corners.reshape(-1, 3))
    return marker


def hazard_markers(header: Header, hazard: dict[str, FloatArray]) -> MarkerArray:
    """One marker a level that has facets; RViz refuses a TRIANGLE_LIST without points."""
    filled = [hazard_marker(header, level, corners) for level, corners in hazard.items() if len(corners)]
    return MarkerArray(markers=[delete_all(header), *filled])


def delete_all(header: Header) -> Marker:
    """The marker that clears what earlier arrays of the topic have drawn."""
    return Marker(header=header, action=Marker.DELETEALL, pose=_identity())


def evenly(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` (>= 2) of the indices 0 .. count - 1, evenly spread, with the first and the last."""
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def _marker(header: Header, namespace: str, number: int, kind: int) -> Marker:
    return Marker(header=header, ns=namespace, id=number, type=kind, action=Marker.ADD, pose=_identity())


def _identity() -> Pose:
    return Pose(orientation=Quaternion(w=1.0))


def _points(points: FloatArray) -> list[Point]:
    return [Point(x=x, y=y, z=z) for x, y, z in points.tolist()]


def _colours(speed: FloatArray, fastest: float) -> list[ColorRGBA]:
    shares = speed_colours(speed, fastest) / 255.0
    return [ColorRGBA(r=r, g=g, b=b, a=1.0) for r, g, b in shares.tolist()]
