"""Tests of spheres on facets that are almost one plane: they take off at each seam for nanoseconds and land again.

If the heights of a plane have noise of 1e-10 to 1e-3 m, the angles between its facets are 1e-10 to 1e-3 rad. A rotation
or shift in float64 has this effect. The tests compute the height above the plane from the plane's equation alone.
"""

import itertools
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

RADIUS, FALL, STEEP = 0.5, 0.6, 200.0
"""Radius (m) of the spheres; falls (m/m) of the slope and of the wall, which are 31 and 89.7 degrees."""
GROUND = Surface(0.3, 0.8, 0.6, 0.05, 0.05)
NOISES = (0.0, 1e-9, 1e-8, 1e-7, 1e-6)
"""Heights of noise (m), by which the vertices of a plane move up or down."""


def released(random: np.random.Generator, count: int, fall: float = FALL) -> tuple[np.ndarray, np.ndarray]:
    """Return positions (R, 3) m of spheres 5 cm above the plane, and their velocities (R, 3) m/s."""
    x = np.column_stack([random.uniform(3.0, 10.0, count), random.uniform(15.0, 45.0, count), np.zeros(count)])
    x[:, 2] = -fall * x[:, 0] + (RADIUS + 0.05) * math.hypot(1.0, fall)
    return x, np.column_stack([random.uniform(0.0, 3.0, count), random.uniform(-2.0, 2.0, count), np.zeros(count)])


def height_of(places: np.ndarray, fall: float = FALL) -> np.ndarray:
    """Return the height (N,) m of centres inside the plane's border above the plane through the facets."""
    inside = ((places[:, :2] > 0.6) & (places[:, :2] < 59.4)).all(axis=1)
    return (places[inside, 2] + fall * places[inside, 0]) / math.hypot(1.0, fall)


