"""Tests of impacts and releases on edges and vertices, exactly or within 1e-12 m."""

import dataclasses
import math

import numpy as np
import pytest
from flights.on_both_engines import BOTH, MODELS, NEAR, G, lies_on, loses_energy
from flights.scenes_of_facets import (
    cone,
    down_the_slope,
    engine_over,
    flight,
    floor,
    fly,
    incline,
    rough_grid,
    strip,
    surface,
    terrain_of,
)

from rpf3d_core.effects.drag import Drag
from rpf3d_core.effects.hooks import chain_of
from rpf3d_core.ensemble.releases import Releases, check_above_ground
from rpf3d_core.errors import InputError
from rpf3d_core.terrain.frame import Frame
from rpf3d_core.values import Outcome

SPOTS = {
    "inside a facet": (1.3, 0.4),
    "on an edge": (1.0, 0.25),
    "on a diagonal": (0.5, 0.5),
    "on a vertex": (1.0, 1.0),
}
ANYWHERE = pytest.mark.parametrize("spot", SPOTS.values(), ids=SPOTS)
HAIR = pytest.mark.parametrize("off", [0.0, 1e-12, -1e-12], ids=["on it", "1e-12 m above", "1e-12 m below"])
"""Offsets (m) below the contact tolerance of these terrains (1e-11 m) but above rounding errors (1e-15 m)."""


def one_release(*x):
    ones, zeros = np.ones(1), np.zeros(1, dtype=int)
    return Releases(zeros, zeros, np.array([x]), np.zeros((1, 3)), ones, ones)


# --- releases ---------------------------------------------------------------------------------------------------------


@BOTH
@MODELS
@HAIR
@ANYWHERE
def test_a_rock_released_at_rest_on_level_ground_stays_there(engine, model, off, spot):
    over = engine_over(engine, floor(4.0, z=3.0, cells=8))
    flights = fly(over, flight(surface(stop_speed=0.0), model), (*spot, 3.0 + off))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    np.testing.assert_array_equal(flights.deposits.x[0, :2], spot)
    assert flights.deposits.x[0, 2] == pytest.approx(3.0, abs=abs(off)) and flights.deposits.impacts[0] == 0
    check_above_ground(one_release(*spot, 3.0 + off), ["crest"], over, Frame())


@BOTH
@HAIR
@ANYWHERE
def test_a_rock_released_at_rest_on_a_steep_slope_slides_off_it_wherever_it_lies(engine, off, spot):
    over = engine_over(engine, rough_grid(8, 8.0, 1.0, 0.0))
    flights = fly(over, flight(surface(friction_angle=20.0)), (*spot, -spot[0] + off))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN and flights.deposits.impacts[0] == 0
    a = G * (math.sin(math.pi / 4) - math.tan(math.radians(20)) * math.cos(math.pi / 4))
    way = (8.0 - spot[0]) * math.sqrt(2.0)
    assert flights.deposits.t[0] == pytest.approx(math.sqrt(2 * way / a), rel=1e-5)
    assert flights.deposits.x[0, 1] == pytest.approx(spot[1], abs=NEAR)


@BOTH
@pytest.mark.parametrize("along", [0.0, 0.1, 0.37, 1.0, 2.9, 6.1])
def test_a_rock_that_moves_along_the_slope_it_is_released_on_slides_from_the_start(engine, along):
    """Rounding puts the rock slightly above or below the plane; this must not cause an impact."""
    for angle in (13.0, 31.0, 44.0, 58.0):
        descent, _ = down_the_slope(angle, 21.0)
        over = engine_over(engine, incline(angle, 21.0))
        flights = fly(over, flight(surface(0.5, 0.8, 60.0, 0.0)), along * descent, 3.0 * descent)
        way = 9.0 / (
            2 * G * (math.tan(math.radians(60)) * math.cos(math.radians(angle)) - math.sin(math.radians(angle)))
        )
        assert flights.deposits.impacts[0] == 0
        assert flights.deposits.path[0] == pytest.approx(way, rel=1e-6)


@BOTH
def test_a_rock_under_the_ground_is_refused_by_name_place_and_depth(engine):
    over = engine_over(engine, floor(4.0, z=3.0))
    with pytest.raises(InputError, match=r"'crest'.*rock 0 at \(11\.000, 20\.500, 32\.750\).*0\.25 m under"):
        check_above_ground(one_release(1.0, 0.5, 2.75), ["crest"], over, Frame((10.0, 20.0, 30.0)))


