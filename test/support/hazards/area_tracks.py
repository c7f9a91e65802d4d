"""Find the rocks that reach an area, from stored paths with shapely, as an independent check of the tallies."""

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon

from rpf3d_core.ensemble.flights import Flights, FloatArray
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.zones import in_plan


def plan_tracks(frame: Frame, flights: Flights) -> tuple[Any, NDArray[np.int64]]:
    """Return the tracks of rocks in plan as shapely lines (T,), and the row of the rock of each track (T,).

    Each rock has one track through its release, impacts and end, and a second track if its path was kept. An arc is a
    straight line in plan, so straight lines between the contacts of a flying rock are exact.
    """
    contacts, paths = _contacts(flights), (flights.paths.row, flights.paths.x)
    lines = [_lines(frame, *contacts), _lines(frame, *paths)]
    return np.concatenate([line for line, _ in lines]), np.concatenate([row for _, row in lines])


def reached(tracks: tuple[Any, NDArray[np.int64]], polygons: MultiPolygon, rocks: int) -> NDArray[np.bool_]:
    """Return a flag (R,) for each rock: True if a track of the rock intersects the polygons.

    tracks : as returned by `plan_tracks`; rocks : R
    """
    lines, row = tracks
    union = shapely.union_all(list(polygons.geoms))  # a multi-polygon with overlapping parts is not valid
    shapely.prepare(union)
    answer = np.zeros(rocks, dtype=bool)
    answer[row[shapely.intersects(union, lines)]] = True
    return answer


def _contacts(flights: Flights) -> tuple[NDArray[np.int64], FloatArray]:
    """Return release, impacts and end of all rocks, grouped by rock in order of time: rows (N,) and points (N, 3) m."""
    deposits, impacts = flights.deposits, flights.impacts
    every = np.arange(len(deposits.x))
    rows = np.concatenate([every, impacts.row, every])
    points = np.concatenate([deposits.release, impacts.x, deposits.x])
    order = np.argsort(rows, kind="stable")
    return rows[order], points[order]


def _lines(frame: Frame, row: NDArray[np.int64], points: FloatArray) -> tuple[Any, NDArray[np.int64]]:
    """Return one line in plan for each group of equal rows with at least two points, and the row of each line.

    row : (N,); points : (N, 3) m, local frame
    """
    rows, place, count = np.unique(row, return_inverse=True, return_counts=True)
    several = count[place] > 1
    if not several.any():
        return np.empty(0, dtype=object), np.empty(0, dtype=np.int64)
    kept, index = np.unique(place[several], return_inverse=True)
    return shapely.linestrings(in_plan(frame, points[several]), indices=index), rows[kept]
