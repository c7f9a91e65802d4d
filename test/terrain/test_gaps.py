"""Tests of the caps over gaps of a terrain, against a point-in-triangle count that shares no code with them."""

import numpy as np
import pytest
import shapely
from flights.scenes_of_facets import terrain_of

from rpf3d_core.terrain import gaps
from rpf3d_core.terrain.gaps import caps_over
from rpf3d_core.terrain.mesh.border import border_after, border_of, net_sides
from rpf3d_core.terrain.plane.triangulation import fills, triangles_of
from rpf3d_core.terrain.steep_gaps import without_steep_rings
from rpf3d_core.values import Outcome

CRACK = 1e-9
RNG = np.random.default_rng(15)


def surveyed(there, warp=0.0, turn=0.0):
    """Return uneven terrain of 1 m squares, two facets each, where `there` (N, M) is true.

    warp : largest shift (m) of vertices in plan; turn : rotation in plan (rad)
    """
    n, m = there.shape
    j, i = np.mgrid[: n + 1, : m + 1].astype(float)
    rng = np.random.default_rng(3)
    x, y = i + warp * rng.uniform(-1, 1, i.shape), j + warp * rng.uniform(-1, 1, i.shape)
    z = -0.4 * i + 0.2 * np.sin(j) + 0.1 * rng.normal(size=i.shape)
    x, y = np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y
    return terrain_of(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), facets_where(there))


def facets_where(there):
    """Return two facets (F, 3) for each square of a grid where `there` (N, M) is true; vertices row by row."""
    n, m = there.shape
    first = (np.arange(n)[:, None] * (m + 1) + np.arange(m))[there]
    return np.concatenate([first[:, None] + np.array(half) for half in ((0, 1, m + 2), (0, m + 2, m + 1))])


def caps_of(terrain):
    return caps_over(border_of(terrain.vertices, terrain.triangles), CRACK)


def plan_caps(caps):
    """Return corners and outcomes of the caps that face up, without the upright walls around the hull."""
    n = np.cross(caps.corners[:, 1] - caps.corners[:, 0], caps.corners[:, 2] - caps.corners[:, 0])
    return caps.corners[n[:, 2] > 1e-12], caps.outcome[n[:, 2] > 1e-12]


def covers(corners, places):
    """Return (P,) the number of triangles (T, 3, 2 or 3) over each place (P, 2), by signed distances from the sides."""
    count = np.zeros(len(places), int)
    for a, b, c in corners[:, :, :2]:
        sides = [(q - p)[0] * (places - p)[:, 1] - (q - p)[1] * (places - p)[:, 0] for p, q in ((a, b), (b, c), (c, a))]
        count += (np.min(sides, axis=0) > 0.0) | (np.max(sides, axis=0) < 0.0)
    return count


def widest_view(points, places):
    """Return (P,) the widest angle (rad) at each place without a point: above pi outside the points' hull."""
    way = points[None] - places[:, None]
    angle = np.sort(np.arctan2(way[..., 1], way[..., 0]), axis=1)
    return np.diff(np.concatenate([angle, angle[:, :1] + 2.0 * np.pi], axis=1), axis=1).max(axis=1)


def masks():
    full = np.ones((14, 15), bool)
    hole, strip, bay, island = full.copy(), full.copy(), full.copy(), full.copy()
    hole[4:8, 5:9] = False
    strip[:, 6:8] = False
    bay[:5, 6:9] = False
    island[3:11, 3:11] = False
    island[6:8, 6:8] = True
    return {
        "whole": full, "hole": hole, "strip": strip, "bay": bay, "island": island,
        "peppered": RNG.random(full.shape) > 0.3,
    }  # fmt: skip


MASKS = pytest.mark.parametrize("there", masks().values(), ids=masks().keys())


@pytest.mark.parametrize("turn", [0.0, 0.5])
@pytest.mark.parametrize("warp", [0.0, 0.3])
@MASKS
def test_each_place_in_the_hull_has_ground_or_one_cap_and_never_both(there, warp, turn):
    terrain = surveyed(there, warp, turn)
    corners, _ = plan_caps(caps_of(terrain))
    used = terrain.vertices[np.unique(terrain.triangles)]
    places = RNG.uniform(used[:, :2].min(axis=0), used[:, :2].max(axis=0), (1500, 2))
    ground, capped = covers(terrain.vertices[terrain.triangles], places), covers(corners, places)
    view = widest_view(used[:, :2], places)
    inside = view < np.pi - 1e-6
    assert (ground + capped)[inside].tolist() == [1] * int(inside.sum())
    assert not capped[view > np.pi + 1e-6].any()


