"""Find the gaps of a terrain, and make the caps that close them: the flight of a rock ends where it crosses a cap.

A gap is a region in plan, within the convex hull of the terrain, where the mesh has no ground: a hole, a strip between
two components, or a bay of the terrain's outer edge. The cap of a gap is a triangulation over the corners of the border
around the gap, at the heights of these corners. Cap and terrain together are therefore watertight, and no ground lies
below a cap.

The border alone determines how often the ground covers a place in plan. A facet that faces up counts 1, a facet that
faces down counts -1, and the sum over all facets at the place is the winding number of the border around the place. In
plan the border divides the hull into regions (polygons, `faces` in the code). The sum is constant in each region, and a
region with a sum below 1 is a gap. An overhang above ground counts 1 - 1 + 1 = 1.

Vertical walls close the sides of the hull, except sides that lie on the terrain's box (`outer_walls.py`). A hole in a
steep slope has hardly any area in plan; the cap of such a hole lies in the plane of the hole (`steep_gaps.py`).
"""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.border import left_over
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.outer_walls import outer_walls
from rpf3d_core.terrain.plane.hull import convex_hull
from rpf3d_core.terrain.plane.triangulation import triangles_of
from rpf3d_core.terrain.steep_gaps import without_steep_rings
from rpf3d_core.terrain.winding import crossings
from rpf3d_core.values import Outcome

HOLE, BAY = int(Outcome.LOST_TO_HOLE), int(Outcome.LEFT_TERRAIN)
IN_PLAN = -1
"""Value of `Caps.ring` for a triangle that closes a gap with an area in plan."""

ALONG_EDGE = (0.5, 0.382)
"""Places along an edge of a gap, as shares of its length, at which the distance to the border is tested.

Such an edge is either a side of the border, or a side of the convex hull where the terrain is open. One place is not
enough: a corner of the border may lie on a side of the hull, often exactly in its middle. A straight rim of regular
points that was rounded to the millimetre has such corners.
"""

WELL_INSIDE = 0.1
"""A point is well inside a region if its distance to the boundary exceeds this share of the square root of the area."""

Ids = NDArray[np.int64]


class Caps(NamedTuple):
    """Triangles that close the gaps of a terrain.

    corners : (T, 3, 3) m, counter-clockwise seen from the free side
    outcome : (T,) outcome of a rock that passes through: LEFT_TERRAIN in a bay and at outer walls, else LOST_TO_HOLE
    ring : (T,) number of the hole in a steep slope that the triangle closes; each triangle of an outer wall has a
        number of its own; IN_PLAN for all other triangles, whose gaps have an area in plan
    layered : true if ground lies above other ground, so that a rock below the upper ground may still hit lower ground
    """

    corners: FloatArray
    outcome: NDArray[np.int32]
    ring: NDArray[np.int32]
    layered: bool = False


class Outline(NamedTuple):
    """The border of the terrain in plan: its points, and the sides between them.

    places : (P, 2) m; height : (P,) m, the lowest height if border corners lie above each other
    sides : (S, 2) indices into `places` of both ends of each side; the ground is to the left
    ring : (P,) number of the closed ring that each place belongs to: the smallest number of a place in the ring
    lines : (S,) the sides as line objects of shapely; hull : convex hull of the places
    """

    places: FloatArray
    height: FloatArray
    sides: Ids
    ring: Ids
    lines: NDArray[np.object_]
    hull: shapely.Geometry


NOTHING = Caps(corners=np.empty((0, 3, 3)), outcome=np.empty(0, np.int32), ring=np.empty(0, np.int32))