@BOTH
@pytest.mark.parametrize("depth", [1e-8, 1e-6])
def test_a_rock_deeper_under_the_ground_than_any_tolerance_is_refused(engine, depth):
    over = engine_over(engine, floor(4.0, z=3.0))
    with pytest.raises(InputError, match="under the ground"):
        check_above_ground(one_release(1.3, 0.4, 3.0 - depth), ["crest"], over, Frame())


@BOTH
@pytest.mark.parametrize("spot", [(0.5, 2.0), (1.0, 3.0), (0.8, 6.0)], ids=["in a facet", "on a diagonal", "on a seam"])
def test_a_rock_in_the_ground_straight_above_an_edge_of_an_overhang_is_refused(engine, spot):
    """The bench face leans out by 2 m over a height of 4 m; the rock is inside the rock mass under the overhang."""
    profile = [(-6.0, 4.0), (2.0, 4.0), (0.0, 0.0), (6.0, 0.0)]
    corners = [(x, y, z) for y in (0.0, 6.0, 12.0) for x, z in profile]
    facets = [t for k in (0, 1, 2, 4, 5, 6) for t in ((k, k + 1, k + 5), (k, k + 5, k + 4))]
    over = engine_over(engine, terrain_of(corners, facets))
    for height in (2.0 * spot[0] + 0.05, 3.0, 3.9):
        with pytest.raises(InputError, match="under the ground"):
            check_above_ground(one_release(*spot, height), ["crest"], over, Frame())
    for height in (0.0, 0.5, 2.0 * spot[0] - 0.05, 4.0, 4.5):
        check_above_ground(one_release(*spot, height), ["crest"], over, Frame())
    for place in ((0.0, spot[1], 0.0), (2.0, spot[1], 4.0)):  # in the corner at the foot, and on the crest
        check_above_ground(one_release(*place), ["crest"], over, Frame())


@BOTH
@pytest.mark.parametrize("height", [1e-6, 1e-5, 1e-3, 0.03])
def test_a_rock_in_the_ground_straight_above_the_foot_of_an_overhang_is_refused(engine, height):
    """The line that searches the ground next to the release runs along the foot, so it also meets the floor."""
    along, out = np.array([0.4, -1.0]) / math.hypot(0.4, 1.0), np.array([1.0, 0.4]) / math.hypot(0.4, 1.0)
    profile = [(-6.0, 4.0), (2.0, 4.0), (0.0, 0.0), (6.0, 1.0)]
    corners = [(*(x * out + y * along), z) for y in (-6.0, 0.0, 6.0) for x, z in profile]
    facets = [t for k in (0, 1, 2, 4, 5, 6) for t in ((k, k + 5, k + 1), (k, k + 4, k + 5))]
    over = engine_over(engine, terrain_of(corners, facets))
    with pytest.raises(InputError, match="under the ground"):
        check_above_ground(one_release(*(1.3 * along), height), ["crest"], over, Frame())
    in_the_air = 1.3 * along + 0.6 * height * out
    check_above_ground(one_release(*in_the_air, height), ["crest"], over, Frame())


# --- impacts ----------------------------------------------------------------------------------------------------------


@BOTH
@ANYWHERE
def test_a_vertical_drop_on_level_ground_bounces_in_place(engine, spot):
    flights = fly(engine_over(engine, floor(4.0, cells=8)), flight(surface(0.6, 0.8), "none"), (*spot, 2.0))
    t0 = math.sqrt(4.0 / G)
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    assert flights.deposits.t[0] == pytest.approx(t0 * 1.6 / 0.4, rel=1e-12)
    np.testing.assert_array_equal(flights.deposits.x[0], (*spot, 0.0))
    np.testing.assert_allclose(flights.impacts.speed_out, 0.6 * flights.impacts.speed_in, rtol=1e-12)


def rebound_from(n, v, R_n, R_t):
    """Return the velocity -R_n v_n + R_t v_t after an impact with velocity v (3,) m/s on a facet with unit normal n."""
    v_n = (v @ n) * n
    return -R_n * v_n + R_t * (v - v_n)


@BOTH
@pytest.mark.parametrize("across", [0.0, 3.0, -3.0])
def test_an_impact_exactly_on_a_ridge_is_one_impact_on_one_of_its_flanks(engine, across):
    """Both flanks are met at the same time, apart from rounding, which decides (docs/reference/tolerances.md)."""
    over = engine_over(engine, strip([(-10.0, -10.0), (0.0, 0.0), (10.0, -5.0)], across=3))
    fall = 1.0
    v = np.array((across, 0.0, -G * fall))
    flights = fly(
        over, flight(surface(0.5, 0.8), "none", max_impacts=1), (-across * fall, 0.7, 0.5 * G), (across, 0, 0)
    )
    flanks = [np.array((-1.0, 0.0, 1.0)) / math.sqrt(2), np.array((1.0, 0.0, 2.0)) / math.sqrt(5)]
    n = flights.impacts.normal[0]
    assert min(np.abs(n - flank).max() for flank in flanks) < 1e-15
    np.testing.assert_allclose(flights.impacts.x[0], (0.0, 0.7, 0.0), atol=1e-14)
    np.testing.assert_allclose(flights.paths.v[-1], rebound_from(n, v, 0.5, 0.8), rtol=1e-12)