@MASKS
def test_caps_have_the_corners_of_the_ground_around_them(there):
    terrain = surveyed(there, 0.3)
    corners, _ = plan_caps(caps_of(terrain))
    assert {tuple(p) for p in corners.reshape(-1, 3).tolist()} <= {tuple(p) for p in terrain.vertices.tolist()}


@pytest.mark.parametrize(
    ("name", "outcomes"),
    [("whole", set()), ("hole", {Outcome.LOST_TO_HOLE}), ("strip", {Outcome.LOST_TO_HOLE}),
     ("bay", {Outcome.LEFT_TERRAIN}), ("island", {Outcome.LOST_TO_HOLE})],
)  # fmt: skip
def test_a_bay_leads_out_of_the_terrain_and_other_gaps_are_holes(name, outcomes):
    assert set(plan_caps(caps_of(surveyed(masks()[name])))[1].tolist()) == outcomes


def test_a_rim_with_a_corner_exactly_in_the_middle_of_a_side_of_the_hull_has_bays_only():
    """The bays are 1 mm deep, and nearly touch the hull between them, as after rounding a straight rim to 1 mm.

    Rocks that left the terrain through such bays once counted as lost to a hole.
    """
    rim = [(0.0, 0.0, 0.0), (1.0, 0.001, 0.0), (2.0, 1e-10, 0.0), (3.0, 0.001, 0.0), (4.0, 0.0, 0.0)]
    vertices = [*rim, (4.0, 3.0, 1.0), (-1.0, 3.0, 1.0)]
    terrain = terrain_of(vertices, [(5, 6, 0), (0, 1, 5), (1, 2, 5), (2, 3, 5), (3, 4, 5)])
    corners, outcome = plan_caps(caps_of(terrain))
    assert len(corners) > 0 and set(outcome.tolist()) == {Outcome.LEFT_TERRAIN}


def test_a_whole_upright_rectangle_has_no_cap_at_all():
    assert len(caps_of(surveyed(np.ones((9, 7), bool))).corners) == 0


def test_an_outline_that_is_no_upright_rectangle_is_walled_in_by_its_hull():
    terrain = surveyed(np.ones((9, 7), bool), turn=0.5)
    caps = caps_of(terrain)
    n = np.cross(caps.corners[:, 1] - caps.corners[:, 0], caps.corners[:, 2] - caps.corners[:, 0])
    assert np.allclose(n[:, 2], 0.0) and set(caps.outcome.tolist()) == {Outcome.LEFT_TERRAIN}
    inwards = terrain.vertices.mean(axis=0) - caps.corners.mean(axis=1)
    assert (np.einsum("ij,ij->i", n, inwards) > 0.0).all()
    length = np.linalg.norm(np.diff(caps.corners[:, [0, 1], :2], axis=1)[:, 0], axis=1).sum()
    assert np.isclose(length / 2, 2 * (9 + 7), rtol=0.2)


def test_cracks_and_t_junctions_are_no_gaps():
    # A vertex near a neighbour's edge, a third of a crack away from it.
    v = [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (1 + 3e-10, 1 - 3e-10, 0)]
    terrain = terrain_of(v, [(0, 1, 4), (4, 1, 2), (0, 2, 3)])
    assert len(caps_of(terrain).corners) == 0
    soup = terrain.vertices[terrain.triangles].reshape(-1, 3)
    assert len(caps_of(terrain_of(soup, np.arange(9).reshape(-1, 3))).corners) == 0


def test_t_junctions_that_touch_in_a_tilted_face_are_cracks_without_a_cap():
    """Middles of sides on a plane, rounded: the cracks at them form one ring, whose border crosses itself in plan."""
    places = [
        (0.0, 0.0), (0.0, 2.0), (0.0, 4.0), (1.9942556947236176, 0.0), (2.035715965280745, 1.8970299911447395),
        (2.193580897485904, 4.025849115346146), (2.5164787153051638, 6.465116218170536),
        (3.93983382011999, 1.7159365760053729), (4.346942575784555, 3.4518363983070843),
        (3.7155284571476903, 6.152903123540182), (2.1146484313833245, 2.9614395532454427),
    ]  # fmt: skip
    triangles = [
        (0, 3, 1), (1, 4, 2), (2, 5, 6), (4, 7, 8), (5, 8, 9), (3, 4, 1), (4, 10, 2), (3, 7, 4), (4, 8, 5), (5, 9, 6),
        (10, 5, 2),
    ]  # fmt: skip
    heights = [0.0, 0.0, 0.0, -0.15147350944115892, -0.15462262051065917, -0.16661323704096326, -0.19113891134911845,
               -0.2992497185428621, -0.33017162695605645, -0.28221262515218937, -0.1606179287758112]  # fmt: skip
    terrain = terrain_of([(x, y, z) for (x, y), z in zip(places, heights, strict=True)], triangles)
    assert len(without_steep_rings(border_of(terrain.vertices, terrain.triangles), 1e-6)[1]) == 0
    caps_of(terrain)


