"""Tests that spheres that roll along a convex edge pass its end or take off there, without unresolved contacts.

A sphere sinks into an edge by two tolerances. Near the end of the edge, the sphere also touches the corner, the next
edge and the edges of narrow facets, all at almost the same depth.
"""

import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH
from flights.rolling_spheres import places_of, roll, spheres
from flights.scenes_of_facets import engine_over, grid_triangles, rough_grid, terrain_of

from rpf3d_core.detection.sphere_contact import earlier_touch
from rpf3d_core.detection.sphere_course import NO_TOUCH, Course
from rpf3d_core.materials.library import Surface
from rpf3d_core.values import Outcome

GROUND = Surface(0.3, 0.8, 0.5, 0.0, 0.3)
STEP, LENGTH = 0.5, 20.0
"""Distance (m) between the vertices of the crest, and length (m) of the crest."""
OFF = np.geomspace(1e-14, 1e-5, 73)
"""Distances of a sphere from a vertex along the crest (m); the contact tolerance is 2e-11 m."""


def roof(fall: float = 0.0):
    """Return a crest along x at y = 0 with a slope on both sides; fall : of the crest along x (m/m), 0 for level."""
    x, y = np.meshgrid(np.arange(0.0, LENGTH + 1e-9, STEP), [-5.0, 0.0, 5.0], indexing="ij")
    return terrain_of(np.stack([x, y, -0.5 * np.abs(y) - fall * x], -1).reshape(-1, 3), grid_triangles(x.shape[0], 3))


@pytest.mark.parametrize("radius", [0.05, 0.5])
@pytest.mark.parametrize("speed", [3.0, 10.0])
def test_no_sphere_is_caught_at_a_vertex_of_a_level_crest(radius, speed):
    engine = engine_over("compiled", roof())
    along, deep = np.meshgrid([*-OFF, 0.0, *OFF], [0.0, 1.0, 2.0])
    heights = radius - deep.ravel() * engine.facets.tolerance
    x = np.column_stack([3.0 * STEP + along.ravel(), np.zeros(along.size), heights])
    flights = roll(engine, spheres(GROUND, max_time=3.0), radius, x, (speed, 0.0, 0.0), threads=1)
    assert np.isin(flights.deposits.outcome, [Outcome.MAX_TIME, Outcome.STOPPED]).all()
    np.testing.assert_allclose(flights.deposits.x[:, 1:], [[0.0, radius]] * len(x), rtol=0.0, atol=1e-9)
    assert np.ptp(flights.deposits.x[:, 0] - x[:, 0]) < 0.02, "all roll almost equally far"


@pytest.mark.parametrize("fall", [0.1, 0.5, 0.8])
@pytest.mark.parametrize("radius", [0.05, 0.5, 1.7])
def test_no_sphere_sinks_into_a_crest_that_falls_along_its_line(radius, fall):
    """At a vertex, a sphere that is fast enough takes off, and must land on the next edge of the crest."""
    engine, up = engine_over("compiled", roof(fall)), math.hypot(1.0, fall)
    along, deep, speed = np.meshgrid([*-OFF[::6], 0.0, *OFF[::6]], [0.0, 1.9, 2.1, 3.0], [1.0, 4.0, 12.0])
    x = np.zeros((along.size, 3))
    x[:, 0] = 3.0 * STEP + along.ravel()
    x[:, 2] = -fall * x[:, 0]
    x += (radius - deep.ravel() * engine.facets.tolerance)[:, None] / up * np.array([fall, 0.0, 1.0])
    v = speed.ravel()[:, None] / up * np.array([1.0, 0.0, -fall])
    flights = roll(engine, spheres(GROUND, max_time=3.0, max_impacts=5000), radius, x, v, threads=1)
    places = places_of(flights)
    places = places[(places[:, 0] > 0.0) & (places[:, 0] < LENGTH)]
    assert ((places[:, 2] + fall * places[:, 0]) / up).min() > radius - 1e-8, "distance from the line of the crest"
    assert np.isin(flights.deposits.outcome, [Outcome.MAX_TIME, Outcome.STOPPED, Outcome.LEFT_TERRAIN]).all()


@BOTH
def test_a_sphere_rolls_over_the_vertices_of_a_crest_for_ten_metres(engine):
    """With this release, a sphere once ended on the vertex at x = 9 m as an unresolved contact."""
    over, radius, physics = engine_over(engine, roof()), 0.05, spheres(GROUND._replace(mu_r=0.0), max_time=14.0)
    flights = roll(over, physics, radius, (0.185, 0.0, radius), (1.0, 0.0, 0.0))
    assert flights.deposits.outcome[0] == Outcome.MAX_TIME
    assert flights.deposits.x[0, 0] == pytest.approx(0.185 + 14.0 * 5.0 / 7.0, abs=0.1)