@BOTH
@pytest.mark.parametrize("height", [-2.0, 0.0, 2.0], ids=["summit", "level", "pit"])
def test_an_impact_exactly_on_a_vertex_of_six_facets_is_one_impact_on_one_of_them(engine, height):
    over = engine_over(engine, cone(6, height=height))
    v = np.array((0.3, 0.2, -G))
    flights = fly(over, flight(surface(0.5, 0.8), "none", max_impacts=1), (-0.3, -0.2, 0.5 * G), (0.3, 0.2, 0))
    n = flights.impacts.normal[0]
    assert np.abs(np.asarray(over.facets.normals) - n).max(axis=1).min() == 0.0, "that of a facet, no mean of several"
    np.testing.assert_allclose(flights.impacts.x[0], 0.0, atol=1e-14)
    np.testing.assert_allclose(flights.paths.v[-1], rebound_from(n, v, 0.5, 0.8), rtol=1e-12)


@BOTH
@MODELS
@pytest.mark.parametrize("height", [-2.0, 0.0, 2.0], ids=["summit", "level", "pit"])
def test_a_rock_dropped_on_a_vertex_of_six_facets_ends_where_a_rock_can(engine, model, height):
    over = engine_over(engine, cone(6, height=height))
    flights = fly(over, flight(surface(0.5, 0.8, 40.0), model), (0.0, 0.0, 2.0))
    assert flights.deposits.outcome[0] in (Outcome.STOPPED, Outcome.LEFT_TERRAIN)
    assert lies_on(over, flights) and loses_energy(flights)
    if height >= 0.0:
        assert flights.deposits.outcome[0] == Outcome.STOPPED
    if height == 0.0:
        np.testing.assert_array_equal(flights.deposits.x[0], 0.0)


@BOTH
@MODELS
@pytest.mark.parametrize("spot", [(6.0, 0.7), (6.0, 2.0), (6.0, 6.0), (6.0, -6.0)])
def test_a_rock_dropped_on_the_very_rim_of_a_terrain_bounces_on_it(engine, model, spot):
    """The rock meets a boundary edge, a boundary vertex or a corner: a terrain contains its border."""
    over = engine_over(engine, floor(6.0, cells=6))
    flights = fly(over, flight(surface(), model), (*spot, 2.0))
    assert flights.deposits.outcome[0] == Outcome.STOPPED
    np.testing.assert_array_equal(flights.deposits.x[0], (*spot, 0.0))


@BOTH
def test_a_rock_dropped_a_micrometre_beside_the_rim_falls_past_it(engine):
    flights = fly(engine_over(engine, floor(6.0, cells=6)), flight(surface()), (6.0 + 1e-6, 0.7, 2.0))
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN and flights.deposits.impacts[0] == 0


@BOTH
def test_no_rock_falls_between_two_facets(engine):
    """Rocks drop on every vertex and every edge of a rough grid; each must hit the ground."""
    terrain = rough_grid(6, 6.0, 0.3, 0.4, seed=9)
    inner = terrain.vertices[((terrain.vertices[:, :2] > 0.5) & (terrain.vertices[:, :2] < 5.5)).all(1)]
    spots = [np.add(inner, (0, 0, 3))]
    for t in terrain.triangles:
        for a, b in ((0, 1), (1, 2), (2, 0)):
            for share in (0.5, 0.3):
                spots.append((share * terrain.vertices[t[a]] + (1 - share) * terrain.vertices[t[b]] + (0, 0, 3))[None])
    x = np.concatenate(spots)
    x = x[((x[:, :2] > 0.1) & (x[:, :2] < 5.9)).all(1)]
    flights = fly(engine_over(engine, terrain), flight(surface(), max_impacts=1), x)
    assert np.all(flights.deposits.impacts == 1)
    assert loses_energy(flights)


@pytest.mark.long
@BOTH
def test_a_rock_on_a_single_facet_stops_on_it_or_leaves_it(engine):
    over = engine_over(engine, terrain_of([(-5, -5, 0), (5, -5, 0), (0, 5, 0)], [(0, 1, 2)]))
    ends = fly(over, flight(surface()), [(0.0, 0.0, 2.0), (4.0, 4.0, 2.0)]).deposits
    assert list(ends.outcome) == [Outcome.STOPPED, Outcome.LEFT_TERRAIN]


