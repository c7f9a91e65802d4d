"""Tests of the distance of a body and a triangle, against all pairs of their parts in extended precision."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from bodies.nearest_features import BODIES, HULLS, WIDE, Hull, box, by_features, dots, point_triangle, wide_cross

from rpf3d_core.body.distance import separation
from rpf3d_core.body.simplex import Vertex, on_face
from rpf3d_core.jit.dispatch import loop

CLOSE = 1e-9
"""Largest error of a distance, as the search states it, over the size of the body."""


@loop
def searched(corners, size, facets, guesses, found):
    """Write the distance of one body to each facet into `found`.

    Columns: distance (m), normal, nearest points on facet and body, 1 for overlap. guesses : (N, 3), first directions
    """
    for k in range(len(facets)):
        f, g = facets[k], guesses[k]
        facet = (f[0, 0], f[0, 1], f[0, 2]), (f[1, 0], f[1, 1], f[1, 2]), (f[2, 0], f[2, 1], f[2, 2])
        s = separation(corners, 0, len(corners), size, facet, (g[0], g[1], g[2]))
        found[k, 0] = s.distance
        for i in range(3):
            found[k, 1 + i], found[k, 4 + i], found[k, 7 + i] = s.normal[i], s.on_facet[i], s.on_body[i]
        found[k, 10] = 1.0 if s.overlap else 0.0


# --- pairs of all kinds -----------------------------------------------------------------------------------------------


def unit(a: np.ndarray) -> np.ndarray:
    return a / np.linalg.norm(a)


def sliver(rng, width: float) -> np.ndarray:
    """Return a random triangle (3, 3) m that is 10 m long and `width` (m) wide."""
    along, third = unit(rng.normal(size=3)), rng.uniform(-5.0, 5.0)
    aside = unit(np.cross(along, rng.normal(size=3)))
    return np.array([-5.0 * along, 5.0 * along, third * along + width * aside])


def over_a_face(rng, hull: Hull, size: float) -> np.ndarray:
    """Return a triangle (3, 3) m nearly parallel to a face of the body and 1 m from it; size : of the triangle (m)."""
    face = hull.faces[rng.integers(len(hull.faces))].astype(float)
    u = unit(face[1] - face[0])
    n = unit(np.cross(u, face[2] - face[0]))
    flat = size * rng.normal(size=(3, 2)) @ np.array([u, np.cross(n, u)])
    return flat + np.cross(10.0 ** rng.uniform(-14, -2) * rng.normal(size=3), flat) + face.mean(0) + n


def over_an_edge(rng, hull: Hull) -> np.ndarray:
    """Return a triangle (3, 3) m with an edge nearly parallel to an edge of the body."""
    edge = hull.edges[rng.integers(len(hull.edges))].astype(float)
    middle, length = edge.mean(0), 10.0 ** rng.uniform(-1, 3)
    along, out = unit(edge[1] - edge[0]) + 10.0 ** rng.uniform(-14, -2) * rng.normal(size=3), unit(middle)
    a, b = -rng.uniform() * length * along, rng.uniform() * length * along
    return np.array([a, b, length * out + 0.1 * length * rng.normal(size=3)]) + middle + 0.5 * out


KINDS = {
    "random": lambda rng, hull: rng.normal(size=(3, 3)) + rng.normal(size=3),
    "tiny": lambda rng, hull: 10.0 ** rng.uniform(-5, -2) * rng.normal(size=(3, 3)) + rng.normal(size=3),
    "huge": lambda rng, hull: 1000.0 * rng.normal(size=(3, 3)),
    "needle": lambda rng, hull: sliver(rng, 1e-3) + rng.normal(size=3),
    "sliver": lambda rng, hull: sliver(rng, 10.0 ** rng.uniform(-9, -4)) + rng.normal(size=3),
    "parallel": lambda rng, hull: over_a_face(rng, hull, 10.0 ** rng.uniform(-1, 1)),
    "huge-parallel": lambda rng, hull: over_a_face(rng, hull, 1000.0),
    "along-an-edge": lambda rng, hull: over_an_edge(rng, hull),
}
GAPS = (math.nan, 1e-6, 1e-3, 0.1, 1.0, 100.0, -1e-3, -1e-9, 1e-9)
"""Gaps (m) to which the triangles are shifted; NaN: the triangle is not shifted."""
UNCLEAR = 1e-8
"""Gap (m) below which rounding of the input decides whether there is overlap."""
PER_KIND = 36


class Pairs(NamedTuple):
    """Facets (N, 3, 3) m of all kinds around a body, with exact distances (N,) m and nearest points (N, 3) m.

    gaps : (N,) m, to which the facets were shifted
    """

    facets: np.ndarray
    distances: np.ndarray
    on_body: np.ndarray
    on_facet: np.ndarray
    gaps: np.ndarray


def shifted(hull: Hull, facet: np.ndarray, gap: float) -> np.ndarray:
    """Return the facet (3, 3) m, shifted to a given gap (m) from the body; a negative gap is an overlap."""
    while not (found := by_features(hull, facet))[0] > 0:
        facet = facet + unit(facet.mean(0) + 1e-3)
    distance, body, ground = found
    return facet + ((body - ground) / distance * (distance - gap)).astype(float)


@cache
def pairs_of(body: str) -> Pairs:
    rng, hull = np.random.default_rng(list(BODIES).index(body)), HULLS[body]
    gaps = np.array([GAPS[i % len(GAPS)] for i in range(PER_KIND)] * len(KINDS))
    drawn = [kind(rng, hull) for kind in KINDS.values() for _ in range(PER_KIND)]
    facets = [f if math.isnan(gap) else shifted(hull, f, gap) for f, gap in zip(drawn, gaps, strict=True)]
    results = [by_features(hull, f) for f in facets]
    distances, on_body, on_facet = (np.array([r[i] for r in results], float) for i in range(3))
    return Pairs(np.array(facets), distances, on_body, on_facet, gaps)


def found_for(body: str, guesses: np.ndarray, size: float = 1.0) -> np.ndarray:
    facets = size * pairs_of(body).facets
    found = np.zeros((len(facets), 11))
    searched(BODIES[body], size, facets, guesses, found)
    return found


def from_outside(body: str) -> np.ndarray:
    """Return first guesses (N, 3): the directions from the middle of each facet to the body."""
    return -pairs_of(body).facets.mean(1)


def size_of(body: str) -> float:
    return float(np.linalg.norm(BODIES[body], axis=1).max())


EVERY_BODY = pytest.mark.parametrize("body", BODIES)


@EVERY_BODY
def test_the_distance_of_any_pair_is_that_of_its_nearest_features(body):
    pairs = pairs_of(body)
    for guesses in (from_outside(body), np.random.default_rng(1).normal(size=(len(pairs.facets), 3))):
        error = np.abs(found_for(body, guesses)[:, 0] - pairs.distances)
        assert error.max() <= 0.01 * CLOSE * size_of(body) + 1e-14 * 100.0


@EVERY_BODY
def test_a_pair_is_found_to_overlap_exactly_if_its_features_cross(body):
    pairs = pairs_of(body)
    clear = ~(np.abs(pairs.gaps) < UNCLEAR)
    overlap = found_for(body, from_outside(body))[:, 10] == 1.0
    assert np.array_equal(overlap[clear], pairs.distances[clear] == 0.0)
    assert 20 < np.count_nonzero(overlap) < len(overlap) / 2


@EVERY_BODY
def test_the_normal_separates_body_and_triangle_by_the_distance(body):
    # Two parallel planes this far apart, and two points this near, prove the distance without another search.
    found = found_for(body, from_outside(body))
    apart = found[:, 10] == 0.0
    normals = found[:, 1:4]
    room = (BODIES[body] @ normals.T).min(0) - np.einsum("kij,kj->ki", pairs_of(body).facets, normals).max(1)
    assert np.abs(np.linalg.norm(normals, axis=1) - 1.0).max() < 1e-15 * 4
    assert np.abs(room - found[:, 0])[apart].max() <= 0.02 * CLOSE * size_of(body)


@EVERY_BODY
def test_the_nearest_points_lie_on_the_body_and_on_the_triangle_at_the_distance(body):
    found, pairs, hull = found_for(body, from_outside(body)), pairs_of(body), HULLS[body]
    slack = 0.1 * CLOSE * size_of(body)
    on_facet, on_body = found[:, 4:7].astype(WIDE), found[:, 7:10].astype(WIDE)
    f = pairs.facets.astype(WIDE)
    aside = on_facet - point_triangle(on_facet, f[:, 0], f[:, 1], f[:, 2])
    assert np.sqrt(dots(aside, aside)).max() < slack
    planes = wide_cross(hull.faces[:, 1] - hull.faces[:, 0], hull.faces[:, 2] - hull.faces[:, 0])
    planes /= np.sqrt(dots(planes, planes))[:, None]
    assert dots(on_body[:, None] - hull.faces[:, 0], planes).max() < slack
    apart = found[:, 10] == 0.0
    length = np.linalg.norm((on_body - on_facet).astype(float), axis=1)
    assert np.abs(length - found[:, 0])[apart].max() < slack


@EVERY_BODY
def test_the_nearest_points_of_a_random_triangle_are_those_of_its_nearest_features(body):
    found, pairs = found_for(body, from_outside(body)), pairs_of(body)
    rows = np.flatnonzero((found[:, 10] == 0.0) & (pairs.distances > UNCLEAR))
    rows = rows[rows < PER_KIND]  # within rounding, the other kinds have many nearest points
    assert len(rows) > 10
    assert np.abs(found[rows, 4:7] - pairs.on_facet[rows]).max() < 1e-7
    assert np.abs(found[rows, 7:10] - pairs.on_body[rows]).max() < 1e-7


def test_a_body_of_another_size_has_the_distances_of_its_scaled_corners():
    found, small = found_for("equant", from_outside("equant")), found_for("equant", from_outside("equant"), 0.01)
    assert np.allclose(small[:, 0], 0.01 * found[:, 0], rtol=1e-12, atol=0.01 * CLOSE)


def test_the_length_of_the_guess_changes_nothing_and_the_right_guess_gives_the_same_distance():
    first = found_for("equant", from_outside("equant"))
    assert np.array_equal(found_for("equant", 1024.0 * from_outside("equant"))[:, :1], first[:, :1])
    assert np.abs(found_for("equant", first[:, 1:4].copy())[:, 0] - first[:, 0]).max() <= 0.01 * CLOSE


def test_an_overlap_has_distance_0_and_the_guess_as_normal():
    guesses = 3.0 * from_outside("equant")
    found = found_for("equant", guesses)
    overlap = found[:, 10] == 1.0
    assert np.all(found[overlap, 0] == 0.0)
    assert np.allclose(found[overlap, 1:4], [unit(g) for g in guesses[overlap]], rtol=0, atol=1e-15)


@EVERY_BODY
def test_both_engines_find_the_same_bits(body):
    pairs = pairs_of(body)
    rows = np.arange(0, len(pairs.facets), 5)
    facets, guesses = pairs.facets[rows].copy(), from_outside(body)[rows].copy()
    found, plain = np.zeros((len(rows), 11)), np.zeros((len(rows), 11))
    searched(BODIES[body], 0.7, facets, guesses, found)
    searched.py_func(BODIES[body], 0.7, facets, guesses, plain)
    assert np.array_equal(found, plain)


# --- by hand ----------------------------------------------------------------------------------------------------------

UNDER = ((-9.0, -9.0, -2.0), (9.0, -9.0, -2.0), (0.0, 9.0, -2.0))
CUBE = box(2.0, 2.0, 2.0)
ORDERS = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [1, 0, 2], [2, 1, 0]]


@pytest.mark.parametrize(
    ("facet", "distance", "normal"),
    [
        (UNDER, 1.0, (0.0, 0.0, 1.0)),  # face over face
        (((0.0, 0.0, -2.0), (1.0, 0.0, -9.0), (0.0, 1.0, -9.0)), 1.0, (0.0, 0.0, 1.0)),  # corner under a face
        (((-5.0, 3.0, 3.0), (5.0, 3.0, 3.0), (0.0, 9.0, 9.0)), math.sqrt(8.0), (0.0, -(0.5**0.5), -(0.5**0.5))),
        (((4.0, 1.0, 1.0), (9.0, 8.0, 8.0), (9.0, 9.0, 7.0)), 3.0, (-1.0, 0.0, 0.0)),
        (((2.0, 2.0, 2.0), (9.0, 9.0, 7.0), (9.0, 7.0, 9.0)), math.sqrt(3.0), (-(3**-0.5), -(3**-0.5), -(3**-0.5))),
        (((3.0, -3.0, 0.0), (3.0, 9.0, 0.5), (9.0, 0.0, 0.0)), 2.0, (-1.0, 0.0, 0.0)),  # edge next to a face
    ],
)
def test_a_cube_has_the_distances_known_by_hand(facet, distance, normal):
    s = separation(CUBE, 0, 8, 1.0, facet, (0.3, 0.2, 0.1))
    assert s.distance == pytest.approx(distance, rel=1e-15)
    assert s.normal == pytest.approx(normal, abs=1e-15)
    assert not s.overlap


def test_a_triangle_has_the_nearest_point_to_the_origin_in_every_order_of_its_corners():
    rng = np.random.default_rng(9)
    triangles = rng.normal(size=(500, 3, 3)) + 0.7 * rng.normal(size=(500, 1, 3))
    for corners in triangles:
        nearest = point_triangle(np.zeros(3, WIDE), *corners.astype(WIDE))
        exact = float(np.sqrt(dots(nearest, nearest)))
        for order in ORDERS:
            found = on_face(*(Vertex(tuple(corners[i].tolist()), i, 0) for i in order))
            mean = sum(
                weight * corners[vertex.body]
                for weight, vertex in zip(found.weights[: found.size], (found.a, found.b, found.c), strict=False)
            )
            assert math.sqrt(found.square) == pytest.approx(exact, rel=1e-13)
            assert np.allclose(mean, found.v, rtol=0.0, atol=1e-14)
            assert min(found.weights) >= 0.0


@pytest.mark.parametrize("facet", [(UNDER[0], UNDER[1], UNDER[1]), (UNDER[2], UNDER[2], UNDER[2])])
def test_a_triangle_without_area_is_an_edge_or_a_point(facet):
    s = separation(CUBE, 0, 8, 1.0, facet, (0.3, 0.2, 0.1))
    assert s.distance == pytest.approx(math.sqrt(65.0), rel=1e-15)  # 8 m in y and 1 m in z, for both


def test_a_body_has_the_corners_of_its_rows_only():
    rows = np.vstack([50.0 * CUBE, CUBE, 70.0 * CUBE])
    assert separation(rows, 8, 16, 1.0, UNDER, (1.0, 0.0, 0.0)) == separation(CUBE, 0, 8, 1.0, UNDER, (1.0, 0.0, 0.0))
    assert separation(rows, 0, 8, 1.0, UNDER, (1.0, 0.0, 0.0)).overlap
