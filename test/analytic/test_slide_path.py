"""Tests of the closed form of a slide across a slope, against quadrature and Runge-Kutta steps.

The block obeys v' = g_t - k v / |v| in the plane. phi is the angle between v and steepest descent, g the gravity along
the plane, m = k / g.
"""

import itertools
import math

import mpmath
import numpy as np
import pytest
from flights.scenes_of_facets import incline, terrain_of

from rpf3d_core.kinetics.ground import Sliding, law_on_facet
from rpf3d_core.kinetics.slide_path import (
    bend_point,
    exit_point,
    is_straight,
    slide_path,
    slide_state,
    slide_velocity,
    stop_point,
    time_point,
)
from rpf3d_core.kinetics.sliding import CREEP, SlidePlane, slide_on_facet
from rpf3d_core.materials.library import Surface
from rpf3d_core.terrain.facets import facets_of
from rpf3d_core.values import ZERO, Motion


def coulomb(mu, stop_speed, n):
    """Return Coulomb's law on a plane with unit normal n."""
    return law_on_facet(Sliding(), Surface(0.5, 0.8, mu, stop_speed), n[2], 9.81)


PULL = 3.7
LEVEL_NORMAL = (0.0, 0.0, 1.0)
"""Unit normal of the plane in which the paths are computed; gravity along the plane is given separately."""
DOWN = (PULL, 0.0, 0.0)

CLOSED_FORM = 1e-11
"""Largest relative error against quadrature: rounding of exp, log and expm1, multiplied by y, at most 40."""
INTEGRATED = 1e-9
"""Largest relative error against Runge-Kutta of order 4 with 20,000 steps."""

RATIOS = (0.0, 0.3, 0.999999, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 1.000001, 1.7, 5.0, 300.0)
ANGLES = (1e-6, 0.01, 0.7, math.pi / 2, 2.5, 3.1, math.pi - 1e-6)


def path_of(m, phi, speed=4.0):
    v = (speed * math.cos(phi), speed * math.sin(phi), 0.0)
    return slide_path(v, LEVEL_NORMAL, DOWN, m * PULL), v


NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def quadrature(m, phi0, y, speed=4.0):
    """Return time (s), ways (m) down and across, and length (m) of a slide, by integration over phi.

    dt = -u dphi / (g sin phi) with u = u0 (w/w0)^(m-1) (1+w^2)/(1+w0^2)

    That u solves du/dphi = u (m - cos phi) / sin phi, as a test below checks. With q = ln tan(phi/2), dphi is
    sin(phi) dq; every integrand is a sum of exponentials of q, which 40 points of Gauss and Legendre for an e-folding
    or two integrate to rounding.
    """
    pieces = 1 + int(y * (1.0 + m) / 2.0)
    halves = 0.5 * y / pieces
    fallen = ((np.arange(pieces)[:, None] + 0.5) * 2.0 * halves + halves * NODES).ravel()  # ln w0 - ln w
    weights = np.tile(halves * WEIGHTS, pieces)
    w0 = math.tan(phi0 / 2)
    w = w0 * np.exp(-fallen)
    u = speed * np.exp((1.0 - m) * fallen) * (1.0 + w * w) / (1.0 + w0 * w0)
    phi = 2.0 * np.arctan(w)
    return [math.fsum(weights * f) / PULL for f in (u, u * u * np.cos(phi), u * u * np.sin(phi), u * u)]


@pytest.mark.parametrize("m", RATIOS)
def test_the_speed_used_here_for_quadrature_solves_the_equation_of_motion(m):
    with mpmath.workdps(40):

        def u(phi):
            return mpmath.tan(phi / 2) ** (mpmath.mpf(m) - 1) * (1 + mpmath.tan(phi / 2) ** 2)

        for phi in (0.1, 1.0, 2.0, 3.0):
            assert mpmath.almosteq(mpmath.diff(u, phi), u(phi) * (m - mpmath.cos(phi)) / mpmath.sin(phi), rel_eps=1e-15)