@BOTH
def test_a_rock_laid_exactly_on_a_summit_slides_down_or_stays_as_friction_says(engine):
    ends = [
        fly(engine_over(engine, cone(5, height=-2.0)), flight(surface(friction_angle=f)), (0.0, 0.0, 0.0)).deposits
        for f in (40.0, 10.0)
    ]
    assert [end.outcome[0] for end in ends] == [Outcome.STOPPED, Outcome.LEFT_TERRAIN]


@BOTH
@pytest.mark.parametrize("amplitude", [1e-3, 0.5])
def test_a_rock_at_rest_on_a_vertex_of_a_slope_that_nothing_holds_leaves_it(engine, amplitude):
    """All facets fall to +x and there is no friction, so a rock stops on no vertex, inside or on the border."""
    terrain = rough_grid(8, 16.0, 2.5, amplitude, seed=331735)
    flights = fly(engine_over(engine, terrain), flight(surface(0.0, 0.0, 0.0, 0.05)), terrain.vertices)
    assert set(flights.deposits.outcome) == {Outcome.LEFT_TERRAIN}
    assert loses_energy(flights)


# --- cracks -----------------------------------------------------------------------------------------------------------


def crest_with_a_crack(rear, front, off):
    """Return two flanks that meet at x = 0; the edge of the front flank has a vertex at y = 0, moved by `off` (3,) m.

    rear, front : slopes dz/dx of the flanks. The crack between them is widest at y = 0.

    At y = 1.25 the crack is 0.75 times as wide as at y = 0.
    """
    corners = [(0, -5, 0), (0, 5, 0), (-5, 0, -5 * rear), (5, 0, 5 * front), off]
    return terrain_of(corners, [(0, 1, 2), (0, 3, 4), (4, 3, 1)])


def thrown_through(place, v, t):
    """Return position (3,) m and velocity (3,) m/s, t seconds before, of a rock that is at `place` with velocity v."""
    fall = np.array((0.0, 0.0, G))
    return np.array(place) - np.array(v) * t - 0.5 * t * t * fall, np.array(v) + t * fall


@BOTH
@pytest.mark.parametrize("wide", [1e-10, 5e-10])
@pytest.mark.parametrize("air", [None, Drag(1e-9, 1.2, 1e-17, G)], ids=["released", "in mid-air"])
def test_a_rock_that_flies_into_a_crack_at_a_crest_is_not_sent_into_the_ground(engine, wide, air):
    """After the rear flank, the rock is behind the plane of the steep front flank and rises through this plane.

    The thin air does not move the rock, but it divides the flight into segments that start in mid-air.
    """
    over = engine_over(engine, crest_with_a_crack(0.4, -1.7, (wide, 0, 0)))
    x, v = thrown_through((0.3 * wide, 1.25, 0.0), (3.0, 0.0, -3.0), 0.1)
    physics = flight(surface(0.5, 0.8))
    effects = None if air is None else chain_of([air])
    physics = dataclasses.replace(physics, models=physics.models._replace(effects=effects))
    flights = fly(over, physics, x, v)
    assert len(flights.paths.t) > 20 or air is None
    assert (flights.impacts.normal[:, 2] > 0.0).all(), "no impact on the back of a facet"
    assert flights.deposits.outcome[0] == Outcome.LEFT_TERRAIN
    assert flights.deposits.x[0, 0] > 1.0, "down the front flank"


@BOTH
@pytest.mark.parametrize("sine", [0.01, 0.03, 0.3])
def test_a_rock_that_meets_a_crack_at_a_small_angle_does_not_pass_below_the_next_facet(engine, sine):
    """The ground is level, but the vertex on the edge is 5e-10 m too high, and the rock passes the edge just below it.

    The rock meets the plane of the rear facet 0.25 nm / sine past this facet, and never the plane of the front facet.
    """
    over = engine_over(engine, crest_with_a_crack(0.0, 0.0, (0, 0, 5e-10)))
    x, v = thrown_through((0.0, 1.25, 2.5e-10), (3.0, 0.0, -3.0 * sine), 1e-3)
    flights = fly(over, flight(surface(0.5, 0.8)), x, v)
    assert flights.deposits.outcome[0] == Outcome.STOPPED and lies_on(over, flights)
    assert flights.impacts.x[0].tolist() == pytest.approx((0.0, 1.25, 0.0), abs=1e-6)
