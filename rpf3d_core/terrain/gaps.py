"""Gaps of a terrain, and the caps that close them: a rock that passes through a cap falls below the ground.

A gap is a region in plan, within the convex hull of the terrain, where the mesh has no ground: a hole, a strip between
two components, or a bay of the rim. Its cap is a triangulation over the corners of the border around the gap, at their
heights. Cap and terrain together are therefore watertight, and a cap lies over no ground.

The border alone gives the number of times a place in plan is covered: facets that face up count 1, facets that face
down count -1, so the sum is the winding number of the border around the place. The sum is constant on each face of the
drawing that the border makes in plan, and a face with a sum below 1 is a gap. An overhang over ground counts 1 - 1 + 1.
Walls stand around the hull unless it is a rectangle along the axes (`outer_walls.py`).
A hole in a steep face has hardly any area in plan; its ring is closed in its own plane (`steep_gaps.py`).
"""

from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray

from rpf3d_core.terrain.frame import FloatArray
from rpf3d_core.terrain.mesh.border import left_over
from rpf3d_core.terrain.mesh.components import components
from rpf3d_core.terrain.outer_walls import outer_walls
from rpf3d_core.terrain.steep_gaps import without_steep_rings
from rpf3d_core.values import Outcome

HOLE, BAY = int(Outcome.LOST_TO_HOLE), int(Outcome.LEFT_TERRAIN)

Ids = NDArray[np.int64]


class Caps(NamedTuple):
    """Triangles that close the gaps of a terrain.

    corners : (T, 3, 3) m, counter-clockwise seen from the free side
    outcome : (T,) of a rock that passes through: LOST_TO_HOLE; LEFT_TERRAIN in a bay of the outer rim and at its walls
    layered : true if ground lies above other ground, so that a rock below the upper ground may still meet the lower one
    """

    corners: FloatArray
    outcome: NDArray[np.int32]
    layered: bool = False


class Outline(NamedTuple):
    """The border in plan.

    places : (P, 2) m; height : (P,) m, the lowest where border corners lie above each other
    sides : (S, 2) places, the ground to the left; ring : (P,) the smallest place that sides connect each place to
    lines : (S,) the sides as lines
    """

    places: FloatArray
    height: FloatArray
    sides: Ids
    ring: Ids
    lines: NDArray[np.object_]


NOTHING = Caps(corners=np.empty((0, 3, 3)), outcome=np.empty(0, np.int32))


def caps_over(border: FloatArray, crack: float) -> Caps:
    """Return the caps of a terrain with border sides (B, 3, 3) m, as `border.border_of` gives them.

    crack : width (m) up to which a gap is a crack between facets, which gets no cap
    """
    if len(border) == 0:
        return NOTHING
    rest, steep = without_steep_rings(border, crack)
    walls = outer_walls(border, crack)
    outline = _outline(rest)
    faces, layered = _gaps_in_plan(outline, crack)
    corners, outcome = [steep, walls], [np.full(len(steep), HOLE), np.full(len(walls), BAY)]
    if len(faces):
        triangles, face = _triangles(faces, outline, crack)
        corners.append(triangles)
        outcome.append(np.where(_bays(faces, outline, crack), BAY, HOLE)[face])
    return Caps(corners=np.concatenate(corners), outcome=np.concatenate(outcome).astype(np.int32), layered=layered)


def _outline(border: FloatArray) -> Outline:
    """Return the border in plan, without pairs of sides that run along each other in opposite directions.

    Such pairs occur at a vertical wall.
    """
    ends = border[:, :2].reshape(-1, 3) + 0.0
    plan, number = np.unique(ends[:, 0] + 1j * ends[:, 1], return_inverse=True)
    places, height = np.column_stack([plan.real, plan.imag]), np.full(len(plan), np.inf)
    np.minimum.at(height, number, ends[:, 2])
    sides = number.reshape(-1, 2)
    sides = sides[left_over(sides)]
    ring = components(len(places), sides[:, 0], sides[:, 1]).astype(np.int64)  # type: ignore[arg-type]
    return Outline(places=places, height=height, sides=sides, ring=ring, lines=shapely.linestrings(places[sides]))


def _gaps_in_plan(outline: Outline, crack: float) -> tuple[NDArray[np.object_], bool]:
    """Return the faces (polygons in plan) within the hull that no ground covers, and if any face is covered twice.

    Faces no wider than a crack do not count.
    """
    nothing = np.empty(0, object), False
    if len(outline.sides) == 0:
        return nothing
    hull = shapely.convex_hull(shapely.multipoints(outline.places))
    if hull.area <= crack * hull.length:
        return nothing
    drawn = shapely.union_all(np.append(outline.lines, hull.boundary))
    faces = np.array(shapely.get_parts(shapely.polygonize([drawn])))
    faces = faces[2.0 * shapely.area(faces) > crack * shapely.length(faces)]
    winding = _winding(outline, _inner_points(faces))
    return np.asarray(faces[winding < 1]), bool((winding > 1).any())


def _inner_points(faces: NDArray[np.object_]) -> FloatArray:
    """Return a point well inside each face: (G, 2), the centroid of the face's largest triangle.

    `shapely.point_on_surface` may give a corner where a face is pinched. It is used only if rounding makes a face as
    thin as the crack of a T-junction, so that the face cannot be cut into triangles.
    """
    parts, face = shapely.get_parts([_triangles_of(face) for face in faces], return_index=True)
    order = np.lexsort((-shapely.area(parts), face))
    largest = order[np.unique(face[order], return_index=True)[1]]
    return np.asarray(shapely.get_coordinates(shapely.centroid(parts[largest])))