def test_ground_below_a_hole_of_other_ground_needs_no_cap():
    hole = masks()["hole"]
    upper, lower = surveyed(hole), surveyed(np.ones_like(hole))
    both = terrain_of(
        np.concatenate([upper.vertices, lower.vertices - np.array([0, 0, 50])]),
        np.concatenate([upper.triangles, lower.triangles + len(upper.vertices)]),
    )
    assert len(caps_of(both).corners) == 0


def wall(there, lean=0.0):
    """Return vertices (V, 3) m and triangles of a wall of 1 m squares, along x and z.

    there : (N, M), False for missing squares; lean : shift (m) of the wall for each metre of height
    """
    n, m = there.shape
    j, i = np.mgrid[: n + 1, : m + 1].astype(float)
    return np.stack([i.ravel(), lean * j.ravel(), j.ravel()], axis=1), facets_where(there)


def area_vectors(corners):
    """Return the area vectors (T, 3) m^2 of triangles (T, 3, 3) m."""
    return 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def closed_in(there, lean):
    """Return corners, rings and area vectors (T, 3) m^2 of the caps over the holes of a wall (`wall`)."""
    caps = caps_of(terrain_of(*wall(there, lean)))
    n, m = there.shape
    inside = ((caps.corners > 0.5) & (caps.corners < (m - 0.5, np.inf, n - 0.5)))[:, :, [0, 2]].all(axis=(1, 2))
    return caps.corners[inside], caps.ring[inside], area_vectors(caps.corners[inside])


def area_inside(caps, middle, half):
    """Return the sum (3,) m^2 of the area vectors of caps within `half` (m) of a place (x, z) m of a wall."""
    inside = (np.abs(caps.corners[:, :, [0, 2]] - middle) <= half).all(axis=(1, 2))
    return area_vectors(caps.corners[inside]).sum(axis=0)


@pytest.mark.parametrize("lean", [0.0, 0.02, -0.05], ids=["upright", "steep", "overhanging"])
def test_a_hole_in_a_wall_is_closed_in_the_plane_of_the_wall(lean):
    there = np.ones((6, 8), bool)
    there[2:4, 3:6] = False
    _, ring, areas = closed_in(there, lean)
    assert np.allclose(areas.sum(axis=0), 6.0 * np.array([0.0, -1.0, lean])) and len(set(ring.tolist())) == 1


@pytest.mark.parametrize("lean", [0.0, 0.02, -0.05], ids=["upright", "steep", "overhanging"])
def test_holes_in_a_wall_that_touch_at_a_vertex_are_closed_one_by_one(lean):
    there = np.ones((7, 8), bool)
    there[1:3, 1:3] = there[3:5, 3:6] = False
    corners, ring, areas = closed_in(there, lean)
    assert np.allclose(areas.sum(axis=0), 10.0 * np.array([0.0, -1.0, lean])) and len(set(ring.tolist())) == 2
    x_of_each = [corners[ring == each, :, 0] for each in ring]
    assert all((x <= 3.0).all() or (x >= 3.0).all() for x in x_of_each)


@pytest.mark.parametrize("lean", [0.0, 0.02, -0.05], ids=["upright", "steep", "overhanging"])
def test_no_cap_covers_ground_inside_a_hole_that_touches_the_rim_at_a_vertex(lean):
    there = np.ones((7, 8), bool)
    there[1:5, 1:6] = False
    there[1, 1] = True  # at a corner of the hole
    there[2, 2] = True  # touches this ground at a vertex
    corners, ring, areas = closed_in(there, lean)
    assert np.allclose(areas.sum(axis=0), 18.0 * np.array([0.0, -1.0, lean])) and len(set(ring.tolist())) == 1
    middle = corners.mean(axis=1)
    assert not ((middle[:, 0] > 2.0) & (middle[:, 0] < 3.0) & (middle[:, 2] > 2.0) & (middle[:, 2] < 3.0)).any()