@pytest.mark.parametrize("noise", [0.0, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_no_sphere_sinks_into_the_plane(noise):
    x, v = released(np.random.default_rng(int(1e12 * noise) + 7), 60)
    engine = engine_over("compiled", rough_grid(20, 60.0, FALL, noise))
    flights = roll(engine, spheres(GROUND, max_time=30.0, max_impacts=2000), RADIUS, x, v, threads=1)
    assert np.isin(flights.deposits.outcome, [Outcome.LEFT_TERRAIN, Outcome.STOPPED]).all()
    assert height_of(places_of(flights)).min() > RADIUS - 2.0 * noise - 1e-7


@pytest.mark.parametrize("noise", [0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3])
def test_no_sphere_sinks_into_a_wall(noise):
    """Spheres fall along the wall and bounce on it; noise in z displaces the wall STEEP times less across it."""
    x, v = released(np.random.default_rng(int(1e12 * noise) + 8), 60, STEEP)
    v[:, 0] = -np.abs(v[:, 0])
    engine = engine_over("compiled", rough_grid(20, 60.0, STEEP, noise))
    flights = roll(engine, spheres(GROUND, max_time=30.0, max_impacts=2000), RADIUS, x, v, threads=1)
    assert flights.deposits.impacts.min() > 0
    assert height_of(places_of(flights), STEEP).min() > RADIUS - 2.0 * noise - 1e-7


@BOTH
def test_both_engines_keep_a_sphere_on_the_plane(engine):
    terrain, (x, v) = rough_grid(20, 60.0, FALL, 1e-8), released(np.random.default_rng(11), 2)
    flights = roll(engine_over(engine, terrain), spheres(GROUND, max_time=30.0), RADIUS, x, v)
    assert height_of(places_of(flights)).min() > RADIUS - 1e-7


@pytest.mark.parametrize("width", [1e-3, 3e-4, 3e-5, 1e-6])
def test_spheres_roll_over_needles_in_the_plane_as_if_there_were_none(width):
    """A strip of this width (m), of triangles 4 m long, crosses the slope, as meshes have along berms."""
    corners = np.meshgrid([0.0, 8.0, 8.0 + width, 24.0], np.arange(0.0, 60.1, 4.0), indexing="ij")
    slope = terrain_of(np.stack([*corners, -FALL * corners[0]], -1).reshape(-1, 3), grid_triangles(4, 16))
    random, count, up = np.random.default_rng(31), 150, math.hypot(1.0, FALL)
    radius = np.repeat([0.1, 0.25, 1.0], count // 3)
    at = np.column_stack([np.full(count, 3.0), random.uniform(8.0, 52.0, count), np.full(count, -3.0 * FALL)])
    at += radius[:, None] / up * np.array([FALL, 0.0, 1.0])
    v = np.column_stack([np.zeros(count), random.normal(0.0, 0.5, count), np.zeros(count)])
    flights = roll(engine_over("compiled", slope), spheres(GROUND, max_time=60.0), radius, at, v)
    assert (flights.deposits.outcome == Outcome.LEFT_TERRAIN).all()
    assert flights.deposits.x[:, 0].min() > 23.0, "at the lower border"


@pytest.mark.parametrize("noise", [1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-4])
@pytest.mark.parametrize("radius", [0.1, 0.5, 1.3])
def test_fast_spheres_pass_the_vertices_and_the_lower_border_of_the_plane(noise, radius):
    """They roll along a line of the grid from vertex to vertex, faster than a sphere that can roll over a true edge."""
    random, up, step = np.random.default_rng(int(1e12 * noise) + 9), math.hypot(1.0, FALL), 3.0
    corner = random.integers([1, 2], [12, 18], (60, 2)) * step
    x = np.column_stack([corner, -FALL * corner[:, 0]]) + radius / up * np.array([FALL, 0.0, 1.0])
    v = random.choice([0.0, 3.0, 15.0], 60)[:, None] / up * np.array([1.0, 0.0, -FALL])
    engine = engine_over("compiled", rough_grid(20, 60.0, FALL, noise))
    flights = roll(engine, spheres(GROUND, max_time=60.0, max_impacts=5000), radius, x, v, threads=1)
    assert (flights.deposits.outcome == Outcome.LEFT_TERRAIN).all()
    heights = height_of(places_of(flights))
    assert heights.min() > radius - 2.0 * noise - 1e-7
    assert heights.max() < radius + 2.0 * noise + 1e-7, "no sphere flies off the plane"


@BOTH
def test_a_sphere_at_rest_on_a_vertex_slides_down_without_friction(engine):
    """On each of the two facets that it touches, gravity pulls the sphere into the other, by 1e-7 of its weight."""
    at = np.array([[0, 0], [0, 1], [1, 0], [1, 1], [1, 2], [2, 1], [2, 2]]) * 2.4
    heights = [
        -3.846205546816104, -3.8462056084127627, -5.128274144934796, -5.128274160251557, -5.128274114078072,
        -6.410342609599499, -6.41034267746833,
    ]  # fmt: skip
    facets = [[0, 2, 3], [1, 3, 4], [3, 5, 6], [0, 3, 1], [2, 5, 3], [3, 6, 4]]
    over = engine_over(engine, terrain_of(np.column_stack([at, heights]), facets))
    centre = 3.20100595002792, 2.400000009569547, -3.6288111003464896
    flights = roll(over, spheres(GROUND._replace(mu=0.0), max_time=30.0), 1.7, centre)
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN


@pytest.mark.parametrize("mu", [0.5, 5.0])
@pytest.mark.parametrize("R_n, noise", [(0.0, 1e-5), *itertools.product([0.0, 1.0], NOISES)])
def test_spheres_released_in_motion_on_a_seam_leave_it(R_n, noise, mu):
    """Each sphere moves along one facet, from a vertex or an edge of it, so other facets touch the sphere, too."""
    random, count = np.random.default_rng(int(1e12 * noise) + 13), 300
    terrain = rough_grid(20, 60.0, FALL, noise)
    corners = terrain.vertices[terrain.triangles]
    plan = corners[:, :, :2].reshape(len(corners), 6)
    corner = corners[random.choice(np.flatnonzero((plan.min(axis=1) > 15.0) & (plan.max(axis=1) < 45.0)), count)]
    first = random.integers(0, 3, count)
    begin, end = corner[np.arange(count), first], corner[np.arange(count), (first + 1) % 3]
    n = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    radius = random.uniform(0.1, 2.0, count)
    share = np.where(random.random(count) < 0.3, 0.0, random.random(count))[:, None]
    x = begin + share * (end - begin) + radius[:, None] * n
    way = np.cross(random.normal(size=(count, 3)), n)
    v = way / np.linalg.norm(way, axis=1)[:, None] * 10.0 ** random.uniform(-2.0, 1.0, count)[:, None]
    ground = GROUND._replace(R_n=R_n, mu=mu, mu_r=0.02)
    flights = roll(engine_over("compiled", terrain), spheres(ground, max_time=1.0, max_impacts=5000), radius, x, v)
    assert (flights.deposits.outcome == Outcome.MAX_TIME).all()
    moved = flights.deposits.x - x
    assert np.linalg.norm(moved, axis=1).min() > 0.05
    across = (moved[:, 2] + FALL * moved[:, 0]) / math.hypot(1.0, FALL)
    assert np.abs(across).max() < 2.0 * noise + 1e-7, "all spheres stay on the plane"


@pytest.mark.parametrize("noise", NOISES)
@pytest.mark.parametrize("dip", [0.05, 0.3])
def test_spheres_released_in_motion_in_a_groove_move_on(noise, dip):
    """The flanks of the groove consist of facets that are almost one plane; the spheres touch a seam of each flank."""
    random, count, steep = np.random.default_rng(int(1e12 * noise) + 17), 300, 1.5
    along, across = np.meshgrid(np.arange(0.0, 60.1, 3.0), np.arange(-9.0, 9.1, 3.0), indexing="ij")
    heights = -dip * along + steep * np.abs(across) + noise * random.uniform(-1.0, 1.0, along.shape)
    groove = terrain_of(np.stack([along, across, heights], -1).reshape(-1, 3), grid_triangles(*along.shape))
    n = np.array([dip, -steep, 1.0]) / math.sqrt(dip * dip + steep * steep + 1.0)
    radius = random.uniform(0.1, 2.0, count)
    place = 3.0 * random.integers(4, 12, count) + radius * n[0]
    x = np.column_stack([place, np.zeros(count), -dip * place + radius / n[2]])
    speed = random.choice([-1.0, 1.0], count) * 10.0 ** random.uniform(-1.0, 1.0, count)
    v = speed[:, None] * np.array([1.0, 0.0, -dip]) / math.hypot(1.0, dip)
    ground = GROUND._replace(R_n=0.0, mu=2.0, mu_r=0.02)
    flights = roll(engine_over("compiled", groove), spheres(ground, max_time=0.5, max_impacts=5000), radius, x, v)
    assert np.isin(flights.deposits.outcome, [Outcome.MAX_TIME, Outcome.LEFT_TERRAIN]).all()


@pytest.mark.parametrize("outside", [1e-5, 1e-4, 1e-3])
def test_a_sphere_that_swings_around_an_edge_in_flight_lands_on_the_facet_behind_the_edge(outside):
    """Gravity just bends the path around the edge: the sphere rises to the plane of the facet, but not above it."""
    facets = engine_over("compiled", terrain_of([[0, -9, 0], [9, 0, 0], [0, 9, 0]], [[0, 1, 2]])).facets
    speed, height = math.sqrt(9.81 * RADIUS * (1.0 - 1e-6)), math.sqrt(RADIUS**2 - outside**2)
    v = speed * height / RADIUS, 0.0, speed * outside / RADIUS
    course = Course(x=(-outside, 0.0, height), v=v, a=(0.0, 0.0, -9.81), radius=RADIUS, gravity=9.81)
    touch = earlier_touch(facets, 0, course, 1.0, 1.0, NO_TOUCH)
    at_border = outside / v[0]
    assert touch.face and 0.99 * at_border < touch.t < 2.01 * at_border  # the second: it comes back to its height


@pytest.mark.parametrize("size, noise, radius", [(1e3, 0.2, 0.1), (1e3, 0.2, 0.5), (1e4, 0.2, 0.05), (1e4, 0.5, 0.05)])
@pytest.mark.parametrize("at", ["edge", "vertex"])
def test_spheres_released_at_rest_on_an_edge_of_a_large_terrain_roll_down(size, noise, radius, at):
    """Each sphere touches the facets on both sides within rounding; none holds it on a slope of 38 degrees."""
    random, count = np.random.default_rng(17), 300
    terrain = rough_grid(100, size, 0.8, noise)
    corners = terrain.vertices[terrain.triangles]
    middles = corners.mean(axis=1)[:, :2]
    inner = np.flatnonzero(((middles > 0.1 * size) & (middles < 0.9 * size)).all(axis=1))
    corner = corners[random.choice(inner, count)]
    n = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    n /= np.linalg.norm(n, axis=1)[:, None]
    share = random.random(count)[:, None] if at == "edge" else 0.0
    x = corner[:, 0] + share * (corner[:, 1] - corner[:, 0]) + radius * n
    flights = roll(engine_over("compiled", terrain), spheres(GROUND, max_time=0.1, max_impacts=3000), radius, x)
    assert (flights.deposits.outcome == Outcome.MAX_TIME).all()
    assert (x[:, 2] - flights.deposits.x[:, 2]).min() > 0.005, "a sphere that rolls freely falls by 13 mm"
