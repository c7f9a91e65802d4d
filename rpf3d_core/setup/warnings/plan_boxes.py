"""Boxes in plan around inputs of a scene: whether two boxes overlap, and what the coordinates of a box look like."""

import numpy as np

from rpf3d_core.setup.coverage import plain
from rpf3d_core.setup.warnings.extents import Extent
from rpf3d_core.terrain.frame import FloatArray

EASTINGS, LEAST_NORTHING = (100_000.0, 900_000.0), 1_000_000.0
"""Range of UTM eastings (m), and a northing (m) that no easting reaches."""

Box = tuple[FloatArray, FloatArray]
"""Lower and upper corner (2,) m of a rectangle in plan."""


def plan_box(extent: Extent, up: str) -> Box:
    """Return the box in plan of an input; up : the axis that points up in the input."""
    axes = [0, 1] if up == "z" else [0, 2]
    return extent.low[axes], extent.high[axes]


def overlaps(first: Box, second: Box) -> bool:
    """Return True if two boxes in plan have at least a point in common."""
    return bool((first[0] <= second[1]).all() and (second[0] <= first[1]).all())


def swapped(box: Box) -> Box:
    """Return a box in plan with both axes swapped."""
    return box[0][::-1], box[1][::-1]


def looks_like_degrees(box: Box) -> bool:
    """Return True if all coordinates of a box can be longitudes and latitudes, in this order."""
    low, high = box
    limits = np.array([180.0, 90.0])
    return bool((low >= -limits).all() and (high <= limits).all())


def is_northing_first(box: Box) -> bool:
    """Return True if the first coordinates of a box can only be northings, and the second look like eastings."""
    low, high = box
    return bool(low[0] > LEAST_NORTHING and EASTINGS[0] < low[1] < high[1] < EASTINGS[1])


def is_near_the_origin(ground: Box) -> bool:
    """Return True if the middle of the terrain's box is nearer to the origin than the box is long (diagonal).

    Near the origin, an input in almost any unit would lie on the terrain, so scaled coordinates do not show the unit.
    """
    return bool(np.linalg.norm(0.5 * (ground[0] + ground[1])) < np.linalg.norm(ground[1] - ground[0]))


def box_in_words(low: FloatArray, high: FloatArray) -> str:
    """Return a box in plan as text, in whole metres; low, high : (2,) m, its corners."""
    return " and ".join(f"{axis} {plain(round(a))} to {plain(round(b))} m"
                        for axis, a, b in zip("xy", low.tolist(), high.tolist(), strict=True))  # fmt: skip