def caps_over(border: FloatArray, crack: float) -> Caps:
    """Return the caps (triangles) that close the gaps of a terrain.

    border : (B, 3, 3) m, border sides: begin, end and third corner of their facet, from `border_of`
    crack : gaps up to this width (m) are cracks between facets and get no cap
    """
    if len(border) == 0:
        return NOTHING
    rest, steep, hole = without_steep_rings(border, crack)
    walls = outer_walls(border, crack)
    outline = _outline(rest)
    faces, layered = _gaps_in_plan(outline, crack)
    corners, outcome = [steep, walls], [np.full(len(steep), HOLE), np.full(len(walls), BAY)]
    first_wall = int(hole.max(initial=-1)) + 1
    ring = [hole, np.arange(first_wall, first_wall + len(walls))]
    if len(faces):
        triangles, face = _triangles(faces, outline, crack)
        corners.append(triangles)
        outcome.append(np.where(_bays(faces, outline, crack), BAY, HOLE)[face])
        ring.append(np.full(len(triangles), IN_PLAN))
    return Caps(
        corners=np.concatenate(corners),
        outcome=np.concatenate(outcome).astype(np.int32),
        ring=np.concatenate(ring).astype(np.int32),
        layered=layered,
    )


def _outline(border: FloatArray) -> Outline:
    """Return the border of the terrain in plan.

    Two border sides between the same places in opposite directions are left out; such pairs occur at a vertical wall.

    border : (B, 3, 3) m, begin and end of each border side, and the third corner of its facet
    """
    ends = border[:, :2].reshape(-1, 3) + 0.0
    plan, number = np.unique(ends[:, 0] + 1j * ends[:, 1], return_inverse=True)
    places, height = np.column_stack([plan.real, plan.imag]), np.full(len(plan), np.inf)
    np.minimum.at(height, number, ends[:, 2])
    sides = number.reshape(-1, 2)
    sides = sides[left_over(sides)]
    ring = components(len(places), sides[:, 0], sides[:, 1]).astype(np.int64)  # type: ignore[arg-type]
    lines = shapely.linestrings(places[sides])
    hull = convex_hull(places) if len(places) else shapely.Polygon()
    return Outline(places=places, height=height, sides=sides, ring=ring, lines=lines, hull=hull)


def _gaps_in_plan(outline: Outline, crack: float) -> tuple[NDArray[np.object_], bool]:
    """Return the gaps as regions (G,), polygons in plan; also return True if ground lies above other ground anywhere.

    A gap is a region within the convex hull without ground. Regions no wider than `crack` (m) do not count.
    """
    nothing = np.empty(0, object), False
    if len(outline.sides) == 0:
        return nothing
    hull = outline.hull
    if hull.area <= crack * hull.length:
        return nothing
    drawn = shapely.union_all(np.append(outline.lines, hull.boundary))
    faces = np.array(shapely.get_parts(shapely.polygonize([drawn])))
    faces = faces[2.0 * shapely.area(faces) > crack * shapely.length(faces)]
    winding = _winding(outline, _inner_points(faces))
    return np.asarray(faces[winding < 1]), bool((winding > 1).any())


def _inner_points(faces: NDArray[np.object_]) -> FloatArray:
    """Return a point (G, 2) well inside each region, at which to test whether the region has ground.

    Usually the point is the region's centroid. If the centroid is not well inside (WELL_INSIDE), it is the centroid of
    the region's largest triangle, whose computation takes 100 ms for the whole plan of a large terrain. A region that
    is very thin after rounding, such as the crack of a T-junction, may have no triangles; then
    `shapely.point_on_surface` gives the point. For other regions `shapely.point_on_surface` is not used, because it may
    return a corner of a region with a narrow part.

    faces : (G,) regions, as polygons of shapely
    """
    points = shapely.centroid(faces)
    room = shapely.distance(points, shapely.boundary(faces)) / np.sqrt(shapely.area(faces))
    for k in np.flatnonzero(~(shapely.contains(faces, points) & (room > WELL_INSIDE))):
        parts = shapely.get_parts(triangles_of(faces[k]))
        if len(parts):
            points[k] = shapely.centroid(parts[np.argmax(shapely.area(parts))])
        else:
            points[k] = shapely.point_on_surface(faces[k])
    return np.asarray(shapely.get_coordinates(points))


def _winding(outline: Outline, points: FloatArray) -> Ids:
    """Return the winding number (Q,) of the border around each point (Q, 2) m in plan; below 1 for no ground.

    The winding number is the number of upward facets at the point in plan, minus the number of downward facets. It is
    found from the border sides that cross a ray from the point to the east (`winding.crossings`).
    """
    sides = outline.places[outline.sides]
    far = sides[:, :, 0].max() + 1.0
    rays = shapely.box(points[:, 0], points[:, 1], far, points[:, 1])
    rays[points[:, 0] >= far] = None
    ray, side = shapely.STRtree(outline.lines).query(rays)
    return np.bincount(ray, crossings(sides[side], points[ray]), len(points)).astype(np.int64)