@pytest.mark.parametrize("off", [1e-8, 1e-7, 1e-6])
@pytest.mark.parametrize("deep", [1.6, 2.0, 3.0])
def test_the_end_of_an_edge_does_not_stop_a_sphere_that_rolls_on_the_edge(off, deep):
    """Just before the end of the edge, the sphere touches the corner, too, and approaches it slowly."""
    one = terrain_of([[0, 0, 0], [LENGTH, 0, 0], [0, 10, 0]], [[0, 1, 2]])
    facets, radius = engine_over("compiled", one).facets, 0.5
    x = LENGTH - off, 0.0, radius - deep * facets.tolerance
    course = Course(x=x, v=(3.0, 0.0, 0.0), a=(-1.0, 0.0, 0.0), radius=radius, gravity=9.81)
    assert earlier_touch(facets, 0, course, 0.1, 0.1, NO_TOUCH).t == math.inf
    sinking = course._replace(v=(3.0, 0.0, -1e-3))
    assert earlier_touch(facets, 0, sinking, 0.1, 0.1, NO_TOUCH).t == 0.0, "the edge stops it"


@pytest.mark.parametrize("mu", [0.0, 0.6])
@pytest.mark.parametrize("overhang", [0.0, 5.0])
def test_a_sphere_at_rest_at_the_brow_of_a_wall_takes_off_where_the_contact_is_level(mu, overhang):
    """The brow is at x = 0, z = 0; the contact of the sphere is up to 2 degrees above level at the release."""
    foot = -20.0 * math.sin(math.radians(overhang))
    corners = [[-9, -9, 0], [0, -9, 0], [0, 9, 0], [-9, 9, 0], [foot, -9, -20], [foot, 9, -20]]
    engine = engine_over("compiled", terrain_of(corners, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]))
    radius, above = 1.5, np.array([1e-6, 1e-4, 2e-3, 5e-3, 0.01, 0.02, 0.03, 0.035])
    x = radius * np.column_stack([np.cos(above), np.zeros(above.size), np.sin(above)])
    flights = roll(engine, spheres(GROUND._replace(mu=mu), max_time=3.0), radius, x, threads=1)
    paths = flights.paths
    energy = 9.81 * paths.x[:, 2] + 0.5 * (paths.v**2).sum(axis=1)
    assert (energy - 9.81 * x[paths.row, 2]).max() < 1e-6 and (np.bincount(paths.row) > 2).any(), "and some roll"
    at_brow = np.abs(np.hypot(paths.x[:, 0], paths.x[:, 2]) - radius) < 1e-9
    assert paths.x[at_brow, 2].min() > -1e-4 * radius
    assert (flights.deposits.outcome == Outcome.LEFT_TERRAIN).all(), "none stays at the brow"


@pytest.mark.parametrize("radius", [0.05, 0.1, 0.5])
def test_a_sphere_that_flies_over_a_crest_of_a_large_terrain_lands_on_the_level_facet_behind_it(radius):
    """The facet before the crest rises; at the release, the foot of the sphere is outside the level facet.

    Some spheres swing around the crest in flight: each rises to its height above the level facet, but not higher.
    """
    size, outside, share = 1000.0, np.repeat([0.0145, 0.02, 0.033, 0.045], 11), np.tile(np.linspace(-0.5, 1.0, 11), 4)
    speed = np.sqrt(9.81 * radius * (1.0 - 0.5 * share * outside**2))
    up = np.sqrt(1.0 - outside**2)
    x = radius * np.column_stack([-outside, np.zeros(outside.size), up])
    v = speed[:, None] * np.column_stack([up, np.zeros(outside.size), outside])
    for rise in np.unique(outside):
        low, rows = -size * math.tan(math.asin(rise)), outside == rise
        corners = size * np.array([[-1, -1, 0], [0, -1, 0], [0, 1, 0], [-1, 1, 0], [1, -1, 0], [1, 1, 0]])
        corners[[0, 3], 2] = low
        engine = engine_over("compiled", terrain_of(corners, [[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]))
        flights = roll(engine, spheres(GROUND, max_time=0.15), radius, x[rows], v[rows])
        assert flights.deposits.x[:, 2].min() > radius - 1e-6, "none is below the level facet"


@pytest.mark.parametrize("size", [1e3, 1e4])
def test_spheres_that_skid_around_edges_of_rough_ground_roll_on_in_a_large_terrain(size):
    """On an edge, spin can keep the slip of a sphere near zero; such spheres once ended as unresolved contacts."""
    rough, random, count = rough_grid(40, 80.0, 0.36, 0.15, seed=5), np.random.default_rng(3), 900
    far = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])  # makes the contact tolerance larger
    place = np.array([0.7 * size, 0.7 * size, 0.0])
    vertices, alone = np.vstack([rough.vertices + place, far]), len(rough.vertices) + np.arange(3)
    terrain = terrain_of(vertices, np.vstack([rough.triangles, alone]))
    radius, at = random.choice([0.05, 0.1, 0.25], count), random.uniform([5.0, 10.0], [30.0, 70.0], (count, 2))
    x = np.column_stack([at, -0.36 * at[:, 0] + 0.15 + 1.4 * radius + random.choice([0.01, 0.3, 2.0], count)])
    v = np.column_stack([random.uniform(0.0, 3.0, count), random.uniform(-2.0, 2.0, count), np.zeros(count)])
    ground = Surface(0.35, 0.8, 0.5, 0.1, 0.35)
    physics = spheres(ground, max_time=60.0, max_impacts=100_000)
    flights = roll(engine_over("compiled", terrain), physics, radius, x + place, v)
    assert np.isin(flights.deposits.outcome, [Outcome.STOPPED, Outcome.LEFT_TERRAIN]).all()
    assert flights.deposits.path.mean() > 5.0
