"""Areas of interest that arrive in messages while the simulator runs: outlines, and circles around vehicles."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, reduce
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.formats.polygons import polygon_of
from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.plane.hull import convex_hull

Indices = NDArray[np.integer[Any]]

CORNERS_A_QUARTER = 8
"""Corners per quarter of a circle drawn as a polygon, which differs by at most 0.5 % of the radius from the circle."""


def outline_of(corners: Sequence[tuple[float, float]]) -> list[FloatArray]:
    """Return the area of interest with the given corners as a list of rings (P, 2) m.

    corners : at least three, (x, y) in plan, m

    Raises
    ------
    InputError
        The outline crosses itself or encloses no area.
    """
    return _rings(polygon_of(corners))


def circles_around(places: FloatArray, radius: float) -> list[FloatArray]:
    """Return the area within circles around places (N, 2) m, such as vehicles, as a list of rings (P, 2) m.

    Overlapping circles share one outline. The rings of holes are included. Each circle is drawn as a polygon that
    encloses the circle, so a rock on the circle is counted.

    radius : m, of the circles
    """
    drawn = radius / np.cos(np.pi / (4 * CORNERS_A_QUARTER))
    circles = shapely.buffer(shapely.points(places), drawn, quad_segs=CORNERS_A_QUARTER)
    return _rings(shapely.union_all(circles))


SMALLEST = 1.0
"""Smallest allowed size (m2) of an area of interest; the ground below a single machine is larger."""


def too_small(rings: Iterable[FloatArray]) -> str:
    """Return a clause that states why an area of interest is too small to watch; "" if the area is large enough.

    The caller writes the name of the area before the clause.

    rings : rings (P, 2) m of the area; holes are rings within other rings
    """
    size = float(_surface_of([shapely.Polygon(ring) for ring in rings]).area)
    if size >= SMALLEST:
        return ""
    return (f"encloses only {size:.3g} m2, and must enclose at least {SMALLEST:g} m2: are its coordinates in m, or in "
            "degrees or kilometres?")  # fmt: skip


def _rings(area: shapely.Geometry) -> list[FloatArray]:
    rings = [ring for polygon in shapely.get_parts(area) for ring in (polygon.exterior, *polygon.interiors)]
    return [shapely.get_coordinates(ring) for ring in rings]


FEWEST_CORNERS = 3
"""Smallest number of corners of a ring that encloses an area."""


@dataclass(frozen=True, eq=False)
class AreaOutline:
    """An area of interest, prepared to find which places and paths lie inside; only one thread at a time may use it.

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

    @property
    def corners(self) -> FloatArray:
        """The corners (C, 2) m of all rings."""
        return np.concatenate([shapely.get_coordinates(ring) for ring in self.rings])

    def is_crossed_by(self, points: FloatArray, begins: Indices) -> NDArray[np.bool_]:
        """Return flags (R,), True for paths in plan with a part inside the area.

        A hole is outside the area. A path that only touches the outline has no part inside.

        points : (N, 2) m, the points of all paths, path after path; paths are straight between two points
        begins : (R,) index of the first point of each path
        """
        if not len(begins):
            return np.zeros(0, dtype=bool)
        lines = _lines(points, begins)
        crossed: NDArray[np.bool_] = shapely.intersects(self._surface, lines)
        crossed[crossed] = ~shapely.touches(self._surface, lines[crossed])
        return crossed

    @cached_property
    def _surface(self) -> shapely.Geometry:
        """The area as one polygon with holes."""
        surface = _surface_of(self.rings)
        shapely.prepare(surface)
        return surface


def _surface_of(rings: Iterable[shapely.Polygon]) -> shapely.Geometry:
    """Return the places inside an odd number of rings as one polygon with holes, or several."""
    return reduce(shapely.symmetric_difference, (shapely.make_valid(ring) for ring in rings), shapely.Polygon())


class AreaGround(NamedTuple):
    """The terrain below an area of interest (`live.coverage`).

    uncovered : share (-) of the area in plan that has no terrain below it. An area may have several outlines, such as
        the circles around machines. If more than half of one outline has no terrain, `uncovered` is at least the share
        of this outline without terrain
    lowest : m, local frame, estimated height of the lowest ground in the area, more likely too low than too high;
        -infinite if the height is not known
    """

    uncovered: float
    lowest: float


def outlines_for_places(areas: Mapping[str, Sequence[FloatArray]]) -> list[AreaOutline]:
    """Return an `AreaOutline` for each area of interest, in the order of `areas`.

    areas : rings (P, 2) m of each area, by name
    """
    return [
        AreaOutline(rings=[shapely.Polygon(ring) for ring in rings], hull=_hull(np.concatenate(list(rings))))
        for rings in areas.values()
    ]


def reached_by(areas: Iterable[Sequence[FloatArray]], points: FloatArray, begins: Indices) -> NDArray[np.bool_]:
    """Return flags (R,), True for paths that cross or touch an area of interest, or lie inside one, in plan.

    areas : rings (P, 2) or (P, 3) m of each area; a hole of an area counts as a part of the area; rings of fewer than
        FEWEST_CORNERS (3) corners are ignored
    points : (N, 2) or (N, 3) m, the points of all paths, path after path; paths are straight between two points
    begins : (R,) index of the first point of each path
    """
    rings = [ring[:, :2] for rings in areas for ring in rings if len(ring) >= FEWEST_CORNERS]
    if not rings or not len(begins):
        return np.zeros(len(begins), dtype=bool)
    area = shapely.union_all(shapely.make_valid([shapely.Polygon(ring) for ring in rings]))
    shapely.prepare(area)
    return np.asarray(shapely.intersects(_lines(points[:, :2], begins), area))


def _lines(points: FloatArray, begins: Indices) -> NDArray[np.object_]:
    """Return R paths as shapely lines (R,); points, begins : as in `AreaOutline.is_crossed_by`."""
    # The first point of each path is repeated, because a line needs two points.
    plan = np.insert(points, begins, points[begins], axis=0)
    path = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(points))) + 1)
    return np.asarray(shapely.linestrings(plan, indices=path))


def _hull(corners: FloatArray) -> FloatArray:
    return np.asarray(shapely.get_coordinates(convex_hull(corners)))
