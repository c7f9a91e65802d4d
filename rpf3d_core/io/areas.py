"""Areas of interest: which rocks came into them and which stayed."""

from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon

from rpf3d_core.ensemble.flights import Flights, FloatArray
from rpf3d_core.ensemble.statistics import share_of
from rpf3d_core.io.polygons import read_polygons
from rpf3d_core.io.scene_model import Scene
from rpf3d_core.terrain.facets import Terrain
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.terrain.zones import covered, in_plan
from rpf3d_core.values import DEPOSITED

REACHED_BY = (
    "a rock reached an area if its path crosses it in plan: release, impacts and end joined by straight lines, "
    "which is exact in flight, and the events of its path where that was kept"
)


def read_areas(scene: Scene) -> dict[str, MultiPolygon]:
    """The areas of interest by name, in the input's plan coordinates; `InputError` as `read_polygons`."""
    return {area.name: read_polygons(area.polygons) for area in scene.areas_of_interest}


def area_shares(terrain: Terrain, flights: Flights, areas: dict[str, MultiPolygon]) -> dict[str, Any]:
    """Of all rocks, the shares that reached each area and that stopped in it, with 95 % Wilson intervals."""
    if not areas:
        return {}
    tracks = plan_tracks(terrain.frame, flights)
    ends = in_plan(terrain.frame, flights.deposits.x)
    at_rest = np.isin(flights.deposits.outcome, DEPOSITED)
    rocks = len(at_rest)
    return {
        name: {
            "reached": share_of(int(reached(tracks, polygons, rocks).sum()), rocks),
            "stopped_inside": share_of(int((at_rest & covered(polygons, ends)).sum()), rocks),
        }
        for name, polygons in areas.items()
    }


def plan_tracks(frame: Frame, flights: Flights) -> tuple[Any, NDArray[np.int64]]:
    """Tracks in plan, one line (shapely) for each rock's contacts and each path that was kept, and the rock of each.

    In plan a flight is a straight line, so contacts joined by straight lines are its exact track.
    """
    contacts, paths = _contacts(flights), (flights.paths.row, flights.paths.x)
    lines = [_lines(frame, *contacts), _lines(frame, *paths)]
    return np.concatenate([line for line, _ in lines]), np.concatenate([row for _, row in lines])


def reached(tracks: tuple[Any, NDArray[np.int64]], polygons: MultiPolygon, rocks: int) -> NDArray[np.bool_]:
    """(R,) whether a track of the rock meets the polygons."""
    lines, row = tracks
    union = shapely.union_all(list(polygons.geoms))  # a multi-polygon whose parts overlap is not valid
    shapely.prepare(union)
    answer = np.zeros(rocks, dtype=bool)
    answer[row[shapely.intersects(union, lines)]] = True
    return answer


def local_outlines(frame: Frame, polygons: MultiPolygon) -> list[FloatArray]:
    """Outer and inner rings (N, 2) m in plan, local frame."""
    rings = [ring for polygon in polygons.geoms for ring in (polygon.exterior, *polygon.interiors)]
    return [_local_plan(frame, np.asarray(ring.coords)[:, :2]) for ring in rings]


def _local_plan(frame: Frame, plan: FloatArray) -> FloatArray:
    level = np.zeros(len(plan))
    columns = (plan[:, 0], plan[:, 1], level) if frame.up == "z" else (plan[:, 0], level, plan[:, 1])
    return frame.points_to_local(np.stack(columns, axis=1))[:, :2]


def _contacts(flights: Flights) -> tuple[NDArray[np.int64], FloatArray]:
    """Release, impacts and end of all rocks, as rows (N,) and points (N, 3), grouped by rock in order of time."""
    deposits, impacts = flights.deposits, flights.impacts
    every = np.arange(len(deposits.x))
    rows = np.concatenate([every, impacts.row, every])
    points = np.concatenate([deposits.release, impacts.x, deposits.x])
    order = np.argsort(rows, kind="stable")
    return rows[order], points[order]


def _lines(frame: Frame, row: NDArray[np.int64], points: FloatArray) -> tuple[Any, NDArray[np.int64]]:
    """One line in plan for each run of equal rows that has at least two points, and its row."""
    rows, place, count = np.unique(row, return_inverse=True, return_counts=True)
    several = count[place] > 1
    if not several.any():
        return np.empty(0, dtype=object), np.empty(0, dtype=np.int64)
    kept, index = np.unique(place[several], return_inverse=True)
    return shapely.linestrings(in_plan(frame, points[several]), indices=index), rows[kept]