@pytest.mark.parametrize("phi", ANGLES)
@pytest.mark.parametrize("m", RATIOS)
def test_time_place_and_length_are_the_integrals_of_the_motion(m, phi):
    path, _ = path_of(m, phi)
    for y in (1e-6, 0.3, 4.0, 25.0):
        state = slide_state(path, y)
        t, x, across, length = quadrature(m, phi, y)
        assert state.t == pytest.approx(t, rel=CLOSED_FORM)
        assert state.length == pytest.approx(length, rel=CLOSED_FORM)
        assert state.offset[0] == pytest.approx(x, rel=CLOSED_FORM, abs=CLOSED_FORM * length)
        assert state.offset[1] == pytest.approx(across, rel=CLOSED_FORM, abs=1e-15 * length)
        assert state.offset[2] == 0.0


def runge_kutta(v, n_across, m, t, steps=20_000):
    """Return position (2), velocity (2) and length after t seconds, by four-stage Runge-Kutta with equal steps."""
    k, h = m * PULL, t / steps

    def rate(s):
        u = math.hypot(s[2], s[3])
        return (s[2], s[3], PULL - k * s[2] / u, -k * s[3] / u, u)

    def ahead(s, r, d):
        return tuple(a + d * b for a, b in zip(s, r, strict=True))

    s = (0.0, 0.0, v[0], v[1], 0.0)
    for _ in range(steps):
        a = rate(s)
        b = rate(ahead(s, a, h / 2))
        c = rate(ahead(s, b, h / 2))
        d = rate(ahead(s, c, h))
        s = tuple(x + h / 6 * (p + 2 * q + 2 * r + w) for x, p, q, r, w in zip(s, a, b, c, d, strict=True))
    return s


@pytest.mark.parametrize(
    ("m", "phi", "y"),
    [
        (0.0, 2.5, 3.0),
        (0.4, 2.0, 3.0),
        (0.999, 1.0, 2.0),
        (1.0, 2.8, 5.0),
        (1.3, 1.5, 1.5),
        (2.5, 0.7, 0.5),
        (0.6, 3.0, 2.0),
    ],
)
def test_the_path_is_what_runge_kutta_steps_along(m, phi, y):
    path, v = path_of(m, phi)
    state = slide_state(path, y)
    x, across, vx, vy, length = runge_kutta(v, None, m, state.t)
    assert state.offset[:2] == pytest.approx((x, across), abs=INTEGRATED * length)
    assert state.v[:2] == pytest.approx((vx, vy), abs=INTEGRATED * 4.0)
    assert state.length == pytest.approx(length, rel=INTEGRATED)


@pytest.mark.parametrize("phi", ANGLES)
@pytest.mark.parametrize("m", RATIOS)
def test_a_path_begins_where_the_block_is_with_the_velocity_it_has(m, phi):
    path, v = path_of(m, phi)
    state = slide_state(path, 0.0)
    assert (state.t, state.offset, state.length) == (0.0, ZERO, 0.0)
    assert state.v == pytest.approx(v, rel=1e-9, abs=1e-14)
    assert slide_velocity(path, 0.0) == state.v


@pytest.mark.parametrize("m", [1.0 + 1e-3, 1.5, 10.0, 1e6])
@pytest.mark.parametrize("phi", ANGLES)
def test_strong_friction_ends_the_path_after_a_finite_time_and_way(m, phi):
    path, v = path_of(m, phi)
    end = slide_state(path, math.inf)
    late = slide_state(path, 30.0 / (m - 1.0))
    assert end.v == ZERO
    assert all(math.isfinite(value) for value in (end.t, *end.offset, end.length))
    assert end.t == pytest.approx(late.t, rel=1e-9) and end.length == pytest.approx(late.length, rel=1e-9)
    # work and energy per mass: friction takes k per metre, gravity gives g per metre of descent
    assert 0.5 * np.dot(v, v) + PULL * end.offset[0] == pytest.approx(m * PULL * end.length, rel=1e-9)