def _triangles_of(face: shapely.Polygon) -> shapely.Geometry:
    """Return a face cut into triangles; a point of the face if rounding leaves no convex corner to start from."""
    try:
        return shapely.constrained_delaunay_triangles(face)
    except shapely.errors.GEOSException:
        return shapely.point_on_surface(face)


def _winding(outline: Outline, points: FloatArray) -> Ids:
    """Return how often the border runs counter-clockwise around each point (Q, 2) m: (Q,).

    A ray to the east counts sides that cross it northwards, minus sides that cross it southwards.
    """
    sides = outline.places[outline.sides]
    far = sides[:, :, 0].max() + 1.0
    rays = shapely.box(points[:, 0], points[:, 1], far, points[:, 1])
    rays[points[:, 0] >= far] = None
    ray, side = shapely.STRtree(outline.lines).query(rays)
    (ax, ay), (bx, by) = sides[side, 0].T, sides[side, 1].T
    x, y = points[ray].T
    up, down = (ay <= y) & (by > y), (by <= y) & (ay > y)
    left = (bx - ax) * (y - ay) - (x - ax) * (by - ay)  # above 0 where the point lies to the left of the side
    crossed = np.where(up & (left > 0.0), 1, 0) - np.where(down & (left < 0.0), 1, 0)
    return np.bincount(ray, crossed, len(points)).astype(np.int64)


def _bays(faces: NDArray[np.object_], outline: Outline, crack: float) -> NDArray[np.bool_]:
    """Return which faces (G,) are open to the outside of the hull and touch only one ring of the border.

    An open face that touches several rings lies between components of the terrain: a rock that flew over it would find
    ground again.
    """
    owner, corners = _edges_of(faces)
    middle = shapely.points(0.5 * (corners[:, 0] + corners[:, 1]))
    hull = shapely.convex_hull(shapely.multipoints(outline.places)).boundary
    shapely.prepare(hull)
    on_hull = np.flatnonzero(shapely.dwithin(middle, hull, crack))
    border = shapely.STRtree(outline.lines)
    on_border = np.unique(border.query(middle[on_hull], predicate="dwithin", distance=crack)[0])
    is_open = np.zeros(len(faces), dtype=bool)
    is_open[owner[np.delete(on_hull, on_border)]] = True
    place = _places_at(outline, corners[:, 0])
    known = place >= 0
    met = np.unique(np.stack([owner[known], outline.ring[place[known]]], axis=1), axis=0)
    return is_open & (np.bincount(met[:, 0], minlength=len(faces)) <= 1)


def _edges_of(faces: NDArray[np.object_]) -> tuple[Ids, FloatArray]:
    """Return the face (N,) and the ends (N, 2, 2) m of each edge around the faces."""
    rings, of_ring = shapely.get_rings(faces, return_index=True)
    points, of_point = shapely.get_coordinates(rings, return_index=True)
    same = of_point[1:] == of_point[:-1]
    ends = np.stack([points[:-1], points[1:]], axis=1)[same]
    return of_ring[of_point[:-1][same]], ends


def _places_at(outline: Outline, points: FloatArray) -> Ids:
    """Return the place of the outline with exactly the coordinates of each point (N, 2) m; -1 if there is none."""
    number = {place: n for n, place in enumerate(map(tuple, outline.places.tolist()))}
    return np.array([number.get(point, -1) for point in map(tuple, (points + 0.0).tolist())], dtype=np.int64)


def _triangles(faces: NDArray[np.object_], outline: Outline, crack: float) -> tuple[FloatArray, Ids]:
    """Return triangles (T, 3, 3) m that close the faces, at the heights of the border, and the face (T,) of each."""
    parts, face = shapely.get_parts(shapely.constrained_delaunay_triangles(faces), return_index=True)
    plan = shapely.get_coordinates(shapely.orient_polygons(parts)).reshape(-1, 4, 2)[:, :3].reshape(-1, 2)
    place = _places_at(outline, plan)
    height = outline.height[place]
    crossings = np.flatnonzero(place < 0)
    if len(crossings):
        height[crossings] = _lowest_at(plan[crossings], outline, crack)
    return np.column_stack([plan, height]).reshape(-1, 3, 3), face


def _lowest_at(points: FloatArray, outline: Outline, crack: float) -> FloatArray:
    """Return the lowest height (N,) m of the sides through each point (N, 2) m, where sides cross in plan."""
    places, height = outline.places[outline.sides], outline.height[outline.sides]
    tree, there = shapely.STRtree(outline.lines), shapely.points(points)
    point, side = np.concatenate([tree.query(there, "dwithin", crack), tree.query_nearest(there)], axis=1)
    begin, way = places[side, 0], places[side, 1] - places[side, 0]
    share = np.clip(((points[point] - begin) * way).sum(axis=1) / (way * way).sum(axis=1), 0.0, 1.0)
    low = np.full(len(points), np.inf)
    np.minimum.at(low, point, height[side, 0] + share * (height[side, 1] - height[side, 0]))
    return low
