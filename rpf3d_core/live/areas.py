"""Areas of interest that arrive in messages while the simulator runs: outlines, and circles around vehicles."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.formats.polygons import polygon_of
from rpf3d_core.terrain.facets import IntArray
from rpf3d_core.terrain.frame import FloatArray

CORNERS_A_QUARTER = 8
"""Corners per quarter of a circle drawn as a polygon, which differs by at most 0.5 % of the radius from the circle."""


def outline_of(corners: Sequence[tuple[float, float]]) -> list[FloatArray]:
    """Return the outlines (P, 2) m of an area of interest; corners : at least three, (x, y) in plan, m.

    Raises
    ------
    InputError
        The outline crosses itself or encloses no area.
    """
    return _rings(polygon_of(corners))


def circles_around(places: FloatArray, radius: float) -> list[FloatArray]:
    """Return the outlines (P, 2) m of the area within circles around places (N, 2) m, such as vehicles.

    Overlapping circles form one area. Outlines of holes are included. Each circle is drawn as a polygon that encloses
    the circle, so a rock on the circle is counted. radius : of the circles, m
    """
    drawn = radius / np.cos(np.pi / (4 * CORNERS_A_QUARTER))
    circles = shapely.buffer(shapely.points(places), drawn, quad_segs=CORNERS_A_QUARTER)
    return _rings(shapely.union_all(circles))


def _rings(area: shapely.Geometry) -> list[FloatArray]:
    rings = [ring for polygon in shapely.get_parts(area) for ring in (polygon.exterior, *polygon.interiors)]
    return [shapely.get_coordinates(ring) for ring in rings]


FEWEST_CORNERS = 3
"""Least number of corners of a ring that encloses an area."""


@dataclass(frozen=True, eq=False)
class AreaOutline:
    """An area of interest, prepared for many tests whether a place is inside.

    rings : rings of the area as polygons; a place inside an odd number of rings is inside the area
    hull : (H, 2) m, corners of the convex hull of the area
    """

    rings: Sequence[shapely.Polygon]
    hull: FloatArray

    def contains(self, places: FloatArray) -> NDArray[np.bool_]:
        """Return flags (N,), True for places (N, 2) m inside the area."""
        inside = np.zeros(len(places), dtype=bool)
        for ring in self.rings:
            inside ^= shapely.contains_xy(ring, places[:, 0], places[:, 1])
        return inside

    def is_ahead(self, places: FloatArray, ways: FloatArray) -> NDArray[np.bool_]:
        """Return flags (N,), True if a part of the area is ahead of a rock.

        places : (N, 2) m, places of the rocks in plan; ways : (N, 2) m, from the release of each rock to its place

        A rock straight below its release has no direction: every area is ahead of this rock.
        """
        farthest = (ways @ self.hull.T).max(axis=1)
        return np.asarray((farthest > (places * ways).sum(axis=1)) | (ways == 0.0).all(axis=1))


def outlines_for_places(areas: Mapping[str, Sequence[FloatArray]]) -> list[AreaOutline]:
    """Return the areas of interest, given as rings (P, 2) m, prepared for tests whether places are inside."""
    return [
        AreaOutline(rings=[shapely.Polygon(ring) for ring in rings], hull=_hull(np.concatenate(list(rings))))
        for rings in areas.values()
    ]


def reached_by(areas: Iterable[Sequence[FloatArray]], points: FloatArray, begins: IntArray) -> NDArray[np.bool_]:
    """Return flags (R,), True for paths that cross or touch an area of interest in plan.

    areas : rings (P, 2) or (P, 3) m of each area; a hole of an area counts as a part of the area
    points : (N, 2) or (N, 3) m, the points of all paths, path after path; paths are straight between two points
    begins : (R,) index of the first point of each path
    """
    rings = [ring[:, :2] for rings in areas for ring in rings if len(ring) >= FEWEST_CORNERS]
    if not rings or not len(begins):
        return np.zeros(len(begins), dtype=bool)
    # The first point of each path is repeated, because a line needs two points.
    plan = np.insert(points[:, :2], begins, points[begins, :2], axis=0)
    path = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(points))) + 1)
    area = shapely.union_all(shapely.make_valid([shapely.Polygon(ring) for ring in rings]))
    shapely.prepare(area)
    return np.asarray(shapely.intersects(shapely.linestrings(plan, indices=path), area))


def _hull(corners: FloatArray) -> FloatArray:
    return np.asarray(shapely.get_coordinates(shapely.convex_hull(shapely.multipoints(corners))))