@pytest.mark.parametrize(("m", "phi"), list(itertools.product(RATIOS, ANGLES)))
def test_work_and_energy_balance_along_a_path(m, phi):
    path, v = path_of(m, phi)
    for y in (1e-3, 0.5, 5.0):
        s = slide_state(path, y)
        scale = 0.5 * np.dot(v, v) + PULL * abs(s.offset[0]) + m * PULL * s.length
        assert 0.5 * np.dot(s.v, s.v) - 0.5 * np.dot(v, v) == pytest.approx(
            PULL * s.offset[0] - m * PULL * s.length, abs=1e-11 * scale
        )


@pytest.mark.parametrize("m", [1.0 + 1e-6, 1.2, 4.0])
@pytest.mark.parametrize("phi", ANGLES)
@pytest.mark.parametrize("speed", [3.9, 2.0, 1e-3])
def test_the_stop_point_is_where_the_speed_is_the_stop_speed(m, phi, speed):
    path, _ = path_of(m, phi)
    y = stop_point(path, speed)
    assert math.hypot(*slide_velocity(path, y)) == pytest.approx(speed, rel=1e-9)
    assert all(math.hypot(*slide_velocity(path, y * share)) > speed for share in (0.0, 0.3, 0.9, 0.999))


def test_a_block_that_friction_only_balances_keeps_more_than_nothing_for_ever():
    path, _ = path_of(1.0, 1.5)
    last = 4.0 / (1.0 + math.tan(0.75) ** 2)
    assert stop_point(path, 0.99 * last) == math.inf
    assert math.hypot(*slide_velocity(path, 60.0)) == pytest.approx(last, rel=1e-12)


@pytest.mark.parametrize(
    ("phi", "straight"), [(0.0, True), (1e-10, True), (1e-6, False), (math.pi - 1e-6, False), (math.pi, True)]
)
def test_only_a_path_along_the_descent_is_a_line(phi, straight):
    assert is_straight(path_of(0.5, phi)[0]) is straight


# --- exits from a facet -----------------------------------------------------------------------------------------------


def edges_of_triangle(corners):
    """Yield the inward unit vector and the offset of each edge of a triangle, in its plane, for any winding."""
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    normal /= np.linalg.norm(normal)
    for k in range(3):
        edge = corners[(k + 1) % 3] - corners[k]
        inward = np.cross(normal, edge) / np.linalg.norm(edge)
        yield inward, inward @ corners[k]


def random_slides(count):
    """Yield facets of all slopes: corners, unit normal, a point inside, a velocity along the facet, and mu."""
    draw = np.random.default_rng(5)
    for number in range(count):
        corners = draw.uniform(-5, 5, (3, 3))
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        if normal[2] < 0:
            corners, normal = corners[::-1].copy(), -normal
        n = normal / np.linalg.norm(normal)
        shares = draw.dirichlet((1, 1, 1))
        v = np.cross(n, draw.normal(size=3)) * 10.0 ** draw.uniform(-3, 1.5)
        slope = math.hypot(n[0], n[1]) / n[2]
        mu = slope * (0.0, 0.5, 1.0 - 1e-7, 1.0, 1.0 + 1e-7, 1.5, 20.0)[number % 7]
        yield corners, n, shares @ corners, v - (v @ n) * n, mu


MOST_PIECES = 60
"""Most pieces of a slide over one facet: 25 bends of 7 degrees, 8 halvings, and as many after a turn downhill."""


def slide_to_its_end(facets, normal, motion, mu, stop_speed):
    """Return the last piece of a slide over a facet; a slide that turns consists of one piece per bend."""
    for _ in range(MOST_PIECES):
        piece = slide_on_facet(
            facets, SlidePlane(0, normal, 0.0), motion, coulomb(mu, stop_speed, normal), 9.81, math.inf
        )
        if piece.left_first or piece.stopped:
            return piece
        motion = piece.motion
    raise AssertionError("a slide goes on and on")