def _bays(faces: NDArray[np.object_], outline: Outline, crack: float) -> NDArray[np.bool_]:
    """Return flags (G,): true for each gap that is a bay.

    A bay is open to the outside, and its corners lie on at most one ring of the border.

    A rock that flies into a bay has left the terrain. An open region with corners on several rings lies between
    components of the terrain: the region is not a bay, because there is ground again behind it.

    faces : (G,) gaps, as polygons of shapely; crack : largest width (m) of a crack
    """
    owner, corners = _edges_of(faces)
    hull = outline.hull.boundary
    shapely.prepare(hull)
    border = shapely.STRtree(outline.lines)
    is_open = np.zeros(len(faces), dtype=bool)
    for share in ALONG_EDGE:
        points = shapely.points((1.0 - share) * corners[:, 0] + share * corners[:, 1])
        on_hull = np.flatnonzero(shapely.dwithin(points, hull, crack))
        on_border = np.unique(border.query(points[on_hull], predicate="dwithin", distance=crack)[0])
        is_open[owner[np.delete(on_hull, on_border)]] = True
    place = _places_at(outline, corners[:, 0])
    known = place >= 0
    met = np.unique(np.stack([owner[known], outline.ring[place[known]]], axis=1), axis=0)
    return is_open & (np.bincount(met[:, 0], minlength=len(faces)) <= 1)


def _edges_of(faces: NDArray[np.object_]) -> tuple[Ids, FloatArray]:
    """Return the edges around the gaps: the number (N,) of the gap of each edge, and both ends (N, 2, 2) m.

    faces : (G,) gaps, as polygons of shapely
    """
    rings, of_ring = shapely.get_rings(faces, return_index=True)
    points, of_point = shapely.get_coordinates(rings, return_index=True)
    same = of_point[1:] == of_point[:-1]
    ends = np.stack([points[:-1], points[1:]], axis=1)[same]
    return of_ring[of_point[:-1][same]], ends


def _places_at(outline: Outline, points: FloatArray) -> Ids:
    """Return the number (N,) of the border point that has exactly the coordinates of each point (N, 2) m; -1 if none.

    The number is an index into `Outline.places` and `Outline.height`.
    """
    number = {place: n for n, place in enumerate(map(tuple, outline.places.tolist()))}
    return np.array([number.get(point, -1) for point in map(tuple, (points + 0.0).tolist())], dtype=np.int64)


def _triangles(faces: NDArray[np.object_], outline: Outline, crack: float) -> tuple[FloatArray, Ids]:
    """Return the caps of gaps: triangles (T, 3, 3) m at the heights of the border, and the gap number (T,) of each.

    faces : (G,) gaps, as polygons of shapely; crack : largest width (m) of a crack
    """
    parts, face = shapely.get_parts([triangles_of(face) for face in faces], return_index=True)
    plan = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    place = _places_at(outline, plan)
    height = outline.height[place]
    crossings = np.flatnonzero(place < 0)
    if len(crossings):
        height[crossings] = _lowest_at(plan[crossings], outline, crack)
    return np.column_stack([plan, height]).reshape(-1, 3, 3), face


def _lowest_at(points: FloatArray, outline: Outline, crack: float) -> FloatArray:
    """Return the lowest height (N,) m of the border sides at points (N, 2) m in plan, such as crossings of sides.

    crack : distance (m) from a point within which a border side counts as at the point; the nearest side always counts
    """
    places, height = outline.places[outline.sides], outline.height[outline.sides]
    tree, there = shapely.STRtree(outline.lines), shapely.points(points)
    point, side = np.concatenate([tree.query(there, "dwithin", crack), tree.query_nearest(there)], axis=1)
    begin, way = places[side, 0], places[side, 1] - places[side, 0]
    share = np.clip(((points[point] - begin) * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)
    low = np.full(len(points), np.inf)
    np.minimum.at(low, point, height[side, 0] + share * (height[side, 1] - height[side, 0]))
    return low
