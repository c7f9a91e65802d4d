"""Read live areas of interest from PolygonStamped and PoseArray messages: rings in plan, map frame."""

import numpy as np
from geometry_msgs.msg import PolygonStamped, PoseArray

from rpf3d_core.errors import InputError
from rpf3d_core.live.areas import circles_around, outline_of, too_small
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_ros.messages.map_frame import FARTHEST, MapFrame
from rpf3d_ros.messages.refusals import MessageRefused
from rpf3d_ros.messages.source_reading import positions_of

LIVE_AREA, EQUIPMENT = "live_area", "equipment"
"""Names of the areas that areas/polygon and areas/equipment define."""

MOST_CORNERS, MOST_EQUIPMENT = 10_000, 1_000
"""Largest number of corners, and of poses, in one message.

A hand-drawn haul road has dozens of corners, and a mine has a few hundred machines.
"""


def rings_of_polygon(polygon: PolygonStamped, frame: MapFrame) -> list[FloatArray]:
    """Return the outline of a live area of interest from a polygon message: rings of P points (P, 2) m, map frame.

    A polygon without corners deletes the area: the result is then empty.

    Raises MessageRefused in the cases of `MapFrame.points`, for corners that are not finite, are too many or form no
    polygon, and for an area that is too small (`live.areas.too_small`). Also refused are received x, y beyond
    `FARTHEST`, because float32 has lost centimetres there, and corners of equal height in a tilted frame: their heights
    are probably missing, and without heights the places in plan are unknown.
    """
    frame.check(polygon.header.frame_id)
    corners = polygon.polygon.points
    _check_number(len(corners), MOST_CORNERS, "corners")
    if not corners:
        return []
    points = np.array([(p.x, p.y, p.z) for p in corners], dtype=np.float64)
    _check_finite(points, "corner")
    if bool(np.any(np.abs(points[:, :2]) > FARTHEST)):
        raise MessageRefused(
            f"the polygon has float32 coordinates beyond {FARTHEST:.0e} m, which have lost centimetres or more; "
            f"subtract map_origin and publish them in frame '{frame.name}'"
        )
    if len(points) < 3:
        raise MessageRefused(
            f"the polygon has {len(points)} corners; it must have at least 3, or 0 to remove the area"
        )
    if bool(np.ptp(points[:, 2]) == 0.0) and frame.tilts(polygon.header.frame_id):
        raise MessageRefused("an outline without heights in a tilted frame has no place in plan")
    plan = frame.points(points, polygon.header.frame_id)[:, :2]
    try:
        rings = outline_of([(x, y) for x, y in plan.tolist()])
    except InputError as refusal:
        raise MessageRefused(f"the polygon {refusal}") from None
    if fault := too_small(rings):
        raise MessageRefused(f"the polygon {fault}")
    return rings


def rings_of_equipment(poses: PoseArray, frame: MapFrame, radius: float) -> list[FloatArray]:
    """Return the outlines of the area within a radius (m) of the poses of machines: rings (P, 2) m, in plan, map frame.

    Overlapping circles are joined. The list is empty if the message has no poses.

    Raises MessageRefused in the cases of `MapFrame.points`, and for poses that are not finite or too many.
    """
    frame.check(poses.header.frame_id)
    _check_number(len(poses.poses), MOST_EQUIPMENT, "poses")
    if not poses.poses:
        return []
    points = positions_of(poses)
    _check_finite(points, "pose")
    return circles_around(frame.points(points, poses.header.frame_id)[:, :2], radius)


def _check_number(count: int, most: int, what: str) -> None:
    if count > most:
        raise MessageRefused(f"the message has {count:,} {what}; at most {most:,} are allowed")


def _check_finite(points: FloatArray, what: str) -> None:
    finite = np.isfinite(points).all(axis=1)
    if not bool(finite.all()):
        raise MessageRefused(f"{what} {int(np.flatnonzero(~finite)[0])} is not finite")
