"""The place in plan where parameter sets were calibrated, and whether other rocks start far from this place."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray


class Surroundings(NamedTuple):
    """A rectangle in plan around the releases and the observed stops of a calibration.

    west, east : m, smallest and largest x; south, north : m, smallest and largest y

    The coordinates are those of the input with z upwards, so that all runs over the same pit have the same coordinates.
    """

    west: float
    south: float
    east: float
    north: float


def place_around(points: ArrayLike) -> Surroundings:
    """Return the rectangle around points (N, 2) m."""
    low, high = np.min(points, axis=0), np.max(points, axis=0)
    return Surroundings(west=float(low[0]), south=float(low[1]), east=float(high[0]), north=float(high[1]))


def share_away(place: Surroundings, points: ArrayLike) -> float:
    """Return the share (-) of points (N, 2) m, N > 0, that lie far from a place (see `are_away`)."""
    return float(are_away(place, points).mean())


def are_away(place: Surroundings, points: ArrayLike) -> NDArray[np.bool_]:
    """Return flags (N,), True for each point that lies far from a place.

    "Far" means: the distance from the rectangle of the place is more than the diagonal of the rectangle.

    place : a rectangle in plan; points : (N, 2) m, in the same coordinates
    """
    x, y = np.asarray(points, dtype=float).T
    away_x = np.maximum(np.maximum(place.west - x, x - place.east), 0.0)
    away_y = np.maximum(np.maximum(place.south - y, y - place.north), 0.0)
    diagonal = np.hypot(place.east - place.west, place.north - place.south)
    return np.asarray(np.hypot(away_x, away_y) > diagonal)