@pytest.mark.parametrize("distance", [-1.0, 0.0], ids=["in front of it", "inside it"])
def test_an_upright_hole_has_its_cap_with_separate_ground(distance):
    there = np.ones((9, 9), bool)
    there[2:7, 2:7] = False
    vertices, triangles = wall(there)
    other = np.array([(3.0, distance, 3.0), (5.0, distance, 3.0), (5.0, distance, 5.0), (3.0, distance, 5.0)])
    both = np.concatenate([triangles, len(vertices) + np.array([(0, 1, 2), (0, 2, 3)])])
    caps = caps_of(terrain_of(np.concatenate([vertices, other]), both))
    assert np.allclose(area_inside(caps, (4.5, 4.5), 2.5), (0.0, -25.0, 0.0))


def test_an_outer_border_that_is_undercut_is_no_hole():
    there = np.ones((20, 20), bool)
    there[5:7, 5:7] = there[12:14, 12:14] = False
    plate = surveyed(there)
    rim = border_of(plate.vertices, plate.triangles)
    outer = rim[(rim[:, :2, :2] % 20.0 == 0.0).any(axis=(1, 2))]
    ends = outer[:, :2].reshape(-1, 3)
    vertices, number = np.unique(np.concatenate([plate.vertices, ends]), axis=0, return_inverse=True)
    below = np.array([10.0, 10.0, -2.0]) + (vertices - (10.0, 10.0, 0.0)) * (0.95, 0.95, 1.0)
    a, b = number[len(plate.vertices) :].reshape(-1, 2).T
    c, d = a + len(vertices), b + len(vertices)
    triangles = np.concatenate([number[plate.triangles], np.stack([b, a, c], axis=1), np.stack([b, c, d], axis=1)])
    corners, _ = plan_caps(caps_of(terrain_of(np.concatenate([vertices, below]), triangles)))
    assert np.isclose(area_vectors(corners)[:, 2].sum(), 8.0)


@pytest.mark.parametrize("off", [-1e-9, 0.0, 1e-9])
def test_a_crack_at_the_rim_of_an_upright_hole_does_not_open_the_hole(off):
    there = np.ones((6, 8), bool)
    there[2:4, 3:6] = False
    vertices, triangles = wall(there)
    ends = 4 * 9 + 3, 5 * 9 + 3  # of an edge above a corner of the hole; the facet on one side of it is cut in two
    cut = next(k for k, facet in enumerate(triangles.tolist()) if set(ends) <= set(facet))
    halves = [[len(vertices) if each == end else each for each in triangles[cut].tolist()] for end in ends]
    middle = (3.0 + off, 0.0, 4.5)
    cracked = np.concatenate([np.delete(triangles, cut, axis=0), np.array(halves)])
    caps = caps_of(terrain_of(np.concatenate([vertices, [middle]]), cracked))
    assert np.allclose(area_inside(caps, (4.5, 3.0), (1.5, 1.0)), (0.0, -6.0, 0.0))


def rough_toe(seed, dip, noise=0.15):
    """Return a rough face of `dip` degrees, 10 m high, above a berm of 10 m, in squares of 1 m of two facets each.

    A square of the face and the next square of the berm are missing, for y from 5 to 6 m.
    """
    rng, rows = np.random.default_rng(seed), np.arange(11.0)
    slope = np.radians(dip)
    profile = np.concatenate([np.outer(rows, [np.cos(slope), -np.sin(slope)]), [[0.0, 0.0]] * 10])
    profile[11:] = profile[10] + np.outer(rows[1:], [1.0, 0.0])
    across = np.arange(12.0)
    x, y = profile[:, :1] + 0.0 * across, across + 0.0 * profile[:, :1]
    z = profile[:, 1:] + 0.0 * across
    inner = (slice(1, -1), slice(1, -1))
    for each in (x, z):
        each[inner] += noise * rng.uniform(-1.0, 1.0, each[inner].shape)
    there = np.ones((20, 11), bool)
    there[9:11, 5] = False
    return terrain_of(np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1), facets_where(there)[:, ::-1])


@pytest.mark.parametrize("dip", [80, 88])
def test_a_hole_over_the_toe_of_a_rough_face_is_closed_up_to_its_whole_rim(dip):
    """Some of these rims cross themselves in plan, because the rough face leans over at them."""
    for seed in range(60):
        terrain = rough_toe(seed, dip)
        sides = border_of(terrain.vertices, terrain.triangles)[:, :2]
        x, y, z = sides.transpose(2, 0, 1)
        at_hole = (np.abs(y - 5.5).max(axis=1) < 1.0) & (z.max(axis=1) < -5.0) & (x.max(axis=1) < 8.0)
        caps = caps_of(terrain).corners
        closed = {frozenset(map(tuple, cap[[a, b]].tolist())) for cap in caps for a, b in ((0, 1), (1, 2), (2, 0))}
        rim = {frozenset(map(tuple, side.tolist())) for side in sides[at_hole]}
        assert len(rim) == 6 and rim <= closed