@pytest.mark.long
@pytest.mark.parametrize("stop_speed", [0.0, 0.3])
def test_a_slide_leaves_a_facet_exactly_on_its_edge_or_stops_inside_it(stop_speed):
    left = stopped = 0
    for corners, n, x, v, mu in random_slides(700):
        facets = facets_of(terrain_of(corners, [(0, 1, 2)]))
        normal = tuple(float(c) for c in facets.normals[0])
        v = tuple(float(c) for c in v - (v @ facets.normals[0]) * facets.normals[0])
        motion = Motion(0.0, tuple(map(float, x)), v, ZERO)
        piece = slide_to_its_end(facets, normal, motion, mu, stop_speed)
        end = np.array(piece.motion.x)
        margins = [inward @ end - offset for inward, offset in edges_of_triangle(corners)]
        assert min(margins) > -1e-10, "outside the facet by more than rounding of 10 m across"
        assert abs(n @ (end - corners[0])) < 1e-10
        assert math.isfinite(piece.motion.t) and piece.motion.t >= 0.0 and piece.length >= 0.0
        if piece.left_first:
            left += 1
            assert min(margins) < 1e-10, "left the facet away from its edges"
            inward = min(zip(margins, edges_of_triangle(corners), strict=True), key=lambda pair: pair[0])[1][0]
            assert inward @ piece.motion.v <= 1e-9, "left across an edge that it was not moving out of"
        if piece.stopped:
            stopped += 1
            assert np.linalg.norm(piece.motion.v) <= max(stop_speed, CREEP) * (1 + 1e-9)
    assert left > 200 and stopped > 100


def test_a_slide_does_not_leave_its_facet_before_the_exit():
    for corners, _, x, v, mu in random_slides(210):
        facets = facets_of(terrain_of(corners, [(0, 1, 2)]))
        n = facets.normals[0]
        v = v - (v @ n) * n
        g = np.array([0, 0, -9.81])
        g_t = g - (g @ n) * n
        path = slide_path(tuple(map(float, v)), tuple(map(float, n)), tuple(map(float, g_t)), mu * 9.81 * n[2])
        if is_straight(path):
            continue
        edges = list(edges_of_triangle(corners))
        leave = min(exit_point(path, tuple(map(float, i)), float(i @ x - d)) for i, d in edges)
        for y in np.linspace(0.0, min(leave, 40.0), 60):
            at = x + np.array(slide_state(path, float(y)).offset)
            assert min(i @ at - d for i, d in edges) > -1e-9


def test_a_slide_across_a_facet_ends_no_later_than_one_that_is_stepped():
    """The first exit counts: a block that climbs over an edge has left, even if it would come back over the edge."""
    facets = facets_of(terrain_of([(-10, 0, 0), (10, 0, 0), (0, -20, -10)], [(0, 2, 1)]))
    n = tuple(float(c) for c in facets.normals[0])
    assert n[2] > 0
    up = np.array([0.0, 2.0, 1.0]) / math.sqrt(5.0)
    v = 3.0 * up + np.array([1.0, 0.0, 0.0])
    start = np.array([0.0, -0.2, -0.1])
    piece = slide_on_facet(
        facets, SlidePlane(0, n, 0.0), Motion(0.0, tuple(map(float, start)), tuple(map(float, v)), ZERO),
        coulomb(0.1, 0.0, n), 9.81, math.inf,
    )  # fmt: skip
    assert piece.left_first
    assert piece.motion.x[1] == pytest.approx(0.0, abs=1e-12)
    assert piece.motion.v[1] > 0.0


def test_an_uphill_slide_that_friction_does_not_hold_turns_round():
    facets = facets_of(incline(40.0, cells=(1, 1)))
    angle = math.radians(40.0)
    n, up = (math.sin(angle), 0.0, math.cos(angle)), np.array([-math.cos(angle), 0.0, math.sin(angle)])
    motion = Motion(0.0, (4.0, -7.0, -4.0 * math.tan(angle)), tuple(map(float, 2.0 * up)), ZERO)
    piece = slide_on_facet(facets, SlidePlane(0, n, 0.0), motion, coulomb(0.2, 0.0, n), 9.81, math.inf)
    way = 4.0 / (2 * 9.81 * (math.sin(angle) + 0.2 * math.cos(angle)))
    assert not piece.stopped and not piece.left_first
    assert piece.length == pytest.approx(way, rel=1e-12)
    assert math.hypot(*piece.motion.v) == 0.0