@pytest.mark.parametrize("drop, size", [(15.0, 40.0), (1.5, 0.3)], ids=["lower ground", "island"])
def test_a_hole_over_the_toe_of_a_face_with_other_ground_in_it_is_not_closed_in_its_own_plane(drop, size):
    """The middle of the other ground is that of the missing square of the berm; its size is half its width."""
    closed = []
    for seed in range(60):
        terrain = rough_toe(seed, 80.0)
        x = 0.5 + terrain.vertices[terrain.vertices[:, 2] < -9.5, 0].min()
        corners = [(x + i * size, 5.5 + j * size, -10.0 - drop) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        both = np.concatenate([terrain.vertices, corners])
        facets = np.concatenate([terrain.triangles, len(terrain.vertices) + np.array([[0, 1, 2], [0, 2, 3]])])
        closed.append(len(without_steep_rings(border_of(terrain.vertices, terrain.triangles), CRACK)[1]))
        assert len(without_steep_rings(border_of(both, facets), CRACK)[1]) == 0
    assert np.count_nonzero(closed) > 5


def refuse(face):
    raise shapely.errors.GEOSException("IllegalStateException: Unable to find a convex corner")


def test_a_face_that_cannot_be_cut_into_triangles_has_an_inner_point_all_the_same(monkeypatch):
    around = shapely.box(0, 0, 9, 9) - shapely.box(1, 0, 8, 8)
    faces = np.array([shapely.box(0, 0, 2, 1), shapely.Polygon([(5, 0), (6, 0), (6, 1e-9)]), around])
    assert not around.contains(around.centroid)
    monkeypatch.setattr(shapely, "constrained_delaunay_triangles", refuse)
    assert shapely.contains_xy(faces, *gaps._inner_points(faces).T).all()
    monkeypatch.setattr(gaps, "triangles_of", lambda face: shapely.GeometryCollection())
    assert shapely.contains_xy(faces, *gaps._inner_points(faces).T).all()


def test_holes_are_closed_where_regions_cannot_be_cut_into_triangles_that_keep_to_their_rims(monkeypatch):
    there = np.ones((9, 9), bool)
    there[3:5, 3:6] = there[5:7, 5] = False
    terrain = surveyed(there, warp=0.2)
    expected = plan_caps(caps_of(terrain))
    monkeypatch.setattr(shapely, "constrained_delaunay_triangles", refuse)
    found = plan_caps(caps_of(terrain))
    places = RNG.uniform(0.0, 9.0, (2000, 2))
    assert np.array_equal(covers(found[0], places), covers(expected[0], places)) and covers(found[0], places).any()


@pytest.mark.parametrize(
    "corners",
    [
        [(0, 0), (20, 0), (20, 10), (10.2, 10), (10.2, 2), (9.8, 2), (9.8, 10), (0, 10)],
        [(0, -2), (10, -0.6), (20, -2), (20, 3), (-1, 3), (-1, 0.2), (0, 0), (18, 0), (18, 0.3), (10, 0.6), (0, 1.5),
         (0, 2.5), (19, 2.5), (19, -1.5), (10, -0.4), (0, -1.5)],
    ],
)  # fmt: skip
def test_triangles_fill_a_region_with_long_sides_and_near_corners_where_geos_fails(monkeypatch, corners):
    monkeypatch.setattr(shapely, "constrained_delaunay_triangles", refuse)
    region = shapely.Polygon(corners)
    parts = shapely.get_parts(triangles_of(region))
    assert fills(parts, region) and shapely.covered_by(parts, region.buffer(1e-9)).all()
    assert shapely.union_all(parts).area == pytest.approx(region.area)


def test_a_border_that_changes_is_that_of_the_new_mesh():
    terrain = surveyed(np.ones((9, 9), bool))
    v, t = terrain.vertices, terrain.triangles
    gone = np.array([10, 11, 60, 100])
    rest = np.delete(t, gone, axis=0)
    holed = border_after(border_of(v, t), v[net_sides(t[gone], t[:0])])
    assert as_set(holed) == as_set(border_of(v, rest))
    assert as_set(border_after(holed, v[net_sides(t[:0], t[gone])])) == as_set(border_of(v, t))
    assert len(net_sides(t[gone], t[gone])) == 0


def as_set(border):
    return {tuple(side.ravel()) for side in border[:, :2]}