def test_a_block_that_moves_along_an_edge_and_then_away_from_it_never_leaves_over_it():
    """Velocity and edge are parallel within rounding; the search for an exit must end."""
    for share in np.linspace(-3e-16, 3e-16, 61):
        for phi in (0.3, 0.7, 1.4, 2.5):
            path, v = path_of(0.33, phi)
            inward = (math.sin(phi) + share, -math.cos(phi), 0.0)
            assert abs(np.dot(inward, v)) < 1e-14
            for distance in (2.0, 0.0, -1e-17):
                assert exit_point(path, inward, distance) == math.inf


def test_friction_that_only_balances_gravity_leaves_no_number_infinite():
    """With m = 1 and stop speed 0, the speed falls to a limit above 0, and the block must leave the facet."""
    facets = facets_of(terrain_of([(-8, -9, 6), (8, -9, -6), (0, 40, 0)], [(0, 1, 2)]))
    n = tuple(float(c) for c in facets.normals[0])
    for across in (1.0, 1e-3, 1e-6, 1e-7, 1e-8):
        v = (-0.8 * 4.0, across, 0.6 * 4.0)
        motion = Motion(0.0, (0.0, -1.0, 0.0), v, ZERO)
        piece = slide_on_facet(facets, SlidePlane(0, n, 0.0), motion, coulomb(0.75, 0.0, n), 9.81, math.inf)
        assert all(math.isfinite(value) for value in (*piece.motion.x, *piece.motion.v, piece.motion.t, piece.length))


@pytest.mark.parametrize("m", [0.3, 1.0, 1.7])
@pytest.mark.parametrize("phi", [0.05, 0.7, 2.5, 3.1])
def test_between_bends_a_slide_is_as_good_as_one_of_constant_acceleration(m, phi):
    """Between two rows, paths are drawn and counted with a cubic and with a speed that is linear in time."""
    path, _ = path_of(m, phi)
    y = min(bend_point(path), 6.0)
    end = slide_state(path, y)
    begin, after = (np.array(slide_velocity(path, at)) for at in (0.0, y))
    u, v = np.linalg.norm(begin), np.linalg.norm(after)
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        at = slide_state(path, time_point(path, share * end.t, y))
        hermite = end.t * share * (1 - share) * (begin * (1 - share) - after * share)
        drawn = np.array(end.offset) * share * share * (3 - 2 * share) + hermite
        assert np.abs(drawn - at.offset).max() <= 1e-3 * end.length
        assert u + (v - u) * share == pytest.approx(np.linalg.norm(at.v), abs=0.01 * max(u, v))


@pytest.mark.parametrize("m", [0.05, 0.4, 0.9])
@pytest.mark.parametrize("phi", [2.0, 2.9, 3.1])
@pytest.mark.parametrize("share", [0.3, 0.99, 1.01])
def test_friction_too_weak_to_hold_a_block_slows_it_to_a_stop_speed_only_while_it_goes_uphill(m, phi, share):
    """share : stop speed over the smallest speed of the block, which it has where w^2 = (1 - m) / (1 + m)."""
    path, _ = path_of(m, phi)
    slowest = math.log(path.w / math.sqrt((1.0 - m) / (1.0 + m)))
    least = np.linalg.norm(slide_velocity(path, slowest))
    assert least <= min(np.linalg.norm(slide_velocity(path, slowest + d)) for d in (-0.01, 0.01))
    y = stop_point(path, share * least)
    if share < 1.0:
        assert y == math.inf
        return
    assert 0.0 < y < slowest
    assert np.linalg.norm(slide_velocity(path, y)) == pytest.approx(share * least, rel=1e-12)
